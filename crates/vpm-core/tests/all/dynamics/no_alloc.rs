//! The algorithms allocate nothing once their buffers exist.

use allocation_counter::measure;
use vpm_core::bushing::Bushing;
use vpm_core::contact::{Contact, ContactFriction, NormalContact, Plane};
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, crba, energy, rnea};
use vpm_core::samples::{Random, arm7};
use vpm_core::scalar::seed;
use vpm_core::spatial::{Matrix3, Pose, Twist, Vector3};
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
fn connections_allocate_nothing() -> Result<()> {
    let normal = NormalContact { stiffness: 5e6, exponent: 1.1, damping: 1e3, damping_depth: 1e-4 };
    let friction = ContactFriction {
        static_coefficient: 0.7,
        static_velocity: 0.1,
        dynamic_coefficient: 0.5,
        dynamic_velocity: 1.0,
    };
    let contact = Contact { normal, friction: Some(friction) };
    let plane = Plane::new(Vector3::zero(), Vector3::new(0.0, 1.0, 2.0))?;
    let bushing = Bushing::diagonal([1e3; 6], [1.0; 6]);
    let pose = Pose::new(Matrix3::rotation(Vector3::new(1.0, 0.0, 0.0), 0.7), Vector3::new(0.1, 0.2, 0.3));
    let counted = measure(|| {
        std::hint::black_box(contact.force(&plane, Vector3::new(0.0, 0.0, -1e-3), pose.translation));
        std::hint::black_box(bushing.wrenches(&pose, Twist::new(pose.translation, pose.translation)));
        std::hint::black_box(bushing.potential(&pose));
    });
    assert_eq!(counted.count_total, 0);
    Ok(())
}

#[test]
fn the_counter_sees_an_allocation() {
    assert_eq!(measure(|| drop(std::hint::black_box(vec![0.0; 8]))).count_total, 1);
    let model = arm7().model::<Dual<f64, 1>>();
    assert!(measure(|| drop(model.map(|model| Data::new(&model)))).count_total > 0);
}
