//! Recorded machines: every program against the direct evaluation of the same laws, derivatives against dual numbers.

use serde_json::{Value, json};
use vpm_core::Result;
use vpm_core::beam::{Component, Level};
use vpm_core::description::Description;
use vpm_core::graph::{Evaluator, LARGEST, Native};
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::mount::{Gauge, Mount};
use vpm_core::ode::Ode;
use vpm_core::samples::{Random, random_tree};
use vpm_core::scalar::Dual;
use vpm_core::system::{Build, Dynamics, Kind, Placed, System};

use crate::common::servo_machine::{MIDDLE, leg, simpler_drives, with_pressures};
use crate::common::trees::{beam, body, description, everything, section};
use crate::common::{Machine, hydraulics, two_beams};

/// Length of one step, whose quarter is the reach of a stage, s.
const STEP: f64 = 1e-3;

/// The largest difference relative to the largest number.
fn apart(found: &[f64], expected: &[f64]) -> f64 {
    let size = expected.iter().fold(1e-300_f64, |most, entry| most.max(entry.abs()));
    found.iter().zip(expected).fold(0.0, |most: f64, (found, expected)| most.max((found - expected).abs() / size))
}

/// Directions that the witness takes at once.
const DIRECTIONS: usize = 8;

type Number = Dual<f64, DIRECTIONS>;

/// The direct evaluation of a machine, in plain numbers and in numbers with derivatives.
struct Witness<'a> {
    description: &'a Description,
    direct: System<f64>,
    dual: Dynamics<Number>,
    theta: Vec<f64>,
}

impl<'a> Witness<'a> {
    fn new(description: &'a Description, theta: Vec<f64>) -> Result<Self> {
        let lifted: Vec<Number> = theta.iter().map(|&value| Dual::constant(value)).collect();
        let (direct, dual) = (description.system::<f64>(&theta)?, Build::dynamics(&description, &lifted)?);
        Ok(Self { description, direct, dual, theta })
    }

    /// The derivative of the rates by the states, row by row.
    fn derivative(&mut self, x: &[f64], u: &[f64]) -> Vec<f64> {
        let dim = x.len();
        let (mut matrix, mut rates) = (vec![0.0; dim * dim], vec![Number::default(); dim]);
        for (number, &input) in u.iter().enumerate() {
            self.dual.hold(number, Dual::constant(input));
        }
        for first in (0..dim).step_by(DIRECTIONS) {
            let seed = |(place, &value): (usize, &f64)| Dual::variable(value, place.wrapping_sub(first));
            self.dual.rhs(&x.iter().enumerate().map(seed).collect::<Vec<_>>(), &mut rates);
            for (row, rate) in matrix.chunks_exact_mut(dim).zip(&rates) {
                row[first..].iter_mut().zip(&rate.gradient).for_each(|(entry, &slope)| *entry = slope);
            }
        }
        matrix
    }

    /// What a program gives, in lanes and as machine code if it is not too large, and where it belongs in a matrix.
    fn run(&mut self, kind: &Kind, [x, implicit, u]: [&[f64]; 3]) -> Result<Vec<Vec<f64>>> {
        let Placed { program, entries, places, .. } = self.description.program(kind, &self.theta)?;
        let n = places.coordinates;
        let inputs = [x, u, implicit, &[0.25 * STEP], &x[n..2 * n], &self.theta].concat();
        let numbers = |found: Vec<f64>| {
            if entries.is_empty() {
                return found;
            }
            let dim = x.len();
            let mut matrix = vec![0.0; dim * dim];
            for (&(row, column), &entry) in entries.iter().zip(&found[dim..]) {
                matrix[row * dim + column] = entry;
            }
            [&found[..dim], &matrix[..]].concat()
        };
        let mut found = vec![0.0; program.outputs().len()];
        Evaluator::new(&program).run(&inputs, &mut found);
        if program.size() > LARGEST {
            return Ok(vec![numbers(found)]);
        }
        let native = Native::compile(&program).unwrap();
        let mut code = vec![0.0; found.len()];
        native.call(&inputs, &mut code, &mut native.work()).unwrap();
        Ok(vec![numbers(found), numbers(code)])
    }

