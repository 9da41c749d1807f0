//! Zero-phase filters against closed forms, and many columns against one.

use std::num::NonZeroUsize;

use vpm_core::filter::ZeroPhase;

/// A filter of one pole, of gain one at rest.
fn one_pole(pole: f64) -> ZeroPhase {
    ZeroPhase::new(&[[1.0 - pole, 0.0, 0.0, 1.0, -pole, 0.0]], 40).expect("it comes to rest")
}

#[test]
fn an_impulse_becomes_even_and_falls_with_the_pole() {
    let (pole, middle) = (0.6_f64, 150_usize);
    let mut record = vec![0.0; 301];
    record[middle] = 1.0;
    let passed = one_pole(pole).apply(&record, 1, NonZeroUsize::MIN);
    for (place, &value) in passed.iter().enumerate() {
        let away = i32::try_from(place.abs_diff(middle)).expect("a short record");
        let exact = (1.0 - pole) / (1.0 + pole) * pole.powi(away); // sum of (1 - p)^2 p^k p^(k + away) over k
        assert!((value - exact).abs() < 1e-15, "{away}: {value} in place of {exact}");
    }
}

#[test]
fn columns_pass_alike_however_many_stand_side_by_side() {
    let (rows, every) = (97, NonZeroUsize::new(4).expect("not zero"));
    let filter = one_pole(0.8);
    for columns in [1, 2, 3, 7, 8, 19] {
        let at =
            |row: usize, column: usize| if column % 3 == 1 { 0.0 } else { ((row * (column + 2)) as f64).sin() + 2.0 };
        let record: Vec<f64> = (0..rows).flat_map(|row| (0..columns).map(move |column| at(row, column))).collect();
        let together = filter.apply(&record, columns, every);
        assert_eq!(together.len(), rows.div_ceil(4) * columns);
        for column in 0..columns {
            let alone: Vec<f64> = (0..rows).map(|row| at(row, column)).collect();
            let alone = filter.apply(&alone, 1, NonZeroUsize::MIN);
            for (row, kept) in together.chunks(columns).enumerate() {
                assert_eq!(kept[column].to_bits(), alone[4 * row].to_bits(), "row {row}, column {column}");
            }
        }
    }
}

#[test]
fn what_rests_stays_and_what_has_no_samples_gives_none() {
    let filter = one_pole(0.9);
    assert!(filter.apply(&[3.5; 60], 1, NonZeroUsize::MIN).iter().all(|value| (value - 3.5).abs() < 1e-14));
    assert!(filter.apply(&[], 4, NonZeroUsize::MIN).is_empty());
    assert!(filter.apply(&[], 0, NonZeroUsize::MIN).is_empty());
}

#[test]
fn a_section_that_never_comes_to_rest_is_refused() {
    let message = ZeroPhase::new(&[[1.0, 0.0, 0.0, 1.0, -1.0, 0.0]], 3).expect_err("a sum").to_string();
    assert!(message.contains("`sections[0]` must begin its denominator with one and come to rest"), "{message}");
}
