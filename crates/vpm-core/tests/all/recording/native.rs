//! Machine code of a program gives what the program says: against each operation in turn, with bounds of rounding where products
//! are fused, and against the standard sine and cosine.

use allocation_counter::measure;
use proptest::prelude::*;
use vpm_core::error::Error;
use vpm_core::graph::{Call, Function, Graph, LARGEST, Native, Node, Operation, Program, Unavailable};
use vpm_core::samples::Random;
use vpm_core::scalar::Search;

const INPUTS: usize = 5;
const FUNCTIONS: [Function; 9] = [
    Function::Negative,
    Function::Root,
    Function::Exp,
    Function::ExpM1,
    Function::Ln,
    Function::Tanh,
    Function::Atan,
    Function::Sine,
    Function::Cosine,
];

/// No search, but called like one.
static SUM: Search = Search { name: "sum", arguments: 3, run: |&[a, b, c, ..]| a - 0.5 * b + c, source: &[] };

/// What a random operation is made from: its kind and the arguments, counted back from the newest number.
type Seed = (u8, [u16; 4], f64);

fn seeds(length: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Seed>> {
    prop::collection::vec((any::<u8>(), any::<[u16; 4]>(), -2.0..2.0), length)
}

/// A graph with an operation for each seed; of the functions only the first `functions`.
fn graph(seeds: &[Seed], functions: usize) -> (Graph, Vec<Node>) {
    let mut graph = Graph::new(INPUTS as u32);
    let mut made: Vec<Node> = (0..INPUTS).map(|k| graph.input(k as u32, 0.0)).collect();
    for &(kind, back, value) in seeds {
        // Near and far arguments: the far ones have to wait in memory, some over the end of a function.
        let reach = |back: u16| if back.is_multiple_of(3) { made.len() } else { made.len().min(24) };
        let [a, b, c, d] = back.map(|back| made[made.len() - 1 - usize::from(back / 3) % reach(back)]);
        made.push(match kind % 17 {
            0 => graph.constant(value),
            1..4 => graph.add(a, b),
            4..6 => graph.subtract(a, b),
            6..10 => graph.multiply(a, b),
            10 => graph.divide(a, b),
            11..13 => graph.select([a, b, c, d]),
            16 => graph.search(Call { search: &SUM, arguments: [a, b, c].into() }),
            _ => graph.apply(FUNCTIONS[usize::from(kind / 16) % functions], a),
        });
    }
    (graph, made)
}

/// Each number of a program in turn.
fn values(program: &Program, inputs: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::new();
    for operation in program.operations() {
        let value = operation.value(program.calls(), |node| values[node as usize], |number| inputs[number as usize]);
        values.push(value);
    }
    values
}

/// How far fused products and sines of 2 units in the last place may take each number: the running error analysis of Higham 2002,
/// "Accuracy and Stability of Numerical Algorithms", section 3.3, by one unit per operation; infinite where nothing is known.
fn bounds(program: &Program, values: &[f64]) -> Vec<f64> {
    let mut bounds: Vec<f64> = Vec::new();
    for (operation, &value) in program.operations().iter().zip(values) {
        let (v, e) = (|node: Node| values[node as usize], |node: Node| bounds[node as usize]);
        let carried = match *operation {
            Operation::Constant(_) | Operation::Input(_) => 0.0,
            Operation::Add(a, b) | Operation::Subtract(a, b) => e(a) + e(b),
            Operation::Multiply(a, b) => v(a).abs() * e(b) + v(b).abs() * e(a) + e(a) * e(b),
            Operation::Divide(a, b) => (e(a) + value.abs() * e(b)) / (v(b).abs() - e(b)).max(0.0),
            Operation::Apply(Function::Root, a) => e(a) / (v(a) - e(a)).max(0.0).sqrt(),
            Operation::Apply(Function::Exp | Function::ExpM1, a) => (v(a) + e(a)).exp() * e(a),
            Operation::Apply(Function::Ln, a) => e(a) / (v(a) - e(a)).max(0.0),
            Operation::Apply(_, a) => e(a),
            Operation::Select([a, b, yes, no]) if (v(a) - v(b)).abs() <= e(a) + e(b) => {
                e(yes).max(e(no)) + (v(yes) - v(no)).abs()
            }
            Operation::Search(call) => {
                program.calls()[call as usize].arguments.iter().map(|&argument| e(argument)).sum()
            }
            Operation::Select([a, b, yes, no]) => e(if v(a) < v(b) { yes } else { no }),
        };
        let bound = carried * (1.0 + 1e-9) + 2.0 * f64::EPSILON * value.abs() + f64::MIN_POSITIVE;
        // From 2^50 on, a sine is not a number.
        let far = matches!(*operation, Operation::Apply(Function::Sine | Function::Cosine, a) if v(a).abs() >= 1e15);
        bounds.push(if value.is_finite() && bound.is_finite() && !far { bound } else { f64::INFINITY });
    }
    bounds
}

fn inputs(random: &mut Random) -> Vec<f64> {
    (0..INPUTS).map(|_| 2.0 * random.symmetric()).collect()
}

fn run(native: &Native, inputs: &[f64]) -> Vec<f64> {
    let mut outputs = vec![0.0; native.n_outputs()];
    native.call(inputs, &mut outputs, &mut native.work()).unwrap();
    outputs
}

/// Equal bits, or both not a number.
fn same(found: f64, expected: f64) -> bool {
    found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan()
}

/// How many outputs agree within a bound that is below `1e-9` of them or of 1; all have to agree within their bound.
fn agreeing(program: &Program, inputs: &[f64]) -> usize {
    let found = run(&Native::compile(program).unwrap(), inputs);
    let expected = values(program, inputs);
    let bounds = bounds(program, &expected);
    let mut tight = 0;
    for (&node, found) in program.outputs().iter().zip(found) {
        let (expected, bound) = (expected[node as usize], bounds[node as usize]);
        assert!(bound.is_infinite() || (found - expected).abs() <= bound, "{found} against {expected} within {bound}");
        tight += usize::from(bound <= 1e-9 * expected.abs().max(1.0));
    }
    tight
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_number_is_bitwise_that_of_its_operation(seeds in seeds(1..400), seed in any::<u64>()) {
        // A number that comes out is not fused with another.
        let (graph, made) = graph(&seeds, 7);
        let program = Program::new(&graph, &made, INPUTS);
        let native = Native::compile(&program).unwrap();
        let inputs = inputs(&mut Random::new(seed));
        let expected = values(&program, &inputs);
        for (&node, found) in program.outputs().iter().zip(run(&native, &inputs)) {
            prop_assert!(same(found, expected[node as usize]), "{found} against {}", expected[node as usize]);
        }
    }

    #[test]
    fn pairs_are_bitwise_what_each_of_the_two_is_alone(seeds in seeds(1..400), seed in any::<u64>()) {
        let (graph, made) = graph(&seeds, 9);
        let outputs: Vec<Node> = made.iter().rev().step_by(7).copied().collect();
        let program = Program::new(&graph, &outputs, INPUTS);
        let (single, pairs) = (Native::compile(&program).unwrap(), Native::compile_pairs(&program).unwrap());
        let mut random = Random::new(seed);
        let [first, second] = [(); 2].map(|()| inputs(&mut random));
        let both: Vec<f64> = first.iter().zip(&second).flat_map(|(&a, &b)| [a, b]).collect();
        for (lane, inputs) in [first, second].iter().enumerate() {
            for (pair, expected) in run(&pairs, &both).chunks_exact(2).zip(run(&single, inputs)) {
                prop_assert!(same(pair[lane], expected), "{} against {expected}", pair[lane]);
            }
        }
    }

    #[test]
    fn fused_programs_stay_within_rounding(seeds in seeds(1..400), seed in any::<u64>()) {
        let (graph, made) = graph(&seeds, 9);
        let outputs: Vec<Node> = made.iter().rev().step_by(7).copied().collect();
        agreeing(&Program::new(&graph, &outputs, INPUTS), &inputs(&mut Random::new(seed)));
    }
}

/// Seeds of a long program.
fn long(random: &mut Random, length: usize) -> Vec<Seed> {
    let mut draw = |top: f64| 0.5 * (random.symmetric() + 1.0) * top;
    (0..length).map(|_| (draw(256.0) as u8, [0; 4].map(|_: u16| draw(65536.0) as u16), draw(4.0) - 2.0)).collect()
}

#[test]
fn long_programs_are_cut_and_stay_right() {
    let mut random = Random::new(7);
    for length in [3_000, 20_000] {
        let (graph, made) = graph(&long(&mut random, length), 9);
        let program = Program::new(&graph, &made[INPUTS..], INPUTS);
        let tight = agreeing(&program, &inputs(&mut random));
        // Not a number spreads, and so do numbers that cancel: enough are left to say something.
        assert!(tight > length / 20, "{tight} of {length}");
    }
}

/// Sine and cosine of input 0.
fn trigonometry() -> Native {
    let mut graph = Graph::new(1);
    let x = graph.input(0, 0.0);
    let both = [graph.apply(Function::Sine, x), graph.apply(Function::Cosine, x)];
    Native::compile(&Program::new(&graph, &both, 1)).unwrap()
}

/// The distance of two numbers in units in the last place of the second.
fn units(found: f64, expected: f64) -> f64 {
    let unit = f64::from_bits(expected.abs().to_bits() + 1) - expected.abs();
    (found - expected).abs() / unit
}

/// x, sin x and cos x by mpmath 1.3 with 300 bits: numerators of the continued fraction of pi (OEIS A002485) and their halves,
/// the arguments that lie nearest to multiples of pi/2 of all of their size.
const NEAREST: [[f64; 3]; 16] = [
    [355.0, -3.014435335948845e-05, -0.999999999545659],
    [-177.5, -0.9999999998864147, -1.50721766814562e-05],
    [104348.0, -1.1015017584240557e-05, -0.9999999999393346],
    [-52174.0, 0.9999999999848337, 5.507508792203807e-06],
    [5419351.0, -3.8200475070896605e-08, -0.9999999999999992],
    [-2709675.5, -0.9999999999999998, -1.9100237535448306e-08],
    [411557987.0, 2.5367160519636766e-09, 1.0],
    [-205778993.5, -1.2683580259818383e-09, 1.0],
    [21053343141.0, 1.7533805082422143e-12, -1.0],
    [-10526671570.5, 1.0, -8.766902541211071e-13],
    [8958937768937.0, -2.2019812105637777e-14, 1.0],
    [-4479468884468.5, -1.1009906052818889e-14, -1.0],
    [139755218526789.0, -7.167032800493559e-15, -1.0],
    [-69877609263394.5, -1.0, -3.5835164002467795e-15],
    [428224593349304.0, 5.187137041571002e-16, -1.0],
    [-214112296674652.0, -1.0, 2.593568520785501e-16],
];

/// Arguments of all sizes below 2^50, multiples of pi/4 with their neighbours among them.
fn arguments() -> impl Iterator<Item = f64> {
    let mut random = Random::new(3);
    let sizes = (0..400_000).map(move |k| random.symmetric() * 2.0_f64.powi(k % 80 - 30));
    let near = (1..100_000_i64).flat_map(|k| {
        let x = (k * k * k / 7 + k) as f64 * std::f64::consts::FRAC_PI_4;
        [x, x.next_up(), x.next_down(), -x]
    });
    let ends = [0.0, 5e-324, f64::MIN_POSITIVE, 1e-300, 1.0, 2.0_f64.powi(50).next_down()];
    sizes.chain(near).chain(ends)
}

#[test]
fn sine_and_cosine_are_right_to_two_units() {
    let (native, mut most) = (trigonometry(), 0.0_f64);
    let mut work = native.work();
    let mut check = |[x, sine, cosine]: [f64; 3]| {
        let mut out = [0.0; 2];
        native.call(&[x], &mut out, &mut work).unwrap();
        for (found, expected) in out.into_iter().zip([sine, cosine]) {
            let apart = units(found, expected);
            assert!(apart <= 2.0, "at {x}: {found} against {expected}, {apart} units");
            most = most.max(apart);
        }
    };
    NEAREST.into_iter().for_each(&mut check);
    arguments().for_each(|x| check([x, x.sin(), x.cos()]));
    assert!(most >= 1.0, "a bound of 2 units is too loose, found {most}");
}

#[test]
fn sine_and_cosine_are_not_numbers_where_nothing_is_known() {
    let native = trigonometry();
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 2.0_f64.powi(50), -1e300, f64::MAX] {
        let out = run(&native, &[x]);
        assert!(out.iter().all(|value| value.is_nan()), "at {x}: {out:?}");
    }
}