    /// The same by direct evaluation.
    fn expected(&mut self, kind: &Kind, [x, implicit, u]: [&[f64]; 3]) -> Vec<f64> {
        let dim = x.len();
        for (number, &input) in u.iter().enumerate() {
            self.direct.hold(number, input);
        }
        let (mut rates, mut matrix) = (vec![0.0; dim], vec![0.0; dim * dim]);
        let mut outputs = vec![0.0; self.description.n_outputs()];
        let (n, a) = (self.direct.coordinates(), &implicit[..self.direct.coordinates()]);
        let mut efforts = vec![0.0; n];
        self.direct.rhs(x, &mut rates);
        match kind {
            Kind::Rates => rates,
            Kind::Sample => {
                self.direct.dynamics().observe(x, &rates, &mut outputs);
                [rates, outputs].concat()
            }
            Kind::Motion => {
                self.direct.dynamics().observe_motion(x, &mut outputs);
                outputs
            }
            Kind::Feedback => {
                let (first, drives) = (self.description.layout().actuators(), self.description.actuators.len());
                let mut all = outputs.clone();
                self.direct.dynamics().observe(x, &rates, &mut all);
                self.direct.dynamics().observe_motion(x, &mut outputs);
                (0..drives).map(|drive| first + 2 * drive + 1).for_each(|force| outputs[force] = all[force]);
                outputs
            }
            Kind::Required => {
                self.direct.dynamics().inverse_dynamics(&x[..n], &x[n..2 * n], a, &mut efforts);
                efforts
            }
            Kind::Linearised => [rates, self.derivative(x, u)].concat(),
            Kind::Prepared => {
                self.direct.iteration_matrix(x, &mut matrix);
                [rates, matrix].concat()
            }
            Kind::Additive => {
                self.direct.additive_rates(x, x, 0.0, &mut rates);
                self.direct.additive_rates(x, implicit, 0.25 * STEP, &mut rates);
                rates
            }
            other => panic!("no witness for {other:?}"),
        }
    }
}

fn state(d: &Description, random: &mut Random, rest: &[f64]) -> Vec<f64> {
    let (n, joints) = (d.n_coordinates(), d.n_joints());
    let motion = [random.numbers(joints, 0.3), random.numbers(n - joints, 0.02), random.numbers(n, 0.3)].concat();
    let mut state: Vec<f64> = motion.iter().chain(&vec![0.0; d.n_states() - 2 * n]).copied().collect();
    if rest.is_empty() {
        let internal = random.numbers(d.n_states() - 2 * n, 0.3);
        state[2 * n..].copy_from_slice(&internal);
    } else {
        // Pressures near those at rest.
        state.iter_mut().zip(rest).enumerate().for_each(|(k, (state, &rest))| {
            *state = if k < 2 * n { rest + *state * 0.1 } else { rest * (1.0 + 0.1 * random.symmetric()) };
        });
    }
    state
}

/// Parameters beside those of the recording, with which the machine exists; the same where it holds for those alone.
fn others(d: &Description, random: &mut Random) -> Result<Vec<f64>> {
    let mut theta = d.parameters.clone();
    if !d.program(&Kind::Sample, &theta)?.of_values {
        for place in 0..theta.len() {
            theta[place] *= 1.0 + 0.02 * random.symmetric();
            if d.check_values(&theta).is_err() {
                theta[place] = d.parameters[place];
            }
        }
    }
    Ok(theta)
}

