//! One recursion on an arm of seven joints, a given number of times: `recursions rnea|crba|aba COUNT`.
//!
//! For tools that count instructions: the difference of two counts is what the calls cost, without the set-up.

use std::hint::black_box;
use std::process::ExitCode;

use vpm_core::data::Data;
use vpm_core::dynamics::{aba, crba, rnea};
use vpm_core::error::Result;
use vpm_core::samples::{Random, arm7};

fn numbers(random: &mut Random) -> [f64; 7] {
    std::array::from_fn(|_| random.symmetric())
}

fn repeat(algorithm: &str, count: usize) -> Result<f64> {
    let model = arm7().model::<f64>()?;
    let (mut data, mut random) = (Data::new(&model), Random::new(7));
    let (q, v, a) = (numbers(&mut random), numbers(&mut random), numbers(&mut random));
    let mut sum = 0.0;
    for _ in 0..count {
        let (q, v, a) = (black_box(&q), black_box(&v), black_box(&a));
        let result = match algorithm {
            "rnea" => rnea(&model, &mut data, q, v, a),
            "crba" => crba(&model, &mut data, q),
            _ => aba(&model, &mut data, q, v, a),
        };
        sum += black_box(result)[0];
    }
    Ok(sum)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [algorithm, count] = &arguments[..] else {
        eprintln!("two arguments are needed, for example: recursions rnea 1000");
        return ExitCode::FAILURE;
    };
    match (["rnea", "crba", "aba"].contains(&algorithm.as_str()), count.parse()) {
        (true, Ok(count)) => match repeat(algorithm, count) {
            Ok(sum) => {
                println!("{sum}");
                ExitCode::SUCCESS
            }
            Err(error) => {
                eprintln!("{error}");
                ExitCode::FAILURE
            }
        },
        _ => {
            eprintln!("`{algorithm} {count}` is not rnea, crba or aba with a whole number; correct it");
            ExitCode::FAILURE
        }
    }
}
