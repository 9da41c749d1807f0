//! Mass matrix, velocity terms and gravity by three derivations.

use nalgebra::{DMatrix, DVector};
use vpm_core::beam::{Component, Level};
use vpm_core::body::Site;
use vpm_core::data::Data;
use vpm_core::dynamics::{aba, crba, flexible, rnea};
use vpm_core::joint::JointKind;
use vpm_core::model::{Model, Parts};
use vpm_core::mount::Mount;
use vpm_core::samples::{Random, random_tree};
use vpm_core::spatial::{Matrix3, SpatialInertia, Symmetric3, Twist, Vector3};
use vpm_core::{Dual, Result, Scalar};

use super::{Row, difference, larger, vanishing};
use crate::common::places::{Heavy, Places};
use crate::common::trees;

/// Mass matrix, velocity terms and gravity, one after another.
type Terms = [Vec<f64>; 3];
/// The inner number follows the time, the lanes around it one rate and its coordinate.
type Number = Dual<Dual<f64, 1>, 2>;
/// Random trees without beams, and of each level with beams.
const TREES: [u64; 2] = [5, 2];
const SOURCE: &str = "Lagrange's equations of the energy by dual numbers";

/// Levels of the beams; every one has its coordinates in space.
const LEVELS: [Level; 8] = [
    Level::Rigid,
    Level::Lumped(2),
    Level::Modal(2),
    Level::Bezier(3),
    Level::Deflection(3),
    Level::Hermite(1),
    Level::Strain(2),
    Level::Elements(1),
];

/// The groups of rows: trees without beams, trees with beams of each level, accelerations.
pub fn rows() -> Result<Vec<Row>> {
    let mut rows = rigid()?;
    for level in LEVELS {
        rows.push(flexible_trees(level)?);
    }
    Ok(rows)
}

/// The terms from the efforts that accelerations need at rates.
fn terms(n: usize, v: &[f64], mut efforts: impl FnMut(&[f64], &[f64]) -> Vec<f64>) -> Terms {
    let rest = vec![0.0; n];
    let minus = |a: Vec<f64>, b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
    let gravity = efforts(&rest, &rest);
    let velocity = minus(efforts(v, &rest), &gravity);
    let mut mass = Vec::new();
    for k in 0..n {
        let unit: Vec<f64> = (0..n).map(|j| f64::from(u8::from(j == k))).collect();
        mass.extend(minus(efforts(&rest, &unit), &gravity));
    }
    [mass, velocity, gravity]
}

/// The largest differences of the three terms so far.
fn worst(so_far: &mut [f64], found: &Terms, expected: &Terms) {
    for ((most, found), expected) in so_far.iter_mut().zip(found).zip(expected) {
        *most = larger(*most, difference(found, expected));
    }
}

fn rigid() -> Result<Vec<Row>> {
    let (mut recursive, mut composite, mut forward) = ([0.0; 3], [0.0; 3], 0.0_f64);
    for seed in 0..TREES[0] {
        let (sample, random, n) = (random_tree(seed, 6), &mut Random::new(!seed), 6);
        let (q, v, tau) = (random.numbers(n, 3.0), random.numbers(n, 2.0), random.numbers(n, 20.0));
        let parts = Parts { gravity: sample.gravity, bodies: sample.bodies.clone(), ..Parts::default() };
        let model = sample.model::<f64>()?;
        let mut data = Data::new(&model);
        let expected = lagrange(&parts, &q, &v)?;
        let mut found = terms(n, &v, |v, a| rnea(&model, &mut data, &q, v, a).to_vec());
        worst(&mut recursive, &found, &expected);
        found[0] = crba(&model, &mut data, &q).to_vec();
        worst(&mut recursive, &found, &expected);
        worst(&mut composite, &sums(&model, &q, &v), &expected);
        let a = aba(&model, &mut data, &q, &v, &tau).to_vec();
        forward = larger(forward, difference(&a, &solved(&found[0], rnea(&model, &mut data, &q, &v, &[0.0; 6]), &tau)));
    }
    let name = |by: &str| format!("Random rigid trees: M, V, G {by}");
    Ok(vec![
        vanishing(name("by recursion (rnea, crba)"), recursive.to_vec(), 1e-10, SOURCE),
        vanishing(name("by composite bodies"), composite.to_vec(), 1e-10, SOURCE),
        vanishing("Random rigid trees: accelerations by aba".into(), vec![forward], 1e-10, "M^-1 (tau - rnea)"),
    ])
}

fn flexible_trees(level: Level) -> Result<Row> {
    let mut most = [0.0; 4];
    for seed in 0..TREES[1] {
        let (parts, random) = (tree(seed, level), &mut Random::new(seed + 100));
        let model = trees::model::<f64>(&parts)?;
        let n = model.n_coordinates();
        let (mut q, v, tau) = (random.numbers(n, 0.3), random.numbers(n, 1.0), random.numbers(n, 5.0));
        q.iter_mut().take(3).for_each(|angle| *angle *= 5.0);
        let found = sums(&model, &q, &v);
        worst(&mut most[..3], &found, &lagrange(&parts, &q, &v)?);
        let mut data = Data::new(&model);
        flexible::terms(&model, &mut data, &q, &v);
        let a = flexible::solve(&model, &mut data, &q, &v, &tau).to_vec();
        let mut loads = vec![0.0; n];
        flexible::required(&model, &data, (&q, &v), &vec![0.0; n], &mut loads);
        most[3] = larger(most[3], difference(&a, &solved(&found[0], &loads, &tau)));
    }
    let name = format!("Random trees with {} beams: M, V, G, and accelerations", name(level));
    Ok(vanishing(name, most.to_vec(), 1e-10, SOURCE))
}