#[test]
fn every_operation_is_bitwise_right_at_special_values() {
    let mut graph = Graph::new(INPUTS as u32);
    let [a, b, c, d] = [0, 1, 2, 3].map(|number| graph.input(number, 0.0));
    let mut outputs: Vec<Node> = FUNCTIONS[..7].iter().map(|&function| graph.apply(function, a)).collect();
    outputs.extend([graph.add(a, b), graph.subtract(a, b), graph.multiply(a, b), graph.divide(a, b)]);
    outputs.extend([[a, b, c, d], [a, b, a, b], [a, b, b, a], [a, b, c, c]].map(|nodes| graph.select(nodes)));
    // Constants and inputs come out as they are, and one number twice.
    outputs.extend([graph.constant(0.1), graph.constant(f64::NEG_INFINITY), d, a, a, outputs[7], outputs[7]]);
    let program = Program::new(&graph, &outputs, INPUTS);
    let native = Native::compile(&program).unwrap();
    let specials =
        [0.0, -0.0, 1.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 5e-324, -1e-310, f64::MAX, 0.5, 800.0];
    for a in specials {
        for b in specials {
            let inputs = [a, b, 3.0, 4.0, 0.0];
            let expected = values(&program, &inputs);
            for (&node, found) in program.outputs().iter().zip(run(&native, &inputs)) {
                let expected = expected[node as usize];
                assert!(same(found, expected), "{a} {b} {:?}: {found} {expected}", program.operations()[node as usize]);
            }
        }
    }
}

