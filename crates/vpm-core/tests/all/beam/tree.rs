//! Flexible trees against other derivations: rigid-body algorithms, the planar chain, Christoffel symbols.

use nalgebra::{DMatrix, DVector};
use vpm_core::beam::linear::TipBody;
use vpm_core::beam::planar::{Hub, LinkParameters, Load, Motion, PlanarChain};
use vpm_core::beam::strain::{FlexibleLink, FlexibleTree, StrainBeam};
use vpm_core::beam::{Basis, Component, Section};
use vpm_core::data::Data;
use vpm_core::dynamics::{crba, rnea};
use vpm_core::joint::Joint;
use vpm_core::mount::Mount;
use vpm_core::samples::{Random, random_tree};
use vpm_core::{Dual, Result, Scalar};

use crate::common::beams::{along_x, body, fields, near, pin, spatial};

/// The body that a body of a rigid tree hangs on.
fn parent(body: &vpm_core::body::Body<f64>) -> Option<usize> {
    match body.on {
        Mount::Body(parent) => Some(parent),
        _ => None,
    }
}

#[test]
fn without_beams_the_tree_is_the_rigid_one() -> Result<()> {
    for seed in 0..5 {
        let (sample, mut random) = (random_tree(seed, 7), Random::new(seed));
        let bodies = sample.bodies.iter();
        let links = bodies.map(|body| FlexibleLink {
            parent: parent(body),
            joint: Some(body.joint.clone()),
            hub: body.spatial_inertia().unwrap_or_default(),
            ..FlexibleLink::welded()
        });
        let tree = FlexibleTree::new(links.collect(), sample.gravity)?;
        let [q, v] = [2.0, 3.0].map(|size| random.numbers(7, size));
        let (model, mut workspace) = (sample.model::<f64>()?, tree.workspace());
        let mut data = Data::new(&model);
        tree.terms(&q, &v, &[], &mut workspace);
        near(&workspace.bias, rnea(&model, &mut data, &q, &v, &[0.0; 7]), 1e-9);
        near(&workspace.mass, crba(&model, &mut data, &q), 1e-10);
    }
    Ok(())
}

#[test]
fn in_a_plane_the_tree_is_the_planar_chain() -> Result<()> {
    let lengths = [0.8, 0.5];
    let (hub, tip) = (Hub { radius: 0.1, mass: 0.4, inertia: 0.02 }, TipBody { mass: 0.7, inertia: 0.03 });
    let link = LinkParameters { bending: 1.0, line: 1.0, rotary: 0.01, damping: 0.0, hub, tip };
    let planar = [0, 1].map(|k| Basis::legendre(lengths[k], 2).map(|basis| (link, basis)));
    let [first, second] = planar;
    let chain = PlanarChain::<2, 3, 6>::new([first?, second?], [1.3, -9.81], 16)?;
    let section = Section::given([1.0; 6], [0.01, 0.01, 0.01, 1.0, 1.0, 1.0])?;
    let spatial = lengths.iter().enumerate().map(|(k, &length)| {
        let beam = StrainBeam::new(section, fields(length, &[(Component::BendingX, 2)])?, 0.0, 30)?;
        // The next joint's frame has to stand as the planar hub does: turned back from the beam's axes.
        let rotation = [0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0];
        let joint = if k == 0 { pin([0.0, 0.0, 1.0]) } else { Joint { rotation, ..pin([0.0, 0.0, 1.0]) } };
        let beam = Some((along_x(0.1), beam));
        Ok(FlexibleLink {
            parent: k.checked_sub(1),
            joint: Some(joint),
            hub: body(0.4, 0.02),
            beam,
            tip: body(0.7, 0.03),
        })
    });
    let tree = FlexibleTree::new(spatial.collect::<Result<_>>()?, [1.3, -9.81, 0.0])?;
    // Absolute hub angles from relative ones: a constant matrix, so that bias transforms like a force.
    let mut change = DMatrix::<f64>::identity(6, 6);
    let joint = chain.joint_row(1);
    for k in 0..3 {
        change[(3, k)] = -joint[k];
    }
    let mut random = Random::new(2);
    let [q, v] = [0.6, 1.0].map(|size| DVector::from_vec(random.numbers(6, size)));
    let mut workspace = tree.workspace();
    tree.terms(q.as_slice(), v.as_slice(), &[], &mut workspace);
    let array = |v: DVector<f64>| std::array::from_fn(|k| v[k]);
    let motion = Motion { position: array(&change * &q), velocity: array(&change * &v) };
    let terms = chain.terms(&motion, &Load::default(), &mut chain.workspace());
    let mass = change.transpose() * DMatrix::from_row_slice(6, 6, terms.mass.as_flattened()) * &change;
    near(mass.as_slice(), &workspace.mass, 1e-6);
    near((change.transpose() * DVector::from_row_slice(&terms.bias)).as_slice(), &workspace.bias, 1e-5);
    Ok(())
}

#[test]
fn velocity_terms_are_the_christoffel_symbols_of_the_mass_matrix() -> Result<()> {
    let (tree, mut random) = (spatial()?, Random::new(11));
    const N: usize = 16;
    assert_eq!(tree.len(), N);
    let [q, v] = [0.5, 1.0].map(|size| random.numbers(N, size));
    let variables: Vec<Dual<f64, N>> = (0..N).map(|k| Dual::variable(q[k], k)).collect();
    let mut derived = tree.workspace();
    tree.terms(&variables, &[Dual::zero(); N], &[], &mut derived);
    let [mut moving, mut resting] = [tree.workspace(), tree.workspace()];
    tree.terms(&q, &v, &[], &mut moving);
    tree.terms(&q, &[0.0; N], &[], &mut resting);
    for i in 0..N {
        let mut sum = 0.0;
        for j in 0..N {
            for k in 0..N {
                let slopes = derived.mass[i * N + j].gradient[k] - 0.5 * derived.mass[j * N + k].gradient[i];
                sum += slopes * v[j] * v[k];
            }
        }
        let found = moving.bias[i] - resting.bias[i];
        assert!((found - sum).abs() < 1e-11 * (1.0 + sum.abs()), "{i}: {found} is not {sum}");
    }
    Ok(())
}
