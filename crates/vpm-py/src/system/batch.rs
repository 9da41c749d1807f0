//! Functions of the motion at many motions at once.

use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;
use vpm_core::batch::{Answers, By, Motions, Question, answer};

use super::System;
use crate::arrays::{Numbers, cube, matrix, place, places};
use crate::errors::CoreError;

type Any<'py> = Bound<'py, PyAny>;
type Answered<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray3<f64>>);

#[pymethods]
impl System {
    /// Batch of answers (N, width) at N motions, and their derivatives (N, width, k). By the motion if wanted, then by
    /// parameters.
    #[pyo3(signature = (theta, question, marker, motions, by_motion=false, parameters=vec![]))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of the Python function")]
    fn answers<'py>(
        &self,
        py: Python<'py>,
        theta: &Any<'py>,
        question: &str,
        marker: i64,
        motions: Vec<Any<'py>>,
        by_motion: bool,
        parameters: Vec<i64>,
    ) -> PyResult<Answered<'py>> {
        let theta = Numbers::vector("theta", theta)?;
        let asked = named(question, place("marker", marker)?)?;
        let parameters = places("parameters", &parameters)?;
        let names = ["position", "velocity", "acceleration or effort"];
        let tables: Vec<_> =
            names.iter().zip(&motions).map(|(name, array)| Numbers::table(name, array)).collect::<PyResult<_>>()?;
        let [position, rates @ ..] = &tables[..] else {
            return Err(CoreError::new_err("answers need positions; give a list that begins with them"));
        };
        let Answers { values, derivatives, width } = self.compute(py, |interrupt| {
            let table = |number: usize| rates.get(number).map(Numbers::as_table).transpose();
            let motions = Motions { position: position.as_table()?, velocity: table(0)?, third: table(1)? };
            let by = By { motion: by_motion, parameters: &parameters };
            answer(&self.description, theta.values(), asked, motions, by, interrupt)
        })?;
        let rows = position.rows();
        let columns = parameters.len() + if by_motion { 3 * self.description.n_coordinates() } else { 0 };
        Ok((matrix(py, values, [rows, width])?, cube(py, derivatives, [rows, width, columns])?))
    }
}

fn named(question: &str, marker: usize) -> PyResult<Question> {
    Ok(match question {
        "inverse_dynamics" => Question::InverseDynamics,
        "forward_dynamics" => Question::ForwardDynamics,
        "mass_matrix" => Question::MassMatrix,
        "marker_pose" => Question::MarkerPose(marker),
        "marker_jacobian" => Question::MarkerJacobian(marker),
        "energy" => Question::Energy,
        _ => return Err(CoreError::new_err(format!("there is no question \"{question}\"; ask for mass_matrix"))),
    })
}
