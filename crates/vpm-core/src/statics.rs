//! Machines at rest with their joints held: how far beams sag, and how they vibrate about that.

use nalgebra::{DMatrix, DVector};

use crate::beam::eigen;
use crate::description::Description;
use crate::dynamics::flexible;
use crate::error::{Error, Result};
use crate::scalar::{Dual, Scalar, seed};
use crate::system::{Build, Dynamics};

/// Derivatives taken in one sweep.
const LANES: usize = 8;
/// Newton steps before the search counts as lost.
const STEPS: usize = 60;
/// Halvings of a Newton step that does not bring the beams closer to rest.
const HALVINGS: usize = 12;

/// A machine whose joints are held.
pub(crate) struct Statics {
    plain: Dynamics<f64>,
    dual: Dynamics<Dual<f64, LANES>>,
}

/// A machine at rest.
pub(crate) struct Rest {
    /// All coordinates.
    pub(crate) coordinates: Vec<f64>,
    /// Derivative of the load that the elastic coordinates miss by themselves: stiffness with that of gravity.
    pub(crate) tangent: DMatrix<f64>,
}

impl Statics {
    pub(crate) fn new(description: &Description, theta: &[f64]) -> Result<Self> {
        let lifted: Vec<_> = theta.iter().map(|&value| Dual::constant(value)).collect();
        Ok(Self { plain: description.dynamics(theta)?, dual: description.dynamics(&lifted)? })
    }

    /// The elastic coordinates at rest under gravity with the joints held at `joints`.
    ///
    /// Law: `bias(q, 0) + K q = 0` on the elastic coordinates, by Newton's method from the straight beams with exact derivatives (dual
    /// numbers); a step that leads away is halved. Checked: converged to rounding.
    pub(crate) fn settle(&mut self, joints: &[f64]) -> Result<Rest> {
        let (first, n) = (joints.len(), self.plain.coordinates());
        let mut coordinates = joints.to_vec();
        coordinates.resize(n, 0.0);
        if first == n {
            return Ok(Rest { coordinates, tangent: DMatrix::zeros(0, 0) });
        }
        let mut residual = self.residual(&coordinates);
        for _ in 0..STEPS {
            let tangent = self.tangent(&coordinates, first);
            let step = tangent.clone().lu().solve(&residual).filter(|step| step.iter().all(|entry| entry.is_finite()));
            let Some(step) = step else { break };
            let size = coordinates[first..].iter().fold(1.0_f64, |most, entry| most.max(entry.abs()));
            let mut share = 1.0;
            for _ in 0..HALVINGS {
                let mut moved = coordinates.clone();
                moved[first..].iter_mut().zip(step.iter()).for_each(|(entry, step)| *entry -= share * step);
                let found = self.residual(&moved);
                let closer = found.norm() <= residual.norm() || share * step.amax() < 1e-11 * size;
                if closer || share < 1e-3 {
                    (coordinates, residual) = (moved, found);
                    break;
                }
                share *= 0.5;
            }
            if step.amax() < 1e-11 * size {
                return Ok(Rest { coordinates, tangent });
            }
        }
        let condition = "vanish within 60 Newton steps".to_owned();
        let repair = "check the stiffness of the beams against what they carry";
        Err(Error::Setting {
            setting: "the load that the beams at rest miss",
            condition,
            value: residual.amax(),
            repair,
        })
    }

    fn residual(&mut self, q: &[f64]) -> DVector<f64> {
        let first = self.plain.joints();
        DVector::from_vec(unbalance(&mut self.plain, q)[first..].to_vec())
    }

    /// The derivative of the residual.
    fn tangent(&mut self, q: &[f64], first: usize) -> DMatrix<f64> {
        let n = q.len();
        let mut tangent = DMatrix::zeros(n - first, n - first);
        let elastic: Vec<usize> = (first..n).collect();
        for lanes in elastic.chunks(LANES) {
            let residual = unbalance(&mut self.dual, &seed(q, lanes));
            for (row, entry) in residual[first..].iter().enumerate() {
                for (&column, slope) in lanes.iter().zip(entry.gradient) {
                    tangent[(row, column - first)] = slope;
                }
            }
        }
        tangent
    }

    /// Efforts that hold the joints at rest, with those of the effects taken off.
    pub(crate) fn holding_efforts(&mut self, rest: &Rest) -> Vec<f64> {
        let n = rest.coordinates.len();
        let (zero, mut efforts) = (vec![0.0; n], vec![0.0; n]);
        self.plain.inverse_dynamics(&rest.coordinates, &zero, &zero, &mut efforts);
        efforts.truncate(self.plain.joints());
        efforts
    }

    /// Natural frequencies in Hz of the beams about rest with the joints held, slowest first; negative for growth instead of vibration.
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

/// What the coordinates miss at rest: `bias(q, 0) + K q`.
fn unbalance<S: Scalar>(dynamics: &mut Dynamics<S>, q: &[S]) -> Vec<S> {
    let zero = vec![S::zero(); q.len()];
    dynamics.terms(q, &zero);
    let mut load = zero.clone();
    flexible::required(&dynamics.model, &dynamics.data, (q, &zero), &zero, &mut load);
    load
}

/// All coordinates at rest with the joints held at `joints`, with exact derivatives: one Newton step over the number type from the
/// solution in plain numbers (the implicit function theorem).
pub(crate) fn settled<S: Scalar>(
    description: &Description,
    dynamics: &mut Dynamics<S>,
    theta: &[S],
    joints: &[S],
) -> Result<Vec<S>> {
    let values = |numbers: &[S]| numbers.iter().map(Scalar::re).collect::<Vec<f64>>();
    let Rest { coordinates, tangent } = Statics::new(description, &values(theta))?.settle(&values(joints))?;
    let mut q: Vec<S> = joints.to_vec();
    q.extend(coordinates[joints.len()..].iter().map(|&value| S::from_f64(value)));
    let Some(inverse) = tangent.try_inverse() else { return Ok(q) };
    let missing = unbalance(dynamics, &q);
    for (row, entry) in inverse.row_iter().zip(&mut q[joints.len()..]) {
        let step: S = row.iter().zip(&missing[joints.len()..]).map(|(&entry, &load)| load * entry).sum();
        *entry -= step;
    }
    Ok(q)
}
