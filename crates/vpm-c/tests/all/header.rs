//! The header is what the functions are.

use std::path::Path;

/// Set it to write the header anew.
const WRITE: &str = "VPM_WRITE_HEADER";

#[test]
fn the_header_tells_what_the_library_has() {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut text = Vec::new();
    cbindgen::generate(crate_folder).expect("the sources can be read").write(&mut text);
    let text = String::from_utf8(text).expect("cbindgen writes UTF-8");
    let path = crate_folder.join("include/vpm.h");
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(&path, &text).expect("the folder can be written");
    }
    let header = std::fs::read_to_string(&path).expect("the header is there");
    assert_eq!(
        header, text,
        "include/vpm.h is old; write it anew with {WRITE}=1 cargo test -p vpm-c --test all header"
    );
}
