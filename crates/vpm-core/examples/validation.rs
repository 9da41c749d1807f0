//! What only the core can show, as one JSON object for each row of the validation table.

#![expect(dead_code, reason = "it prints what the tests check")]

use std::process::ExitCode;

#[path = "../tests/all/validation/rows/mod.rs"]
mod rows;

/// What the rows are made with, as in the program of the tests.
#[path = "../tests/all/common"]
mod common {
    pub mod entries;
    pub mod places;
    pub mod sums;
    pub mod trees;
    pub mod two_link;
}

fn main() -> ExitCode {
    for (group, make) in rows::GROUPS {
        match make() {
            Ok(rows) => rows.iter().for_each(|row| println!("{}", row.json())),
            Err(error) => {
                eprintln!("{group}: {error}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}
