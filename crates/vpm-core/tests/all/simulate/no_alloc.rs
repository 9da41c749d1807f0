//! A simulation allocates before its first step and never after: a record ten times as long takes the same number of allocations.

use allocation_counter::measure;
use serde_json::json;
use vpm_core::integrator::Method;
use vpm_core::samples::double_pendulum;
use vpm_core::simulate::Hold;

use crate::common::hydraulics::nominal;
use crate::common::servo_machine::{rest, simpler_drives};
use crate::common::{Bench, Machine};

fn bench(method: Method, sensitivities: &[usize]) -> Bench {
    let mut machine = Machine::new(&double_pendulum([1.0, 0.7], [0.5, 0.4]));
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.3)])
        .effect("spring", 1, &[("stiffness", 2.0), ("rest", 0.3)])
        .actuator(0, &[("gain", 1.5), ("delay", 0.0137), ("dead_zone", 0.1), ("saturation", 1.9), ("lag", 0.06)])
        .actuator(1, &[("gain", 1.5)])
        .sensor(json!({"kind": "position", "joint": 0}), &[("gain", 1.1), ("delay", 0.0172)])
        .controller("cascade", 0, 0, &[("position_gain", 3.0), ("velocity_gain", 1.2), ("limit", 2.5)])
        .controller("pid", 1, 1, &[("proportional", 2.0), ("integral", 1.0), ("derivative", 0.1)]);
    Bench { sensitivities: sensitivities.to_vec(), ..Bench::new(&machine, 0.01, 2, method) }
}

const START: [f64; 5] = [0.4, -0.3, 0.5, 0.2, 0.7];

#[test]
fn steps_allocate_nothing() {
    let inputs = vec![0.5; 2 * 200];
    for method in Method::ALL {
        // One pass of four derivatives stays on this thread, where the counter sees it.
        for sensitivities in [&[][..], &[0, 3, 20, 25][..]] {
            let (bench, moving) = (bench(method, sensitivities), bench(method, sensitivities));
            let moving = Bench { hold: Hold::Cubic, ..moving };
            let free = |rows: usize| measure(|| drop(bench.free(&START, &inputs[..2 * rows]))).count_total;
            let closed = |rows: usize| {
                measure(|| drop(bench.closed(&START, &inputs[..2 * rows], &inputs[..2 * rows]))).count_total
            };
            // What is recorded in the first run is kept; both are long enough for machine code.
            free(60);
            let (short, long) = (free(60), free(200));
            assert_eq!(short, long, "free run, {}", method.name());
            let moving = |rows: usize| measure(|| drop(moving.free(&START, &inputs[..2 * rows]))).count_total;
            moving(60);
            assert_eq!(moving(60), moving(200), "moving inputs, {}", method.name());
            closed(60);
            let (short, long) = (closed(60), closed(200));
            assert_eq!(short, long, "closed loop, {}", method.name());
            assert!(short > 0, "the counter sees nothing");
        }
    }
}

#[test]
fn pieces_of_restarts_allocate_nothing() {
    let inputs = vec![0.5; 2 * 200];
    let bench = bench(Method::LinearlyImplicit, &[]);
    let pieces = |count: usize| {
        let starts: Vec<usize> = (0..count).map(|k| 10 * k).collect();
        let states = START.repeat(count);
        measure(|| drop(bench.restart(&states, &starts, 20, &inputs))).count_total
    };
    // What is recorded in the first run is kept.
    pieces(2);
    assert_eq!(pieces(2), pieces(18));
}

#[test]
fn drives_with_fewer_states_allocate_nothing() {
    let mut servo = nominal();
    // Heavy enough for steps of every method beside pressures that follow at once.
    servo.load.mass = 300.0;
    let currents: Vec<f64> = (0..200).map(|k| 2e-3 * (0.05 * f64::from(k)).sin()).collect();
    for (name, machine) in simpler_drives(&servo) {
        let start = rest(&machine);
        for method in Method::ALL {
            for sensitivities in [&[][..], &[0, 3][..]] {
                let bench = Bench { sensitivities: sensitivities.to_vec(), ..Bench::new(&machine, 1e-5, 2, method) };
                let free = |rows: usize| measure(|| drop(bench.free(&start, &currents[..rows]))).count_total;
                // What is recorded in the first run is kept; both are long enough for machine code.
                free(60);
                assert_eq!(free(60), free(200), "{name}, {}", method.name());
            }
        }
    }
}
