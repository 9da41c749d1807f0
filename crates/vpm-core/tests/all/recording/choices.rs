//! Laws over a number that does not tell how it compares: both ways of every choice can be worked out, and what is selected, with its
//! derivatives, is what plain numbers give.

use crate::common::both;
use crate::common::connections;
use crate::common::hydraulics;
use crate::common::trees;

use both::Both;
use proptest::prelude::*;
use serde_json::{Value, json};
use vpm_core::actuator::hydraulic::{Balance, EntrainedAir, ServoState, chambers_under_load};
use vpm_core::actuator::{DeadZone, Ideal, Saturation, TableDrive};
use vpm_core::bushing::Bushing;
use vpm_core::contact::{ContactFriction, NormalContact};
use vpm_core::controller::{ControlMemory, Pid};
use vpm_core::description::Description;
use vpm_core::effect::{Hysteresis, JointEffect, MemoryEffect};
use vpm_core::mount::Mount;
use vpm_core::samples::Random;
use vpm_core::spatial::{Matrix3, Pose, Twist, Vector3};
use vpm_core::system::Build;
use vpm_core::{Dual, Scalar};

/// Numbers that come with a direction each.
const WIDTH: usize = 6;

/// Some laws as functions of six numbers, over any number type.
trait Laws {
    fn of<S: Scalar>(&self, x: [S; WIDTH]) -> Vec<S>;
}

/// Checks that values and derivatives are the same whether comparisons are known or not, bit for bit but for the sign of zero.
fn same(laws: &impl Laws, x: [f64; WIDTH]) {
    let plain = laws.of::<Dual<f64, WIDTH>>(std::array::from_fn(|k| Dual::variable(x[k], k)));
    let both = laws.of::<Dual<Both, WIDTH>>(std::array::from_fn(|k| Dual::variable(Both(x[k]), k)));
    assert_eq!(plain.len(), both.len());
    for (place, (plain, both)) in plain.iter().zip(&both).enumerate() {
        assert!(plain.is_finite() && plain.value == both.value.0, "{place} at {x:?}: {plain:?}, {both:?}");
        assert_eq!(plain.gradient, both.gradient.map(|number| number.0), "{place} at {x:?}");
    }
}

fn read<T: serde::de::DeserializeOwned>(value: Value) -> T {
    serde_json::from_value(value).unwrap()
}

struct Effects(Vec<JointEffect<f64>>, Vec<MemoryEffect<f64>>);

impl Laws for Effects {
    fn of<S: Scalar>(&self, [q, v, way, z, ..]: [S; WIDTH]) -> Vec<S> {
        let mut found = Vec::new();
        for law in &self.0 {
            let effect = law.map(&mut |&number| S::from_f64(number));
            let law = effect.law();
            found.extend([law.effort(q, v), law.resistance(q, v), law.effort_at_rest(q), law.potential(q)]);
            found.extend([law.share_of_load(q, v, z), law.resistance_per_load(v, z), effect.slope_at_rest(q)]);
        }
        for law in &self.1 {
            let (effect, z) = (law.map(&mut |&number| S::from_f64(number)), z * 0.3);
            let law = effect.law();
            found.extend([law.rate(v, z), law.advance(z, way, S::from_f64(0.1)), law.effort(v, z)]);
            if let MemoryEffect::Hysteresis(law) = effect {
                found.push(law.stored(z));
            }
        }
        found
    }
}

