//! An axis as C holds it, and commands.

use std::env;
use std::ffi::{CStr, CString, c_char};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::ptr;

use vpm::{VpmSimulation, VpmStatus, vpm_close, vpm_message, vpm_open, vpm_step};

/// The compiled axis.
pub const AXIS: &str = include_str!("../data/axis.json");

/// A text of the library.
pub fn text(of: *const c_char) -> String {
    // SAFETY: the library gives zero-terminated texts.
    unsafe { CStr::from_ptr(of) }.to_str().unwrap().to_owned()
}

/// The axis, closed at the end.
pub struct Axis(pub *mut VpmSimulation);

impl Axis {
    pub fn open() -> Self {
        let path =
            CString::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/axis.json").to_str().unwrap()).unwrap();
        // SAFETY: a text, and no room for a message.
        let opened = unsafe { vpm_open(path.as_ptr(), ptr::null_mut(), 0) };
        assert!(!opened.is_null());
        Self(opened)
    }

    pub fn step(&self, input: f64, outputs: &mut [f64; 6]) -> VpmStatus {
        // SAFETY: one input and six outputs, as the test of the counts says.
        unsafe { vpm_step(self.0, &raw const input, outputs.as_mut_ptr()) }
    }

    pub fn message(&self) -> String {
        // SAFETY: an open simulation.
        text(unsafe { vpm_message(self.0) })
    }
}

impl Drop for Axis {
    fn drop(&mut self) {
        // SAFETY: opened by `open`, closed once.
        unsafe { vpm_close(self.0) };
    }
}

/// The folder that cargo puts the libraries in: tests run from there.
pub fn libraries() -> PathBuf {
    env::current_exe().unwrap().parent().unwrap().to_owned()
}

/// What a command printed.
pub fn run(command: &mut Command) -> String {
    let done = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(done.status.success(), "{command:?}: {}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}
