//! What only the core can show, as one JSON object for each row of the validation table.

use std::process::ExitCode;

#[path = "../tests/rows/mod.rs"]
mod rows;

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