fn effects() -> Effects {
    let end_stop =
        json!({"type": "end_stop", "stiffness": 1e3, "damping": 0.1, "low": -1.0, "high": 0.8, "width": 0.05});
    let backlash = json!({"type": "backlash", "gap": 0.4, "stiffness": 100.0, "damping": 1.0, "contact_damping": 2.0, "width": 0.01});
    let stribeck =
        json!({"type": "stribeck_friction", "stribeck": 1.0, "stribeck_velocity": 0.5, "transition_velocity": 0.1});
    let coulomb = json!({"type": "coulomb_friction", "coulomb": 2.0, "transition_velocity": 0.1});
    let uneven = json!({"type": "asymmetric_friction", "coulomb_difference": 2.0, "viscous_difference": 0.4,
        "transition_velocity": 0.1});
    let fitted = json!({"type": "empirical_force", "middle": 0.1, "reach": 0.7, "speed": 0.9, "transition_velocity": 0.05,
        "drag": 0.3, "speed_2": 0.1, "position_3": 2.0, "dry_cosine": 0.5, "load_dry": 2.0, "load_sine": 0.4});
    let formula = json!({"type": "formula", "constants": [], "parameters": [2.0],
        "program": ["velocity", "abs", "velocity", "multiply", {"parameter": 0}, "multiply"]});
    let drag = json!({"type": "quadratic_drag", "drag": 2.0});
    let gear = json!({"type": "load_dependent_friction", "driving": 0.2, "driven": 0.1, "transition_velocity": 0.1});
    let winding = json!({"type": "current_ripple", "period": 0.7, "cosine": 0.8, "sine": 0.6});
    let laws = [end_stop, backlash, stribeck, coulomb, uneven, fitted, formula, drag, gear, winding].map(read);
    let memory = |shape: f64| MemoryEffect::Hysteresis(Hysteresis { force: 3.0, displacement: 0.2, shape });
    let bristles = json!({"type": "lugre_friction", "coulomb": 3.0, "displacement": 0.2, "damping": 0.3, "excess": 0.5,
        "stribeck_velocity": 0.4});
    let warming = json!({"type": "warming_friction", "coulomb": 2.0, "viscous": 0.3, "time_constant": 0.5,
        "transition_velocity": 0.1});
    Effects(laws.into(), vec![memory(0.0), memory(1.0), memory(4.0), read(bristles), read(warming)])
}

struct Contacts(NormalContact<f64>, ContactFriction<f64>);

impl Laws for Contacts {
    fn of<S: Scalar>(&self, [d, rate, speed, normal, x, y]: [S; WIDTH]) -> Vec<S> {
        let (law, friction) = (self.0.map(&mut |&n| S::from_f64(n)), self.1.map(&mut |&n| S::from_f64(n)));
        let turn = Matrix3::rotation(Vector3::from_f64([0.6, 0.0, 0.8]), x * 2.0);
        let pose = Pose::new(turn, Vector3::new(d, rate, speed));
        let bushing = Bushing::diagonal([S::one(); 6], [S::from_f64(0.1); 6]);
        let wrench = bushing.wrenches(&pose, Twist::new(Vector3::new(x, y, rate), Vector3::new(y, d, speed))).on_b;
        let square = speed * speed;
        let mut found = vec![law.force(d, rate), law.spring(d), law.potential(d), law.dissipation(d, rate)];
        found.extend(law.slopes(d));
        found.extend([friction.resistance(square, normal), friction.chord(square)]);
        found.extend(wrench.angular.to_array().into_iter().chain(wrench.linear.to_array()));
        found.extend(turn.rotation_vector().to_array());
        found
    }
}

/// Cylinders whose valve leaks in its middle or not, with air or not.
struct Cylinders;

