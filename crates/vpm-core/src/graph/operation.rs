//! One operation of a graph.

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
    /// x itself, which derivatives take for a constant. No program contains it.
    Frozen,
}

/// What makes a number.
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
}

impl Function {
    /// Its value.
    #[inline]
    pub fn value(self, x: f64) -> f64 {
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
            Self::Frozen => x,
        }
    }
}

impl Operation {
    /// Calls `visit` with each number that it is made of.
    #[inline]
    pub fn arguments(&self, mut visit: impl FnMut(Node)) {
        match *self {
            Self::Constant(_) | Self::Input(_) => {}
            Self::Apply(_, a) => visit(a),
            Self::Add(a, b) | Self::Subtract(a, b) | Self::Multiply(a, b) | Self::Divide(a, b) => {
                visit(a);
                visit(b);
            }
            Self::Select(nodes) => nodes.into_iter().for_each(visit),
        }
    }

    /// The same operation with its arguments renamed.
    #[inline]
    #[must_use]
    pub fn renamed(self, mut name: impl FnMut(Node) -> Node) -> Self {
        match self {
            Self::Constant(_) | Self::Input(_) => self,
            Self::Apply(function, a) => Self::Apply(function, name(a)),
            Self::Add(a, b) => Self::Add(name(a), name(b)),
            Self::Subtract(a, b) => Self::Subtract(name(a), name(b)),
            Self::Multiply(a, b) => Self::Multiply(name(a), name(b)),
            Self::Divide(a, b) => Self::Divide(name(a), name(b)),
            Self::Select(nodes) => Self::Select(nodes.map(name)),
        }
    }

    /// Its value, where `value` tells those of its arguments and `input` those of inputs.
    #[inline]
    pub fn value(&self, value: impl Fn(Node) -> f64, input: impl Fn(u32) -> f64) -> f64 {
        match *self {
            Self::Constant(bits) => f64::from_bits(bits),
            Self::Input(number) => input(number),
            Self::Add(a, b) => value(a) + value(b),
            Self::Subtract(a, b) => value(a) - value(b),
            Self::Multiply(a, b) => value(a) * value(b),
            Self::Divide(a, b) => value(a) / value(b),
            Self::Apply(function, a) => function.value(value(a)),
            Self::Select([a, b, yes, no]) => value(if value(a) < value(b) { yes } else { no }),
        }
    }
}
