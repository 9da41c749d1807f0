//! Pressures without a state: the balance of flows, its closed form and slopes, the limit of stiff oil, long steps.

use serde_json::{Value, json};
use vpm_core::actuator::hydraulic::{Balance, Chambers, PistonSize, ServoCylinder};
use vpm_core::integrator::Method;
use vpm_core::ode::Ode;
use vpm_core::{Dual, Scalar};

use crate::common::hydraulics::nominal;
use crate::common::servo_machine::{MIDDLE, with_pressures};
use crate::common::{Bench, Machine, close};

/// The nominal servo-cylinder behind a valve that follows at once and leaks in its middle.
fn leaking(clearance: f64) -> ServoCylinder<f64> {
    let mut servo = nominal();
    (servo.valve.frequency, servo.valve.damping) = (None, None);
    servo.valve.clearance = Some(clearance);
    servo
}

fn balanced<S: Scalar>(servo: &ServoCylinder<S>, spool: S, v: S) -> Chambers<S> {
    let fed = [servo.supply_pressure, servo.tank_pressure];
    Balance::new(&servo.valve, &servo.cylinder, &servo.fluid, spool, fed).chambers(v)
}

#[test]
fn what_flows_in_flows_out() {
    for (internal, external) in [(0.0, 0.0), (1.7e-13, 0.0), (0.0, 4e-13), (5e-12, 2e-12)] {
        let mut servo = leaking(2e-4);
        servo.cylinder.internal_leakage = internal;
        servo.cylinder.external_leakage = external;
        let (mut full, mut cavitating) = (0, 0);
        for spool in [-0.02, -6e-3, -1e-3, -1e-5, 0.0, 1e-6, 4e-4, 5e-3] {
            for v in [-1.5, -0.2, -0.01, -1e-6, 0.0, 3e-4, 0.05, 0.4] {
                let found = balanced(&servo, spool, v);
                let flows = servo.valve.flows(spool, 16e6, 1e5, [found.a, found.b]);
                let inflow = Chambers { a: flows.into_a, b: -flows.out_of_b };
                close(flows.supply - flows.tank, flows.into_a - flows.out_of_b, 1e-15);
                let rates = servo.cylinder.rates(&servo.fluid, found, [0.0, v], inflow, 1e5);
                // Pa/s: rounding of the roots and of flows of up to 1e-4 m^3/s through oil of 3e14 Pa per m^3.
                for (pressure, rate) in [(found.a, rates.a), (found.b, rates.b)] {
                    if pressure > servo.fluid.vapour_pressure {
                        assert!(rate.abs() < 1e3, "{spool} {v}: {pressure} {rate}");
                        full += 1;
                    } else {
                        assert!(rate <= 0.0, "{spool} {v}: {rate}");
                        cavitating += 1;
                    }
                }
            }
        }
        assert!(full > 60 && cavitating > 5, "{full} {cavitating}");
    }
}

#[test]
fn worn_seals_leak_beside_new_ones() {
    let mut new = leaking(2e-4);
    new.cylinder.internal_leakage = 5e-12;
    let mut worn = new;
    (worn.cylinder.internal_leakage, worn.cylinder.worn_leakage) = (2e-12, Some(3e-12));
    for (spool, v) in [(4e-4, 0.01), (-1e-3, -0.05), (0.0, 0.0)] {
        let [as_new, as_worn] = [new, worn].map(|servo| balanced(&servo, spool, v));
        close(as_worn.a, as_new.a, 1e-6);
        close(as_worn.b, as_new.b, 1e-6);
        let lost = worn.cylinder.leakage(as_worn, 1e5);
        close(lost.a, 5e-12 * (as_worn.a - as_worn.b), 1e-18);
        close(lost.a + lost.b, 0.0, 0.0);
    }
}

#[test]
fn a_symmetric_cylinder_has_a_closed_form() {
    // Both drops are those of A v through an edge: pa - pb = ps - pt - 2 (A v / (gain u))^2 along an open valve.
    let mut servo = leaking(1e-8);
    servo.cylinder.size = PistonSize::Areas { area: 1.2e-4, area_ratio: 1.0 };
    servo.cylinder.internal_leakage = 0.0;
    for spool in [2e-3, 5e-3, -4e-3] {
        for share in [0.05, 0.5, 0.9, 1.3, -0.4] {
            let most = servo.valve.orifice.gain * spool * (15.9e6_f64 / 2.0).sqrt() / 1.2e-4;
            let v = share * most;
            let Chambers { a, b } = balanced(&servo, spool, v);
            let drop = (1.2e-4 * v / (servo.valve.orifice.gain * spool)).powi(2);
            // Against the flow of the valve the drops add to the pressures that drive it.
            let along = 15.9e6 - 2.0 * share.signum() * drop;
            let (a, b) = if spool > 0.0 { (a, b) } else { (b, a) };
            if b < 1e4 || a < 1e4 {
                continue;
            }
            close(a - b, along, 1e-4 * 15.9e6);
            close(a + b, 16.1e6, 1e-4 * 16.1e6);
        }
    }
    let rest = balanced(&servo, 0.0, 0.0);
    close(rest.a, 0.5 * 16.1e6, 1e-3);
    close(rest.b, 0.5 * 16.1e6, 1e-3);
}

