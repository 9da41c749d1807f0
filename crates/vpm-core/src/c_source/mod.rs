//! A machine as C99: rates, outputs, their exact derivatives and steps, for controllers and solvers without Python or Rust.
//!
//! The source needs `math.h` alone, takes all memory from its caller, and keeps nothing between calls. It has what CasADi's and
//! acados' external functions are called by.
//!
//! Tested: compiled as C and as C++ with all warnings as errors, against linearisations by dual numbers and steps of the integrators.

mod externals;
mod machine;

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use crate::ball;
use crate::description::Description;
use crate::error::{Error, Result};
use crate::graph::literal;
use crate::integrator::RODAS4P2;
use machine::{Balls, Derivatives, Machine, Pattern};

const HEADER: &str = include_str!("template.h");
const FUNCTIONS: &str = include_str!("template.c");
const BALLS: &str = include_str!("balls.c");

/// What a machine is called in C.
#[derive(Clone, Debug)]
pub struct Names {
    /// Begins every name of the source; an identifier of C.
    pub machine: String,
    /// Dotted names of the states.
    pub states: Vec<String>,
    /// Dotted names of the inputs.
    pub inputs: Vec<String>,
    /// Dotted names of the outputs.
    pub outputs: Vec<String>,
}

/// The texts of a machine's two files.
#[derive(Clone, Debug, PartialEq)]
pub struct Files {
    /// `NAME.h`.
    pub header: String,
    /// `NAME.c`.
    pub source: String,
}

/// The machine with the parameters `theta` in C; those at the places `free` are arguments of its functions, all others constants.
///
/// Delays of actuators and sensors pass their signals unchanged, as in [`crate::linearize::linearize`].
pub fn files(description: &Description, theta: &[f64], free: &[usize], names: &Names) -> Result<Files> {
    let name = names.machine.as_str();
    description
        .refuse_sampled("the machine has no rates in continuous time", "write it with an ideal drive in its place")?;
    description
        .refuse_loops("C source, whose steps would not close them again,", "compile the model without C source")?;
    description.check_values(theta)?;
    check(description, free, names)?;
    let machine = Machine::new(description, theta, free, name)?;
    let (declarations, externals) = externals::externals(&machine, name);
    let of = |what: &str| what.replace("NAME", name);
    let header = with_limits(&HEADER.replace("SIZES\n", &sizes(&machine)));
    let header = of(&header).replace("EXTERNALS\n", &declarations);
    let mut source = format!("#include \"{name}.h\"\n\n#include <math.h>\n#include <stddef.h>\n\n");
    let free_names: Vec<_> = free.iter().map(|&place| description.parameter_names[place].clone()).collect();
    for (what, list) in
        [("state", &names.states), ("input", &names.inputs), ("output", &names.outputs), ("parameter", &free_names)]
    {
        let list: Vec<_> = list.iter().map(|name| format!("{name:?}")).collect();
        table(&mut source, &format!("char *const {name}_{what}_names"), &list, "NULL");
    }
    let numbers = |values: &[f64]| values.iter().map(|&value| literal(value)).collect::<Vec<_>>();
    table(&mut source, &format!("double {name}_parameters"), &numbers(&machine.constants[..machine.np]), "0.0");
    table(&mut source, &format!("double {name}_constants"), &numbers(&machine.constants), "0.0");
    patterns(&mut source, &format!("{name}_rates"), &machine.rates);
    patterns(&mut source, &format!("{name}_outputs"), &machine.outputs);
    let mut called: Vec<&str> = Vec::new();
    for &text in machine.functions.iter().flat_map(|function| &function.called) {
        if !called.contains(&text) {
            called.push(text);
            source.push_str(text);
        }
    }
    machine.functions.iter().for_each(|function| source.push_str(&function.text));
    source.push_str(&of(&balls(&machine.balls)));
    source.push_str(&of(&functions(machine.np > 0, !machine.balls.angles.is_empty())));
    source.push('\n');
    source.push_str(&externals);
    Ok(Files { header, source })
}

fn check(description: &Description, free: &[usize], names: &Names) -> Result<()> {
    let name = &names.machine;
    let mut letters = name.chars();
    let begins = letters.next().is_some_and(|first| first.is_ascii_alphabetic());
    if !begins || !letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_') {
        return Err(Error::SourceName { name: name.clone() });
    }
    let lengths = [
        ("states", names.states.len(), description.n_states()),
        ("inputs", names.inputs.len(), description.n_inputs()),
        ("outputs", names.outputs.len(), description.n_outputs()),
    ];
    if let Some((what, found, expected)) = lengths.into_iter().find(|(_, found, expected)| found != expected) {
        let message = format!("{found} names of {what} were given for {expected}");
        return Err(Error::Description { message });
    }
    match free.iter().find(|&&place| place >= description.n_parameters()) {
        Some(place) => Err(Error::Description { message: format!("there is no parameter number {place}") }),
        None => Ok(()),
    }
}

