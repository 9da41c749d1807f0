//! Order of convergence on flexible links, where nothing but the integrator errs.

use vpm_core::beam::Component;
use vpm_core::beam::Section;
use vpm_core::beam::witness::strain_tree::{Drive, FlexibleLink, FlexibleTree, StrainBeam, TreeMotion};
use vpm_core::integrator::{Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::{Result, Scalar};

use crate::common::beams::{along_x, body, fields, pin};
use crate::common::distance;

/// State of an undamped elastic pendulum of two links in space after 0.1 s from a fall out of the horizontal.
fn flexible_state(method: Method, steps: usize) -> Result<Vec<f64>> {
    let section = Section::given([3.0, 2.0, 1.5, 200.0, 250.0, 400.0], [0.02, 0.03, 0.05, 1.0, 1.0, 1.0])?;
    let list = fields(0.7, &[(Component::BendingX, 2), (Component::BendingY, 1), (Component::Torsion, 1)])?;
    let beam = StrainBeam::new(section, list, 0.0, 6)?;
    let link = |parent, axis| FlexibleLink {
        parent,
        joint: Some(pin(axis)),
        hub: body(0.5, 0.02),
        beam: Some((along_x(0.1), beam.clone())),
        tip: body(0.3, 0.01),
    };
    let links = vec![link(None, [0.0, 0.0, 1.0]), link(Some(0), [0.6, 0.8, 0.0])];
    let tree = FlexibleTree::new(links, [0.4, -9.0, 2.0])?;
    let mut motion = TreeMotion::<Still>::new(&tree, None)?;
    let dim = motion.dim();
    let (mut x, mut integrator) = (vec![0.0; dim], Integrator::new(method, dim));
    for _ in 0..steps {
        integrator.step(&mut motion, &mut x, 0.1 / steps as f64);
    }
    Ok(x)
}

/// No joint is driven.
struct Still;
impl Drive for Still {
    fn motion<S: Scalar>(&self, _: S) -> [S; 3] {
        [S::zero(); 3]
    }
}

#[test]
fn integrators_converge_with_their_order_on_flexible_links_without_friction() {
    let reference = flexible_state(Method::Rk4, 4096).unwrap();
    for (method, order, coarse) in [
        (Method::SemiImplicit, 1.0, 512),
        (Method::Rk4, 4.0, 64),
        (Method::LinearlyImplicit, 2.0, 128),
        (Method::Rosenbrock, 4.0, 32),
    ] {
        let errors =
            [coarse, 2 * coarse, 4 * coarse].map(|steps| distance(&flexible_state(method, steps).unwrap(), &reference));
        for pair in errors.windows(2) {
            let found = (pair[0] / pair[1]).log2();
            assert!((found - order).abs() < 0.15, "{}: order {found} from errors {errors:?}", method.name());
        }
    }
}