#[test]
fn slopes_and_slopes_of_slopes_are_those_of_differences() {
    let servo = leaking(3e-4);
    let force = |u: f64, v: f64| {
        let found = balanced(&servo, u, v);
        servo.cylinder.force(found)
    };
    type Twice = Dual<Dual<f64, 2>, 2>;
    let lifted = servo.map(&mut |&number| Twice::constant(Dual::constant(number)));
    for (u, v) in [(1e-3, 0.05), (-2e-3, -0.1), (1e-5, 0.01), (4e-3, -0.1), (-1e-4, 0.02), (0.0, 1e-4)] {
        let [at_u, at_v] = [(0, u), (1, v)].map(|(lane, value)| Twice::variable(Dual::variable(value, lane), lane));
        let found = lifted.cylinder.force(balanced(&lifted, at_u, at_v));
        close(found.re(), force(u, v), 1e-9 * force(u, v).abs().max(1.0));
        for (lane, step) in [(0, 1e-7), (1, 1e-6)] {
            let at = |side: f64| match lane {
                0 => force(u + side * step, v),
                _ => force(u, v + side * step),
            };
            let slope = (at(1.0) - at(-1.0)) / (2.0 * step);
            close(found.gradient[lane].value, slope, 1e-5 * slope.abs());
            let [near, far] = [30.0, 60.0].map(|w| (at(w) - 2.0 * at(0.0) + at(-w)) / (w * step).powi(2));
            let bend = (4.0 * near - far) / 3.0;
            close(found.gradient[lane].gradient[lane], bend, 2e-2 * bend.abs().max(slope.abs()));
        }
    }
}

/// Velocity and pressures at samples under `currents`, from rest at mid-stroke.
fn moved(machine: &Machine, (step, method): (f64, Method), currents: &[f64]) -> vpm_core::Result<[Vec<f64>; 3]> {
    let bench = Bench::new(machine, step, 1, method);
    let mut start = vec![MIDDLE, 0.0];
    start.extend(vpm_core::evaluate::internal_state(&bench.description, &machine.values, &[MIDDLE])?);
    let (run, first) = (bench.try_free(&start, currents)?, bench.description.layout().hydraulics());
    let width = bench.description.n_outputs();
    let column = |at: usize| run.outputs.chunks_exact(width).map(|row| row[at]).collect::<Vec<_>>();
    Ok([1, first + 1, first + 2].map(column))
}

#[test]
fn stiff_oil_comes_near_to_it_in_first_order() -> vpm_core::Result<()> {
    const STEP: f64 = 1e-4;
    let sine = |k: u32| 2e-3 + 1e-3 * (std::f64::consts::TAU * 20.0 * f64::from(k) * STEP).sin();
    let currents: Vec<f64> = (0..1000).map(sine).collect();
    let mut servo = leaking(2e-4);
    // A spool of its own, so that no pressure jumps with the held current.
    (servo.valve.frequency, servo.valve.damping) = (Some(1570.0), Some(0.7));
    let fine = (STEP, Method::Rosenbrock);
    let limit = moved(&with_pressures(&servo, "quasi_static", json!("constant")), fine, &currents)?;
    let mut gaps = Vec::new();
    for stiffer in [4.0, 16.0, 64.0] {
        let mut stiff = servo;
        stiff.fluid.bulk_modulus *= stiffer;
        let full = moved(&with_pressures(&stiff, "chambers", json!("constant")), fine, &currents)?;
        gaps.push([0, 1, 2].map(|channel| {
            let most = limit[channel].iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            let gap = limit[channel][400..].iter().zip(&full[channel][400..]).map(|(a, b)| (a - b).abs());
            gap.fold(0.0, f64::max) / most
        }));
    }
    for (softer, stiffer) in [(0, 1), (1, 2)] {
        for channel in 0..3 {
            let order = (gaps[softer][channel] / gaps[stiffer][channel]).log(4.0);
            assert!((order - 1.0).abs() < 0.15, "{channel}: {order} {gaps:?}");
        }
    }
    assert!(gaps[0].iter().all(|&gap| gap > 1e-4 && gap < 0.1), "{gaps:?}");
    Ok(())
}

