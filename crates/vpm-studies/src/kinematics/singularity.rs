//! Where a chain loses a freedom of its task.

use super::SerialChain;
use crate::algebra::{SingularValues, determinant, is_definite};
use vpm_core::spatial::Twist;
use vpm_core::{Error, Result};

/// One component of the tool's motion, in world axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Rotation about x, y or z (0, 1, 2).
    Rotation(usize),
    /// Translation along x, y or z (0, 1, 2).
    Translation(usize),
}

/// What the tool is meant to do: the components that count, and the length that makes metres comparable with radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// The components that count.
    pub components: Vec<Component>,
    /// Characteristic length in m: translations are divided by it.
    pub length: f64,
    /// Singular where the smallest singular value is below this fraction of the largest.
    pub tolerance: f64,
}

/// Whether a configuration loses a freedom of the task, and in which way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Singularity {
    /// All freedoms of the task are there.
    Regular,
    /// The tool is at the edge of what it can reach: it can leave only to one side of the lost direction.
    Boundary,
    /// A freedom is lost for an instant inside the workspace: joints are aligned, but motion to both sides is possible.
    Interior,
}

/// Result of [`SerialChain::analyse`].
#[derive(Clone, Debug, PartialEq)]
pub struct Analysis {
    /// Determinant of the task's Jacobian, if it is square.
    pub determinant: Option<f64>,
    /// Singular values of the task's Jacobian, one per component, descending.
    pub singular_values: Vec<f64>,
    /// The verdict.
    pub kind: Singularity,
}

impl SerialChain {
    /// Rank of the task's Jacobian at `q`, and what kind of singularity it is.
    ///
    /// Law: singular where `det J = 0` (section 2.2.5 of the thesis), or the smallest singular value is zero when J is
    /// not square. With a lost direction u (`u^T J = 0`) and joint motions v that leave the task at rest (`J v = 0`),
    /// the tool moves by `1/2 u . (J_dot v)` along u: if that has one sign for all v the tool touches its boundary,
    /// otherwise the singularity is interior. At a rank loss above one, boundary means: in one of the lost directions
    /// found.
    /// Checked: stretched, folded and aligned planar arms; the wrist of a six-joint arm.
    pub fn analyse(&self, q: &[f64], task: &Task) -> Result<Analysis> {
        self.check(q, task)?;
        let mut twists = vec![Twist::zero(); q.len()];
        self.conventional_jacobian(q, &mut twists);
        let columns: Vec<Vec<f64>> = twists.iter().map(|twist| task.select(twist)).collect();
        let rows: Vec<Vec<f64>> =
            (0..task.components.len()).map(|row| columns.iter().map(|column| column[row]).collect()).collect();
        let left = SingularValues::new(&rows);
        let largest = left.values.first().copied().unwrap_or(0.0);
        let floor = task.tolerance * largest;
        let lost: Vec<&Vec<f64>> =
            left.values.iter().zip(&left.vectors).filter(|(value, _)| **value <= floor).map(|(_, u)| u).collect();
        let kind = match lost.is_empty() {
            true => Singularity::Regular,
            false => self.kind(q, task, &SingularValues::new(&columns), &lost, floor),
        };
        let square = columns.len() == rows.len();
        Ok(Analysis { determinant: square.then(|| determinant(&columns)), singular_values: left.values, kind })
    }

    fn kind(&self, q: &[f64], task: &Task, right: &SingularValues, lost: &[&Vec<f64>], floor: f64) -> Singularity {
        let still: Vec<&Vec<f64>> =
            right.values.iter().zip(&right.vectors).filter(|(value, _)| **value <= floor).map(|(_, v)| v).collect();
        let rest = vec![0.0; q.len()];
        let bend = |v: &[f64]| task.select(&self.motion_by_differentiation(q, v, &rest).acceleration);
        let touches = |u: &Vec<f64>| {
            let along = |v: &[f64]| bend(v).iter().zip(u).map(|(b, u)| b * u).sum::<f64>();
            let entry = |i: &Vec<f64>, j: &Vec<f64>| {
                let (plus, minus): (Vec<f64>, Vec<f64>) = i.iter().zip(j).map(|(i, j)| (i + j, i - j)).unzip();
                0.25 * (along(&plus) - along(&minus))
            };
            let form: Vec<Vec<f64>> = still.iter().map(|i| still.iter().map(|j| entry(i, j)).collect()).collect();
            is_definite(&form, floor)
        };
        if lost.iter().any(|u| touches(u)) { Singularity::Boundary } else { Singularity::Interior }
    }

    fn check(&self, q: &[f64], task: &Task) -> Result<()> {
        let (n, each) = (self.n_coordinates(), "coordinate of the chain".to_owned());
        if q.len() != n {
            return Err(Error::Dimension { what: "the coordinates".to_owned(), expected: n, found: q.len(), each });
        }
        if let Some(index) = q.iter().position(|value| !value.is_finite()) {
            return Err(Error::NonFinite { path: format!("coordinate[{index}]"), value: q[index] });
        }
        let positive = |setting, value: f64, repair| match value.is_finite() && value > 0.0 {
            true => Ok(()),
            false => Err(Error::Setting { setting, condition: "be positive and finite".to_owned(), value, repair }),
        };
        positive("the length of a task", task.length, "give about the reach of the chain in m")?;
        positive("the tolerance of a task", task.tolerance, "give a small fraction such as 1e-9")?;
        task.check_axes(n)
    }
}

impl Task {
    /// Components of a twist in the task of a singularity, translations in lengths.
    fn select(&self, twist: &Twist<f64>) -> Vec<f64> {
        let (angular, linear) = (twist.angular.to_array(), twist.linear.to_array());
        let one = |component: &Component| match *component {
            Component::Rotation(axis) => angular[axis],
            Component::Translation(axis) => linear[axis] / self.length,
        };
        self.components.iter().map(one).collect()
    }

    fn check_axes(&self, coordinates: usize) -> Result<()> {
        for component in &self.components {
            let (Component::Rotation(axis) | Component::Translation(axis)) = *component;
            if axis > 2 {
                let what = format!("component {component:?} of a task");
                return Err(Error::Reference { what, target: "axis", index: axis, count: 3 });
            }
        }
        if self.components.is_empty() || self.components.len() > coordinates {
            let (setting, repair) = ("the number of components of a task", "drop the components that do not matter");
            let condition = format!("be between 1 and the chain's {coordinates} coordinates");
            return Err(Error::Setting { setting, condition, value: self.components.len() as f64, repair });
        }
        Ok(())
    }
}
