//! A description of a machine is refused, or is a machine whose answers are numbers.
#![no_main]

mod json;

use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use vpm_core::description::Description;
use vpm_core::evaluate::{energy, equilibrium, mass_matrix, natural_frequencies};

fuzz_mutator!(|data: &mut [u8], size: usize, most: usize, seed: u32| { json::mutate(data, size, most, seed) });

fuzz_target!(|text: &str| {
    json::limited(|| {
        let Ok(description) = Description::from_json(text) else { return };
        let (theta, rest) = (&description.parameters, vec![0.0; description.n_coordinates()]);
        let found = [
            mass_matrix(&description, theta, &rest),
            energy(&description, theta, &rest, &rest).map(|(kinetic, potential)| vec![kinetic, potential]),
            equilibrium(&description, theta, &rest[..description.n_joints()]).map(|(one, other)| [one, other].concat()),
            natural_frequencies(&description, theta, &rest[..description.n_joints()]),
        ];
        for numbers in found.into_iter().flatten() {
            assert!(!numbers.iter().any(|number| number.is_nan()), "{numbers:?}");
        }
    });
});
