//! Motors, springs and visco-elastic elements as drives of machines, against closed forms; what is refused.

use serde_json::{Value, json};
use vpm_core::description::Description;
use vpm_core::error::{DriveError, Error};
use vpm_core::evaluate::{energy, internal_state, mass_matrix};
use vpm_core::integrator::Method;
use vpm_core::inverse::{Motion, inverse_dynamics};
use vpm_core::linearize::linearize;
use vpm_core::samples::{double_pendulum, pendulum, slider};
use vpm_core::table::Table;

use crate::common::{ALWAYS, Bench, Machine, close};

/// R, tau, k_t, k_e, N, eta, v_t, J of a motor.
const MOTOR: [(&str, f64); 8] = [
    ("resistance", 0.5),
    ("time_constant", 2e-3),
    ("torque_constant", 0.06),
    ("back_emf", 0.06),
    ("gear_ratio", 50.0),
    ("efficiency", 0.8),
    ("transition_velocity", 1e-3),
    ("rotor_inertia", 2e-5),
];

fn motor(changes: &[(&str, f64)]) -> Value {
    let mut drive = json!({"type": "dc_motor"});
    for (name, value) in MOTOR.iter().chain(changes) {
        drive[name] = json!(value);
    }
    drive
}

fn on_joint(machine: &mut Machine, drive: Value) -> &mut Machine {
    machine.add("actuators", json!({"name": "hip", "on": {"joint": 0}}), json!({"drive": drive}))
}

/// A line from the world to a body, with what acts on it.
fn on_line(machine: &mut Machine, (from, body, at): ([f64; 3], usize, [f64; 3]), drive: Value) -> &mut Machine {
    let line = json!({"name": "strut", "from": {"on": "world", "point": from}, "to": {"on": {"body": body}, "point": at},
        "barrel": null, "rod": null});
    machine.add("lines", line, json!({}));
    machine.add("actuators", json!({"name": "spring", "on": {"line": 0}}), json!({"drive": drive}))
}

/// A wheel about z, without weight on its way, 0.1 kg m^2.
fn wheel() -> Machine {
    let mut sample = slider(3.0);
    sample.bodies[0].joint.kind = vpm_core::joint::JointKind::Revolute;
    if let Some(inertia) = &mut sample.bodies[0].inertia {
        inertia.moments[..3].fill(0.1);
    }
    Machine::new(&sample)
}

#[test]
fn current_of_a_locked_motor_settles_exponentially() {
    let mut machine = wheel();
    machine.effect("viscous_friction", 0, &[("viscous", 1e9)]);
    on_joint(&mut machine, motor(&[]));
    let bench = Bench::new(&machine, 1e-3, 20, Method::Rosenbrock);
    let run = bench.free(&[0.0; 3], &[6.0; 11]);
    let column = bench.description.layout().dc_motors();
    for (k, current) in bench.channel(&run, column).into_iter().enumerate() {
        let exact = 6.0 / 0.5 * (1.0 - (-(k as f64) * 1e-3 / 2e-3).exp());
        close(current, exact, 1e-6);
        close(run.states[3 * k + 2], current, 0.0);
    }
}

#[test]
fn a_motor_without_load_runs_at_the_speed_of_its_voltage() {
    // Without load there is no torque, so that nothing is lost in the gear: u = k_e N dq.
    let mut machine = wheel();
    on_joint(&mut machine, motor(&[]));
    let bench = Bench::new(&machine, 0.01, 10, Method::Rosenbrock);
    let last = |run: &vpm_core::simulate::Run, place: usize| *bench.state(run, place).last().unwrap();
    let run = bench.free(&[0.0; 3], &[24.0; 300]);
    close(last(&run, 1), 24.0 / (0.06 * 50.0), 1e-9);
    close(last(&run, 2), 0.0, 1e-9);
}

#[test]
fn of_a_loaded_motor_the_share_eta_of_the_power_arrives() {
    for (viscous, load) in [(5.0, 0.0), (5.0, -40.0)] {
        let mut machine = wheel();
        machine.effect("viscous_friction", 0, &[("viscous", viscous)]);
        machine.effect("bias_force", 0, &[("force", load)]);
        on_joint(&mut machine, motor(&[]));
        let bench = Bench::new(&machine, 0.01, 10, Method::Rosenbrock);
        let run = bench.free(&[0.0; 3], &[12.0; 300]);
        let [rate, current] = [1, 2].map(|place| *bench.state(&run, place).last().unwrap());
        // Steady, both signs of the torque: eta of it arrives where the motor drives, 2 - eta where it is driven.
        let driving = 50.0 * 0.06 * current;
        let factor = if current > 0.0 { 0.8 } else { 1.2 };
        close(driving * factor, viscous * rate + load, 1e-7);
        close(current, (12.0 - 0.06 * 50.0 * rate) / 0.5, 1e-7);
        assert!(rate > 1.0 && (current > 0.0) == (load == 0.0), "{rate} {current}");
        let layout = bench.description.layout();
        let force = *bench.channel(&run, layout.actuators() + 1).last().unwrap();
        close(force, driving * factor, 1e-9);
    }
}