/// As model files write it.
pub fn name(level: Level) -> String {
    let [kind, count] = match level {
        Level::Rigid => return "rigid".into(),
        Level::Lumped(n) => ["lumped".to_owned(), n.to_string()],
        Level::Modal(n) => ["modal".to_owned(), n.to_string()],
        Level::Bezier(n) => ["bezier".to_owned(), n.to_string()],
        Level::Deflection(n) => ["deflection".to_owned(), n.to_string()],
        Level::Hermite(n) => ["hermite".to_owned(), n.to_string()],
        Level::Strain(n) => ["strain".to_owned(), n.to_string()],
        Level::Elements(n) => ["elements".to_owned(), n.to_string()],
        Level::Reduced(n) => ["reduced".to_owned(), n.to_string()],
    };
    format!("{kind}({count})")
}

/// Joints, beams and bodies on each other, with welds and payloads; stiffness and damping have no share in the terms.
fn tree(seed: u64, level: Level) -> Parts<f64> {
    use Component::{BendingX, BendingY, Extension, Torsion};
    let random = &mut Random::new(seed);
    let mut parts = Parts { gravity: random.vector(10.0), ..Parts::default() };
    parts.beams.push(trees::beam(random, "upper", Mount::Body(0), level, &[BendingX, BendingY, Torsion]));
    let (tip, middle) = (trees::section(&parts, 0, 1.0), trees::section(&parts, 0, 0.5));
    parts.bodies = vec![
        trees::body(random, "shoulder", Mount::World, JointKind::Revolute),
        trees::body(random, "slider", middle, JointKind::Prismatic),
        trees::body(random, "elbow", tip, JointKind::Revolute),
    ];
    parts.beams.push(trees::beam(random, "lower", Mount::Body(2), level, &[BendingY, Extension]));
    parts.point_masses.push(vpm_core::body::PointMass { on: Site::Tip(1), mass: 0.3, position: random.vector(0.1) });
    parts
}

/// By virtual work over composite bodies.
fn sums(model: &Model<f64>, q: &[f64], v: &[f64]) -> Terms {
    let (mut data, n) = (Data::new(model), q.len());
    let rest = vec![0.0; n];
    terms(n, v, |v, a| {
        let mut efforts = rest.clone();
        flexible::terms(model, &mut data, q, v);
        flexible::required(model, &data, (&rest, &rest), a, &mut efforts);
        efforts
    })
}

/// `M^-1 (tau - loads)`.
fn solved(mass: &[f64], loads: &[f64], tau: &[f64]) -> Vec<f64> {
    let n = tau.len();
    let rest = DVector::from_fn(n, |k, _| tau[k] - loads[k]);
    let solution = DMatrix::from_row_slice(n, n, mass).cholesky().map(|factors| factors.solve(&rest));
    solution.map(|a| a.as_slice().to_vec()).unwrap_or_default()
}

/// `d/dt dL/dv_i - dL/dq_i`, from the energies of everything that has mass in the frames that the parts themselves say.
fn lagrange(parts: &Parts<f64>, q: &[f64], v: &[f64]) -> Result<Terms> {
    let places = Places::<Dual<Number, 1>>::new(parts)?;
    let moving = |numbers: &[f64], rates: &[f64], varied: usize, lane: usize| -> Vec<Number> {
        let vary = |(k, (&value, &rate)): (usize, (&f64, &f64))| {
            let number = Dual { value, gradient: [rate] };
            if k == varied { Dual::variable(number, lane) } else { Dual::constant(number) }
        };
        numbers.iter().zip(rates).enumerate().map(vary).collect()
    };
    Ok(terms(q.len(), v, |v, a| {
        let effort = |i: usize| {
            let at = moving(q, v, i, 1).into_iter().zip(moving(v, a, i, 0));
            let state: Vec<_> = at.map(|(value, rate)| Dual { value, gradient: [rate] }).collect();
            let lagrangian: Number = places.heavy(&state).iter().map(|part| action(part, parts.gravity)).sum();
            lagrangian.gradient[0].gradient[0] - lagrangian.gradient[1].value
        };
        (0..q.len()).map(effort).collect()
    }))
}

/// Kinetic less potential energy of a body that moves as the outermost number says.
fn action(part: &Heavy<Dual<Number, 1>>, gravity: [f64; 3]) -> Number {
    let Heavy::Body(pose, inertia) = part else { return Number::zero() };
    let now = |v: Vector3<Dual<Number, 1>>| Vector3::from(v.to_array().map(|number| number.value));
    let rate = |v: Vector3<Dual<Number, 1>>| Vector3::from(v.to_array().map(|number| number.gradient[0]));
    let (axes, speed) = (pose.rotation.columns, rate(pose.translation));
    let [x, y, z] = axes.map(now);
    let spin = Vector3::new(z.dot(rate(axes[1])), x.dot(rate(axes[2])), y.dot(rate(axes[0])));
    let twist = Twist::new(spin, Vector3::new(x.dot(speed), y.dot(speed), z.dot(speed)));
    let inertia = lifted(inertia);
    let turned = Matrix3::from_columns(x, y, z) * inertia.first_moment;
    let weight = Vector3::from_f64(gravity).dot(turned + now(pose.translation) * inertia.mass);
    inertia.kinetic_energy(twist) + weight
}

fn lifted(inertia: &SpatialInertia<f64>) -> SpatialInertia<Number> {
    SpatialInertia {
        mass: inertia.mass.into(),
        first_moment: Vector3::from(inertia.first_moment.to_array().map(Number::from)),
        rotational: Symmetric3::from_array(inertia.rotational.to_array().map(Number::from)),
    }
}