/// All programs of a machine at random states, inputs and parameters.
fn check(name: &str, d: &Description, kinds: &[Kind], rest: &[f64]) -> Result<()> {
    let random = &mut Random::new(7);
    let mut witness = Witness::new(d, others(d, random)?)?;
    for _ in 0..3 {
        let (x, implicit) = (state(d, random, rest), state(d, random, rest));
        let u: Vec<f64> = random.numbers(d.n_inputs(), 1e-3);
        for kind in kinds {
            let states = [&x[..], &implicit[..], &u[..]];
            let expected = witness.expected(kind, states);
            for (way, found) in ["lanes", "machine code"].into_iter().zip(witness.run(kind, states)?) {
                assert_eq!(found.len(), expected.len(), "{name}, {kind:?}");
                let dim = x.len().min(found.len());
                let error = apart(&found[..dim], &expected[..dim]).max(apart(&found[dim..], &expected[dim..]));
                assert!(error < 1e-10, "{name}, {kind:?}, {way}: {error}");
            }
        }
    }
    Ok(())
}

/// What all methods of integration ask for but the exact derivatives, which are large where beams bend.
const WITHOUT_DERIVATIVES: [Kind; 6] =
    [Kind::Rates, Kind::Sample, Kind::Motion, Kind::Feedback, Kind::Required, Kind::Additive];
/// With the matrices of implicit steps.
const WITH_DERIVATIVES: [Kind; 8] = [
    Kind::Rates,
    Kind::Sample,
    Kind::Motion,
    Kind::Feedback,
    Kind::Required,
    Kind::Additive,
    Kind::Linearised,
    Kind::Prepared,
];

#[test]
fn rigid_trees_with_effects_on_all_joints_agree() -> Result<()> {
    for seed in 1..8 {
        let mut machine = Machine::new(&random_tree(seed, 2 + seed as usize % 4));
        machine
            .effect("coulomb_friction", 0, &[("coulomb", 0.8), ("transition_velocity", 0.1)])
            .effect(
                "stribeck_friction",
                0,
                &[("stribeck", 0.3), ("stribeck_velocity", 0.2), ("transition_velocity", 0.1)],
            )
            .effect("viscous_friction", 1, &[("viscous", 0.2)])
            .effect("spring", 1, &[("stiffness", 6.0), ("rest", 0.3)])
            .effect(
                "backlash",
                1,
                &[("gap", 0.1), ("stiffness", 50.0), ("damping", 0.1), ("contact_damping", 0.5), ("width", 0.01)],
            )
            .effect(
                "end_stop",
                0,
                &[("stiffness", 1e3), ("damping", 0.1), ("low", -0.2), ("high", 0.2), ("width", 0.05)],
            )
            .effect("torque_ripple", 0, &[("period", 2.1), ("cosine", 0.2), ("sine", -0.1)])
            .effect("hysteresis", 1, &[("force", 0.5), ("displacement", 0.1), ("shape", 1.0)]);
        check(&format!("tree {seed}"), &machine.build(), &WITH_DERIVATIVES, &[])?;
    }
    Ok(())
}

#[test]
fn every_effect_agrees_with_its_derivatives() -> Result<()> {
    for (seed, (kind, numbers)) in (1..).zip(EFFECTS) {
        let mut machine = Machine::new(&random_tree(seed, 2));
        machine.effect(kind, 1, numbers).actuator(1, &[("gain", 3e3)]);
        check(kind, &machine.build(), &WITH_DERIVATIVES, &[])?;
    }
    Ok(())
}

#[test]
fn effects_behind_a_joint_agree() -> Result<()> {
    for seed in 1..5 {
        let mut machine = Machine::new(&random_tree(seed, 2 + seed as usize % 3));
        machine
            .effect("coulomb_friction", 0, &[("coulomb", 0.8), ("transition_velocity", 0.1)])
            .effect("joint_compliance", 1, &[("stiffness", 20.0), ("damping", 0.1)])
            .effect_behind("coulomb_friction", [0, 1], &[("coulomb", 0.5), ("transition_velocity", 0.1)])
            .effect_behind("viscous_friction", [0, 1], &[("viscous", 0.2)])
            .effect_behind("spring", [0, 1], &[("stiffness", 6.0), ("rest", 0.3)])
            .effect_behind("hysteresis", [0, 1], &[("force", 0.5), ("displacement", 0.1), ("shape", 1.0)]);
        check(&format!("tree {seed}"), &machine.build(), &WITH_DERIVATIVES, &[])?;
    }
    Ok(())
}