impl Laws for Cylinders {
    fn of<S: Scalar>(&self, [x, spool, v, a, b, load]: [S; WIDTH]) -> Vec<S> {
        let mut found = Vec::new();
        let air = EntrainedAir { fraction: 0.01, exponent: 1.2, reference_pressure: 1e5 };
        for (clearance, air, overlap) in [(None, None, 1e-3), (Some(1e-4), Some(air), 0.0), (Some(1e-4), None, 1e-3)] {
            let mut servo = hydraulics::nominal();
            (servo.valve.clearance, servo.fluid.air, servo.valve.overlap) =
                (clearance, air, DeadZone { width: overlap });
            let servo = servo.map(&mut |&number| S::from_f64(number));
            // Beyond the stroke, beyond what the spool opens, below the vapour pressure and above the supply.
            let (place, spool, [a, b]) = (x * 0.05, spool * 0.012, [a, b].map(|share| share * 1e7 + 7e6));
            let chambers = vpm_core::actuator::hydraulic::Chambers { a, b };
            let state = ServoState { position: place, spool, velocity: v, spool_rate: load, chambers };
            found.extend(servo.rates(&state, spool * 1.1, load).to_array());
            let flows = servo.flows(&state);
            found.extend([flows.into_a, flows.out_of_b, flows.supply, flows.tank]);
            let ends = [servo.supply_pressure, servo.tank_pressure];
            let under = chambers_under_load(load * 1e6, servo.valve.opening(spool), ends, S::from_f64(0.6));
            if clearance.is_some() {
                let balance = Balance::new(&servo.valve, &servo.cylinder, &servo.fluid, spool, ends).chambers(v);
                found.extend([balance.a, balance.b]);
            }
            found.extend([under.a, under.b, servo.valve.orifice.conductance(spool, a - b)]);
        }
        found
    }
}

struct Signals(TableDrive);

impl Laws for Signals {
    fn of<S: Scalar>(&self, [u, v, r, y, width, limit]: [S; WIDTH]) -> Vec<S> {
        let (dead, cut) = (DeadZone { width: width * width }, Saturation { limit: limit * limit + 0.1 });
        let ideal = Ideal { gain: r, limit: Some(cut) };
        let one = |number: f64| S::from_f64(number);
        let pid = Pid { proportional: one(2.0), integral: one(3.0), derivative: one(0.1), limit: Some(cut) };
        let mut memory = ControlMemory::default();
        let mut found: Vec<S> = (0..4).map(|k| pid.command(&mut memory, r * f64::from(k), y, 0.5)).collect();
        found.extend([self.0.effort(u, v), dead.apply(u), cut.apply(u), ideal.effort(u), ideal.slope(u)]);
        found.extend([u.abs(), u.max(v), u.min(v), u.if_less(v, || r * u, || y * v), u.if_positive(|| r, || y)]);
        found
    }
}

fn table() -> TableDrive {
    let (commands, velocities) = ([-1.0, -0.3, 0.5, 1.0], [-0.8, 0.1, 0.9]);
    let efforts: Vec<f64> = commands.iter().flat_map(|u| velocities.map(|v| (3.0 * u).tanh() - v * v * v)).collect();
    read(json!({"commands": commands, "velocities": velocities, "efforts": efforts}))
}

/// Anywhere, on both sides of small numbers, and where laws change over.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![6 => -1.5..1.5, 2 => -1e-6..1e-6, 1 => Just(0.0), 1 => Just(1.0), 1 => Just(-1.0)]
}

proptest! {
    #[test]
    fn effects_select_what_plain_numbers_take(x in prop::array::uniform6(number())) {
        same(&effects(), x);
    }

    #[test]
    fn contacts_and_turns_select_what_plain_numbers_take(x in prop::array::uniform6(number())) {
        let normal = NormalContact { stiffness: 1e4, exponent: 1.5, damping: 1e4, damping_depth: 0.5 };
        let friction =
            ContactFriction { static_coefficient: 0.7, static_velocity: 0.2, dynamic_coefficient: 0.5, dynamic_velocity: 1.0 };
        same(&Contacts(normal, friction), x);
    }

    #[test]
    fn cylinders_select_what_plain_numbers_take(x in prop::array::uniform6(number())) {
        same(&Cylinders, x);
    }

    #[test]
    fn tables_limits_and_controllers_select_what_plain_numbers_take(x in prop::array::uniform6(number())) {
        same(&Signals(table()), x);
    }

    /// The value and the derivatives are those of the branch, whichever it is.
    #[test]
    fn a_choice_of_duals_is_the_number_of_its_branch(a in number(), b in number(), yes in number(), no in number()) {
        let [yes, no] = [(yes, 0), (no, 1)].map(|(value, lane)| Dual::<f64, 2>::variable(value, lane));
        let (found, expected) = (Dual::from(a).if_less(Dual::from(b), || yes, || no), if a < b { yes } else { no });
        prop_assert_eq!((found.value, found.gradient), (expected.value, expected.gradient));
        let eager = Dual::from(a).select_less(Dual::from(b), yes, no);
        prop_assert_eq!((eager.value, eager.gradient), (expected.value, expected.gradient));
    }
}

