//! The algorithms allocate nothing once their buffers exist.

use allocation_counter::measure;
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, crba, energy, rnea};
use vpm_core::samples::{Random, arm7};
use vpm_core::scalar::seed;
use vpm_core::{Dual, Result, Scalar};

/// Allocations of one call of every algorithm on the seven-joint arm.
fn allocations<S: Scalar>(lift: impl Fn(&[f64]) -> Vec<S>) -> Result<u64> {
    let mut random = Random::new(5);
    let [q, v, tau] = [3.0, 1.0, 10.0].map(|size| lift(&random.numbers(7, size)));
    let model = arm7().model::<S>()?;
    let mut data = Data::new(&model);
    let counted = measure(|| {
        rnea(&model, &mut data, &q, &v, &tau);
        crba(&model, &mut data, &q);
        aba(&model, &mut data, &q, &v, &tau);
        energy(&model, &mut data, &q, &v);
    });
    Ok(counted.count_total)
}

#[test]
fn algorithms_allocate_nothing() -> Result<()> {
    assert_eq!(allocations(<[f64]>::to_vec)?, 0);
    assert_eq!(allocations(|numbers| seed::<f64, 4>(numbers, &[0, 1]))?, 0);
    Ok(())
}

#[test]
fn the_counter_sees_an_allocation() {
    assert_eq!(measure(|| drop(std::hint::black_box(vec![0.0; 8]))).count_total, 1);
    let model = arm7().model::<Dual<f64, 1>>();
    assert!(measure(|| drop(model.map(|model| Data::new(&model)))).count_total > 0);
}
