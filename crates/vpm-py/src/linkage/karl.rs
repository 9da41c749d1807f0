//! The class `Karl`.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use vpm_studies::algebra::{Conic, resultant};
use vpm_studies::linkage::StrokeLinkage;
use vpm_studies::linkage::karl::{Karl as Limb, KarlGeometry, KarlPose};

use crate::arrays::{Numbers, matrix};
use crate::errors::{CoreError, exception};
use crate::linkage::raised;

type Table<'py> = Bound<'py, PyArray2<f64>>;
type Any<'py> = Bound<'py, PyAny>;

/// KARL: a limb of two joints whose two linear actuators both sit on its first body.
///
/// Tables have one configuration per row; lengths in m, angles in rad, forces in N, torques in N m.
///
/// Parameters
/// ----------
/// medial, distal : float
/// stroke_direction : float
/// sliders : array_like, shape (2, 2)
/// ground_anchor, distal_anchor, rods : sequence of two float
///
/// Raises
/// ------
/// CoreError
///     No limb has these dimensions.
#[pyclass(frozen, module = "vpm._core")]
pub(crate) struct Karl {
    limb: Limb,
}

#[pymethods]
impl Karl {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python class")]
    fn new(
        py: Python<'_>,
        medial: f64,
        distal: f64,
        stroke_direction: f64,
        sliders: [[f64; 2]; 2],
        ground_anchor: [f64; 2],
        distal_anchor: [f64; 2],
        rods: [f64; 2],
    ) -> PyResult<Self> {
        let geometry = KarlGeometry { medial, distal, stroke_direction, sliders, ground_anchor, distal_anchor, rods };
        Ok(Self { limb: Limb::new(geometry).map_err(|error| exception(py, error, 0, 0))? })
    }

    /// Dimensions of the KARL prototype, in the order of the class's arguments.
    #[staticmethod]
    #[expect(clippy::type_complexity, reason = "the arguments of the Python class")]
    fn prototype() -> (f64, f64, f64, [[f64; 2]; 2], [f64; 2], [f64; 2], [f64; 2]) {
        let g = KarlGeometry::default();
        (g.medial, g.distal, g.stroke_direction, g.sliders, g.ground_anchor, g.distal_anchor, g.rods)
    }