#[test]
fn effects_on_shafts_agree() -> Result<()> {
    for (seed, inertia) in [(1, None), (2, Some(0.3)), (3, Some(0.05)), (4, None)] {
        let mut machine = Machine::new(&random_tree(seed, 2 + seed as usize % 3));
        machine
            .transmission(&[(0, 3.0), (1, -2.0)], inertia)
            .transmission(&[(1, 4.0)], inertia)
            .effect_on_shaft("coulomb_friction", 0, &[("coulomb", 0.5), ("transition_velocity", 0.1)])
            .effect_on_shaft("viscous_friction", 0, &[("viscous", 0.2)])
            .effect_on_shaft("spring", 1, &[("stiffness", 6.0), ("rest", 0.3)])
            .effect_on_shaft("hysteresis", 0, &[("force", 0.5), ("displacement", 0.1), ("shape", 1.0)])
            .effect("viscous_friction", 1, &[("viscous", 0.2)])
            .actuator_on_shaft(0, &[("gain", 30.0), ("lag", 0.05)])
            .rubbing_actuator(1, 8.0, [0.2, 0.1, 0.1]);
        check(&format!("tree {seed}"), &machine.build(), &WITH_DERIVATIVES, &[])?;
    }
    Ok(())
}

/// Effects of joints with their parameters: each a size that is drawn up to it, from a tenth of it.
const EFFECTS: &[(&str, &[(&str, f64)])] = &[
    ("viscous_friction", &[("viscous", 0.5)]),
    ("coulomb_friction", &[("coulomb", 2.0), ("transition_velocity", 0.2)]),
    ("stribeck_friction", &[("stribeck", 1.0), ("stribeck_velocity", 0.4), ("transition_velocity", 0.2)]),
    ("asymmetric_friction", &[("coulomb_difference", 0.3), ("viscous_difference", 0.1), ("transition_velocity", 0.2)]),
    ("spring", &[("stiffness", 20.0), ("rest", 0.5)]),
    ("backlash", &[("gap", 0.2), ("stiffness", 50.0), ("damping", 0.2), ("contact_damping", 0.5), ("width", 0.02)]),
    ("torque_ripple", &[("period", 2.0), ("cosine", 0.5), ("sine", 0.5)]),
    ("bias_force", &[("force", 1.0)]),
    ("hysteresis", &[("force", 1.0), ("displacement", 0.2), ("shape", 1.0)]),
    ("quadratic_drag", &[("drag", 0.5)]),
    ("cubic_spring", &[("stiffness", 20.0), ("rest", 0.5)]),
    ("position_dependent_friction", &[("period", 2.0), ("cosine", 0.5), ("sine", 0.5), ("transition_velocity", 0.2)]),
    ("current_ripple", &[("period", 2.0), ("cosine", 0.2), ("sine", -0.3)]),
    ("load_dependent_friction", &[("driving", 0.3), ("driven", 0.2), ("transition_velocity", 0.2)]),
    (
        "lugre_friction",
        &[("coulomb", 1.0), ("displacement", 0.2), ("damping", 0.1), ("excess", 0.5), ("stribeck_velocity", 0.4)],
    ),
    ("warming_friction", &[("coulomb", 1.0), ("viscous", 0.3), ("time_constant", 2.0), ("transition_velocity", 0.2)]),
];

