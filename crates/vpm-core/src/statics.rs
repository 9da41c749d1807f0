//! Machines at rest with their joints held, or some of them free: how far beams sag, where springs hold, and how beams vibrate about that.

use nalgebra::{DMatrix, DVector};

use crate::algebra::dense;
use crate::beam::eigen;
use crate::description::Description;
use crate::error::{Error, Result};
use crate::scalar::Scalar;
use crate::system::{Build, Dynamics, Kind, Routine};

/// Newton steps before the search counts as lost.
const STEPS: usize = 60;
/// Into how many stages the weight is cut, until the way from the straight beams to rest is smooth.
const STAGES: [usize; 6] = [1, 2, 4, 8, 16, 32];
/// Halvings of a Newton step that does not bring the beams closer to rest.
const HALVINGS: usize = 12;

/// Bisections on the way to the place where the load of a free joint changes its sign.
const BISECTIONS: usize = 60;
/// The first and the longest way in which that place is sought, m or rad.
const WAYS: [f64; 2] = [1e-6, 10.0];

/// A machine whose joints are held, but for passive ones.
pub(crate) struct Statics {
    plain: Dynamics<f64>,
    /// What the coordinates miss, with its derivatives; nothing where no coordinate is free.
    unbalance: Option<Routine<f64>>,
    /// The coordinates that find their rest themselves: passive joints, then elastic coordinates.
    free: Vec<usize>,
    passive: Vec<String>,
    /// Share of the forces of springs along lines: all, or none where drives do nothing.
    springs: f64,
}

/// A machine at rest.
pub(crate) struct Rest {
    /// All coordinates.
    pub(crate) coordinates: Vec<f64>,
    /// Derivative of the load that the free coordinates miss by themselves: stiffness with that of gravity.
    pub(crate) tangent: DMatrix<f64>,
}

/// How Newton's method ended.
enum Newton {
    /// Every step led closer.
    Smooth(Rest),
    /// Some steps had to be halved: this may be another rest than the one that the weight bends the beams to.
    Rough(Rest),
    /// What was missing when it gave up.
    Lost(f64),
}

impl Statics {
    /// Statics of beams and the joints `passive`, all other joints held: prepares the search for rest. Without `drives`
    /// springs along lines do nothing.
    pub(crate) fn new(description: &Description, theta: &[f64], passive: &[usize], drives: bool) -> Result<Self> {
        let plain: Dynamics<f64> = description.dynamics(theta)?;
        let free: Vec<usize> = passive.iter().copied().chain(plain.joints()..plain.coordinates()).collect();
        let springs = f64::from(u8::from(drives));
        let unbalance = if free.is_empty() { None } else { Some(unbalance(description, theta, springs)?) };
        let passive = passive.iter().map(|&joint| description.bodies[joint].joint.name.clone()).collect();
        Ok(Self { plain, unbalance, free, passive, springs })
    }

    /// Static free coordinates under gravity with the other joints held at `joints`. Passive ones are sought from
    /// there.
    ///
    /// Law: `bias(q, 0) + K q = effects(q, 0) + springs(q)` on the free coordinates, by Newton's method from the straight beams with exact
    /// derivatives (of the recorded load). Where that goes astray the weight is put on in stages, so that of several places at rest it is the
    /// one that the beams sag to. Passive joints are first moved to where their own load changes its sign: from the flat middle of a
    /// play Newton's first step would lead anywhere. Checked: converged to rounding.
    pub(crate) fn settle(&mut self, joints: &[f64]) -> Result<Rest> {
        let n = self.plain.coordinates();
        let mut coordinates = joints.to_vec();
        coordinates.resize(n, 0.0);
        if self.free.is_empty() {
            return Ok(Rest { coordinates, tangent: DMatrix::zeros(0, 0) });
        }
        for place in 0..self.passive.len() {
            self.push(&mut coordinates, place);
        }
        for &stages in &STAGES {
            if let Some(rest) = self.staged(&coordinates, stages) {
                return Ok(rest);
            }
        }
        match self.newton(coordinates.clone(), 1.0) {
            Newton::Smooth(rest) | Newton::Rough(rest) => Ok(rest),
            Newton::Lost(missing) => Err(self.unsettled(missing)),
        }
    }

