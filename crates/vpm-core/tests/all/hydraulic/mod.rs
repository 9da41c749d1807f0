//! Servo-cylinders and their supplies.

mod balance;
mod machine;
mod quasi_static;
mod reduced;
mod servo_cylinder;
mod stiff;
mod supply;