/// A tree of one to five joints with some effects, a payload and a drive.
pub(super) fn drawn(seed: u64) -> Machine {
    let random = &mut Random::new(seed);
    let mut pick = |count: usize| (random.unit() * count as f64) as usize;
    let joints = 1 + pick(5);
    let mut machine = Machine::new(&random_tree(seed, joints));
    let mut taken = Vec::new();
    for _ in 0..pick(4) {
        let (effect, joint) = (EFFECTS[pick(EFFECTS.len())], pick(joints));
        if !taken.contains(&(effect.0, joint)) {
            taken.push((effect.0, joint));
            let shares: Vec<f64> = effect.1.iter().map(|_| 0.1 * (1 + pick(10)) as f64).collect();
            let numbers: Vec<_> =
                effect.1.iter().zip(shares).map(|(&(name, most), share)| (name, most * share)).collect();
            // Now and then on the sum of two coordinates.
            match pick(4) {
                0 if joints > 1 => machine.effect_behind(effect.0, [joint, (joint + 1) % joints], &numbers),
                _ => machine.effect(effect.0, joint, &numbers),
            };
        }
    }
    machine.payload(pick(joints), 0.1 * (1 + pick(10)) as f64, [0.05, -0.1, 0.2]);
    machine.actuator(pick(joints), &[("gain", 1.0 + pick(10) as f64), ("lag", 0.01 * (1 + pick(5)) as f64)]);
    machine
}

/// The same with a second drive, which rubs.
pub(super) fn rubbing(seed: u64) -> Machine {
    let (mut machine, random) = (drawn(seed), &mut Random::new(seed));
    let [gain, driving, driven] = [1.0 + 9.0 * random.unit(), 0.4 * random.unit(), 0.4 * random.unit()];
    machine.rubbing_actuator(0, gain, [driving, driven, 0.1]);
    machine
}

#[test]
fn a_thousand_random_machines_agree() -> Result<()> {
    let machines = (0..800).map(|seed| (seed, drawn(seed))).chain((800..1000).map(|seed| (seed, rubbing(seed))));
    for (seed, machine) in machines {
        let d = machine.build();
        let random = &mut Random::new(seed);
        let mut witness = Witness::new(&d, others(&d, random)?)?;
        let (x, implicit) = (state(&d, random, &[]), state(&d, random, &[]));
        let u: Vec<f64> = random.numbers(d.n_inputs(), 1.0);
        let states = [&x[..], &implicit[..], &u[..]];
        for kind in [Kind::Sample, Kind::Required, Kind::Additive] {
            let expected = witness.expected(&kind, states);
            for (way, found) in ["lanes", "machine code"].into_iter().zip(witness.run(&kind, states)?) {
                let error = apart(&found, &expected);
                assert!(error < 1e-12, "machine {seed}, {kind:?}, {way}: {error}");
            }
        }
    }
    Ok(())
}

#[test]
fn cylinders_on_lines_agree() -> Result<()> {
    for source in ["constant", "logged"] {
        let (machine, rest) = leg(&hydraulics::nominal(), json!(source));
        check(
            &format!("leg, {source}"),
            &machine.build(),
            &[Kind::Rates, Kind::Sample, Kind::Linearised, Kind::Prepared],
            &rest,
        )?;
    }
    Ok(())
}

#[test]
fn simpler_drives_agree() -> Result<()> {
    for (name, machine) in simpler_drives(&hydraulics::nominal()) {
        let d = machine.build();
        let rest = crate::common::servo_machine::rest(&machine);
        check(name, &d, &[Kind::Rates, Kind::Sample, Kind::Linearised], &rest)?;
    }
    Ok(())
}

