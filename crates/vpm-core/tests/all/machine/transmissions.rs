//! Transmissions: each against the same machine without one, with what the shaft does written on the joints.

use allocation_counter::measure;
use serde_json::json;
use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::integrator::Method;
use vpm_core::samples::{Random, random_tree};
use vpm_core::system::{Build, Dynamics};

use crate::common::{Bench, Machine, close};

const JOINTS: usize = 3;
const RATIOS: [f64; JOINTS] = [3.0, -2.0, 5.0];
const INERTIA: f64 = 0.2;

/// A tree without transmissions.
fn bare(seed: u64) -> Machine {
    Machine::new(&random_tree(seed, JOINTS))
}

/// The same with a shaft that turns with all joints.
fn geared(seed: u64, inertia: Option<f64>) -> Machine {
    let mut machine = bare(seed);
    let ratios: Vec<(usize, f64)> = RATIOS.into_iter().enumerate().collect();
    machine.transmission(&ratios, inertia);
    machine
}

fn dynamics(machine: &Machine) -> Result<Dynamics<f64>> {
    let description = machine.build();
    Build::dynamics(&&description, &machine.values)
}

fn turn(numbers: &[f64]) -> f64 {
    RATIOS.iter().zip(numbers).map(|(ratio, number)| ratio * number).sum()
}

#[test]
fn a_rotor_adds_a_rank_one_term() -> Result<()> {
    for seed in 0..10 {
        let random = &mut Random::new(seed);
        let (mut plain, mut with) = (dynamics(&bare(seed))?, dynamics(&geared(seed, Some(INERTIA)))?);
        assert!(plain.model.is_recursive() && !with.model.is_recursive());
        let [q, v, a] = [2.0, 3.0, 5.0].map(|size| random.numbers(JOINTS, size));
        let (mass, geared_mass) = (plain.mass_matrix(&q).to_vec(), with.mass_matrix(&q).to_vec());
        for (k, (found, own)) in geared_mass.iter().zip(&mass).enumerate() {
            close(*found, own + INERTIA * RATIOS[k / JOINTS] * RATIOS[k % JOINTS], 1e-12 * (1.0 + found.abs()));
        }
        let (mut efforts, mut geared_efforts) = ([0.0; JOINTS], [0.0; JOINTS]);
        plain.inverse_dynamics(&q, &v, &a, &mut efforts);
        with.inverse_dynamics(&q, &v, &a, &mut geared_efforts);
        for ((found, own), ratio) in geared_efforts.iter().zip(efforts).zip(RATIOS) {
            close(*found, own + ratio * INERTIA * turn(&a), 1e-10 * (1.0 + found.abs()));
        }
        let back = with.forward_dynamics(&q, &v, &geared_efforts).to_vec();
        back.iter().zip(&a).for_each(|(found, expected)| close(*found, *expected, 1e-9));
        let (energy, geared_energy) = (plain.energy(&q, &v), with.energy(&q, &v));
        let rotor = 0.5 * INERTIA * turn(&v) * turn(&v);
        close(geared_energy.kinetic, energy.kinetic + rotor, 1e-10 * (1.0 + rotor));
        close(geared_energy.potential, energy.potential, 1e-10 * (1.0 + energy.potential.abs()));
    }
    Ok(())
}

#[test]
fn a_rotor_that_one_joint_turns_is_that_of_the_joint() -> Result<()> {
    for seed in 0..5 {
        let random = &mut Random::new(seed);
        let (mut one, mut other) = (bare(seed), bare(seed));
        one.transmission(&[(1, -7.0)], Some(0.01));
        other.effect("rotor_inertia", 1, &[("inertia", 0.49)]);
        let (mut one, mut other) = (dynamics(&one)?, dynamics(&other)?);
        assert!(one.model.is_recursive(), "the recursions know it");
        let [q, v, tau] = [2.0, 3.0, 5.0].map(|size| random.numbers(JOINTS, size));
        let found = one.forward_dynamics(&q, &v, &tau).to_vec();
        found
            .iter()
            .zip(other.forward_dynamics(&q, &v, &tau))
            .for_each(|(a, b)| close(*a, *b, 1e-11 * (1.0 + b.abs())));
    }
    Ok(())
}

