//! NARX models.

mod maxwell;
mod polynomial;
