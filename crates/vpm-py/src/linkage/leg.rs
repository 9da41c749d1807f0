//! The class `Leg`.

use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;
use vpm_core::Error;
use vpm_core::spatial::Vector2;
use vpm_studies::linkage::leg::{
    Attachment, DutyCycle, HyqData, Leg as Limb, LegBody, LegParameters, Reactions, ShareDefinition, ShareStudy,
};
use vpm_studies::linkage::{ActuatorBody, LineActuator};

use super::karl::{same_rows, table};
use crate::arrays::{Numbers, cube};
use crate::errors::{CoreError, exception};
use crate::interrupt::interruptible;
use crate::linkage::raised;

type Table<'py> = Bound<'py, PyArray2<f64>>;
type Cube<'py> = Bound<'py, PyArray3<f64>>;
type Any<'py> = Bound<'py, PyAny>;
/// slider mass; bodies [length, mass, inertia, center along, center ahead]; attachments [base, angle, tip, angle]; parts of the
/// cylinders [mass, center, inertia]; gravity.
type Parameters = (f64, [[f64; 5]; 2], [[f64; 4]; 2], [[f64; 3]; 4], f64);

/// A leg of upper and lower part on a vertical slider, driven by two cylinders, its foot on the ground.
///
/// Tables have one configuration per row; SI units.
///
/// Parameters
/// ----------
/// slider_mass : float
/// bodies : array_like, shape (2, 5)
/// attachments : array_like, shape (2, 4)
/// parts : array_like, shape (4, 3)
/// gravity : float
///
/// Raises
/// ------
/// CoreError
///     No leg has these parameters.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct Leg {
    limb: Limb,
}

/// Parameters of the leg of HyQ, in the order of the arguments of `Leg`: data "table", "identified" or "plausible", shank in m.
#[pyfunction]
pub(crate) fn hyq_parameters(data: &str, shank: f64) -> PyResult<Parameters> {
    let data = match data {
        "table" => HyqData::Cad,
        "identified" => HyqData::Identified,
        "plausible" => HyqData::Plausible,
        other => {
            let text = format!("there are no parameters \"{other}\"; the choices are table, identified, plausible");
            return Err(CoreError::new_err(text));
        }
    };
    let p = LegParameters::hyq(data, shank);
    let body = |b: LegBody| [b.length, b.mass, b.inertia, b.center[0], b.center[1]];
    let place = |a: Attachment| [a.base, a.base_angle, a.tip, a.tip_angle];
    let part = |part: ActuatorBody| [part.mass, part.center, part.inertia];
    let [hip, knee] = p.actuators;
    let parts = [hip.barrel, hip.rod, knee.barrel, knee.rod].map(part);
    Ok((p.slider_mass, [body(p.upper), body(p.lower)], p.attachments.map(place), parts, p.gravity))
}

#[pymethods]
impl Leg {
    #[new]
    fn new(
        py: Python<'_>,
        slider_mass: f64,
        bodies: [[f64; 5]; 2],
        attachments: [[f64; 4]; 2],
        parts: [[f64; 3]; 4],
        gravity: f64,
    ) -> PyResult<Self> {
        let [upper, lower] = bodies.map(|[length, mass, inertia, along, ahead]| LegBody {
            length,
            mass,
            inertia,
            center: [along, ahead],
        });
        let attachments =
            attachments.map(|[base, base_angle, tip, tip_angle]| Attachment { base, base_angle, tip, tip_angle });
        let [a, b, c, d] = parts.map(|[mass, center, inertia]| ActuatorBody { mass, inertia, center });
        let actuators = [LineActuator { barrel: a, rod: b }, LineActuator { barrel: c, rod: d }];
        let parameters = LegParameters { slider_mass, upper, lower, attachments, actuators, gravity };
        Ok(Self { limb: Limb::new(parameters).map_err(|error| exception(py, error, 0, 0))? })
    }

    /// Lengths (N, 2) of the leg's hip and knee cylinder at joint angles (N, 2).
    fn strokes<'py>(&self, py: Python<'py>, angles: &Any<'_>) -> PyResult<Table<'py>> {
        let angles = pairs("angles", angles)?;
        table(py, angles.iter().map(|&q| self.limb.strokes(q)))
    }

    /// Lever arms (N, 2) of the leg's cylinders in m/rad at joint angles (N, 2).
    fn levers<'py>(&self, py: Python<'py>, angles: &Any<'_>) -> PyResult<Table<'py>> {
        let angles = pairs("angles", angles)?;
        table(py, angles.iter().map(|&q| self.limb.levers(q)))
    }

    /// Points (N, 7, 2) of the leg: hip, knee, foot, bases of hip and knee cylinder, their tips.
    fn points<'py>(&self, py: Python<'py>, angles: &Any<'_>) -> PyResult<Cube<'py>> {
        let angles = pairs("angles", angles)?;
        let row = |q: [f64; 2]| {
            let p = self.limb.points(q);
            [p.hip, p.knee, p.foot, p.bases[0], p.bases[1], p.tips[0], p.tips[1]].map(Vector2::to_array)
        };
        let values = angles.iter().flat_map(|&q| row(q).into_iter().flatten().collect::<Vec<f64>>()).collect();
        cube(py, values, [angles.len(), 7, 2])
    }

