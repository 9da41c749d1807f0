//! A compiled model is refused, or steps with finite outputs.
#![no_main]

mod json;

use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use vpm_core::compiled::Compiled;

/// More are no mistake, but take their time.
const SUBSTEPS: usize = 100;

fuzz_mutator!(|data: &mut [u8], size: usize, most: usize, seed: u32| { json::mutate(data, size, most, seed) });

fuzz_target!(|text: &str| {
    json::limited(|| {
        let Ok(compiled) = Compiled::parse(text) else { return };
        if compiled.stepping.substeps > SUBSTEPS {
            return;
        }
        let Ok(mut live) = compiled.live() else { return };
        for command in [0.0, 1.0, -1e6] {
            let inputs = vec![command; compiled.inputs.len()];
            if let Ok(outputs) = live.step(&inputs) {
                assert!(outputs.iter().all(|value| value.is_finite()), "{outputs:?}");
            }
        }
    });
});
