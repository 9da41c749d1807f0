//! Whether a tree can move at all.

use super::aba::singular_joint;
use super::flexible;
use crate::data::Data;
use crate::error::{Error, Result};
use crate::model::Model;
use crate::scalar::Scalar;

/// A pivot of the mass matrix counts as zero below this fraction of its diagonal entry.
const SINGULAR: f64 = 1e-12;

/// Whether the tree is regular: every joint moves inertia, so that the accelerations exist.
///
/// Judged at one generic configuration: a tree that is singular there is singular everywhere. A regular tree can still be
/// singular in special configurations.
pub fn check_regular<S: Scalar>(model: &Model<S>, data: &mut Data<S>) -> Result<()> {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653; // rad: multiples of it are never special to each other
    let (joints, rest) = (model.n_joints(), vec![S::zero(); model.n_coordinates()]);
    let mut q = rest.clone();
    for (k, q) in q[..joints].iter_mut().enumerate() {
        *q = S::from_f64(GOLDEN_ANGLE * (k + 1) as f64);
    }
    let found = match model.is_recursive() {
        true => singular_joint(model, data, &q, &rest),
        false => singular_pivot(model, data, &q, &rest),
    };
    match found.and_then(|(number, inertia)| model.joint(number).map(|joint| (joint, inertia))) {
        Some((joint, inertia)) => Err(Error::SingularJoint { joint: joint.name.clone(), inertia }),
        None => Ok(()),
    }
}

/// First joint at which the tree is not regular: its pivot of the mass matrix vanishes. Beams have mass all along, so
/// theirs do not.
fn singular_pivot<S: Scalar>(model: &Model<S>, data: &mut Data<S>, q: &[S], rest: &[S]) -> Option<(usize, f64)> {
    flexible::terms(model, data, q, rest);
    data.factorise();
    let n = model.n_coordinates();
    (0..model.n_joints()).find_map(|joint| {
        let (pivot, scale) =
            (data.composite.factors.pivot(joint).inspect(), data.mass_matrix[joint * n + joint].inspect());
        (pivot.is_nan() || pivot <= SINGULAR * scale.abs()).then_some((joint, pivot))
    })
}
