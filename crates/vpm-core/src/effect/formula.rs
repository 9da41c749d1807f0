//! A law that a user wrote: an expression in the coordinate, the velocity and some parameters.

use serde::Deserialize;

use super::{Domain, Law};
use crate::scalar::{Dual, Scalar};

/// Most instructions of a formula.
const LENGTH: usize = 32;
/// Most numbers that wait for their operation at a time.
const DEPTH: usize = 8;
/// Most parameters, and most constants.
const NUMBERS: usize = 6;
/// Below this velocity the resistance is the slope of the effort instead of its chord, m/s or rad/s.
const SLOW: f64 = 1e-8;

/// One instruction: put a number on the stack, or replace the last one or two by what an operation makes of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Instruction {
    /// The coordinate, m or rad.
    Position,
    /// The velocity, m/s or rad/s.
    Velocity,
    /// A parameter.
    Parameter(u8),
    /// A constant.
    Constant(u8),
    /// Sum.
    Add,
    /// Difference.
    Subtract,
    /// Product.
    Multiply,
    /// Quotient.
    Divide,
    /// Whole power.
    Power(i8),
    /// Change of sign.
    Negate,
    /// Absolute value.
    Abs,
    /// Square root.
    Sqrt,
    /// Exponential.
    Exp,
    /// Hyperbolic tangent.
    Tanh,
    /// Sine of an angle in rad.
    Sin,
    /// Cosine of an angle in rad.
    Cos,
}

impl Instruction {
    /// Number of values that a formula's instruction takes off the stack; it puts one on.
    fn takes(self) -> usize {
        match self {
            Self::Position | Self::Velocity | Self::Parameter(_) | Self::Constant(_) => 0,
            Self::Add | Self::Subtract | Self::Multiply | Self::Divide => 2,
            _ => 1,
        }
    }
}

/// A formula as it is read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text<P> {
    program: Vec<Instruction>,
    constants: Vec<f64>,
    parameters: Vec<P>,
}

/// An effort by a program in postfix order, of fixed size so that it is evaluated without allocation.
///
/// Law: tau = what the program leaves on the stack, in N or N m. It counts as a law without potential.
/// Source: Dijkstra 1961, "Algol 60 translation", section 3 (expressions in postfix order on a stack). Checked: lengths, depth of the
/// stack and places of numbers when it is read; values and derivatives against the expression.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Text<P>")]
pub struct Formula<P> {
    program: [Instruction; LENGTH],
    length: u8,
    constants: [f64; NUMBERS],
    parameters: [Option<P>; NUMBERS],
}

impl<P> TryFrom<Text<P>> for Formula<P> {
    type Error = String;

    fn try_from(text: Text<P>) -> Result<Self, String> {
        let Text { program, constants, parameters } = text;
        let sizes = [("instructions", program.len(), LENGTH), ("constants", constants.len(), NUMBERS)];
        for (what, count, most) in [sizes[0], sizes[1], ("parameters", parameters.len(), NUMBERS)] {
            if count > most {
                return Err(format!("it has {count} {what}, but {most} are the most; write it shorter"));
            }
        }
        check(&program, constants.len(), parameters.len())?;
        let length = program.len();
        let mut padded = [Instruction::Position; LENGTH];
        padded[..length].copy_from_slice(&program);
        let mut numbers = [0.0; NUMBERS];
        numbers[..constants.len()].copy_from_slice(&constants);
        let mut places = parameters.into_iter();
        let parameters = std::array::from_fn(|_| places.next());
        Ok(Self { program: padded, length: length as u8, constants: numbers, parameters })
    }
}

/// Checks whether a formula's program finds every number it asks for and leaves one.
fn check(program: &[Instruction], constants: usize, parameters: usize) -> Result<(), String> {
    let mut depth = 0;
    for instruction in program {
        let missing = match *instruction {
            Instruction::Constant(place) => usize::from(place) >= constants,
            Instruction::Parameter(place) => usize::from(place) >= parameters,
            _ => false,
        };
        if missing || depth < instruction.takes() {
            return Err(format!("its instruction {instruction:?} finds no number; correct the program"));
        }
        depth += 1 - instruction.takes().min(1);
        depth -= instruction.takes().saturating_sub(1);
        if depth > DEPTH {
            return Err(format!("more than {DEPTH} of its numbers wait for an operation; use fewer brackets"));
        }
    }
    if depth == 1 { Ok(()) } else { Err(format!("it leaves {depth} numbers instead of one; correct the program")) }
}

impl<P> Formula<P> {
    /// Formula over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Formula<T> {
        let parameters = std::array::from_fn(|place| self.parameters[place].as_ref().map(&mut *f));
        Formula { program: self.program, length: self.length, constants: self.constants, parameters }
    }

    /// Parameters of a formula; their ranges are those of the one who wrote it.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        self.parameters.iter().flatten().map(|parameter| (parameter, Domain::Any)).collect()
    }
}

impl<S: Scalar> Law<S> for Formula<S> {
    fn effort(&self, q: S, v: S) -> S {
        let (mut stack, mut top) = ([S::zero(); DEPTH], 0);
        for instruction in &self.program[..usize::from(self.length)] {
            let number = match *instruction {
                Instruction::Position => q,
                Instruction::Velocity => v,
                Instruction::Parameter(place) => self.parameters[usize::from(place)].unwrap_or_default(),
                Instruction::Constant(place) => S::from_f64(self.constants[usize::from(place)]),
                operation => {
                    top -= operation.takes();
                    result(operation, stack[top], stack[(top + 1).min(DEPTH - 1)])
                }
            };
            stack[top] = number;
            top += 1;
        }
        stack[0]
    }

    #[inline]
    fn effort_at_rest(&self, q: S) -> S {
        self.effort(q, S::zero())
    }

    fn resistance(&self, q: S, v: S) -> S {
        let slope = || {
            let law = self.map(&mut |&parameter| Dual::<S, 1>::constant(parameter));
            -law.effort(Dual::constant(q), Dual::variable(v, 0)).gradient[0]
        };
        let chord = || (self.effort_at_rest(q) - self.effort(q, v)) / v;
        S::from_f64(SLOW).if_less(v.abs(), chord, slope)
    }
}

/// Result of a formula's operation on one number, or on two.
#[inline]
fn result<S: Scalar>(operation: Instruction, first: S, second: S) -> S {
    match operation {
        Instruction::Add => first + second,
        Instruction::Subtract => first - second,
        Instruction::Multiply => first * second,
        Instruction::Divide => first / second,
        Instruction::Power(exponent) => first.powi(i32::from(exponent)),
        Instruction::Negate => -first,
        Instruction::Abs => first.abs(),
        Instruction::Sqrt => first.sqrt(),
        Instruction::Exp => first.exp(),
        Instruction::Tanh => first.tanh(),
        Instruction::Sin => first.sin(),
        Instruction::Cos => first.cos(),
        Instruction::Position | Instruction::Velocity | Instruction::Parameter(_) | Instruction::Constant(_) => first,
    }
}