fn sizes(machine: &Machine) -> String {
    let &Machine { nx, nu, ny, np, ref balls, .. } = machine;
    let [rates, outputs] = [&machine.rates, &machine.outputs].map(|of| of.patterns.each_ref().map(Pattern::len));
    let run = machine.work();
    // Where a step begins: its state, and the orientations there.
    let begin = if balls.angles.is_empty() { 0 } else { nx + 4 * balls.free };
    let step = nx * nx + 7 * nx + rates.iter().sum::<usize>();
    let sizes = [
        ("NX", nx),
        ("NU", nu),
        ("NY", ny),
        ("NP", np),
        ("NC", machine.constants.len()),
        ("NNZ_RATES_X", rates[0]),
        ("NNZ_RATES_U", rates[1]),
        ("NNZ_RATES_P", rates[2]),
        ("NNZ_OUTPUTS_X", outputs[0]),
        ("NNZ_OUTPUTS_U", outputs[1]),
        ("NNZ_OUTPUTS_P", outputs[2]),
        ("NW_RUN", run),
        ("NW", run + begin + step.max(3 * nx).max(1)),
        ("NW_EXTERNAL", run + externals::work(machine)),
        ("LONGEST", nx.max(nu).max(np).max(1)),
    ];
    let lines: Vec<_> = sizes.iter().map(|(what, value)| format!("    NAME_{what} = {value}")).collect();
    lines.join(",\n") + "\n"
}

/// A table; C knows none without entries.
fn table(text: &mut String, declaration: &str, entries: &[String], none: &str) {
    let entries = if entries.is_empty() { none.to_owned() } else { entries.join(",\n    ") };
    let _ = write!(text, "const {declaration}[] = {{\n    {entries}\n}};\n\n");
}

fn patterns(text: &mut String, name: &str, derivatives: &Derivatives) {
    for (kind, pattern) in ["x", "u", "p"].into_iter().zip(&derivatives.patterns) {
        let mut numbers = vec![pattern.rows, pattern.columns];
        numbers
            .extend((0..=pattern.columns).map(|column| pattern.places.iter().filter(|place| place.1 < column).count()));
        numbers.extend(pattern.places.iter().map(|place| place.0));
        let numbers: Vec<_> = numbers.iter().map(usize::to_string).collect();
        let _ = write!(text, "const casadi_int {name}_by_{kind}[] = {{{}}};\n\n", numbers.join(", "));
    }
}

/// C source with limits of ball joints in place of their names.
fn with_limits(text: &str) -> String {
    let limits = [
        ("LEAST_COSINE", ball::LEAST),
        ("SHOWN_COSINE", ball::SHOWN),
        ("STEPS_AWAY", ball::STEPS_AWAY),
        ("LARGEST_TURN", ball::LARGEST_TURN),
        ("HALF_TURN", PI),
        ("FULL_TURN", TAU),
    ];
    limits.into_iter().fold(text.to_owned(), |text, (name, value)| text.replace(name, &literal(value)))
}

/// C source for ball joints in steps; nothing where there are none.
fn balls(balls: &Balls) -> String {
    if balls.angles.is_empty() {
        return String::new();
    }
    let (mut first, mut places) = (vec![0], Vec::new());
    for coordinates in balls.angles.iter().flatten() {
        places.extend_from_slice(coordinates);
        first.push(places.len());
    }
    let list = |numbers: &[usize]| numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    // C knows no table without entries.
    let upright = vec!["1.0, 0.0, 0.0, 0.0"; balls.free.max(1)].join(", ");
    with_limits(BALLS)
        .replace("= COORDINATES", &format!("= {}", balls.coordinates))
        .replace("= BALLS", &format!("= {}", balls.angles.len()))
        .replace("= FREE_BALLS", &format!("= {}", balls.free))
        .replace("{FIRST}", &format!("{{{}}}", list(&first)))
        .replace("{PLACES}", &format!("{{{}}}", list(&places)))
        .replace("{UPRIGHT}", &format!("{{{upright}}}"))
}

/// C source of the functions that are the same for every machine. `turning` ball joints and `parameters` add to them.
fn functions(parameters: bool, turning: bool) -> String {
    let rows = |table: &[[f64; 6]; 6]| {
        let rows: Vec<_> = table.iter().map(|row| format!("{{{}}}", row.map(literal).join(", "))).collect();
        format!("{{\n        {}}}", rows.join(",\n        "))
    };
    let mut text = FUNCTIONS
        .replace("GAMMA", &literal(RODAS4P2.gamma))
        .replace("DISTANCE", &rows(&RODAS4P2.distance))
        .replace("COUPLING", &rows(&RODAS4P2.coupling));
    let of_balls = |own: &str, none: &str| if turning { own.to_owned() } else { none.to_owned() };
    for place in ["x", "NAME_given(arg[0])"] {
        text = text.replace(&format!("STATUS({place})"), &of_balls(&format!("NAME_near({place}, 0, 0.0)"), "NAME_OK"));
    }
    text = text.replace("AT_ANGLES ", &of_balls("NAME_upright, ", "")).replace("IN_STEP ", &of_balls("q, ", ""));
    for place in ["sum + NAME_NX", "dx_p + NAME_NNZ_RATES_P"] {
        let own = format!("double *begin = {place}, *q = begin + NAME_NX;\n    NAME_enter(x, begin, q);");
        text = text.replace(&format!("BEGIN({place})"), &of_balls(&own, "const double *begin = x;"));
    }
    for result in ["sum", "stage"] {
        let copied = format!("for (k = 0; k < NAME_NX; ++k) next[k] = {result}[k];\n    return NAME_OK;");
        let own = format!("return NAME_arrive(x, q, h, {result}, next);");
        text = text.replace(&format!("END({result})"), &of_balls(&own, &copied));
    }
    for place in 2..5 {
        let given = |list: &str| if parameters { format!("{list}[{place}]") } else { "NULL".to_owned() };
        text = text.replace(&format!("PARAMETERS({place})"), &given("arg"));
        text = text.replace(&format!("RESULT({place})"), &given("res"));
    }
    text
}
