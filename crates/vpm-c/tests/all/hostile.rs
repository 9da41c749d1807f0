//! Compiled models that somebody has damaged: each is refused with a sentence or steps, and none stops the program.

use std::env;
use std::ffi::{CString, c_char};

use vpm::{VpmStatus, vpm_close, vpm_input_count, vpm_message, vpm_open_text, vpm_output_count, vpm_step};

use crate::support::{AXIS, text};

/// Numbers and texts that stand in the place of others.
const HOSTILE: [&str; 18] = [
    "0",
    "-1",
    "1",
    "7",
    "-0.0",
    "1e-300",
    "1e155",
    "1e308",
    "-1e308",
    "1e400",
    "18446744073709551615",
    "1000000",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"axis\"",
];

/// Random numbers that are the same everywhere (Marsaglia's xorshift).
struct Dice(u64);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % count as u64) as usize
    }
}

/// The axis with one to three lines changed: each line of the file holds one value, key or bracket.
fn damaged(dice: &mut Dice) -> String {
    let mut lines: Vec<String> = AXIS.lines().map(str::to_owned).collect();
    for _ in 0..=dice.below(3) {
        let at = dice.below(lines.len());
        match dice.below(4) {
            0 => drop(lines.remove(at)),
            1 => lines.insert(at, lines[dice.below(lines.len())].clone()),
            _ => {
                let line = &lines[at];
                let value = HOSTILE[dice.below(HOSTILE.len())];
                let comma = if line.ends_with(',') { "," } else { "" };
                let key = line.find("\": ").map_or("", |end| &line[..end + 3]);
                lines[at] = format!("{key}{value}{comma}");
            }
        }
    }
    lines.join("\n")
}

/// Opens a text and steps thrice; the sentence of a refusal, or of a failure.
fn tried(model: &str) -> String {
    let (content, mut message) = (CString::new(model).unwrap(), [1 as c_char; 400]);
    // SAFETY: a text, and room for the message.
    let opened = unsafe { vpm_open_text(content.as_ptr(), message.as_mut_ptr(), message.len()) };
    if opened.is_null() {
        return text(message.as_ptr());
    }
    // SAFETY: an open simulation, closed once; as many places as there are inputs and outputs.
    unsafe {
        let inputs = vec![1e-3; vpm_input_count(opened)];
        let mut outputs = vec![0.0; vpm_output_count(opened)];
        let mut told = String::new();
        for _ in 0..3 {
            match vpm_step(opened, inputs.as_ptr(), outputs.as_mut_ptr()) {
                VpmStatus::VpmOk => assert!(outputs.iter().all(|value| value.is_finite()), "{outputs:?} of {model}"),
                _ => told = text(vpm_message(opened)),
            }
        }
        vpm_close(opened);
        told
    }
}

/// Processor time of this thread, s: by the clock, a case takes as long as other work on the machine makes it.
#[cfg(target_os = "linux")]
fn spent() -> i64 {
    rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime).tv_sec
}

/// Elsewhere nobody looks.
#[cfg(not(target_os = "linux"))]
fn spent() -> i64 {
    0
}

#[test]
fn damaged_files_are_refused_or_step() {
    let cases = env::var("VPM_CASES").map_or(600, |count| count.parse().unwrap());
    let (mut dice, mut refused) = (Dice(0x9E37_79B9_7F4A_7C15), 0);
    for case in 0..cases {
        let model = damaged(&mut dice);
        let begin = spent();
        let told = tried(&model);
        assert!(!told.contains("failed inside"), "case {case}: {told}\n{model}");
        assert!(spent() - begin < 10, "case {case} takes {} s\n{model}", spent() - begin);
        refused += usize::from(!told.is_empty());
    }
    assert!(cases / 4 < refused && refused < cases, "{refused} of {cases} were refused");
}

#[test]
fn steps_and_sizes_have_a_limit() {
    let many = AXIS.replace("\"substeps\": 1", "\"substeps\": 18446744073709551615");
    assert!(tried(&many).contains("substeps must be at most 1000000"), "{}", tried(&many));
}

#[cfg(target_os = "linux")]
#[test]
fn what_is_no_file_is_not_read() {
    let mut message = [1 as c_char; 400];
    // SAFETY: a text, and room for the message.
    assert!(unsafe { vpm::vpm_open(c"/dev/zero".as_ptr(), message.as_mut_ptr(), message.len()) }.is_null());
    assert!(text(message.as_ptr()).contains("it is no ordinary file"), "{}", text(message.as_ptr()));
}
