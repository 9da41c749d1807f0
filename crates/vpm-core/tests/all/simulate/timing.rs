//! Steps timed one by one, without allocation, and the stages of a step.

use allocation_counter::measure;
use vpm_core::integrator::Method;
use vpm_core::samples;
use vpm_core::table::Table;
use vpm_core::timing::{Course, Stage};

use crate::common::{Bench, Machine};

fn calls(stages: &[Stage], name: &str) -> f64 {
    stages.iter().find(|stage| stage.name == name).map_or(0.0, |stage| stage.calls)
}

/// A motor on a slider, with friction.
fn axis() -> Machine {
    let mut machine = Machine::new(&samples::slider(95.0));
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 20.0), ("transition_velocity", 1e-3)])
        .actuator(0, &[("gain", 35.0)]);
    machine
}

#[test]
fn stages_are_called_as_often_as_the_methods_say() {
    let inputs = [0.1; 40];
    let table = Table::new("inputs", &inputs, 40, 1).unwrap();
    // Evaluations of a step of each method from its law, the one of the sample among them; matrices.
    for (method, rates, jacobians, matrices) in [
        (Method::Rk4, 5.0, 0.0, 0.0),
        (Method::SemiImplicit, 2.0, 0.0, 0.0),
        (Method::LinearlyImplicit, 2.0, 0.0, 1.0),
        (Method::Rosenbrock, 6.0, 1.0, 0.0),
    ] {
        let bench = Bench::new(&axis(), 1e-3, 1, method);
        let mut course = Course::new(bench.setting(), &[0.0, 0.0], table).unwrap();
        let stages = course.stages(4).unwrap();
        assert_eq!(calls(&stages, "solve"), rates, "{method}");
        assert_eq!(calls(&stages, "effects"), rates, "{method}");
        assert_eq!(calls(&stages, "Jacobian"), jacobians, "{method}");
        assert_eq!(calls(&stages, "iteration matrix"), matrices, "{method}");
        assert_eq!(calls(&stages, "sensors"), 1.0, "{method}");
        assert!(stages.iter().all(|stage| stage.seconds > 0.0 && stage.seconds.is_finite()), "{stages:?}");
        assert!(!stages.iter().any(|stage| stage.name == "beams"));
    }
}

#[test]
fn steps_are_counted_through_substeps() {
    let inputs = [0.1; 10];
    let table = Table::new("inputs", &inputs, 10, 1).unwrap();
    let bench = Bench::new(&axis(), 1e-3, 3, Method::Rk4);
    let stages = Course::new(bench.setting(), &[0.0, 0.0], table).unwrap().stages(2).unwrap();
    assert_eq!(calls(&stages, "solve"), 13.0);
}

#[test]
fn timed_steps_allocate_nothing_and_one_that_does_is_seen() {
    let inputs = [0.1; 40];
    let table = Table::new("inputs", &inputs, 40, 1).unwrap();
    let bench = Bench::new(&axis(), 1e-3, 1, Method::LinearlyImplicit);
    let mut durations = vec![0.0; 1000];
    let mut course = Course::new(bench.setting(), &[0.0, 0.0], table).unwrap();
    assert_eq!(measure(|| course.time(&mut durations).unwrap()).count_total, 0);
    assert!(durations.iter().all(|&duration| duration > 0.0));
    // What is asked now and then within a step is the one place where somebody else's code can allocate.
    let asks = || std::hint::black_box(vec![0_u8; 16]).is_empty();
    let setting = vpm_core::simulate::Setting { interrupt: &asks, ..bench.setting() };
    let mut course = Course::new(setting, &[0.0, 0.0], table).unwrap();
    assert!(measure(|| course.time(&mut durations).unwrap()).count_total > 0);
}
