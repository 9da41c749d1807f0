//! Inertial measurement units: what they read is how their frames move, by differences of poses along the motion.

use vpm_core::Result;
use vpm_core::evaluate;
use vpm_core::samples::Random;
use vpm_core::spatial::{Matrix3, Vector3};
use vpm_core::system::Build;
use vpm_core::table::Table;

use crate::common::close;
use crate::common::trees::{description, everything};

/// Time between the poses of a difference, s.
const STEP: f64 = 3e-4;

#[test]
fn imus_read_how_their_frames_move() -> Result<()> {
    for seed in 0..8 {
        let mut parts = everything(seed);
        parts.imus = parts.markers.clone();
        let d = description(&parts, |_| ());
        let (n, random) = (d.n_coordinates(), &mut Random::new(seed));
        let [q, v, a] = [0.3, 0.5, 2.0].map(|size| random.numbers(n, size));
        let (state, rate) = ([q.clone(), v.clone()].concat(), [v.clone(), a.clone()].concat());
        let (mut dynamics, mut outputs) = (Build::dynamics(&&d, &d.parameters)?, vec![0.0; d.n_outputs()]);
        dynamics.observe(&state, &rate, &mut outputs);
        let along: Vec<f64> = [-STEP, 0.0, STEP]
            .iter()
            .flat_map(|t| q.iter().zip(&v).zip(&a).map(move |((q, v), a)| q + t * v + 0.5 * t * t * a))
            .collect();
        let poses = evaluate::marker_poses(&d, &d.parameters, Table::new("positions", &along, 3, n)?)?;
        let pose = |time: usize, marker: usize| {
            let numbers = &poses[12 * (time * d.markers.len() + marker)..][..12];
            let rotation = Matrix3::from_rows_f64(numbers[3..].try_into().expect("nine numbers"));
            (Vector3::<f64>::new(numbers[0], numbers[1], numbers[2]), rotation)
        };
        assert!(!d.imus.is_empty());
        for (imu, read) in outputs[d.layout().imus()..].chunks_exact(6).enumerate() {
            let [(before, turned), (now, rotation), (after, turning)] = [0, 1, 2].map(|time| pose(time, imu));
            let acceleration = (before + after - now * 2.0) * STEP.powi(-2);
            let force = rotation.transpose_mul(acceleration - Vector3::from(parts.gravity));
            let rate = turned.transpose() * turning;
            let angular = rate.rotation_vector() * (0.5 / STEP);
            let size = force.dot(force).sqrt().max(1.0);
            for (read, expected) in read.iter().zip([force.to_array(), angular.to_array()].concat()) {
                close(*read, expected, 1e-5 * size);
            }
        }
    }
    Ok(())
}
