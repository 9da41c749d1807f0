//! The functions that CasADi and acados call: what they tell of their arguments.
//!
//! Source: CasADi user guide, section "Using external functions"; Jacobians as `jac_F` with the inputs of F, then its results (which it
//! does not need), and one matrix for each pair of a result and an input. acados, interface `external_function_casadi`.

use std::fmt::Write;

use super::machine::Machine;

/// An argument or a result: its name, and the table of its pattern.
type Entry = (String, String);

/// A function as CasADi sees it.
struct External {
    name: String,
    inputs: Vec<Entry>,
    outputs: Vec<Entry>,
}

/// External functions for CasADi and acados: declarations for the header and definitions for the source.
pub(super) fn externals(machine: &Machine, name: &str) -> (String, String) {
    let (mut header, mut source) = (String::new(), tables(machine, name));
    for external in all(machine, name) {
        external.write(&mut header, &mut source, name);
    }
    (header, source)
}

/// Working memory of the external functions beside that of a run. It is for prepared constants and results that nobody
/// asks for.
pub(super) fn work(machine: &Machine) -> usize {
    let of =
        |derivatives: &super::machine::Derivatives| derivatives.patterns.iter().map(|one| one.len()).sum::<usize>();
    let (rates, outputs) = (machine.nx + of(&machine.rates), machine.ny + of(&machine.outputs));
    machine.constants.len() + rates.max(outputs)
}

fn all(machine: &Machine, name: &str) -> Vec<External> {
    let table = |what: &str| format!("{name}_pattern_{what}");
    let entry = |what: &str| (what.to_owned(), table(what));
    let with_p = |mut inputs: Vec<Entry>| {
        inputs.extend((machine.np > 0).then(|| entry("p")));
        inputs
    };
    let kinds = if machine.np > 0 { ["x", "u", "p"].as_slice() } else { ["x", "u"].as_slice() };
    let pair = |function: &str, result: &str| {
        let inputs = with_p(vec![entry("x"), entry("u")]);
        let mut of_jacobian = inputs.clone();
        of_jacobian.push((format!("out_{result}"), table(&format!("no_{result}"))));
        let blocks = kinds.iter().map(|kind| (format!("jac_{result}_{kind}"), format!("{name}_{function}_by_{kind}")));
        [
            External { name: format!("{name}_{function}"), inputs, outputs: vec![entry(result)] },
            External { name: format!("jac_{name}_{function}"), inputs: of_jacobian, outputs: blocks.collect() },
        ]
    };
    let mut all: Vec<_> = pair("rates", "dx").into_iter().chain(pair("outputs", "y")).collect();
    let named = |name: &str, of: &str| (name.to_owned(), table(of));
    all.push(External {
        name: format!("{name}_expl_vde_forw"),
        inputs: with_p(vec![entry("x"), named("Sx", "xx"), named("Su", "xu"), entry("u")]),
        outputs: vec![entry("dx"), named("dSx", "xx"), named("dSu", "xu")],
    });
    all.push(External {
        name: format!("{name}_expl_vde_adj"),
        inputs: with_p(vec![entry("x"), named("lambda", "x"), entry("u")]),
        outputs: vec![named("adjoint", "xu_x")],
    });
    all
}

/// Patterns for the external functions: of full vectors and matrices, and of results without a Jacobian.
fn tables(machine: &Machine, name: &str) -> String {
    let &Machine { nx, nu, ny, np, .. } = machine;
    let full = [
        ("x", nx, 1),
        ("u", nu, 1),
        ("p", np, 1),
        ("dx", nx, 1),
        ("y", ny, 1),
        ("xx", nx, nx),
        ("xu", nx, nu),
        ("xu_x", nx + nu, 1),
    ];
    let mut text = String::new();
    for (what, rows, columns) in full {
        if what != "p" || np > 0 {
            let _ = writeln!(text, "static const casadi_int {name}_pattern_{what}[3] = {{{rows}, {columns}, 1}};");
        }
    }
    for (what, rows) in [("no_dx", nx), ("no_y", ny)] {
        let _ = writeln!(text, "static const casadi_int {name}_pattern_{what}[4] = {{{rows}, 1, 0, 0}};");
    }
    text.push('\n');
    text
}

impl External {
    fn write(&self, header: &mut String, source: &mut String, prefix: &str) {
        let Self { name, inputs, outputs } = self;
        let main =
            format!("int {name}(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)");
        let _ = writeln!(header, "{prefix}_EXPORT {main};");
        let mut add = |signature: String, body: String| {
            let _ = writeln!(header, "{prefix}_EXPORT {signature};");
            let _ = write!(source, "{signature}\n{{\n{body}}}\n\n");
        };
        for (which, list) in [("in", inputs), ("out", outputs)] {
            let count = list.len();
            add(format!("casadi_int {name}_n_{which}(void)"), format!("    return {count};\n"));
            let names: Vec<_> = list.iter().map(|(name, _)| format!("\"{name}\"")).collect();
            let names = format!("    static const char *const names[{count}] = {{{}}};\n", names.join(", "));
            let within = format!("i >= 0 && i < {count}");
            add(
                format!("const char *{name}_name_{which}(casadi_int i)"),
                format!("{names}    return {within} ? names[i] : NULL;\n"),
            );
            let patterns: Vec<_> = list.iter().map(|(_, pattern)| pattern.as_str()).collect();
            let patterns =
                format!("    static const casadi_int *const patterns[{count}] = {{{}}};\n", patterns.join(", "));
            add(
                format!("const casadi_int *{name}_sparsity_{which}(casadi_int i)"),
                format!("{patterns}    return {within} ? patterns[i] : NULL;\n"),
            );
        }
        let body = format!(
            "    if (sz_arg != NULL) *sz_arg = {};\n    if (sz_res != NULL) *sz_res = {};\n    if (sz_iw != NULL) *sz_iw = 0;\n    \
             if (sz_w != NULL) *sz_w = {prefix}_NW_EXTERNAL;\n    return 0;\n",
            inputs.len(),
            outputs.len()
        );
        add(
            format!("int {name}_work(casadi_int *sz_arg, casadi_int *sz_res, casadi_int *sz_iw, casadi_int *sz_w)"),
            body,
        );
        header.push('\n');
    }
}
