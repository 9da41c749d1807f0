//! Flexible trees against other derivations: rigid-body algorithms, Christoffel symbols.

use vpm_core::beam::witness::strain_tree::{FlexibleLink, FlexibleTree};
use vpm_core::data::Data;
use vpm_core::dynamics::{crba, rnea};
use vpm_core::mount::Mount;
use vpm_core::samples::{Random, random_tree};
use vpm_core::{Dual, Result, Scalar};

use crate::common::beams::{near, spatial};

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