#[test]
fn the_rotor_adds_to_the_inertia_of_its_joint() {
    let mut machine = wheel();
    let before = mass_matrix(&machine.build(), &machine.values, &[0.3]).unwrap()[0];
    on_joint(&mut machine, motor(&[]));
    let after = mass_matrix(&machine.build(), &machine.values, &[0.3]).unwrap()[0];
    close(after - before, 50.0 * 50.0 * 2e-5, 1e-14);
}

#[test]
fn springs_along_lines_vibrate_and_keep_energy() {
    // A mass on a rail between the spring and the world: m a = k (s0 + u - s), closed form of the vibration.
    let mut machine = Machine::new(&slider(2.0));
    let spring = json!({"type": "spring_damper", "stiffness": 800.0, "free_length": 0.3, "damping": 0.0});
    on_line(&mut machine, ([0.0; 3], 0, [0.0; 3]), spring);
    let bench = Bench::new(&machine, 1e-3, 1, Method::Rk4);
    let run = bench.free(&[0.35, 0.0], &[0.02; 400]);
    for (k, state) in run.states.chunks_exact(2).enumerate() {
        close(state[0], 0.32 + 0.03 * (20.0 * k as f64 * 1e-3).cos(), 1e-9);
    }
    // A double pendulum in space, the line aslant: without damping nothing is lost.
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    let spring = json!({"type": "spring_damper", "stiffness": 90.0, "free_length": 0.5, "damping": 0.0});
    on_line(&mut machine, ([0.4, 0.1, 0.2], 1, [0.0, 0.0, -0.3]), spring);
    let bench = Bench::new(&machine, 1e-3, 2, Method::Rk4);
    let run = bench.free(&[0.6, -0.4, 0.5, 1.0], &[0.0; 1001]);
    let total = |state: &[f64]| {
        let (kinetic, potential) = energy(&bench.description, &bench.theta, &state[..2], &state[2..]).unwrap();
        kinetic + potential
    };
    let (start, end) = (total(&run.states[..4]), total(&run.states[4000..]));
    close(end, start, 1e-8);
}

#[test]
fn damping_along_a_line_takes_its_power() {
    let mut machine = Machine::new(&slider(2.0));
    let spring = json!({"type": "spring_damper", "stiffness": 800.0, "free_length": 0.3, "damping": 16.0});
    on_line(&mut machine, ([0.0; 3], 0, [0.0; 3]), spring);
    let bench = Bench::new(&machine, 1e-3, 1, Method::Rk4);
    let run = bench.free(&[0.35, 0.0], &[0.0; 400]);
    // x'' + 8 x' + 400 x = 0.
    let (decay, omega) = (4.0, (400.0_f64 - 16.0).sqrt());
    for (k, state) in run.states.chunks_exact(2).enumerate() {
        let t = k as f64 * 1e-3;
        let exact = 0.05 * (-decay * t).exp() * ((omega * t).cos() + decay / omega * (omega * t).sin());
        close(state[0], 0.3 + exact, 1e-9);
    }
}

#[test]
fn a_visco_elastic_element_relaxes_as_its_closed_form() {
    // Held at its length by a huge friction: after a jump of the command the force falls from k0 + k1 to k0.
    let mut machine = Machine::new(&slider(2.0));
    machine.effect("viscous_friction", 0, &[("viscous", 1e12)]);
    let element = json!({"type": "maxwell", "stiffness": 1000.0, "free_length": 0.3, "fast_stiffness": 3000.0,
        "relaxation_time": 0.05});
    on_line(&mut machine, ([0.0; 3], 0, [0.0; 3]), element);
    let bench = Bench::new(&machine, 1e-3, 10, Method::Rosenbrock);
    let stretch = internal_state(&bench.description, &bench.theta, &[0.35]).unwrap();
    close(stretch[0], 0.05, 1e-15);
    let run = bench.free(&[0.35, 0.0, stretch[0]], &[0.01; 200]);
    let tension = bench.description.layout().lines() + 2;
    for (k, force) in bench.channel(&run, tension).into_iter().enumerate() {
        // Positive pushes apart: the free length is 0.31, the stretch 0.04 and that of the damper still 0.05.
        let fade = (-(k as f64) * 1e-3 / 0.05).exp();
        close(force, -1000.0 * 0.04 + 3000.0 * 0.01 * fade, 1e-6);
    }
}

