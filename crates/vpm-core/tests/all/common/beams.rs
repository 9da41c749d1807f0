//! Parts of flexible trees that several tests use.

use vpm_core::Result;
use vpm_core::beam::witness::strain_tree::{Field, FlexibleLink, FlexibleTree, StrainBeam};
use vpm_core::beam::{Basis, Component, Section};
use vpm_core::joint::{Joint, JointKind};
use vpm_core::spatial::{Matrix3, Pose, SpatialInertia, Symmetric3, Vector3};

/// Numbers agree within a tolerance.
pub fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
    }
}

/// Legendre fields of these sizes.
pub fn fields(length: f64, list: &[(Component, usize)]) -> Result<Vec<Field>> {
    list.iter().map(|&(strain, count)| Ok(Field { strain, basis: Basis::legendre(length, count)? })).collect()
}

/// A revolute joint in the origin of its parent.
pub fn pin(axis: [f64; 3]) -> Joint {
    let rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    Joint { name: "pin".to_owned(), kind: JointKind::Revolute, axis, translation: [0.0; 3], rotation }
}

/// The root of a beam along x of the joint's frame, whose bending about its x is a turn about z of the joint's frame.
pub fn along_x(radius: f64) -> Pose<f64> {
    let columns = [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]].map(Vector3::from_f64);
    Pose::new(Matrix3 { columns }, Vector3::from_f64([radius, 0.0, 0.0]))
}

/// A ball.
pub fn body(mass: f64, inertia: f64) -> SpatialInertia<f64> {
    SpatialInertia::new(mass, Vector3::zero(), Symmetric3::diagonal(inertia))
}

/// Two links in space with every strain there is.
pub fn spatial() -> Result<FlexibleTree> {
    use Component::{BendingX, BendingY, Extension, ShearX, ShearY, Torsion};
    let section = Section::given([3.0, 2.0, 1.5, 20.0, 25.0, 40.0], [0.02, 0.03, 0.05, 1.0, 1.0, 1.0])?;
    let all = fields(0.7, &[(BendingX, 2), (BendingY, 1), (Torsion, 1), (ShearX, 1), (ShearY, 1), (Extension, 1)])?;
    let beam = StrainBeam::new(section, all, 1e-3, 6)?;
    let link = |parent, axis| FlexibleLink {
        parent,
        joint: Some(pin(axis)),
        hub: body(0.5, 0.02),
        beam: Some((along_x(0.1), beam.clone())),
        tip: body(0.3, 0.01),
    };
    FlexibleTree::new(vec![link(None, [0.0, 0.0, 1.0]), link(Some(0), [0.6, 0.8, 0.0])], [0.4, -9.0, 2.0])
}
