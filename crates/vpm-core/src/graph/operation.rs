//! One operation of a graph.

use crate::scalar::{Scalar, Search};

/// Place of a number in a graph or a program.
pub type Node = u32;

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Function {
    /// -x.
    Negative,
    /// Square root.
    Root,
    /// e^x.
    Exp,
    /// e^x - 1.
    ExpM1,
    /// Natural logarithm.
    Ln,
    /// Sine.
    Sine,
    /// Cosine.
    Cosine,
    /// Hyperbolic tangent.
    Tanh,
    /// Arc tangent.
    Atan,
    /// x itself, which derivatives take for a constant.
    Frozen,
}

/// One operation of a graph: how a number is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    /// A constant, by the bits of its `f64`, so that equal constants are one.
    Constant(u64),
    /// Input number k.
    Input(u32),
    /// a + b.
    Add(Node, Node),
    /// a - b.
    Subtract(Node, Node),
    /// a b.
    Multiply(Node, Node),
    /// a / b.
    Divide(Node, Node),
    /// A function of a number.
    Apply(Function, Node),
    /// `[a, b, yes, no]`: yes where a < b, else no.
    Select([Node; 4]),
    /// What the search of a call finds, by its place among the calls that stand beside the operations.
    Search(u32),
}

/// A search with the numbers that it is called with.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Call {
    /// What is looked for.
    pub search: &'static Search,
    /// With which numbers, in its order.
    pub arguments: Box<[Node]>,
}

impl Call {
    /// Result of a search operation, where `value` gives the values of its arguments.
    #[inline]
    pub fn value(&self, value: impl Fn(Node) -> f64) -> f64 {
        self.search.value(self.arguments.iter().map(|&argument| value(argument)))
    }
}

impl Function {
    /// Value at `x` of the function in an operation.
    #[inline]
    pub fn of<S: Scalar>(self, x: S) -> S {
        match self {
            Self::Negative => -x,
            Self::Root => x.sqrt(),
            Self::Exp => x.exp(),
            Self::ExpM1 => x.exp_m1(),
            Self::Ln => x.ln(),
            Self::Sine => x.sin(),
            Self::Cosine => x.cos(),
            Self::Tanh => x.tanh(),
            Self::Atan => x.atan(),
            Self::Frozen => x.frozen(),
        }
    }
}

impl Operation {
    /// Calls `visit` with each argument of an operation; `calls` are those beside it.
    #[inline]
    pub fn arguments(&self, calls: &[Call], mut visit: impl FnMut(Node)) {
        match *self {
            Self::Constant(_) | Self::Input(_) => {}
            Self::Apply(_, a) => visit(a),
            Self::Add(a, b) | Self::Subtract(a, b) | Self::Multiply(a, b) | Self::Divide(a, b) => {
                visit(a);
                visit(b);
            }
            Self::Select(nodes) => nodes.into_iter().for_each(visit),
            Self::Search(call) => calls[call as usize].arguments.iter().copied().for_each(visit),
        }
    }

    /// The same operation with its arguments renamed; its call, one of `calls`, is appended to those beside the new one.
    #[inline]
    #[must_use]
    pub fn renamed(self, (calls, beside): (&[Call], &mut Vec<Call>), mut name: impl FnMut(Node) -> Node) -> Self {
        match self {
            Self::Constant(_) | Self::Input(_) => self,
            Self::Apply(function, a) => Self::Apply(function, name(a)),
            Self::Add(a, b) => Self::Add(name(a), name(b)),
            Self::Subtract(a, b) => Self::Subtract(name(a), name(b)),
            Self::Multiply(a, b) => Self::Multiply(name(a), name(b)),
            Self::Divide(a, b) => Self::Divide(name(a), name(b)),
            Self::Select(nodes) => Self::Select(nodes.map(name)),
            Self::Search(call) => {
                let Call { search, arguments } = &calls[call as usize];
                beside.push(Call { search, arguments: arguments.iter().map(|&argument| name(argument)).collect() });
                Self::Search(beside.len() as u32 - 1)
            }
        }
    }

    /// The value of the operation, where `value` gives those of its arguments and `input` those of inputs.
    ///
    /// `calls` are the searches that stand beside it.
    #[inline]
    pub fn value(&self, calls: &[Call], value: impl Fn(Node) -> f64, input: impl Fn(u32) -> f64) -> f64 {
        match *self {
            Self::Constant(bits) => f64::from_bits(bits),
            Self::Input(number) => input(number),
            Self::Add(a, b) => value(a) + value(b),
            Self::Subtract(a, b) => value(a) - value(b),
            Self::Multiply(a, b) => value(a) * value(b),
            Self::Divide(a, b) => value(a) / value(b),
            Self::Apply(function, a) => function.of(value(a)),
            Self::Select([a, b, yes, no]) => value(if value(a) < value(b) { yes } else { no }),
            Self::Search(call) => calls[call as usize].value(value),
        }
    }
}
