//! Mode shapes as the fields of a beam.

use nalgebra::DMatrix;

use crate::beam::eigen::modes;
use crate::beam::fields::{Field, Fields, Interpolated};
use crate::beam::profile::Profile;
use crate::beam::{Basis, Component};
use crate::error::Result;
use crate::scalar::Scalar;

/// Modal fields: the `count` slowest clamped modes of each, as combinations of its shape functions.
///
/// The shapes are made from the values of the parameters, without their derivatives. That is exact for every parameter that scales
/// stiffness or mass as a whole (Young's modulus, density, the sizes of a uniform slender beam), because the shapes then do not
/// change (they are scaled to 1 at the tip); for others the derivatives are those of a beam with these shapes held, which by Rayleigh's
/// principle moves frequencies in second order only.
pub(in crate::beam) fn modal<S: Scalar>(profile: &Profile<S>, list: Vec<Field>, count: usize) -> Result<Vec<Field>> {
    let list = list.into_iter().map(|Field { component, basis }| {
        let shapes = shapes(profile, component, &basis)?.columns(0, count).into_owned();
        Ok(Field { component, basis: Basis::combination(basis, shapes)? })
    });
    list.collect()
}

/// Modal shapes of one field alone, scaled to 1 at the tip. A coordinate is the deflection (m) or the turn (rad) of the
/// tip.
fn shapes<S: Scalar>(profile: &Profile<S>, component: Component, basis: &Basis) -> Result<DMatrix<f64>> {
    let fields = Fields::new(Interpolated::Deflection, vec![Field { component, basis: basis.clone() }]);
    let n = basis.len();
    let (mut mass, mut stiffness) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    for at in profile.rule(fields.points(), &fields.breaks()) {
        let section = profile.at(at.place)?;
        let row = |order| DMatrix::from_row_slice(1, n, &basis.evaluate(at.place, order));
        let mut add = |field: DMatrix<f64>, density: S| mass += field.tr_mul(&field) * (density.re() * at.weight);
        match component {
            Component::BendingX | Component::BendingY => {
                add(row(0), section.line_density());
                add(row(1), section.inertia[component as usize]);
            }
            _ => add(row(0), section.inertia[component as usize]),
        }
        let strain = DMatrix::from_row_slice(1, n, &fields.strain_row(at.place));
        stiffness += strain.tr_mul(&strain) * (section.stiffness[component as usize].re() * at.weight);
    }
    let mut shapes = modes(&stiffness, &mass)?.shapes;
    let tip = basis.evaluate(profile.length(), 0);
    for mut shape in shapes.column_iter_mut() {
        let size: f64 = shape.iter().zip(&tip).map(|(entry, tip)| entry * tip).sum();
        shape /= size;
    }
    Ok(shapes)
}