/// A program of several functions with every operation.
fn large() -> Program {
    let (graph, made) = graph(&long(&mut Random::new(11), 9_000), 9);
    Program::new(&graph, &made[INPUTS..], INPUTS)
}

#[test]
fn threads_share_one_code_and_agree_bitwise() {
    let native = Native::compile(&large()).unwrap();
    let mut random = Random::new(5);
    let inputs: Vec<Vec<f64>> = (0..20).map(|_| inputs(&mut random)).collect();
    let all = || inputs.iter().flat_map(|inputs| run(&native, inputs)).map(f64::to_bits).collect::<Vec<_>>();
    let alone = all();
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(all)).collect();
        assert!(threads.into_iter().all(|thread| thread.join().unwrap() == alone));
    });
}

#[test]
fn a_call_allocates_nothing() {
    let native = Native::compile(&large()).unwrap();
    let (mut work, mut outputs) = (native.work(), vec![0.0; native.n_outputs()]);
    let counted = measure(|| native.call(&[0.1, 0.2, 0.3, 0.4, 0.5], &mut outputs, &mut work).unwrap());
    assert_eq!(counted.count_total, 0);
}

#[test]
fn wrong_lengths_are_refused() {
    let (native, other) = (trigonometry(), Native::compile(&large()).unwrap());
    let mut outputs = [0.0; 2];
    let mut refused = |inputs: &[f64], count: usize, work: &Native| {
        let error = native.call(inputs, &mut outputs[..count], &mut work.work()).unwrap_err();
        matches!(error, Error::Dimension { .. })
    };
    assert!(refused(&[], 2, &native) && refused(&[1.0; 2], 2, &native) && refused(&[1.0], 1, &native));
    assert!(refused(&[1.0], 2, &other));
}

