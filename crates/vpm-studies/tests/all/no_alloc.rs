//! Chains and linkages allocate nothing once they exist.

use allocation_counter::measure;
use vpm_core::spatial::{Matrix3, Pose, Twist, Vector3};
use vpm_studies::Result;
use vpm_studies::kinematics::{LowerPair, SerialChain};
use vpm_studies::linkage::Newton;
use vpm_studies::linkage::karl::{Karl, KarlGeometry};
use vpm_studies::linkage::leg::{HyqData, Leg, LegParameters};

#[test]
fn chains_allocate_nothing() {
    let turn = Matrix3::rotation(Vector3::from_f64([1.0, 0.0, 0.0]), 0.7);
    let frame = Pose::new(turn, Vector3::from_f64([0.1, 0.2, 0.3]));
    let pairs = [LowerPair::Helical { pitch: 0.1 }, LowerPair::Spherical, LowerPair::Planar];
    let chain = SerialChain::new(&pairs.map(|pair| (frame, pair)), frame);
    let (q, mut columns) = ([0.3; 7], [Twist::zero(); 7]);
    let counted = measure(|| {
        chain.conventional_jacobian(&q, &mut columns);
        chain.screw_jacobian(&q, &mut columns);
        chain.motion_by_screws(&q, &q, &q);
        chain.motion_by_differentiation(&q, &q, &q);
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn linkages_allocate_nothing() -> Result<()> {
    let (leg, karl) = (Leg::new(LegParameters::hyq(HyqData::Cad, 0.341))?, Karl::new(KarlGeometry::default())?);
    let (q, v, strokes) = ([0.3, -1.4], [2.0, -3.0], [0.2, 0.18]);
    let start = karl.direct(strokes)?[0].angles.map(|angle| angle + 0.05);
    let mut solved = false;
    let counted = measure(|| {
        let torques = leg.terms(q, v).effort(&v);
        leg.lagrange(q, v);
        let moved = leg.acceleration(q, v, torques).is_ok() && leg.newton_euler(q, v, v).is_ok();
        solved = moved && Newton::default().solve(&karl, start, &strokes).is_ok() && karl.direct(strokes).is_ok();
    });
    assert!(solved);
    assert_eq!(counted.count_total, 0);
    Ok(())
}
