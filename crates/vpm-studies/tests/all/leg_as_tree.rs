//! The leg in closed form against the same leg as a tree with two lines that weigh something.

use std::f64::consts::FRAC_PI_2;

use vpm_core::Dual;
use vpm_core::body::{Body, Inertia};
use vpm_core::data::Data;
use vpm_core::dynamics::flexible;
use vpm_core::joint::{Joint, JointKind};
use vpm_core::line::{Line, LineEnd, LinePart};
use vpm_core::model::{Model, Parts};
use vpm_core::mount::Mount;
use vpm_core::spatial::Vector2;
use vpm_studies::Result;
use vpm_studies::linkage::ActuatorBody;
use vpm_studies::linkage::leg::{HyqData, Leg, LegBody, LegParameters};

const UPRIGHT: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().fold(1.0_f64, |most, entry| most.max(entry.abs()));
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < tolerance * size, "{found} is not {expected}");
    }
}

/// The leg as a tree: a slider, two legs and two lines that weigh something. The foot is left free.
fn leg_tree(p: &LegParameters) -> Result<Model<f64>> {
    let leg = Leg::new(*p)?;
    let points = leg.points([0.0, 0.0]);
    let joint = |name: &str, kind, axis, y| Joint {
        name: name.into(),
        kind,
        axis,
        translation: [0.0, y, 0.0],
        rotation: UPRIGHT,
    };
    let flat = |mass, center: [f64; 2], turning| {
        let moments = [turning, turning, turning, 0.0, 0.0, 0.0];
        Some(Inertia { mass, center_of_mass: [center[1], -center[0], 0.0], moments })
    };
    let z = [0.0, 0.0, 1.0];
    let slider = Body {
        name: "slider".into(),
        on: Mount::World,
        joint: joint("rail", JointKind::Prismatic, [0.0, 1.0, 0.0], 0.0),
        inertia: flat(p.slider_mass, [0.0, 0.0], 1.0),
        rotor_inertia: None,
    };
    let limb = |name: &str, on, y, part: &LegBody| Body {
        name: name.into(),
        on: Mount::Body(on),
        joint: joint(&format!("{name}.joint"), JointKind::Revolute, z, y),
        inertia: flat(part.mass, part.center, part.inertia),
        rotor_inertia: None,
    };
    let bodies = vec![slider, limb("upper", 0, 0.0, &p.upper), limb("lower", 1, -p.upper.length, &p.lower)];
    let end = |on, point: Vector2<f64>, origin: Vector2<f64>| {
        let at = point - origin;
        LineEnd { on: Mount::Body(on), point: [at.x, at.y, 0.0] }
    };
    let part = |body: ActuatorBody| Some(LinePart { mass: body.mass, center: body.center, inertia: body.inertia });
    let line = |k: usize, from, to| Line {
        name: format!("cylinder{k}"),
        from,
        to,
        barrel: part(p.actuators[k].barrel),
        rod: part(p.actuators[k].rod),
    };
    let lines = vec![
        line(0, end(0, points.bases[0], points.hip), end(1, points.tips[0], points.hip)),
        line(1, end(1, points.bases[1], points.hip), end(2, points.tips[1], points.knee)),
    ];
    Ok(Model::assemble(Parts { gravity: [0.0, -p.gravity, 0.0], bodies, lines, ..Parts::default() })?)
}

#[test]
fn a_leg_with_heavy_cylinders_is_that_of_the_closed_linkage() -> Result<()> {
    let parameters = LegParameters::hyq(HyqData::Plausible, 0.341);
    let (leg, tree) = (Leg::new(parameters)?, leg_tree(&parameters)?);
    let mut data = Data::new(&tree);
    for (q, v, a) in [([0.35, -1.4], [2.0, -3.0], [4.0, -5.0]), ([-0.2, -FRAC_PI_2], [-1.0, 4.0], [7.0, 2.0])] {
        // The foot on the ground makes the height of the hip a function of the angles.
        let moving: [Dual<Dual<f64, 2>, 1>; 2] = std::array::from_fn(|k| {
            let angle = Dual::variable(q[k], k);
            Dual { value: angle, gradient: [Dual::constant(v[k])] }
        });
        let height = leg.points(moving).hip.y;
        let psi = [height.value.gradient, [1.0, 0.0], [0.0, 1.0]];
        let rate = [height.gradient[0].value, v[0], v[1]];
        let psi_rate = height.gradient[0].gradient;
        let lift: f64 = (0..2).map(|k| psi[0][k] * a[k] + psi_rate[k] * v[k]).sum();
        flexible::terms(&tree, &mut data, &[height.value.value, q[0], q[1]], &rate);
        let mut efforts = [0.0; 3];
        flexible::required(&tree, &data, (&[0.0; 3], &rate), &[lift, a[0], a[1]], &mut efforts);
        let found = [0, 1].map(|k| (0..3).map(|b| psi[b][k] * efforts[b]).sum::<f64>());
        let terms = leg.terms(q, v);
        close(&found, &terms.effort(&a), 1e-12);
        let mass = data.mass_matrix();
        let reduced: Vec<f64> = [(0, 0), (0, 1), (1, 0), (1, 1)]
            .iter()
            .map(|&(i, j)| (0..9).map(|b| psi[b / 3][i] * mass[b] * psi[b % 3][j]).sum())
            .collect();
        close(&reduced, terms.mass_matrix.as_flattened(), 1e-12);
    }
    Ok(())
}