#[test]
fn steps_of_a_millisecond_follow_it() -> vpm_core::Result<()> {
    // Damping grows with the velocity, and is none where the piston starts from: one step of a light mass leads far beyond the steady
    // velocity, where it is thousandfold. Guarded steps find their way there, others with a mass that a millisecond does not throw so far.
    let currents: Vec<f64> = (0..400).map(|k| if k < 200 { 1e-3 } else { 0.0 }).collect();
    let fine_currents: Vec<f64> = currents.iter().flat_map(|&current| [current; 10]).collect();
    for (mass, methods) in [
        (3.0, &[Method::Guarded][..]),
        (30.0, &[Method::Guarded, Method::Rosenbrock]),
        (300.0, &[Method::Guarded, Method::Rosenbrock]),
    ] {
        for clearance in [1e-4, 5e-4] {
            let mut servo = leaking(clearance);
            servo.load.mass = mass;
            let described = with_pressures(&servo, "quasi_static", json!("constant"));
            let [fine, ..] = moved(&described, (1e-4, Method::Guarded), &fine_currents)?;
            for &method in methods {
                let [velocity, ..] = moved(&described, (1e-3, method), &currents)?;
                // Steady before the valve shuts, and creeping after it: equal pressures push a piston with a rod on one side.
                close(velocity[199], fine[1990], 1e-3 * fine[1990].abs());
                close(velocity[399], fine[3990], 1e-3 * fine[1990].abs());
                assert!(velocity[399].abs() < 0.1 * velocity[199].abs(), "{mass} {clearance}: {}", velocity[399]);
            }
        }
    }
    Ok(())
}

#[test]
fn state_jacobian_is_that_of_differences_for_every_supply() {
    let sag = json!({"sagging": {"resistance": 2e10, "capacitance": 1e-12}});
    let lost = |own: Value| json!({"own": own, "drop": {"resistance": 1e10, "time_constant": 0.02}});
    for (source, states) in [(json!("constant"), 0), (sag.clone(), 1), (lost(json!("constant")), 1), (lost(sag), 2)] {
        for spool in [0, 2] {
            let mut servo = leaking(2e-4);
            if spool > 0 {
                (servo.valve.frequency, servo.valve.damping) = (Some(1570.0), Some(0.7));
            }
            let described = with_pressures(&servo, "quasi_static", source.clone());
            let mut system = described.system();
            let dim = 2 + spool + states;
            assert_eq!(system.dim(), dim);
            let mut x = vec![MIDDLE + 0.002, 0.05];
            x.extend(&[1e-3, -0.3][..spool]);
            x.extend(&[14e6, 3e5][2 - states..]);
            if states == 1 && source.get("sagging").is_some() {
                x[dim - 1] = 14e6;
            }
            system.hold(0, 2e-3);
            let (mut exact, mut sizes) = (vec![0.0; dim * dim], vec![0.0; dim]);
            system.jacobian(&x, &mut exact);
            system.scales(&mut sizes);
            for column in 0..dim {
                let step = 1e-4 * sizes[column].min(1.0).max(sizes[column] * 1e-2);
                let mut slope = vec![0.0; dim];
                for sign in [1.0, -1.0] {
                    let (mut near, mut rate) = (x.clone(), vec![0.0; dim]);
                    near[column] += sign * step;
                    system.rhs(&near, &mut rate);
                    slope.iter_mut().zip(&rate).for_each(|(slope, rate)| *slope += sign * rate / (2.0 * step));
                }
                let most = (0..dim).fold(0.0_f64, |most, row| most.max((slope[row] / sizes[row]).abs()));
                for row in 0..dim {
                    let gap = (exact[row * dim + column] - slope[row]).abs() / sizes[row];
                    assert!(
                        gap <= 1e-4 * most,
                        "{source} {spool} {row} {column}: {} {}",
                        exact[row * dim + column],
                        slope[row]
                    );
                }
            }
        }
    }
}

#[test]
fn a_valve_that_shuts_is_refused() {
    let mut servo = leaking(1e-4);
    servo.valve.clearance = None;
    let described = with_pressures(&servo, "quasi_static", json!("constant"));
    let told = vpm_core::description::Description::from_json(&described.json()).map(|_| ()).unwrap_err().to_string();
    assert!(told.contains("`hip` has quasi-static pressures") && told.contains("clearance"), "{told}");
}