    /// Static rest under a weight that grows in equal stages, if each stage leads smoothly to a stable one.
    fn staged(&mut self, start: &[f64], stages: usize) -> Option<Rest> {
        let mut last = None;
        let mut coordinates = start.to_vec();
        for stage in 1..=stages {
            let Newton::Smooth(rest) = self.newton(coordinates, stage as f64 / stages as f64) else { return None };
            let stiffness = (&rest.tangent + rest.tangent.transpose()) * 0.5;
            stiffness.cholesky()?;
            coordinates = rest.coordinates.clone();
            last = Some(rest);
        }
        last
    }

    /// Newton's method for statics under a share of the weight; a step that leads away is halved.
    fn newton(&mut self, mut coordinates: Vec<f64>, weight: f64) -> Newton {
        let mut smooth = true;
        let mut residual = self.residual(&coordinates, weight);
        for _ in 0..STEPS {
            let tangent = self.tangent(&coordinates, weight);
            let Some(step) = dense::solve(&tangent, &residual) else { break };
            let size = self.free.iter().fold(1.0_f64, |most, &place| most.max(coordinates[place].abs()));
            let mut share = 1.0;
            for _ in 0..HALVINGS {
                let mut moved = coordinates.clone();
                self.free.iter().zip(step.iter()).for_each(|(&place, step)| moved[place] -= share * step);
                let found = self.residual(&moved, weight);
                let closer = found.norm() <= residual.norm() || share * step.amax() < 1e-11 * size;
                if closer || share < 1e-3 {
                    (coordinates, residual) = (moved, found);
                    break;
                }
                (share, smooth) = (share * 0.5, false);
            }
            if step.amax() < 1e-11 * size {
                let rest = Rest { coordinates, tangent };
                return if smooth { Newton::Smooth(rest) } else { Newton::Rough(rest) };
            }
        }
        Newton::Lost(residual.amax())
    }

    fn unsettled(&self, value: f64) -> Error {
        let condition = "vanish within 60 Newton steps".to_owned();
        if self.passive.is_empty() {
            let repair = "check the stiffness of the beams against what they carry";
            return Error::Setting { setting: "the load that the beams at rest miss", condition, value, repair };
        }
        let condition = format!("{condition} with the joints `{}` free", self.passive.join("`, `"));
        let repair = "hold them by a spring or a backlash with stiffness, or prescribe their motion";
        Error::Setting { setting: "the load that the machine at rest misses", condition, value, repair }
    }

    /// Moves a passive joint to static rest where its load changes its sign. The other coordinates stand still; nowhere
    /// if it does not.
    fn push(&mut self, coordinates: &mut [f64], place: usize) {
        let joint = self.free[place];
        let start = coordinates[joint];
        let mut load = |way: f64| {
            coordinates[joint] = start + way;
            self.plain.unbalance(coordinates, [1.0, self.springs])[joint]
        };
        let first = load(0.0);
        let (mut near, mut far) = (0.0, -WAYS[0] * first.signum());
        while load(far) * first > 0.0 && far.abs() < WAYS[1] {
            (near, far) = (far, 2.0 * far);
        }
        if first == 0.0 || load(far) * first > 0.0 {
            load(0.0);
            return;
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (near + far);
            if load(middle) * first > 0.0 { near = middle } else { far = middle }
        }
        load(far);
    }

    fn residual(&mut self, q: &[f64], weight: f64) -> DVector<f64> {
        let load = self.plain.unbalance(q, [weight, self.springs]);
        DVector::from_iterator(self.free.len(), self.free.iter().map(|&place| load[place]))
    }

    /// Tangent of the static residual.
    fn tangent(&mut self, q: &[f64], weight: f64) -> DMatrix<f64> {
        let (n, free) = (q.len(), &self.free);
        let (mut matrix, mut load) = (vec![0.0; n * n], vec![0.0; n]);
        if let Some(routine) = &mut self.unbalance {
            routine.hold(0, weight);
            routine.matrix(q, &mut matrix, n, &mut load);
        }
        DMatrix::from_fn(free.len(), free.len(), |row, column| matrix[free[row] * n + free[column]])
    }

