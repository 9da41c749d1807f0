//! Modules import downward only, and the recursive algorithms know nothing of each other.

use std::fs;
use std::io::Result;
use std::path::{Path, PathBuf};

/// The tree, lowest first, `beam` after `integrator` because `beam::witness` steps its motions by itself: each may import any before it.
const TREE: [&str; 15] = [
    "error",
    "scalar",
    "transmission",
    "algebra",
    "spatial",
    "mount",
    "joint",
    "line",
    "body",
    "ode",
    "integrator",
    "beam",
    "model",
    "data",
    "dynamics",
];
/// Parts that stand alone, each a rig of its own, and all that they may import besides themselves.
const ALONE: [(&str, &[&str]); 18] = [
    ("error", &[]),
    ("scalar", &[]),
    ("table", &["error"]),
    ("filter", &["error"]),
    ("narx", &["error", "scalar"]),
    ("realtime", &["error"]),
    ("graph", &["error", "scalar"]),
    ("delay", &["error", "scalar"]),
    ("ode", &["error", "scalar"]),
    ("integrator", &["error", "scalar", "algebra", "ode"]),
    ("effect", &["error", "scalar", "transmission::Ratio"]),
    (
        "actuator",
        &[
            "error",
            "scalar",
            "delay",
            "ode",
            "effect::Domain",
            "effect::CoulombFriction",
            "effect::Law",
            "effect::LoadDependentFriction",
            "effect::StribeckFriction",
            "effect::ViscousFriction",
        ],
    ),
    ("contact", &["error", "scalar", "spatial", "mount", "effect::Domain"]),
    ("bushing", &["error", "scalar", "spatial", "mount", "effect::Domain"]),
    ("closure", &["mount", "bushing::BushingEnd"]),
    ("ball", &["error", "scalar", "spatial"]),
    ("sensor", &["error", "scalar", "delay", "effect::Domain"]),
    ("controller", &["error", "scalar", "effect::Domain", "actuator::Saturation"]),
];
/// What puts the parts together, lowest first: each may import any part, any tree module and any before it.
const WHOLE: [&str; 16] = [
    "sensitivity",
    "system",
    "description",
    "statics",
    "motion",
    "simulate",
    "inverse",
    "batch",
    "evaluate",
    "linearize",
    "c_source",
    "live",
    "compiled",
    "prepared",
    "timing",
    "samples",
];
const WITNESSES: [&str; 5] = ["aba", "crba", "rnea", "virtual_work", "flexible"];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            sources(&path, found)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    Ok(())
}

/// Code without comments, one string per line.
fn code(path: &Path) -> Result<Vec<String>> {
    let text = fs::read_to_string(path)?;
    Ok(text.lines().map(|line| line.split("//").next().unwrap_or_default().to_owned()).collect())
}

/// Whether `module` may import `path`, both inside the crate; nothing for a module that no list knows.
fn allowed(module: &str, path: &str) -> Option<bool> {
    let within = |part: &str| path.strip_prefix(part).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"));
    let before = |list: &[&str], end: usize| list.iter().take(end).any(|part| within(part));
    if within(module) {
        return Some(true);
    }
    if let Some((_, parts)) = ALONE.iter().find(|(name, _)| *name == module) {
        return Some(before(parts, parts.len()));
    }
    if let Some(place) = TREE.iter().position(|name| *name == module) {
        return Some(before(&TREE, place));
    }
    let place = WHOLE.iter().position(|name| *name == module)?;
    Some(before(&WHOLE, place) || before(&TREE, TREE.len()) || ALONE.iter().any(|(name, _)| within(name)))
}

#[test]
fn modules_import_downward_only() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let (mut files, mut checked) = (Vec::new(), 0);
    sources(&root, &mut files)?;
    for file in files {
        let inside = file.strip_prefix(&root).unwrap_or(&file).with_extension("");
        let module = inside.iter().next().unwrap_or_default().to_string_lossy().into_owned();
        if module == "lib" {
            continue;
        }
        for import in code(&file)?.iter().flat_map(|line| line.split("crate::").skip(1)) {
            let path: String = import.chars().take_while(|&c| c.is_alphanumeric() || "_:".contains(c)).collect();
            let verdict = allowed(&module, &path);
            assert!(verdict.is_some(), "{} is in no layer: give `{module}` its place in this test", file.display());
            assert!(verdict == Some(true), "{} imports crate::{path}", file.display());
            checked += 1;
        }
    }
    assert!(checked > 60, "only {checked} imports found: the test has gone blind");
    Ok(())
}

#[test]
fn no_machine_needs_the_witnesses_of_beams() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let (mut files, mut inside) = (Vec::new(), 0);
    sources(&root, &mut files)?;
    for file in files {
        if file.starts_with(root.join("beam/witness")) {
            inside += 1;
            continue;
        }
        for line in code(&file)?.iter().filter(|line| line.contains("witness")) {
            assert_eq!(line, "pub mod witness;", "{} uses what only tests may use", file.display());
        }
    }
    assert!(inside > 5, "only {inside} files of witnesses found: the test has gone blind");
    Ok(())
}

#[test]
fn recursive_algorithms_do_not_call_each_other() -> Result<()> {
    for own in WITNESSES {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("src/dynamics/{own}.rs"));
        for line in code(&file)? {
            for other in WITNESSES.into_iter().filter(|other| *other != own) {
                assert!(!line.contains(other), "{own} mentions {other}: {line}");
            }
        }
    }
    Ok(())
}
