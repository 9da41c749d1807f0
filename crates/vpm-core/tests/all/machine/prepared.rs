//! Prepared evaluations are those of a machine that is built anew for each, undo each other, and allocate nothing.

use allocation_counter::measure;
use vpm_core::evaluate;
use vpm_core::prepared::Prepared;
use vpm_core::samples::{Random, arm7};

use crate::common::{Machine, close};

fn machine() -> Machine {
    let mut machine = Machine::new(&arm7());
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.3)])
        .effect("spring", 1, &[("stiffness", 2.0), ("rest", 0.3)])
        .payload(6, 1.5, [0.0, 0.02, 0.1]);
    machine
}

#[test]
fn evaluations_agree_with_machines_built_anew() {
    let description = machine().build();
    let theta = &description.parameters;
    let mut prepared = Prepared::new(&description, theta).unwrap();
    let mut random = Random::new(11);
    for _ in 0..20 {
        let [q, v, tau] = [0; 3].map(|_| random.numbers(7, 1.5));
        let a = prepared.forward_dynamics(&q, &v, &tau).unwrap().to_vec();
        assert_eq!(a, evaluate::accelerations(&description, theta, &q, &v, &tau).unwrap());
        for (&back, &tau) in prepared.inverse_dynamics(&q, &v, &a).unwrap().iter().zip(&tau) {
            close(back, tau, 1e-9);
        }
        assert_eq!(prepared.mass_matrix(&q).unwrap(), evaluate::mass_matrix(&description, theta, &q).unwrap());
        assert_eq!(prepared.energy(&q, &v).unwrap(), evaluate::energy(&description, theta, &q, &v).unwrap());
    }
}

#[test]
fn evaluations_allocate_nothing() {
    let description = machine().build();
    let mut prepared = Prepared::new(&description, &description.parameters).unwrap();
    let (q, v) = ([0.3; 7], [0.1; 7]);
    let counted = measure(|| {
        prepared.forward_dynamics(&q, &v, &v).unwrap();
        prepared.inverse_dynamics(&q, &v, &v).unwrap();
        prepared.mass_matrix(&q).unwrap();
        prepared.energy(&q, &v).unwrap();
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn lengths_and_markers_that_are_wrong_are_said() {
    let description = machine().build();
    let mut prepared = Prepared::new(&description, &description.parameters).unwrap();
    let error = prepared.energy(&[0.0; 7], &[0.0; 6]).unwrap_err().to_string();
    assert!(error.contains("velocity must have 7 entries, got 6"), "{error}");
    let error = prepared.jacobian(&[0.0; 7], 0).unwrap_err().to_string();
    assert!(error.contains("marker number 0, but there are 0"), "{error}");
}
