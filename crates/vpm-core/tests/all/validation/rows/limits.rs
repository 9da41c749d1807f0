//! Beams that are stiffer and stiffer: what is left is the rigid arm.

use nalgebra::{DMatrix, DVector};
use serde_json::json;
use vpm_core::description::Description;
use vpm_core::ode::Ode;
use vpm_core::{Result, evaluate};

use super::{Row, Tolerance, difference};
use crate::common::entries::material;
use crate::common::two_link::arm;

/// The joints, their rates and the efforts on them.
const STATE: [[f64; 2]; 3] = [[0.4, -0.9], [1.0, -2.0], [3.0, -1.0]];

/// Accelerations of the joints with beams 10^3 to 10^6 times as stiff as steel, and how their difference falls.
pub fn rows() -> Result<Vec<Row>> {
    let (elastic, rigid) = (arm(&json!({"strain": 3}))?, arm(&json!("rigid"))?);
    let [q, v, efforts] = STATE;
    let expected = evaluate::accelerations(&rigid, &rigid.parameters, &q, &v, &efforts)?;
    let stiff: Vec<Vec<f64>> = [1e3, 1e4, 1e5, 1e6]
        .into_iter()
        .map(|factor| settled(&elastic, factor, expected.len()))
        .collect::<Result<_>>()?;
    let gaps: Vec<f64> = stiff.iter().map(|found| difference(found, &expected)).collect();
    Ok(vec![
        Row {
            name: "Rigid limit of a two-link arm: fall of the difference per tenfold stiffness, E x 10^3 to 10^6"
                .into(),
            found: gaps.windows(2).map(|pair| pair[0] / pair[1]).collect(),
            expected: vec![10.0; 3],
            unit: "-",
            source: "the compliance is proportional to 1/E",
            tolerance: Tolerance::Relative(0.05),
        },
        Row {
            name: "Rigid limit of a two-link arm: accelerations of the joints, E x 10^6".into(),
            found: stiff[3].clone(),
            expected,
            unit: "rad/s^2",
            source: "the same arm with beams of level rigid",
            tolerance: Tolerance::Relative(1e-5),
        },
    ])
}

/// Accelerations of the joints with beams that rest in this motion: their own accelerations vanish.
fn settled(d: &Description, factor: f64, joints: usize) -> Result<Vec<f64>> {
    let mut theta = d.parameters.clone();
    theta[material(&d.beams[0]).young] *= factor;
    let mut system = d.system::<f64>(&theta)?;
    let (n, [q, v, efforts]) = (d.n_coordinates(), STATE);
    let (elastic, mut x) = (n - joints, vec![0.0; 2 * n]);
    x[..joints].copy_from_slice(&q);
    x[n..n + joints].copy_from_slice(&v);
    for _ in 0..20 {
        let a = system.dynamics().accelerations(&x[..n], &x[n..], &efforts).to_vec();
        let mut block = vec![0.0; 2 * n * n];
        system.elasticity(&x, &mut block);
        let stiffness = DMatrix::from_fn(elastic, elastic, |i, j| block[(joints + i) * 2 * n + joints + j]);
        let step = stiffness.lu().solve(&DVector::from_row_slice(&a[joints..]));
        for (entry, step) in x[joints..n].iter_mut().zip(step.iter().flat_map(|step| step.iter())) {
            *entry -= step;
        }
    }
    Ok(system.dynamics().accelerations(&x[..n], &x[n..], &efforts)[..joints].to_vec())
}
