//! The example in C compiles without a warning against the header, links with the library, and controls the axis.

use std::env;
use std::path::Path;
use std::process::Command;

use crate::support::{libraries, run};

#[test]
fn the_example_in_c_controls_the_axis() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (source, binary) = (
        root.join("../../examples/c/position_loop.c"),
        env::temp_dir().join(format!("vpm_position_loop_{}", std::process::id())),
    );
    for (compiler, standard) in [("cc", "-std=c99"), ("c++", "-xc++")] {
        run(Command::new(compiler)
            .args([standard, "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I"])
            .arg(root.join("include"))
            .arg(&source)
            .args(["-xnone", "-o"])
            .arg(&binary)
            .arg(libraries().join("libvpm.a"))
            .args(["-lpthread", "-ldl", "-lm"]));
        let said = run(Command::new(&binary).arg(root.join("tests/data/axis.json")));
        // The position after one second, where the loop has brought the axis to its reference of 0.1 m.
        let last = said.lines().last().unwrap();
        let position: f64 = last.split_whitespace().nth(3).unwrap().parse().unwrap();
        assert!((position - 0.1).abs() < 2e-3, "{said}");
    }
}