    /// Direct kinematics of KARL: joint angles (4, 2) of all assembly modes at two strokes.
    fn direct<'py>(&self, py: Python<'py>, strokes: [f64; 2]) -> PyResult<Table<'py>> {
        let poses = self.limb.direct(strokes).map_err(|error| raised(py, error))?;
        matrix(py, poses.iter().flat_map(|pose| pose.angles).collect(), [4, 2])
    }

    /// Inverse kinematics of KARL: angles and strokes (8, 4) that put the end point at `target`.
    fn inverse<'py>(&self, py: Python<'py>, target: [f64; 2]) -> PyResult<Table<'py>> {
        let poses = self.limb.inverse(target).map_err(|error| raised(py, error))?;
        matrix(py, poses.iter().flat_map(|pose| [pose.angles, pose.strokes].concat()).collect(), [8, 4])
    }

    /// End points (N, 2) of KARL at joint angles (N, 2).
    fn end_point<'py>(&self, py: Python<'py>, angles: &Any<'_>) -> PyResult<Table<'py>> {
        let angles = Numbers::table("angles", angles)?.rows_of::<2>()?;
        table(py, angles.iter().map(|&q| self.limb.end_point(q)))
    }

    /// Determinants (N,) of KARL's end-point Jacobian at joint angles (N, 2), in m^2.
    fn end_point_determinant<'py>(&self, py: Python<'py>, angles: &Any<'_>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let angles = Numbers::table("angles", angles)?.rows_of::<2>()?;
        Ok(PyArray1::from_iter(py, angles.iter().map(|&q| self.limb.end_point_determinant(q))))
    }

    /// Diagonals (N, 2) of KARL's Lambda in rad/m.
    fn transmission<'py>(&self, py: Python<'py>, angles: &Any<'_>, strokes: &Any<'_>) -> PyResult<Table<'py>> {
        let poses = poses(angles, strokes)?;
        table(py, poses.iter().map(|pose| self.limb.lambda(pose)))
    }

    /// Determinants (N, 2) of KARL's Psi and Omega in m^2.
    fn determinants<'py>(&self, py: Python<'py>, angles: &Any<'_>, strokes: &Any<'_>) -> PyResult<Table<'py>> {
        let poses = poses(angles, strokes)?;
        table(py, poses.iter().map(|pose| self.limb.determinants(pose)))
    }

    /// Derivatives (N, 2) of KARL's constraints by the strokes in m. They are zero where a rod is perpendicular to its
    /// stroke.
    fn stroke_slopes<'py>(&self, py: Python<'py>, angles: &Any<'_>, strokes: &Any<'_>) -> PyResult<Table<'py>> {
        let poses = poses(angles, strokes)?;
        let slope = |pose: &KarlPose, k: usize| self.limb.linkages()[k].stroke_slope(pose.strokes[k], pose.angles[k]);
        table(py, poses.iter().map(|pose| [slope(pose, 0), slope(pose, 1)]))
    }

    /// Joint torques (N, 2) of KARL's actuator forces (N, 2).
    fn torques<'py>(
        &self,
        py: Python<'py>,
        angles: &Any<'_>,
        strokes: &Any<'_>,
        forces: &Any<'_>,
    ) -> PyResult<Table<'py>> {
        let (poses, forces) = (poses(angles, strokes)?, Numbers::table("forces", forces)?.rows_of::<2>()?);
        same_rows("forces", forces.len(), poses.len())?;
        table(py, poses.iter().zip(forces).map(|(pose, force)| self.limb.torques(pose, force)))
    }

    /// Alignments of KARL: rows (stroke, angle, extended) of one actuator that loses control of its joint.
    fn alignments<'py>(&self, py: Python<'py>, actuator: i64) -> PyResult<Table<'py>> {
        let rows = self.linkage(actuator)?.alignments();
        let shape = [rows.len(), 3];
        let flag = |yes: bool| if yes { 1.0 } else { 0.0 };
        matrix(py, rows.iter().flat_map(|at| [at.stroke, at.angle, flag(at.extended)]).collect(), shape)
    }

    /// Rows (stroke, angle) at which the rod of one KARL actuator is perpendicular to the stroke.
    fn perpendiculars<'py>(&self, py: Python<'py>, actuator: i64) -> PyResult<Table<'py>> {
        let rows = self.linkage(actuator)?.perpendiculars();
        let shape = [rows.len(), 2];
        matrix(py, rows.iter().flat_map(|at| [at.stroke, at.angle]).collect(), shape)
    }

    /// Span of a KARL joint in rad between the extended and the folded alignment, in mode +1 or -1. It is that with the
    /// larger strokes.
    fn span(&self, actuator: i64, mode: f64) -> PyResult<f64> {
        let linkage = self.linkage(actuator)?;
        match linkage.alignments()[..] {
            [extended, _, folded, _] => Ok(linkage.span(&extended, &folded, mode)),
            _ => Err(CoreError::new_err(format!(
                "actuator {actuator} has no two pairs of alignments, so no span between them; ask for its alignments"
            ))),
        }
    }

    /// Resultant of KARL at one stroke: coefficients (5,) in s = sin q, lowest power first.
    fn resultant(&self, actuator: i64, stroke: f64) -> PyResult<[f64; 5]> {
        Ok(resultant(&self.linkage(actuator)?.polynomial(stroke), &Conic::CIRCLE))
    }
}

impl Karl {
    fn linkage(&self, actuator: i64) -> PyResult<&StrokeLinkage> {
        let place = usize::try_from(actuator).ok();
        place
            .and_then(|place| self.limb.linkages().get(place))
            .ok_or_else(|| CoreError::new_err(format!("KARL has no actuator {actuator}; its actuators are 0 and 1")))
    }
}

fn poses(angles: &Any<'_>, strokes: &Any<'_>) -> PyResult<Vec<KarlPose>> {
    let angles = Numbers::table("angles", angles)?.rows_of::<2>()?;
    let strokes = Numbers::table("strokes", strokes)?.rows_of::<2>()?;
    same_rows("strokes", strokes.len(), angles.len())?;
    Ok(angles.into_iter().zip(strokes).map(|(angles, strokes)| KarlPose { angles, strokes }).collect())
}

pub(super) fn same_rows(name: &str, found: usize, wanted: usize) -> PyResult<()> {
    if found == wanted {
        return Ok(());
    }
    Err(CoreError::new_err(format!("`{name}` has {found} rows for {wanted} configurations; give one row for each")))
}

pub(super) fn table<'py, const N: usize>(
    py: Python<'py>,
    rows: impl Iterator<Item = [f64; N]>,
) -> PyResult<Table<'py>> {
    let values: Vec<f64> = rows.flatten().collect();
    let shape = [values.len() / N, N];
    matrix(py, values, shape)
}
