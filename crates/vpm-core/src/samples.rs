//! Named models for tests, benchmarks and examples.

use crate::body::{Body, Inertia};
use crate::error::Result;
use crate::joint::{Joint, JointKind};
use crate::model::Model;
use crate::mount::Mount;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Vector3};

/// Standard gravity downward along z, in m/s^2.
pub const GRAVITY: [f64; 3] = [0.0, 0.0, -9.806_65];
const UPRIGHT: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// A model in plain numbers, to be built over any number type.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Gravity in m/s^2.
    pub gravity: [f64; 3],
    /// The bodies, parents first.
    pub bodies: Vec<Body<f64>>,
}

impl Sample {
    /// Sample model over the number type `S`, all numbers constants.
    pub fn model<S: Scalar>(&self) -> Result<Model<S>> {
        let bodies: Vec<_> = self.bodies.iter().map(|body| body.map(&mut |&number| S::from_f64(number))).collect();
        Model::new(self.gravity, &bodies, &[])
    }
}

/// Sample of one mass (kg) on a horizontal rail along x, without gravity: M = mass.
pub fn slider(mass: f64) -> Sample {
    let body = body("carriage", None, joint("axis", JointKind::Prismatic, [1.0, 0.0, 0.0], [0.0; 3]), mass);
    Sample { gravity: [0.0; 3], bodies: vec![body] }
}

/// Sample of a point mass (kg) on a massless rod (m) that turns about y and hangs along -z at zero.
///
/// Closed form: m l^2 a = tau - m g l sin q.
pub fn pendulum(mass: f64, length: f64) -> Sample {
    Sample { gravity: GRAVITY, bodies: vec![bob("bob", "pivot", None, [0.0; 3], mass, length)] }
}

/// Sample of two point masses on massless rods in series. Both angles are about y and the second relative to the first.
///
/// Closed form: Goldstein, Poole & Safko 2002, chapter 1, problem 22.
pub fn double_pendulum(masses: [f64; 2], lengths: [f64; 2]) -> Sample {
    let upper = bob("upper", "shoulder", None, [0.0; 3], masses[0], lengths[0]);
    let lower = bob("lower", "elbow", Some(0), [0.0, 0.0, -lengths[0]], masses[1], lengths[1]);
    Sample { gravity: GRAVITY, bodies: vec![upper, lower] }
}

/// Sample of a seven-joint arm of a lightweight robot's proportions. Roll and pitch axes alternate; 16 kg, 1.2 m.
pub fn arm7() -> Sample {
    const MASSES: [f64; 7] = [4.0, 3.5, 3.0, 2.5, 1.5, 1.0, 0.5];
    let mut bodies = Vec::new();
    for (k, mass) in MASSES.into_iter().enumerate() {
        let axis = if k % 2 == 0 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
        let below = if k == 0 { 0.15 } else { 0.175 };
        let joint = joint(&format!("joint{}", k + 1), JointKind::Revolute, axis, [0.0, 0.0, below]);
        let mut link = body(&format!("link{}", k + 1), k.checked_sub(1), joint, mass);
        let moments = [0.012, 0.011, 0.004, 0.000_3, -0.000_2, 0.000_5].map(|moment| moment * mass);
        link.inertia = Some(Inertia { mass, center_of_mass: [0.01, -0.02, 0.08], moments });
        bodies.push(link);
    }
    Sample { gravity: GRAVITY, bodies }
}

/// Sample of a random tree of `n` bodies; the same `seed` gives the same tree. Joints, frames and inertias are random.
///
/// Every body is a cloud of four random point masses, so its inertia is physical by construction.
pub fn random_tree(seed: u64, n: usize) -> Sample {
    let mut random = Random::new(seed);
    let bodies = (0..n).map(|k| random_body(&mut random, k)).collect();
    Sample { gravity: random.vector(10.0), bodies }
}

fn random_body(random: &mut Random, k: usize) -> Body<f64> {
    // Half of the bodies continue the chain, the others branch off anywhere (slot 0 is the world).
    let slot = if random.unit() < 0.5 { k } else { (random.unit() * (k + 1) as f64) as usize };
    let kind = if random.unit() < 0.3 { JointKind::Prismatic } else { JointKind::Revolute };
    let turn = Matrix3::rotation(Vector3::from(random.direction()), 3.0 * random.symmetric());
    let mut joint = joint(&format!("joint{k}"), kind, random.direction(), random.vector(0.5));
    joint.rotation = turn.transpose().columns.map(Vector3::to_array).as_flattened().try_into().unwrap_or(UPRIGHT);
    let points: [(f64, [f64; 3]); 4] = std::array::from_fn(|_| (0.1 + random.unit(), random.vector(0.3)));
    let mut link = body(&format!("body{k}"), slot.checked_sub(1), joint, 0.0);
    link.inertia = Some(cloud(points));
    link
}

/// Inertia of a sample's few point masses.
fn cloud<const N: usize>(points: [(f64, [f64; 3]); N]) -> Inertia<f64> {
    let mut cloud = Inertia { mass: points.iter().map(|point| point.0).sum(), ..Inertia::default() };
    for (mass, position) in points {
        for (center, coordinate) in cloud.center_of_mass.iter_mut().zip(position) {
            *center += mass * coordinate / cloud.mass;
        }
    }
    for (mass, position) in points {
        let [x, y, z]: [f64; 3] = [0, 1, 2].map(|axis| position[axis] - cloud.center_of_mass[axis]);
        let moments = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z];
        for (entry, moment) in cloud.moments.iter_mut().zip(moments) {
            *entry += mass * moment;
        }
    }
    cloud
}

fn joint(name: &str, kind: JointKind, axis: [f64; 3], translation: [f64; 3]) -> Joint {
    Joint { name: name.to_owned(), kind, axis, translation, rotation: UPRIGHT }
}

fn body(name: &str, parent: Option<usize>, joint: Joint, mass: f64) -> Body<f64> {
    let inertia = Some(Inertia { mass, ..Inertia::default() });
    Body { name: name.to_owned(), on: parent.map_or(Mount::World, Mount::Body), joint, inertia, rotor_inertia: None }
}

fn bob(name: &str, pivot: &str, parent: Option<usize>, at: [f64; 3], mass: f64, length: f64) -> Body<f64> {
    let joint = joint(pivot, JointKind::Revolute, [0.0, 1.0, 0.0], at);
    let inertia = Some(Inertia { mass, center_of_mass: [0.0, 0.0, -length], ..Inertia::default() });
    Body { inertia, ..body(name, parent, joint, mass) }
}

/// A small deterministic generator: SplitMix64 (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number
/// generators").
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// Random numbers for samples, from `seed`.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Next random number of a sample, uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.state;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Next random number of a sample, uniform in [-1, 1).
    pub fn symmetric(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Three random numbers of a sample, each uniform in [-size, size).
    pub fn vector(&mut self, size: f64) -> [f64; 3] {
        std::array::from_fn(|_| size * self.symmetric())
    }

    /// Random numbers of a sample, `n` of them, each uniform in [-size, size).
    pub fn numbers(&mut self, n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|_| size * self.symmetric()).collect()
    }

    /// Random unit vector of a sample, uniform on the sphere (rejection from the cube).
    pub fn direction(&mut self) -> [f64; 3] {
        loop {
            let candidate = self.vector(1.0);
            let square: f64 = candidate.iter().map(|component| component * component).sum();
            if (0.01..1.0).contains(&square) {
                return candidate.map(|component| component / square.sqrt());
            }
        }
    }
}