/// Slow and fast, with chambers full and at the vapour pressure, with every leakage or none, fed from supplies with and without states.
#[test]
fn pressures_that_are_searched_for_agree() -> Result<()> {
    let sag = json!({"sagging": {"resistance": 2e10, "capacitance": 1e-12}});
    let (random, mut full, mut empty) = (&mut Random::new(11), 0, 0);
    for (leakage, spool, source) in
        [(0.0, false, json!("constant")), (1e-12, true, json!("constant")), (5e-12, false, sag)]
    {
        let mut servo = hydraulics::nominal();
        servo.valve.clearance = Some(2e-4);
        (servo.cylinder.internal_leakage, servo.cylinder.external_leakage) = (leakage, 0.3 * leakage);
        if !spool {
            (servo.valve.frequency, servo.valve.damping) = (None, None);
        }
        let d = with_pressures(&servo, "quasi_static", source).build();
        let mut witness = Witness::new(&d, d.parameters.clone())?;
        assert!(!d.program(&Kind::Sample, &d.parameters)?.of_values);
        for _ in 0..30 {
            let size = 10.0_f64.powf(1.5 * random.symmetric() - 1.0);
            let mut x = vec![MIDDLE + 0.01 * random.symmetric(), size * random.symmetric()];
            let internal = if spool { vec![2e-3 * random.symmetric(), 0.1 * random.symmetric()] } else { vec![] };
            x.extend(internal);
            x.resize(d.n_states(), 14e6);
            let states = [&x[..], &x[..], &[5e-3 * random.symmetric()]];
            for (kind, bound) in
                [(Kind::Rates, 1e-12), (Kind::Sample, 1e-12), (Kind::Additive, 1e-12), (Kind::Linearised, 1e-10)]
            {
                let expected = witness.expected(&kind, states);
                for (way, found) in ["lanes", "machine code"].into_iter().zip(witness.run(&kind, states)?) {
                    let error = apart(&found[..x.len()], &expected[..x.len()])
                        .max(apart(&found[x.len()..], &expected[x.len()..]));
                    assert!(error < bound, "{leakage} {kind:?}, {way}, at {x:?}: {error}");
                }
                if kind == Kind::Sample {
                    let pressures = &expected[x.len() + d.layout().hydraulics() + 1..][..2];
                    let least = pressures[0].min(pressures[1]);
                    (full, empty) = if least > 1e4 { (full + 1, empty) } else { (full, empty + 1) };
                }
            }
        }
    }
    assert!(full > 30 && empty > 9, "{full} {empty}");
    Ok(())
}

/// One joint, one beam that bends and twists, a hand at its tip.
fn arm(level: Level) -> Parts<f64> {
    let random = &mut Random::new(5);
    let mut parts = Parts { gravity: [0.0, 0.0, -9.81], ..Parts::default() };
    parts.bodies.push(body(random, "hub", Mount::World, JointKind::Revolute));
    let deforms = [Component::BendingX, Component::BendingY, Component::Torsion];
    parts.beams.push(beam(random, "link", Mount::Body(0), level, &deforms));
    let tip = section(&parts, 0, 1.0);
    parts.bodies.push(body(random, "hand", tip, JointKind::Revolute));
    parts.gauges.push(Gauge { name: "strip".into(), beam: 0, at: 0.1, x: 0.003, y: 0.005 });
    parts
}

#[test]
fn beams_of_all_levels_agree() -> Result<()> {
    let levels = [
        Level::Rigid,
        Level::Lumped(2),
        Level::Modal(1),
        Level::Bezier(2),
        Level::Deflection(2),
        Level::Hermite(1),
        Level::Strain(1),
        Level::Elements(1),
    ];
    for level in levels {
        let (d, of_values) = (description(&arm(level), |_| ()), matches!(level, Level::Modal(_)));
        assert_eq!(d.program(&Kind::Sample, &d.parameters)?.of_values, of_values, "{level:?}");
        check(&format!("{level:?}"), &d, &WITHOUT_DERIVATIVES, &[])?;
    }
    Ok(())
}

#[test]
fn derivatives_of_a_flexible_arm_agree() -> Result<()> {
    let friction = |content: &mut Value| {
        let numbers = [("coulomb", 0.3), ("transition_velocity", 0.1)];
        two_beams::effect(content, "coulomb_friction", 0, &numbers);
    };
    check("two beams", &two_beams::machine(1, friction), &WITH_DERIVATIVES, &[])
}

#[test]
fn machines_with_all_kinds_of_parts_agree() -> Result<()> {
    for seed in 1..4 {
        check(&format!("everything {seed}"), &description(&everything(seed), |_| ()), &WITHOUT_DERIVATIVES, &[])?;
    }
    Ok(())
}
