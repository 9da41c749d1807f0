//! Virtual work of one beam on a root that moves as it is told: the sums that a tree makes, written out.

use nalgebra::{DMatrix, DVector};
use vpm_core::beam::{Beam, BeamEntry, Sections};
use vpm_core::scalar::seed;
use vpm_core::spatial::{Twist, Vector3, Wrench};
use vpm_core::{Dual, Result, Scalar};

/// Lanes of derivatives in one sweep.
const LANES: usize = 8;

/// A load on the section at the last mark, in the axes of the root.
#[derive(Clone, Copy, Debug, Default)]
pub struct Load {
    /// Force in N.
    pub force: [f64; 3],
    /// Moment in N m.
    pub moment: [f64; 3],
}

/// Twist of the root and its acceleration (gravity taken off), in root axes.
#[derive(Clone, Copy, Debug)]
pub struct Root {
    /// Twist.
    pub twist: Twist<f64>,
    /// Acceleration.
    pub acceleration: Twist<f64>,
}

impl Root {
    /// A root at rest under gravity.
    pub fn resting(gravity: [f64; 3]) -> Self {
        Self { twist: Twist::zero(), acceleration: Twist::new(Vector3::zero(), -Vector3::from_f64(gravity)) }
    }

    /// A root that turns steadily; its origin stands `arm` from the axis of rotation.
    pub fn turning(speed: [f64; 3], arm: [f64; 3]) -> Self {
        let (w, r) = (Vector3::from_f64(speed), Vector3::from_f64(arm));
        let velocity = w.cross(r);
        // The spatial acceleration of steady rotation is zero in inertial axes; in turning axes the components stand still.
        Self { twist: Twist::new(w, velocity), acceleration: Twist::zero() }
    }
}

fn lift<S: Scalar>(twist: Twist<f64>) -> Twist<S> {
    Twist::new(Vector3::from_f64(twist.angular.to_array()), Vector3::from_f64(twist.linear.to_array()))
}

/// Bias of the beam's coordinates, elastic forces left out: `sum J^T (m A + V x* m V) - J^T load`.
pub fn bias<S: Scalar>(beam: &Beam<S>, q: &[S], v: &[S], root: &Root, load: &Load) -> Vec<S> {
    let mut out = beam.sections();
    beam.motion(q, v, &mut out);
    let (n, mut bias) = (beam.len(), vec![S::zero(); beam.len()]);
    for station in 0..beam.stations() {
        let at = &out.at[station];
        let carried = at.pose.inverse_twist(lift(root.twist));
        let twist = carried + at.twist;
        let acceleration = at.pose.inverse_twist(lift(root.acceleration)) + carried.cross(at.twist) + at.acceleration;
        let inertia = beam.inertia(station);
        let mut wrench = inertia.apply(acceleration) + twist.cross_wrench(inertia.apply(twist));
        if station + 1 == beam.stations() {
            let turn = |v: [f64; 3]| at.pose.rotation.transpose_mul(Vector3::from_f64(v));
            wrench = wrench - Wrench::new(turn(load.moment), turn(load.force));
        }
        for (sum, column) in bias.iter_mut().zip(&out.columns[station * n..]) {
            *sum += column.power(wrench);
        }
    }
    bias
}

/// Mass matrix at coordinates `q`, row by row.
pub fn mass<S: Scalar>(beam: &Beam<S>, sections: &Sections<S>) -> Vec<S> {
    let n = beam.len();
    let mut mass = vec![S::zero(); n * n];
    for station in 0..beam.stations() {
        let columns = &sections.columns[station * n..(station + 1) * n];
        for i in 0..n {
            for j in 0..n {
                mass[i * n + j] += columns[i].power(beam.inertia(station).apply(columns[j]));
            }
        }
    }
    mass
}

/// Bias without elastic forces, and its derivative by the coordinates, at rest in the root.
pub fn linearised(
    entry: &BeamEntry<f64>,
    marks: &[f64],
    q: &[f64],
    root: &Root,
    load: &Load,
) -> Result<(DVector<f64>, DMatrix<f64>)> {
    let beam = Beam::new(&entry.map(&mut |&x| Dual::<f64, LANES>::constant(x)), marks)?;
    Ok(slopes(&beam, q, root, load))
}

fn slopes(beam: &Beam<Dual<f64, LANES>>, q: &[f64], root: &Root, load: &Load) -> (DVector<f64>, DMatrix<f64>) {
    let n = beam.len();
    let (mut value, mut slope) = (DVector::zeros(n), DMatrix::zeros(n, n));
    let all: Vec<usize> = (0..n).collect();
    for lanes in all.chunks(LANES) {
        let found = bias(beam, &seed(q, lanes), &vec![Dual::zero(); n], root, load);
        for (i, found) in found.iter().enumerate() {
            value[i] = found.value;
            lanes.iter().zip(found.gradient).for_each(|(&j, entry)| slope[(i, j)] = entry);
        }
    }
    (value, slope)
}

/// Coordinates at rest under a load, raised in stages.
pub fn equilibrium(entry: &BeamEntry<f64>, load: &Load, root: &Root, stages: usize) -> Result<Vec<f64>> {
    let beam = Beam::new(entry, &[entry.length])?;
    let stiffness = DMatrix::from_row_slice(beam.len(), beam.len(), beam.stiffness());
    let beam = Beam::new(&entry.map(&mut |&x| Dual::constant(x)), &[entry.length])?;
    let mut q = DVector::zeros(beam.len());
    for stage in 1..=stages {
        let part = stage as f64 / stages as f64;
        let now = Load { force: load.force.map(|x| x * part), moment: load.moment.map(|x| x * part) };
        for _ in 0..30 {
            let (value, slope) = slopes(&beam, q.as_slice(), root, &now);
            let step = (&stiffness + slope).lu().solve(&(value + &stiffness * &q)).unwrap_or_else(|| q.clone() * 0.0);
            q -= &step;
            if step.amax() < 1e-13 * (1.0 + q.amax()) {
                break;
            }
        }
    }
    Ok(q.as_slice().to_vec())
}

/// Place of the tip at coordinates `q`.
pub fn tip(entry: &BeamEntry<f64>, q: &[f64]) -> Result<[f64; 3]> {
    let beam = Beam::new(entry, &[entry.length])?;
    let mut out = beam.sections();
    beam.motion(q, &vec![0.0; q.len()], &mut out);
    Ok(out.at[beam.mark(0)].pose.translation.to_array())
}