#[test]
fn what_is_too_large_is_refused() {
    let mut graph = Graph::new(1);
    let x = graph.input(0, 0.0);
    let mut sum = x;
    for _ in 0..LARGEST {
        sum = graph.add(sum, x);
    }
    assert!(Native::compile(&Program::new(&graph, &[sum], 1)).is_ok());
    let beyond = graph.add(sum, x);
    let refused = Native::compile(&Program::new(&graph, &[beyond], 1)).err();
    assert_eq!(refused, Some(Unavailable::Size { size: LARGEST + 1 }));
}

#[test]
fn an_input_that_is_not_there_is_refused() {
    let mut graph = Graph::new(1);
    let x = graph.input(3, 0.0);
    assert!(matches!(Native::compile(&Program::new(&graph, &[x], 3)), Err(Unavailable::Failed { .. })));
}

#[test]
fn nothing_at_all_is_a_program() {
    let program = Program::new(&Graph::new(0), &[], 0);
    assert_eq!(run(&Native::compile(&program).unwrap(), &[]), Vec::<f64>::new());
}

/// Memory regions of this process.
#[cfg(target_os = "linux")]
fn regions() -> usize {
    std::fs::read_to_string("/proc/self/maps").unwrap().lines().count()
}

#[cfg(target_os = "linux")]
#[test]
fn the_memory_of_the_code_is_given_back() {
    let program = large();
    let before = regions();
    // Every one has several functions of its own region each.
    (0..200).for_each(|_| drop(trigonometry()));
    drop(Native::compile(&program).unwrap());
    // Other tests compile at the same time.
    assert!(regions() < before + 150, "{before} regions became {}", regions());
}
