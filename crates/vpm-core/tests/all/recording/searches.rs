//! Searches in plain numbers as operations of a graph: found, merged, cut, refined and differentiated.

use vpm_core::graph::{Evaluator, Graph, Native, Program, Recorded, input, record};
use vpm_core::scalar::{Dual, Scalar, Search};

/// Root of the first argument over the second by halves, to a thousandth.
static ROOT: Search = Search { name: "root", arguments: 2, run: |&[x, y, ..]| halves(x / y), source: &[] };

fn halves(square: f64) -> f64 {
    let (mut low, mut high) = (0.0, square.max(1.0));
    while high - low > 1e-3 {
        let middle = 0.5 * (low + high);
        if middle * middle < square { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The root of x / y, with its derivatives up to order four.
fn root<S: Scalar>(x: S, y: S) -> S {
    let mut found = S::search(&ROOT, [x, y].into_iter());
    for _ in 0..3 {
        found -= (found * found - x / y) / (found * 2.0);
    }
    found
}

/// Inputs x and y; the root, and with it the sum of another that is the same.
fn recorded() -> ([Recorded; 2], Graph) {
    record(1, || {
        let [x, y] = [input(0, 2.0), input(1, 3.0)];
        [root(x, y), root(x, y) + root(Recorded::from(4.0), Recorded::one())]
    })
}

#[test]
fn a_search_is_one_operation_whose_refinement_has_the_derivatives() {
    let ([first, second], mut graph) = recorded();
    assert_eq!((graph.calls().len(), graph.decisions().len()), (1, 0), "equal calls are one, constants are worked out");
    let derivative = graph.derive(&[first.node()], &[0, 1]);
    let twice = graph.derive(&derivative.entries, &[0, 1]);
    let outputs: Vec<_> =
        [first.node(), second.node()].into_iter().chain(derivative.entries).chain(twice.entries).collect();
    let program = Program::new(&graph, &outputs, 2);
    // More than the lanes of one pass, each with a search of another length.
    let inputs: Vec<f64> = (1..40).flat_map(|k| [0.1 * f64::from(k * k), 1.0 / f64::from(k)]).collect();
    let mut found = vec![0.0; 39 * outputs.len()];
    Evaluator::new(&program).run(&inputs, &mut found);
    let native = Native::compile(&program).unwrap();
    let (mut work, mut code) = (native.work(), vec![0.0; outputs.len()]);
    for (inputs, found) in inputs.chunks(2).zip(found.chunks(outputs.len())) {
        let [x, y] = [(0, inputs[0]), (1, inputs[1])]
            .map(|(lane, value)| Dual::<Dual<f64, 2>, 2>::variable(Dual::variable(value, lane), lane));
        let dual = root(x, y);
        let [by_x, by_y] = dual.gradient;
        let own = [dual.re(), dual.re() + 2.0, by_x.value, by_y.value];
        let expected = own.into_iter().chain(by_x.gradient).chain(by_y.gradient);
        native.call(inputs, &mut code, &mut work).unwrap();
        for (place, expected) in expected.enumerate() {
            let near = |found: f64| (found - expected).abs() <= 1e-11 * expected.abs();
            assert!(near(found[place]) && near(code[place]), "{inputs:?} {place}: {found:?} {code:?} {expected}");
        }
        let exact = (inputs[0] / inputs[1]).sqrt();
        assert!(
            (dual.re() - exact).abs() < 1e-12 * exact
                && (by_x.value - 0.5 * exact / inputs[0]).abs() < 1e-9 * by_x.value
        );
    }
}

#[test]
fn a_search_is_worked_out_as_seldom_as_its_arguments_change() {
    let ([first, second], graph) = recorded();
    let program = Program::new(&graph, &[first.node(), second.node()], 2);
    let (together, apart) = (program.split(|_| true), program.split(|input| input == 1));
    assert_eq!([together.seldom.calls().len(), together.often.calls().len()], [1, 0]);
    assert_eq!([apart.seldom.calls().len(), apart.often.calls().len()], [0, 1]);
    assert_eq!(program.part([1]).calls(), program.calls());
    let mut passed = vec![0.0; together.seldom.outputs().len()];
    Evaluator::new(&together.seldom).run(&[5.0, 7.0], &mut passed);
    let (mut staged, mut whole) = ([0.0; 2], [0.0; 2]);
    Evaluator::new(&together.often).run(&[&[5.0, 7.0], &passed[..]].concat(), &mut staged);
    Evaluator::new(&program).run(&[5.0, 7.0], &mut whole);
    assert_eq!(staged, whole);
}
