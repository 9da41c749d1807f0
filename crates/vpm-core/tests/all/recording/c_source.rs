//! C99 of programs and machines, compiled with all warnings as errors, against the evaluation of the graph, linearisations by dual
//! numbers and the integrators.

use crate::common;
use crate::machine::balls;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use common::servo_machine::{MIDDLE, with_pressures};
use common::{Machine, hydraulics};
use serde_json::json;
use vpm_core::c_source::{Files, Names, files};
use vpm_core::description::Description;
use vpm_core::graph::{Call, Evaluator, Function, Graph, Node, Program, literal};
use vpm_core::integrator::{Method, Rk4, Rosenbrock};
use vpm_core::linearize::linearize;
use vpm_core::samples::{Random, arm7, pendulum};
use vpm_core::scalar::Search;

const STRICT: [&str; 5] = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-O1"];

/// A folder of its own; none, and a word about it, where there is no compiler.
#[cfg(test)]
fn folder(name: &str) -> Option<PathBuf> {
    if Command::new("cc").arg("--version").output().is_err() {
        eprintln!("skipped: there is no C compiler `cc` here");
        return None;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    Some(folder)
}

#[cfg(test)]
fn compile(folder: &Path, files: &[&str], out: &str, standard: &[&str]) {
    let mut command = Command::new("cc");
    command.current_dir(folder).args(standard).args(STRICT).args(files).args(["-o", out, "-lm"]);
    let done = command.output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

/// What a program of `folder` prints when it reads `numbers`.
#[cfg(test)]
fn run(folder: &Path, program: &str, numbers: &[f64]) -> Vec<f64> {
    let mut child = Command::new(folder.join(program)).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let text: String = numbers.iter().map(|number| format!("{number:e}\n")).collect();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let done = child.wait_with_output().unwrap();
    assert!(done.status.success());
    String::from_utf8(done.stdout).unwrap().lines().map(|line| line.parse().unwrap()).collect()
}

/// Rounding of `math.h` against Rust's functions, and of sums in another order.
#[cfg(test)]
fn same(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let size = expected.iter().fold(1.0_f64, |most, value| most.max(value.abs()));
    for (place, (&found, &expected)) in found.iter().zip(expected).enumerate() {
        let near = (found - expected).abs() <= tolerance * size || (found.is_nan() && expected.is_nan());
        assert!(near, "{what}[{place}]: {found} instead of {expected}");
    }
}

/// The larger of two numbers, by another function.
static LARGER: Search = Search {
    name: "larger",
    arguments: 2,
    run: |&[a, b, ..]| if a < b { b } else { a },
    source: &[
        "static int less(double a, double b) { return a < b; }\n",
        "static double larger(double a, double b) { return less(a, b) ? b : a; }\n",
    ],
};

/// A graph of `count` operations of all kinds over `inputs`, whose numbers stay of moderate size.
#[cfg(test)]
fn random_graph(random: &mut Random, inputs: u32, count: usize) -> (Graph, Vec<Node>) {
    let mut graph = Graph::new(inputs);
    let mut nodes: Vec<Node> = (0..inputs).map(|number| graph.input(number, 0.1)).collect();
    nodes.push(graph.constant(-0.1));
    let functions = [
        Function::Negative,
        Function::Exp,
        Function::ExpM1,
        Function::Sine,
        Function::Cosine,
        Function::Tanh,
        Function::Atan,
    ];
    for number in 0..count {
        let mut pick = |among: usize| ((random.symmetric().abs() * among as f64) as usize).min(among - 1);
        let [a, b, c, d] = [(); 4].map(|()| nodes[nodes.len() - 1 - pick(nodes.len().min(2500))]);
        let kind = pick(functions.len());
        let node = match number % 7 {
            0 => graph.add(a, b),
            1 => graph.subtract(a, b),
            2 => graph.multiply(a, b),
            3 => graph.select([a, b, c, d]),
            4 => graph.apply(functions[kind], a),
            5 => graph.search(Call { search: &LARGER, arguments: [a, b].into() }),
            _ => {
                let square = graph.multiply(b, b);
                let one = graph.constant(1.0 + 1.0 / (1.0 + number as f64));
                let sum = graph.add(square, one);
                let root = graph.apply(Function::Root, sum);
                let logarithm = graph.apply(Function::Ln, sum);
                let quotient = graph.divide(a, root);
                graph.add(quotient, logarithm)
            }
        };
        nodes.push(graph.apply(Function::Sine, node));
    }
    (graph, nodes)
}

#[test]
fn programs_of_any_length_say_the_same_in_c() {
    let Some(folder) = folder("programs") else { return };
    let mut random = Random::new(7);
    for count in [0, 30, 2000] {
        let (mut graph, nodes) = random_graph(&mut random, 4, count);
        let infinite = graph.constant(f64::INFINITY);
        let last = nodes[nodes.len() - 1];
        // An input and constants, an output that comes twice, and numbers from the beginning of a long program.
        let outputs = [nodes[0], infinite, nodes[4], last, last, nodes[nodes.len() / 2], nodes[nodes.len() / 9]];
        let program = Program::new(&graph, &outputs, 4);
        let source = program.to_c("f", &[("x", 3), ("u", 1)], &[("y", 5), ("z", 2)]);
        assert_eq!(source.text.matches("static void").count() > 1, program.size() > 1000);
        let main = format!(
            "#include <math.h>\n#include <stdio.h>\n{}{}int main(void)\n{{\n    double x[4], y[7], w[{}];\n    int k;\n    \
             for (k = 0; k < 4; ++k) if (scanf(\"%lf\", x + k) != 1) return 1;\n    f(x, x + 3, w, y, y + 5);\n    \
             for (k = 0; k < 7; ++k) printf(\"%.17g\\n\", y[k]);\n    return 0;\n}}\n",
            source.called.concat(),
            source.text,
            source.work + 1
        );
        fs::write(folder.join("main.c"), main).unwrap();
        compile(&folder, &["main.c"], "program", &["-std=c99"]);
        for _ in 0..5 {
            let inputs: Vec<f64> = (0..4).map(|_| random.symmetric()).collect();
            let mut expected = [0.0; 7];
            Evaluator::new(&program).run(&inputs, &mut expected);
            let found = run(&folder, "program", &inputs);
            assert_eq!(found[1], f64::INFINITY);
            // A sine keeps every step below one; a thousand steps that double an error of the last digit are not among them.
            let finite = |values: &[f64]| values.iter().map(|value| value.min(2.0)).collect::<Vec<_>>();
            same(&finite(&found), &finite(&expected), 1e-9, "program");
        }
    }
}

#[test]
fn constants_read_back_exactly() {
    for value in [1.0 / 3.0, -1e-300, 6.02e23, 0.1 + 0.2, f64::MIN_POSITIVE, f64::MAX] {
        assert_eq!(literal(value).parse::<f64>().unwrap().to_bits(), value.to_bits());
    }
    assert_eq!([f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(literal), ["NAN", "INFINITY", "(-INFINITY)"]);
}

/// Reads x, u, p and a step; prints all that the functions give, matrices row by row.
const MAIN: &str = r#"
#include "m.h"
#include <stdio.h>
static void take(double *to, int n) { while (n-- > 0) if (scanf("%lf", to++) != 1) *to = 0.0; }
static void show(const double *from, int n) { while (n-- > 0) printf("%.17g\n", *from++); }
static double x[m_NX + 1], u[m_NU + 1], p[m_NP + 1], h[1], c[m_NC + 1], w[m_NW], dx[m_NX + 1], y[m_NY + 1];
static double by_x[(m_NX + m_NY) * m_NX + 1], by_u[(m_NX + m_NY) * m_NU + 1], by_p[(m_NX + m_NY) * m_NP + 1];
static double matrix[(m_NX + m_NY) * (m_NX + m_NU + m_NP) + 1];
int main(void)
{
    take(x, m_NX); take(u, m_NU); take(p, m_NP); take(h, 1);
    m_prepare(p, w, c);
    m_evaluate_rates(x, u, c, w, dx);
    show(dx, m_NX);
    m_evaluate_outputs(x, u, c, w, y);
    show(y, m_NY);
    m_evaluate_rates_jacobian(x, u, c, w, dx, by_x, by_u, by_p);
    m_dense(m_rates_by_x, by_x, matrix); show(matrix, m_NX * m_NX);
    m_dense(m_rates_by_u, by_u, matrix); show(matrix, m_NX * m_NU);
    m_dense(m_rates_by_p, by_p, matrix); show(matrix, m_NX * m_NP);
    m_evaluate_outputs_jacobian(x, u, c, w, y, by_x, by_u, by_p);
    m_dense(m_outputs_by_x, by_x, matrix); show(matrix, m_NY * m_NX);
    m_dense(m_outputs_by_u, by_u, matrix); show(matrix, m_NY * m_NU);
    m_step_rk4(x, u, c, h[0], w, dx);
    show(dx, m_NX);
    if (m_step_rosenbrock(x, u, c, h[0], w, x) != 0) return 1;
    show(x, m_NX);
    return 0;
}
"#;

#[cfg(test)]
fn write(description: &Description, free: &[usize], folder: &Path) -> Files {
    let numbered = |what: &str, count: usize| (0..count).map(|number| format!("{what}{number}")).collect();
    let names = Names {
        machine: "m".to_owned(),
        states: numbered("x", description.n_states()),
        inputs: numbered("u", description.n_inputs()),
        outputs: numbered("y", description.n_outputs()),
    };
    let files = files(description, &description.parameters, free, &names).unwrap();
    fs::write(folder.join("m.h"), &files.header).unwrap();
    fs::write(folder.join("m.c"), &files.source).unwrap();
    fs::write(folder.join("main.c"), MAIN).unwrap();
    files
}

/// Rates, outputs, all derivatives and steps at random places, with the free parameters at `theta`, another machine than the one written.
#[cfg(test)]
fn agrees(name: &str, description: &Description, free: &[usize]) {
    agrees_at(name, description, free, |random| {
        let mut numbers = |count: usize, size: f64| (0..count).map(|_| size * random.symmetric()).collect();
        [numbers(description.n_states(), 0.5), numbers(description.n_inputs(), 1.0)]
    });
}

/// The same at states and inputs of a choice.
#[cfg(test)]
fn agrees_at(name: &str, description: &Description, free: &[usize], place: impl Fn(&mut Random) -> [Vec<f64>; 2]) {
    let Some(folder) = folder(name) else { return };
    write(description, free, &folder);
    compile(&folder, &["main.c", "m.c"], "machine", &["-std=c99"]);
    if Command::new("c++").arg("--version").output().is_ok() {
        compile(&folder, &["-x", "c++", "main.c", "m.c"], "as_cpp", &["-std=c++11"]);
    }
    let mut random = Random::new(3);
    let (nx, nu, ny) = (description.n_states(), description.n_inputs(), description.n_outputs());
    for _ in 0..4 {
        let mut theta = description.parameters.clone();
        free.iter().for_each(|&place| theta[place] *= 1.0 + 0.2 * random.symmetric());
        let [x, u] = place(&mut random);
        let h = 1e-3;
        let mut given = [x.as_slice(), &u].concat();
        given.extend(free.iter().map(|&place| theta[place]));
        given.push(h);
        let found = run(&folder, "machine", &given);
        let mut rest = found.as_slice();
        let mut next = |count: usize| {
            let (own, after) = rest.split_at(count);
            rest = after;
            own
        };
        let linear = linearize(description, &theta, &x, &u).unwrap();
        same(next(nx), &linear.rate, 1e-12, "rates");
        same(next(ny), &linear.reading, 1e-12, "outputs");
        same(next(nx * nx), &linear.state, 1e-12, "A");
        same(next(nx * nu), &linear.input, 1e-12, "B");
        let by_p = next(nx * free.len());
        for (column, &place) in free.iter().enumerate() {
            // The rates' Taylor error of third order and their rounding over the step.
            let step = 1e-5 * theta[place].abs().max(1.0);
            let at = |sign: f64| {
                let mut theta = theta.clone();
                theta[place] += sign * step;
                linearize(description, &theta, &x, &u).unwrap().rate
            };
            let quotient: Vec<f64> =
                at(1.0).iter().zip(&at(-1.0)).map(|(plus, minus)| (plus - minus) / (2.0 * step)).collect();
            let own: Vec<f64> = by_p.chunks(free.len()).map(|row| row[column]).collect();
            same(&own, &quotient, 1e-6, "derivative by a parameter");
        }
        same(next(ny * nx), &linear.output, 1e-12, "C");
        same(next(ny * nu), &linear.feedthrough, 1e-12, "D");
        let mut system = description.system(&theta).unwrap();
        for (number, &command) in u.iter().enumerate() {
            let held = system.input(number, 0, 1.0, |_| command);
            system.hold(number, held);
        }
        let (mut explicit, mut implicit) = (x.clone(), x.clone());
        Rk4::new(nx).step(&mut system, &mut explicit, h);
        Rosenbrock::new(nx).step(&mut system, &mut implicit, h);
        same(next(nx), &explicit, 1e-12, "Runge-Kutta step");
        same(next(nx), &implicit, 1e-12, "Rosenbrock step");
        assert!(rest.is_empty());
    }
}

#[test]
fn a_driven_pendulum_says_the_same_in_c() {
    let mut machine = Machine::new(&pendulum(1.5, 0.8));
    machine
        .effect("viscous_friction", 0, &[("viscous", 0.3)])
        .actuator(0, &[("gain", 2.0), ("lag", 0.05), ("delay", 0.02)])
        .sensor(json!({"kind": "position", "joint": 0}), &[("gain", 1.1), ("offset", 0.4)]);
    let description = machine.build();
    let free: Vec<usize> = ["viscous_friction.viscous", "drive0.gain", "drive0.lag"]
        .iter()
        .map(|name| description.parameter_names.iter().position(|known| known == name).unwrap())
        .collect();
    agrees("pendulum", &description, &free);
}

#[test]
fn an_arm_of_seven_joints_says_the_same_in_c() {
    let mut machine = Machine::new(&arm7());
    machine
        .effect("coulomb_friction", 0, &[("coulomb", 0.4), ("transition_velocity", 0.3)])
        .effect("spring", 1, &[("stiffness", 2.0), ("rest", 0.3)])
        .actuator(0, &[("gain", 1.5), ("lag", 0.06)])
        .actuator(3, &[("gain", 0.7)]);
    let description = machine.build();
    agrees("arm", &description, &[]);
    let stiffness = description.parameter_names.iter().position(|name| name == "spring.stiffness").unwrap();
    agrees("free_arm", &description, &[stiffness]);
}

#[test]
fn pressures_that_are_searched_for_say_the_same_in_c() {
    for leakage in [0.0, 2e-12] {
        let mut servo = hydraulics::nominal();
        (servo.valve.frequency, servo.valve.damping, servo.valve.clearance) = (None, None, Some(2e-4));
        (servo.cylinder.internal_leakage, servo.cylinder.external_leakage) = (leakage, leakage);
        let description = with_pressures(&servo, "quasi_static", json!("constant")).build();
        let viscous = description.parameter_names.iter().position(|name| name == "viscous_friction.viscous").unwrap();
        agrees_at(&format!("quasi_static_{leakage}"), &description, &[viscous], |random| {
            let [place, speed, current] = [0.01, 0.1, 4e-3].map(|size| size * random.symmetric());
            [vec![MIDDLE + place, speed], vec![current]]
        });
    }
}

/// Reads a state and a step; prints the state after each of a thousand steps by both methods, each with what the step returned.
const STEPS: &str = r#"
#include "m.h"
#include <stdio.h>
int main(void)
{
    double x[m_NX], next[m_NX], u[1] = {0.0}, h, w[m_NW];
    int method, k, i, status;
    for (k = 0; k < m_NX; ++k) if (scanf("%lf", x + k) != 1) return 1;
    if (scanf("%lf", &h) != 1) return 1;
    for (method = 0; method < 2; ++method) {
        for (k = 0; k < m_NX; ++k) next[k] = x[k];
        for (k = 0; k < 1000; ++k) {
            if (method == 0) status = m_step_rk4(next, u, m_constants, h, w, next);
            else status = m_step_rosenbrock(next, u, m_constants, h, w, next);
            for (i = 0; i < m_NX; ++i) printf("%.17g\n", next[i]);
            printf("%d\n", status);
        }
    }
    return 0;
}
"#;

#[test]
fn bodies_tumble_in_c_as_in_the_core() {
    let Some(folder) = folder("tumbling") else { return };
    let content = balls::content();
    write(&balls::built(&content).unwrap(), &[], &folder);
    fs::write(folder.join("steps.c"), STEPS).unwrap();
    compile(&folder, &["steps.c", "m.c"], "steps", &["-std=c99"]);
    if Command::new("c++").arg("--version").output().is_ok() {
        compile(&folder, &["-x", "c++", "steps.c", "m.c"], "as_cpp", &["-std=c++11"]);
    }
    // The second begins at the singularity itself.
    for start in [balls::START, [0.2, std::f64::consts::FRAC_PI_2, -0.4, 0.5, 2.0, -1.0]] {
        let found = run(&folder, "steps", &[start.as_slice(), &[2e-3]].concat());
        let mut rows = found.chunks_exact(7);
        for method in [Method::Rk4, Method::Rosenbrock] {
            let mut over = false;
            let mut live = balls::live(balls::built(&content).unwrap(), &start, 2e-3, method).unwrap();
            for _ in 0..1000 {
                let row = rows.next().unwrap();
                live.step(&[]).unwrap();
                over |= live.state()[1].cos() < 0.1;
                same(&row[..6], live.state(), 1e-10, method.name());
                assert_eq!(row[6], 0.0);
            }
            assert!(over, "{} stays away from the singularity", method.name());
        }
    }
}

#[test]
fn names_that_c_does_not_take_are_refused() {
    let description = Machine::new(&pendulum(1.0, 1.0)).build();
    let mut names = Names { machine: "2 arms".to_owned(), states: vec![], inputs: vec![], outputs: vec![] };
    let refused = |names: &Names| files(&description, &description.parameters, &[], names).unwrap_err().to_string();
    assert!(refused(&names).contains("`2 arms` is no name for functions of C"));
    names.machine = "arms".to_owned();
    assert!(refused(&names).contains("0 names of states were given for 2"));
}