    /// Mass matrices (N, 2, 2), velocity terms (N, 2) and gravity terms (N, 2) of the leg.
    fn terms<'py>(
        &self,
        py: Python<'py>,
        angles: &Any<'_>,
        rates: &Any<'_>,
        derivation: &str,
    ) -> PyResult<(Cube<'py>, Table<'py>, Table<'py>)> {
        let (angles, rates) = (pairs("angles", angles)?, pairs("rates", rates)?);
        same_rows("rates", rates.len(), angles.len())?;
        let evaluate = match derivation {
            "virtual_work" => |leg: &Limb, q, v| leg.terms(q, v),
            "lagrange" => |leg: &Limb, q, v| leg.lagrange(q, v),
            other => {
                let text = format!("there is no derivation \"{other}\" of terms; use virtual_work or lagrange");
                return Err(CoreError::new_err(text));
            }
        };
        let rows = py.detach(|| {
            let each = angles.iter().zip(&rates).map(|(&q, &v)| evaluate(&self.limb, q, v));
            each.collect::<Vec<_>>()
        });
        let mass = rows.iter().flat_map(|terms| terms.mass_matrix.as_flattened()).copied().collect();
        Ok((
            cube(py, mass, [rows.len(), 2, 2])?,
            table(py, rows.iter().map(|terms| terms.velocity))?,
            table(py, rows.iter().map(|terms| terms.gravity))?,
        ))
    }

    /// Reactions (N, 23) of the leg: torques, cylinder forces, ground, guide (2), pins (6 x 2), bearings (2 x 2).
    fn reactions<'py>(
        &self,
        py: Python<'py>,
        angles: &Any<'_>,
        rates: &Any<'_>,
        accelerations: &Any<'_>,
    ) -> PyResult<Table<'py>> {
        let (q, v) = (pairs("angles", angles)?, pairs("rates", rates)?);
        let a = pairs("accelerations", accelerations)?;
        same_rows("rates", v.len(), q.len())?;
        same_rows("accelerations", a.len(), q.len())?;
        let rows: Result<Vec<[f64; 23]>, vpm_studies::Error> =
            py.detach(|| (0..q.len()).map(|k| Ok(flat(&self.limb.newton_euler(q[k], v[k], a[k])?))).collect());
        table(py, rows.map_err(|error| raised(py, error))?.into_iter())
    }

    /// Cylinder forces (N, 2) of the leg that give joint torques (N, 2).
    fn cylinder_forces<'py>(&self, py: Python<'py>, angles: &Any<'_>, torques: &Any<'_>) -> PyResult<Table<'py>> {
        let (angles, torques) = (pairs("angles", angles)?, pairs("torques", torques)?);
        same_rows("torques", torques.len(), angles.len())?;
        table(py, angles.iter().zip(torques).map(|(&q, torque)| self.limb.cylinder_forces(q, torque)))
    }

    /// Joint accelerations (N, 2) of the leg under joint torques (N, 2).
    fn accelerations<'py>(
        &self,
        py: Python<'py>,
        angles: &Any<'_>,
        rates: &Any<'_>,
        torques: &Any<'_>,
    ) -> PyResult<Table<'py>> {
        let (q, v, tau) = (pairs("angles", angles)?, pairs("rates", rates)?, pairs("torques", torques)?);
        same_rows("rates", v.len(), q.len())?;
        same_rows("torques", tau.len(), q.len())?;
        let rows: Result<Vec<[f64; 2]>, vpm_studies::Error> =
            (0..q.len()).map(|k| self.limb.acceleration(q[k], v[k], tau[k])).collect();
        table(py, rows.map_err(|error| raised(py, error))?.into_iter())
    }

    /// Largest shares (N, 3) of inertia, velocity and gravity in the leg at joint angles (N, 2). They are those over
    /// all sampled motions.
    fn shares<'py>(
        &self,
        py: Python<'py>,
        angles: &Any<'_>,
        rate: f64,
        acceleration: f64,
        samples: i64,
        definition: &str,
    ) -> PyResult<Table<'py>> {
        let angles = pairs("angles", angles)?;
        let definition = match definition {
            "sum_of_norms" => ShareDefinition::SumOfNorms,
            "norm_of_absolute_sum" => ShareDefinition::NormOfAbsoluteSum,
            "root_of_squares" => ShareDefinition::RootOfSquares,
            "torque" => ShareDefinition::Torque,
            other => {
                let choices = "sum_of_norms, norm_of_absolute_sum, root_of_squares and torque";
                let text = format!("there is no definition \"{other}\" of a share; the choices are {choices}");
                return Err(CoreError::new_err(text));
            }
        };
        let samples = usize::try_from(samples).unwrap_or(0);
        let study = ShareStudy { definition, samples, ..ShareStudy::of(DutyCycle { rate, acceleration }) };
        let rows = interruptible(py, |interrupt| {
            let each = angles.iter().map(|&q| {
                if interrupt() {
                    return Err(Error::Interrupted);
                }
                let shares = self.limb.shares_at(q, &study)?;
                Ok([shares.inertia, shares.velocity, shares.gravity])
            });
            each.collect::<Result<Vec<[f64; 3]>, Error>>()
        })?;
        table(py, rows.map_err(|error| exception(py, error, 0, 0))?.into_iter())
    }
}

fn pairs(name: &'static str, array: &Any<'_>) -> PyResult<Vec<[f64; 2]>> {
    Numbers::table(name, array)?.rows_of::<2>()
}

fn flat(r: &Reactions) -> [f64; 23] {
    let parts = [&r.torques[..], &r.cylinder_forces, &[r.ground], &r.guide, r.pins.as_flattened()];
    let mut row = [0.0; 23];
    let numbers = parts.into_iter().flatten().chain(r.bearings.as_flattened());
    row.iter_mut().zip(numbers).for_each(|(entry, number)| *entry = *number);
    row
}
