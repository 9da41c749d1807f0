//! The map from coordinates to sections at every level: Jacobian and acceleration are the derivatives of the poses.

use vpm_core::beam::{Beam, BeamEntry, Level};
use vpm_core::samples::Random;
use vpm_core::{Dual, Result};

use crate::common::derivatives;
use crate::common::entries::{entry, lift, mixes};

/// Beams of all levels, with all that they can do.
fn levels() -> Vec<BeamEntry<f64>> {
    let bending = [
        Level::Strain(3),
        Level::Elements(2),
        Level::Bezier(3),
        Level::Deflection(3),
        Level::Hermite(2),
        Level::Modal(2),
    ];
    let mut all = mixes(&[&bending[..], &[Level::Lumped(3)]].concat());
    all.push(entry(Level::Rigid, &[], 0.8, [0.02, 0.01]));
    all
}

#[test]
fn columns_twists_and_accelerations_are_derivatives_of_poses() -> Result<()> {
    let mut random = Random::new(3);
    for entry in levels() {
        let marks = [0.0, 0.31, 0.8];
        let (beam, moving) = (Beam::new(&entry, &marks)?, Beam::new(&lift::<Dual<f64, 1>>(&entry), &marks)?);
        let what = format!("{:?} {:?}", entry.level, entry.deforms);
        derivatives::are_those_of_poses(&beam, &moving, &mut random, &what);
    }
    Ok(())
}

#[test]
fn motions_allocate_nothing() -> Result<()> {
    for entry in levels() {
        let beam = Beam::new(&entry, &[0.8])?;
        let (n, mut out, gauge) = (beam.len(), beam.sections(), beam.gauge(0.3));
        let (q, v) = (vec![0.1; n], vec![0.2; n]);
        let counted = allocation_counter::measure(|| {
            beam.motion(&q, &v, &mut out);
            std::hint::black_box((gauge.strain(&q), beam.slope(&q)));
        });
        assert_eq!(counted.count_total, 0, "{:?}", entry.level);
    }
    Ok(())
}