/// Elastic beams of two levels, lines that weigh something, markers; contacts, a bushing and a load cell.
fn machine() -> Description {
    let (parts, all) = (trees::everything(3), [10.0; 6]);
    trees::description(&parts, |content| {
        let ground = [[0.0, 0.0, 0.1], [0.0, 0.6, 0.8]];
        for (name, body) in [("hand", 4), ("foot", 2), ("knee", 0)] {
            let friction = Some([0.7, 0.1, 0.5, 1.0]);
            connections::contact(
                content,
                (name, Mount::Body(body), [0.1, 0.0, 0.2]),
                ground,
                [1e3, 1.5, 10.0, 0.1],
                friction,
            );
        }
        let ends = [(Mount::Body(4), [0.1, 0.0, 0.0]), (Mount::World, [0.0, 0.2, 0.0])];
        connections::bushing(content, "mount", ends, all, all, [1.0; 6]);
        connections::load_cell(content, "cell", 1);
        let force = trees::parameter(content, "share", 0.4);
        let shape = [0.1, 1.0, 1.0, 0.05].map(|value| trees::parameter(content, "shape", value));
        trees::push(
            content,
            "effects",
            json!({"type": "empirical_force", "joint": 1, "middle": shape[0], "reach": shape[1],
            "speed": shape[2], "transition_velocity": shape[3], "load_dry": force}),
        );
    })
}

/// Rates, all outputs, and efforts that a motion needs.
fn seen<S: Scalar>(d: &Description, x: &[f64]) -> Vec<S> {
    let lift = |numbers: &[f64]| -> Vec<S> { numbers.iter().map(|&number| S::from_f64(number)).collect() };
    let mut dynamics = Build::dynamics(&d, &lift(&d.parameters)).unwrap();
    let (x, n) = (lift(x), dynamics.coordinates());
    let (mut rates, mut outputs) = (x.clone(), vec![S::zero(); dynamics.layout().count()]);
    dynamics.rhs(&x, &mut rates);
    dynamics.observe(&x, &rates, &mut outputs);
    let mut efforts = vec![S::zero(); n];
    dynamics.inverse_dynamics(&x[..n], &x[n..2 * n], &rates[n..2 * n], &mut efforts);
    [rates, outputs, efforts].concat()
}

/// The series of the beams' turns are longer where an angle is not known, which is rounding, times what solving for accelerations adds.
#[test]
fn machines_select_what_plain_numbers_take() {
    let (d, random) = (machine(), &mut Random::new(8));
    let contacts = d.n_states() + d.layout().contacts();
    let mut touched = 0;
    for _ in 0..40 {
        // Joints anywhere, beams bent visibly.
        let x: Vec<f64> =
            (0..d.n_states()).map(|k| if k < d.n_joints() { 3.0 } else { 0.3 } * random.symmetric()).collect();
        let (plain, both) = (seen::<f64>(&d, &x), seen::<Both>(&d, &x));
        let size = plain.iter().fold(0.0, |most: f64, number| most.max(number.abs()));
        for (plain, both) in plain.iter().zip(&both) {
            assert!((plain - both.0).abs() <= 1e-12 * size, "{plain}, {both:?} beside {size}");
        }
        touched += (0..3).filter(|contact| plain[contacts + 5 * contact + 1] > 0.0).count();
    }
    assert!(0 < touched && touched < 120, "points touch the ground {touched} times of 120");
}