    /// Static efforts that hold the joints at rest, with those of the effects and of springs along lines taken off.
    pub(crate) fn holding_efforts(&mut self, rest: &Rest) -> Vec<f64> {
        let n = rest.coordinates.len();
        let (zero, mut efforts) = (vec![0.0; n], vec![0.0; n]);
        self.plain.inverse_dynamics(&rest.coordinates, &zero, &zero, &mut efforts);
        self.plain.subtract_springs(&rest.coordinates, self.springs, &mut efforts);
        efforts.truncate(self.plain.joints());
        efforts
    }

    /// Natural frequencies in Hz of the beams about static rest with the joints held, slowest first. Negative for
    /// growth instead of vibration.
    ///
    /// Law: `K_t a = omega^2 M a` over the elastic coordinates, K_t the stiffness with that of gravity.
    pub(crate) fn natural_frequencies(&mut self, rest: &Rest) -> Result<Vec<f64>> {
        let (first, n) = (self.plain.joints(), rest.coordinates.len());
        if first == n {
            return Ok(Vec::new());
        }
        let mass = self.plain.mass_matrix(&rest.coordinates);
        let mass = DMatrix::from_fn(n - first, n - first, |i, j| mass[(first + i) * n + first + j]);
        let stiffness = (&rest.tangent + rest.tangent.transpose()) * 0.5;
        let frequencies = eigen::modes(&stiffness, &mass)?.frequencies;
        Ok(frequencies.into_iter().map(|omega| omega / std::f64::consts::TAU).collect())
    }
}

/// Static load that holds all coordinates at `position`, n, and its derivative by them, n x n row by row.
pub(crate) fn load(description: &Description, theta: &[f64], position: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
    let n = position.len();
    let (mut matrix, mut load) = (vec![0.0; n * n], vec![0.0; n]);
    unbalance(description, theta, 1.0)?.matrix(position, &mut matrix, n, &mut load);
    Ok((load, matrix))
}

/// Static residual under a share of the weight, for the checked parameters `theta`; first under all of it. `springs` is
/// the share of those along lines.
fn unbalance<S: Scalar>(description: &Description, theta: &[S], springs: f64) -> Result<Routine<S>> {
    let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
    let mut routine = Routine::new(description.functions().function(&Kind::Unbalance, &values)?, theta);
    routine.hold(0, S::one());
    routine.hold(1, S::from_f64(springs));
    Ok(routine)
}

/// Static coordinates with the joints held at `joints` but for `passive` ones, with exact derivatives; without `drives`
/// springs along lines do nothing. One Newton step over the number type from the solution in plain numbers (the implicit
/// function theorem).
pub(crate) fn settled<S: Scalar>(
    description: &Description,
    theta: &[S],
    joints: &[S],
    (passive, drives): (&[usize], bool),
) -> Result<Vec<S>> {
    let values = |numbers: &[S]| numbers.iter().map(Scalar::re).collect::<Vec<f64>>();
    let mut statics = Statics::new(description, &values(theta), passive, drives)?;
    let Rest { coordinates, tangent } = statics.settle(&values(joints))?;
    let mut q: Vec<S> = joints.to_vec();
    q.extend(coordinates[joints.len()..].iter().map(|&value| S::from_f64(value)));
    for &joint in passive {
        q[joint] = S::from_f64(coordinates[joint]);
    }
    let Some(inverse) = tangent.try_inverse() else { return Ok(q) };
    let missing = match S::plain(&q) {
        Some(plain) => statics.plain.unbalance(plain, [1.0, statics.springs]).into_iter().map(S::from_f64).collect(),
        None => unbalance(description, theta, statics.springs)?.at(&q).to_vec(),
    };
    for (row, &place) in inverse.row_iter().zip(&statics.free) {
        let step: S = row.iter().zip(&statics.free).map(|(&entry, &column)| missing[column] * entry).sum();
        q[place] -= step;
    }
    Ok(q)
}
