//! What a contact, a bushing and a load cell cost on a leg of three joints: right-hand sides and steps.

use std::hint::black_box;
use std::time::Duration;

use criterion::Criterion;
use serde_json::Value;
use vpm_core::Result;
use vpm_core::body::Inertia;
use vpm_core::description::Description;
use vpm_core::integrator::{Integrator, Method};
use vpm_core::joint::JointKind;
use vpm_core::model::Parts;
use vpm_core::mount::Mount;
use vpm_core::ode::Ode;
use vpm_core::system::System;

#[path = "../crates/vpm-core/tests/all/common/connections.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod connections;
#[path = "../crates/vpm-core/tests/all/common/trees.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod trees;
use connections::{bushing, chain, contact, load_cell};
#[path = "common/share.rs"]
mod share;

/// A slider along z, then hip and knee about y.
fn leg(change: impl FnOnce(&mut Value)) -> Result<Description> {
    let link = |mass: f64| {
        Some(Inertia { mass, center_of_mass: [0.0, 0.0, -0.17], moments: [0.02, 0.02, 0.002, 0.0, 0.0, 0.0] })
    };
    let turn = [(JointKind::Revolute, [0.0, 1.0, 0.0])];
    let mut bodies = chain("hip", 0, Mount::World, &[(JointKind::Prismatic, [0.0, 0.0, 1.0])], link(6.0));
    bodies.extend(chain("upper", 1, Mount::Body(0), &turn, link(2.6)));
    bodies.extend(chain("lower", 2, Mount::Body(1), &turn, link(0.8)));
    bodies[2].joint.translation = [0.0, 0.0, -0.35];
    trees::try_description(&Parts { gravity: [0.0, 0.0, -9.81], bodies, ..Parts::default() }, change)
}

/// The foot against the ground at a height.
fn foot(content: &mut Value, height: f64) {
    let plane = [[0.0, 0.0, height], [0.0, 0.0, 1.0]];
    let normal = [5.7e6, 1.1, 1000.0, 1e-4];
    contact(content, ("foot", Mount::Body(2), [0.0, 0.0, -0.34]), plane, normal, Some([0.7, 0.1, 0.55, 1.0]));
}

fn pad(content: &mut Value) {
    let ends = [(Mount::Body(2), [0.0, 0.0, -0.34]), (Mount::Body(0), [0.0, 0.0, -0.6])];
    bushing(content, "pad", ends, [10.0, 10.0, 10.0, 1e3, 1e3, 1e3], [1.0; 6], [0.0; 6]);
}

fn main() -> Result<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800))
        .sample_size(20)
        .configure_from_args();
    let state = [0.0, 0.5, -1.0, 0.1, 0.2, -0.3];
    let machines = [
        ("bare", leg(|_| ())?),
        ("load cell", leg(|content| load_cell(content, "cell", 2))?),
        ("open contact", leg(|content| foot(content, -1.0))?),
        ("closed contact", leg(|content| foot(content, -0.6))?),
        ("bushing", leg(pad)?),
    ];
    for (name, description) in machines {
        let mut system: System<f64> = description.system(&description.parameters)?;
        let (mut rate, mut matrix) = ([0.0; 6], [0.0; 36]);
        criterion.bench_function(&format!("leg, {name}: right-hand side"), |b| {
            b.iter(|| system.rhs(black_box(&state), &mut rate));
        });
        criterion.bench_function(&format!("leg, {name}: state Jacobian"), |b| {
            b.iter(|| system.jacobian(black_box(&state), &mut matrix));
        });
        let mut integrator = Integrator::new(Method::LinearlyImplicit, 6);
        criterion.bench_function(&format!("leg, {name}: implicit step"), |b| {
            b.iter(|| {
                let mut x = state;
                integrator.step(&mut system, black_box(&mut x), 1e-4);
                x
            });
        });
        share::print(&format!("leg, {name}"), 1e-4, || {
            let mut x = state;
            integrator.step(&mut system, black_box(&mut x), 1e-4);
        });
    }
    Ok(())
}
