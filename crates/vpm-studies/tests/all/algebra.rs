//! Small linear systems, singular values and polynomials keep their promises.

use proptest::prelude::*;
use vpm_core::samples::Random;
use vpm_studies::algebra::{
    Conic, SingularValues, degree, determinant, is_definite, quadratic_roots, resultant, solve,
};

proptest! {
    #[test]
    fn linear_systems_and_determinants_agree(seed: u64) {
        let random = &mut Random::new(seed);
        let a: [[f64; 5]; 5] = std::array::from_fn(|_| std::array::from_fn(|_| random.symmetric()));
        let x: [f64; 5] = std::array::from_fn(|_| random.symmetric());
        let b = std::array::from_fn(|row| (0..5).map(|k| a[row][k] * x[k]).sum());
        let columns: Vec<Vec<f64>> = a.iter().map(|row| row.to_vec()).collect();
        let values = SingularValues::new(&columns).values;
        let product: f64 = values.iter().product();
        prop_assert!((determinant(&columns).abs() - product).abs() < 1e-13 * (1.0 + product));
        let solved = solve(a, b).unwrap();
        let error = x.iter().zip(&solved).map(|(l, r)| (l - r).abs()).fold(0.0, f64::max);
        prop_assert!(error < 1e-13 * values[0] / values[4], "{error} at condition {}", values[0] / values[4]);
    }

    #[test]
    fn a_resultant_vanishes_where_two_conics_meet(seed: u64) {
        let random = &mut Random::new(seed);
        let [c, s] = [random.symmetric(), random.symmetric()];
        let mut through = || {
            let n = random.numbers(5, 1.0);
            let free = Conic { constant: 0.0, c: n[0], s: n[1], cc: n[2], cs: n[3], ss: n[4] };
            Conic { constant: -free.at(c, s), ..free }
        };
        let (f, g) = (through(), through());
        let polynomial = resultant(&f, &g);
        let value: f64 = polynomial.iter().enumerate().map(|(power, factor)| factor * s.powi(power as i32)).sum();
        prop_assert!(value.abs() < 1e-13);
        // The same number as the determinant of the Sylvester matrix itself.
        let t = random.symmetric();
        let [f0, f1, f2] = f.in_c().map(|k| k[0] + t * (k[1] + t * k[2]));
        let [g0, g1, g2] = g.in_c().map(|k| k[0] + t * (k[1] + t * k[2]));
        let sylvester = vec![vec![f0, f1, f2, 0.0], vec![0.0, f0, f1, f2], vec![g0, g1, g2, 0.0], vec![0.0, g0, g1, g2]];
        let direct: f64 = polynomial.iter().enumerate().map(|(power, factor)| factor * t.powi(power as i32)).sum();
        prop_assert!((determinant(&sylvester) - direct).abs() < 1e-13);
    }
}

#[test]
fn quadratic_roots_keep_their_digits() {
    let [large, small] = quadratic_roots([1e-12, -1.0, 1.0]).unwrap();
    assert!((small / 1.000_000_000_001e-12 - 1.0).abs() < 1e-15 && (large - 1.0).abs() < 1e-11);
    assert_eq!(quadratic_roots([1.0, 0.0, 1.0]), None);
    assert_eq!(quadratic_roots([0.0, 0.0, 2.0]), Some([0.0, 0.0]));
    assert_eq!(degree(&[1.0, -2.0, 3.0, 1e-16, 0.0]), 2);
    assert!(solve([[1.0, 2.0], [2.0, 4.0]], [1.0, 1.0]).is_err());
    assert!(is_definite(&[vec![-2.0, 1.0], vec![1.0, -2.0]], 1e-9));
    assert!(!is_definite(&[vec![1.0, 2.0], vec![2.0, 1.0]], 1e-9));
}