/// A shaft with friction, a spring and a motor with lag; the friction and the spring are parameters that end so.
fn rubbing(seed: u64, inertia: Option<f64>) -> Machine {
    let mut machine = geared(seed, inertia);
    machine
        .effect_on_shaft("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.3)])
        .effect_on_shaft("viscous_friction", 0, &[("viscous", 0.1)])
        .effect_on_shaft("spring", 0, &[("stiffness", 0.8), ("rest", 0.3)])
        .actuator_on_shaft(0, &[("gain", 2.0)]);
    machine
}

#[test]
fn what_acts_on_a_shaft_acts_on_its_joints_by_their_ratios() -> Result<()> {
    for (seed, inertia) in [(1, None), (2, Some(INERTIA))] {
        let random = &mut Random::new(seed);
        let (mut all, mut tree) = (dynamics(&rubbing(seed, inertia))?, dynamics(&geared(seed, inertia))?);
        let [q, v] = [2.0, 1.0].map(|size| random.numbers(JOINTS, size));
        let (angle, speed, command) = (turn(&q), turn(&v), 0.7);
        let torque = 2.0 * command - 0.4 * (speed / 0.3).tanh() - 0.1 * speed - 0.8 * (angle - 0.3);
        let efforts = RATIOS.map(|ratio| ratio * torque);
        let expected = tree.forward_dynamics(&q, &v, &efforts).to_vec();
        let (x, mut rates) = ([&q[..], &v].concat(), [0.0; 2 * JOINTS]);
        all.hold(0, command);
        all.rhs(&x, &mut rates);
        rates[JOINTS..].iter().zip(&expected).for_each(|(a, b)| close(*a, *b, 1e-10 * (1.0 + b.abs())));
        // Angle, speed and effort of the shaft, in the place of a line; the joints' own efforts are of drives on them alone.
        let layout = all.layout();
        let mut outputs = vec![0.0; layout.count()];
        all.observe(&x, &rates, &mut outputs);
        let shown = &outputs[layout.lines()..layout.lines() + 3];
        shown.iter().zip([angle, speed, 2.0 * command]).for_each(|(a, b)| close(*a, b, 1e-12 * (1.0 + b.abs())));
    }
    Ok(())
}

#[test]
fn all_methods_go_the_same_way() {
    for inertia in [None, Some(INERTIA)] {
        let (machine, inputs, rows) = (rubbing(3, inertia), vec![0.5; 101], 101);
        let end = |method: Method, substeps: usize| -> Vec<f64> {
            let bench = Bench::new(&machine, 0.002, substeps, method);
            let run = bench.free(&[0.2, -0.1, 0.3, 0.4, 0.1, -0.2], &inputs);
            run.states[(rows - 1) * 2 * JOINTS..].to_vec()
        };
        let exact = end(Method::Rk4, 40);
        for method in Method::ALL {
            let substeps = if method == Method::SemiImplicit { 400 } else { 20 };
            let tolerance = if method == Method::SemiImplicit { 2e-4 } else { 1e-6 };
            let found = end(method, substeps);
            let apart = found.iter().zip(&exact).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            assert!(apart < tolerance, "{}: {apart}", method.name());
        }
    }
}

#[test]
fn steps_of_shafts_allocate_nothing() {
    let inputs = vec![0.5; 200];
    for method in Method::ALL {
        let bench = Bench::new(&rubbing(3, Some(INERTIA)), 0.002, 2, method);
        let free = |rows: usize| measure(|| drop(bench.free(&[0.1; 2 * JOINTS], &inputs[..rows]))).count_total;
        free(60);
        assert_eq!(free(60), free(200), "{}", method.name());
    }
}

/// What a description of this machine is refused for.
fn refused(machine: &Machine) -> String {
    Description::from_json(&machine.json()).err().map_or_else(|| "it was taken".to_owned(), |error| error.to_string())
}

#[test]
fn what_cannot_be_is_refused() {
    let with = |ratios: &[(usize, f64)], inertia: f64| {
        let mut machine = bare(1);
        machine.transmission(ratios, Some(inertia));
        refused(&machine)
    };
    assert!(with(&[(0, 2.0)], 0.1).contains("it was taken"));
    assert!(with(&[], 0.1).contains("transmission `shaft0` names no joint"));
    assert!(with(&[(0, 2.0), (0, 3.0)], 0.1).contains("or one twice"));
    assert!(with(&[(7, 2.0)], 0.1).contains("transmission `shaft0`") && with(&[(7, 2.0)], 0.1).contains("joint"));
    assert!(with(&[(0, 0.0)], 0.1).contains("`shaft0.ratios.0.ratio` must not be zero"), "{}", with(&[(0, 0.0)], 0.1));
    assert!(with(&[(0, 2.0)], -0.1).contains("`shaft0.inertia` must not be negative"));
    let mut loaded = geared(1, None);
    loaded.effect_on_shaft(
        "load_dependent_friction",
        0,
        &[("driving", 0.1), ("driven", 0.1), ("transition_velocity", 0.1)],
    );
    assert!(refused(&loaded).contains("sits at transmission `shaft0`"), "{}", refused(&loaded));
    let mut along = geared(1, None);
    let law = json!({"drive": {"type": "spring_damper", "stiffness": 10.0, "free_length": 0.1, "damping": 0.1}});
    along.add("actuators", json!({"name": "strut", "on": {"line": 0}}), law);
    let message = refused(&along);
    assert!(message.contains("transmission `shaft0`") && message.contains("a line"), "{message}");
}
