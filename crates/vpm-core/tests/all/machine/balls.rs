//! Ball joints turn through all orientations, with the order of the integrator and without allocation; angles that something needs end
//! the run where they cannot be coordinates.

use std::sync::Arc;

use allocation_counter::measure;
use serde_json::{Value, json};
use vpm_core::Result;
use vpm_core::description::Description;
use vpm_core::evaluate::accelerations;
use vpm_core::integrator::Method;
use vpm_core::linearize::linearize;
use vpm_core::live::Live;
use vpm_core::simulate::Stepping;
use vpm_core::spatial::{Quaternion, Vector3};

const MOMENTS: [f64; 3] = [1.0, 2.0, 2.5];
/// Three angles, then their rates: it turns about its middle axis, and over, again and again.
pub(crate) const START: [f64; 6] = [0.2, 1.4, -0.4, 3.0, 2.0, -1.0];

/// A body that turns about its centre of mass, nothing acting on it.
pub(crate) fn content() -> Value {
    let turns = |k: usize, on: Value, inertia: Value| {
        let mut axis = [0.0; 3];
        axis[k] = 1.0;
        let joint = json!({"name": format!("ball_{k}"), "kind": "revolute", "axis": axis, "translation": [0.0, 0.0, 0.0],
            "rotation": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]});
        json!({"name": format!("body{k}"), "on": on, "joint": joint, "inertia": inertia})
    };
    let inertia = json!({"mass": 0, "center_of_mass": [1, 1, 1], "moments": [2, 3, 4, 1, 1, 1]});
    let bodies = [
        turns(0, json!("world"), Value::Null),
        turns(1, json!({"body": 0}), Value::Null),
        turns(2, json!({"body": 1}), inertia),
    ];
    json!({"gravity": [0.0, 0.0, 0.0], "parameters": [1.0, 0.0, MOMENTS[0], MOMENTS[1], MOMENTS[2]],
        "parameter_names": ["mass", "zero", "xx", "yy", "zz"], "bodies": bodies,
        "balls": [{"name": "ball", "angles": [[0], [1], [2]]}]})
}

pub(crate) fn built(content: &Value) -> Result<Description> {
    Description::from_json(&content.to_string())
}

/// The same with an effect that needs an angle and does nothing.
fn with_friction() -> Result<Description> {
    let mut content = content();
    content["effects"] = json!([{"type": "viscous_friction", "joint": 0, "viscous": 1}]);
    built(&content)
}

pub(crate) fn live(description: Description, start: &[f64], step: f64, method: Method) -> Result<Live> {
    let theta = description.parameters.clone();
    Live::new(Arc::new(description), &theta, start, Stepping::new(step, 1, method)?)
}

/// Angular momentum in axes of the world, from the regular outputs.
fn momentum(live: &Live) -> Vector3<f64> {
    let outputs = live.outputs();
    let [w, x, y, z, u, v, o] = [0, 1, 2, 3, 4, 5, 6].map(|k| outputs[12 + k]);
    let orientation = Quaternion { real: w, vector: Vector3::new(x, y, z) };
    orientation.rotation() * Vector3::new(MOMENTS[0] * u, MOMENTS[1] * v, MOMENTS[2] * o)
}

#[test]
fn angular_momentum_is_kept_to_the_order_of_the_integrator() -> Result<()> {
    let orders = [
        (Method::SemiImplicit, 1),
        (Method::LinearlyImplicit, 2),
        (Method::Rk4, 4),
        (Method::Rosenbrock, 4),
        (Method::Additive, 4),
    ];
    for (method, order) in orders {
        let mut errors = Vec::new();
        for steps in [400, 800] {
            let mut live = live(built(&content())?, &START, 2.0 / f64::from(steps), method)?;
            let (before, mut over) = (momentum(&live), false);
            for _ in 0..steps {
                live.step(&[])?;
                over |= live.state()[1].cos() < 0.0 || live.state()[1].abs() > 1.5;
            }
            let lost = momentum(&live) - before;
            errors.push(lost.dot(lost).sqrt());
            assert!(over, "{} stays away from the singularity", method.name());
        }
        let found = (errors[0] / errors[1]).log2();
        assert!((found - f64::from(order)).abs() < 0.5, "{} has the order {found}: {errors:?}", method.name());
    }
    Ok(())
}

#[test]
fn angles_and_rates_tell_what_the_outputs_tell() -> Result<()> {
    let mut live = live(built(&content())?, &START, 1e-3, Method::Rk4)?;
    assert_eq!(live.state()[..3], START[..3]);
    for _ in 0..2000 {
        live.step(&[])?;
        let (outputs, state) = (live.outputs(), live.state());
        let own = Quaternion::from_angles([state[0], state[1], state[2]]);
        let sign = if own.real * outputs[12] + own.vector.x * outputs[13] < 0.0 { -1.0 } else { 1.0 };
        let ((sb, cb), (sc, cc)) = (state[1].sin_cos(), state[2].sin_cos());
        let [u, v, w] = [state[3], state[4], state[5]];
        let omega = [u * cb * cc + v * sc, v * cc - u * cb * sc, u * sb + w];
        for (k, number) in own.to_array().into_iter().map(|q| q * sign).chain(omega).enumerate() {
            assert!((number - outputs[12 + k]).abs() < 1e-9, "{k} at {}", live.time());
        }
    }
    Ok(())
}

#[test]
fn steps_allocate_nothing() -> Result<()> {
    for method in Method::FIXED {
        let mut live = live(built(&content())?, &START, 1e-3, method)?;
        live.step(&[])?;
        let counted = measure(|| {
            for _ in 0..50 {
                assert!(live.step(&[]).is_ok());
            }
        });
        assert_eq!(counted.count_total, 0, "{}", method.name());
    }
    Ok(())
}

#[test]
fn angles_that_something_needs_end_the_run() -> Result<()> {
    let through = [0.0, 1.0, 0.0, 0.0, 1.5, 0.0];
    let mut live = live(with_friction()?, &through, 1e-3, Method::Rk4)?;
    let end = (0..2000).find_map(|_| live.step(&[]).err());
    let said = end.map(|error| error.to_string()).unwrap_or_default();
    for part in
        ["joint `ball` comes too near to the singularity", "`ball_1` is ", "an effect acts on `ball_0`", "at t = "]
    {
        assert!(said.contains(part), "{said}");
    }
    Ok(())
}

#[test]
fn what_angles_cannot_give_is_refused() -> Result<()> {
    let description = built(&content())?;
    let (theta, q) = (&description.parameters, [0.3, std::f64::consts::FRAC_PI_2, 0.0]);
    let state = [q, [0.0; 3]].concat();
    let refused = [
        accelerations(&description, theta, &q, &[0.0; 3], &[0.0; 3]).err(),
        linearize(&description, theta, &state, &[]).err(),
    ];
    for error in refused {
        let said = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(
            said.contains("joint `ball` is at the singularity of its angles: the second is 90.0000 degrees"),
            "{said}"
        );
    }
    // The same state is a start like any other where it turns freely.
    assert!(live(description, &state, 1e-3, Method::Rk4)?.step(&[]).is_ok());
    let mut content = content();
    content["balls"][0]["angles"][1] = json!([]);
    let said = built(&content).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(said.contains("joint `ball` has an angle without coordinate"), "{said}");
    Ok(())
}