#[test]
fn the_effort_of_an_ideal_drive_ends_at_its_limit() {
    let mut machine = Machine::new(&slider(2.0));
    machine.actuator(0, &[("gain", 10.0), ("limit", 4.0)]);
    let bench = Bench::new(&machine, 0.1, 1, Method::Rk4);
    let run = bench.free(&[0.0; 2], &[0.1, 0.3, 0.5, -9.0]);
    assert_eq!(bench.channel(&run, 5), [1.0, 3.0, 4.0, -4.0]);
    let slope = |input: f64| linearize(&bench.description, &bench.theta, &[0.0; 2], &[input]).unwrap().input[1];
    assert_eq!((slope(0.3), slope(0.5)), (5.0, 0.0));
}

#[test]
fn inverse_dynamics_refuse_drives_with_a_life_of_their_own() {
    let mut machine = wheel();
    on_joint(&mut machine, motor(&[]));
    let (numbers, d) = ([0.0; 5], machine.build());
    let table = Table::new("motion", &numbers, 5, 1).unwrap();
    let motion = Motion { position: table, velocity: table, acceleration: table, inputs: table, time_step: 0.01 };
    let error = inverse_dynamics(&d, &machine.values, motion, &[], ALWAYS).unwrap_err();
    assert!(matches!(&error, Error::Drive(DriveError::Effort { actuator, .. }) if actuator == "hip"), "{error}");
    assert!(error.to_string().contains("free run"), "{error}");
}

#[test]
fn drives_on_what_they_cannot_move_are_refused() {
    let refused = |machine: &Machine, words: &[&str]| {
        let error = Description::from_json(&machine.json()).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    };
    let spring = json!({"type": "spring_damper", "stiffness": 800.0, "free_length": 0.3, "damping": 16.0});
    refused(
        on_joint(&mut Machine::new(&pendulum(1.0, 1.0)), spring),
        &["`hip`", "spring_damper", "joint `pivot`", "a line"],
    );
    let ends = ([0.0; 3], 0, [0.0; 3]);
    refused(
        on_line(&mut Machine::new(&pendulum(1.0, 1.0)), ends, motor(&[])),
        &["`spring`", "line `strut`", "a joint"],
    );
    for (name, value, words) in [
        ("resistance", 0.0, "hip.drive.resistance"),
        ("time_constant", -1.0, "hip.drive.time_constant"),
        ("gear_ratio", 0.0, "hip.drive.gear_ratio"),
        ("transition_velocity", 0.0, "hip.drive.transition_velocity"),
        ("rotor_inertia", -1.0, "hip.drive.rotor_inertia"),
    ] {
        refused(on_joint(&mut wheel(), motor(&[(name, value)])), &[words]);
    }
    refused(on_joint(&mut wheel(), json!({"type": "pneumatic"})), &["pneumatic", "hydraulic"]);
    refused(on_joint(&mut wheel(), json!({"type": "ideal", "gain": 1.0, "gian": 2.0})), &["gian"]);
}

#[test]
fn explicit_steps_are_refused_where_currents_settle_faster() {
    let mut machine = wheel();
    on_joint(&mut machine, motor(&[("time_constant", 1e-5)]));
    for method in [Method::Rk4, Method::SemiImplicit] {
        let error = Bench::new(&machine, 1e-3, 1, method).try_free(&[0.0; 3], &[0.0; 3]).unwrap_err();
        let Error::StepTooLarge { coordinate, limit, .. } = &error else { panic!("{error}") };
        assert_eq!(coordinate, "current of actuator `hip`");
        // A decay with a time constant of 10 us: 2.785 and 2 of it.
        let most = if method == Method::Rk4 { 2.7853e-5 } else { 2e-5 };
        assert!((limit / most - 1.0).abs() < 2e-3, "{}: {limit}", method.name());
        assert!(Bench::new(&machine, 1e-3, 60, method).try_free(&[0.0; 3], &[0.0; 3]).is_ok());
    }
}
