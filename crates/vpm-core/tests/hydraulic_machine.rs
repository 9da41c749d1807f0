//! The servo-cylinder as a drive of a machine, on a sliding joint and on a line, against its rig and against closed forms.

#[cfg(test)]
mod common;
#[cfg(test)]
#[path = "common/hydraulics.rs"]
mod hydraulics;
#[cfg(test)]
#[path = "common/servo_machine.rs"]
mod servo_machine;

use common::{Bench, close};
use hydraulics::{Chirp, nominal};
use servo_machine::{MIDDLE, On, machine, rest};
use vpm_core::Result;
use vpm_core::actuator::hydraulic::{ServoCylinder, ServoRig, ServoState};
use vpm_core::integrator::{Integrator, Method};

/// A step of 2 mA, then a chirp, held for 0.2 ms.
fn currents() -> Vec<f64> {
    let chirp = Chirp { amplitude: 1e-3, start: 12.0, slope: 300.0 };
    (0..1500).map(|k| if k < 500 { 2e-3 } else { chirp.current((k - 500) as f64 * 2e-4) }).collect()
}

/// Position, velocity, spool, spool rate, chambers of the rig after every sample.
fn of_rig(servo: &ServoCylinder<f64>, method: Method, currents: &[f64]) -> Result<Vec<[f64; 6]>> {
    let (mut x, mut rig) = (servo.rest().to_array(), ServoRig::new(*servo)?);
    let mut integrator = Integrator::new(method, 6);
    let row = |x: &[f64; 6]| [x[0] + MIDDLE, x[2], x[1], x[3], x[4], x[5]];
    Ok(currents
        .iter()
        .map(|&current| {
            let shown = row(&x);
            rig.current = current;
            integrator.step(&mut rig, &mut x, 2e-4);
            shown
        })
        .collect())
}

#[test]
fn machine_moves_as_the_rig() {
    let (servo, currents) = (nominal(), currents());
    for method in [Method::LinearlyImplicit, Method::Rosenbrock] {
        let expected = of_rig(&servo, method, &currents).unwrap();
        for on in [On::Joint, On::Line] {
            let machine = machine(&servo, on);
            let bench = Bench::new(&machine, 2e-4, 1, method);
            let run = bench.free(&rest(&machine), &currents);
            // The rig's position is counted from mid-stroke, here it has 9 digits less of the chambers' stiffness to itself.
            let sizes = [1e-3, 0.1, 2e-3, 1.0, 1e6, 1e6];
            for (k, (found, expected)) in run.states.chunks_exact(6).zip(&expected).enumerate() {
                for place in 0..6 {
                    let off = (found[place] - expected[place]).abs() / sizes[place];
                    assert!(off < 1e-8, "{} {on:?} sample {k}: {found:?} {expected:?}", method.name());
                }
            }
        }
    }
}

#[test]
fn outputs_show_the_drive() {
    let servo = nominal();
    let machine = machine(&servo, On::Line);
    let bench = Bench::new(&machine, 1e-3, 4, Method::LinearlyImplicit);
    let run = bench.free(&rest(&machine), &[2e-3; 60]);
    let layout = bench.description.layout();
    let (width, first) = (bench.description.n_outputs(), layout.hydraulics());
    assert_eq!((layout.hydraulics, layout.dc_motors, layout.supplies, width), (1, 0, 1, 4 + 2 + 3 + 5 + 2));
    let (last, state) = (&run.outputs[59 * width..], &run.states[59 * 6..]);
    let shown = &last[first..first + 5];
    assert_eq!(shown[..3], [state[2], state[4], state[5]]);
    let areas = servo.cylinder.areas();
    close(last[5], areas.a * state[4] - areas.b * state[5], 1e-9);
    let at = [state[0] - MIDDLE, state[2], state[1], state[3], state[4], state[5]];
    let flows = servo.flows(&ServoState::from_array(at));
    assert_eq!((shown[3], shown[4]), (flows.into_a, flows.out_of_b));
    let [pressure, flow]: [f64; 2] = last[first + 5..].try_into().unwrap();
    assert_eq!((pressure, flow), (servo.supply_pressure, shown[3]));
}
