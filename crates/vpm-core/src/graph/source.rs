//! Programs as C99.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::operation::{Call, Function, Node, Operation};
use super::program::Program;

/// Statements of one function: the time that compilers take grows faster than the length of functions.
const STATEMENTS: usize = 1000;

/// Numbers in a row that a function takes or gives: the name of the argument, and how many there are.
pub type Block<'a> = (&'a str, usize);

/// A program as C99.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Static functions; the last of them has the name asked for and calls the others.
    pub text: String,
    /// How many numbers the functions hand on to each other.
    pub work: usize,
    /// Functions that these call, each after those that it needs; the text of a file says each once, before it.
    pub called: Vec<&'static str>,
}

/// Where a number is to be found, once it stands.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// In the function that makes it alone.
    Local,
    /// In the working memory besides, for functions that follow.
    Handed(usize),
}

impl Program {
    /// C source of a program: `static void NAME(const double *INPUT, ..., double *w, double *OUTPUT, ...)`. It is in
    /// pieces of at most a thousand statements.
    ///
    /// The blocks of `inputs` are the program's inputs in order, those of `outputs` its outputs; a block without a name is none of the
    /// arguments, and nothing may need it. Arrays must not overlap. Constants have as many digits as it takes to read them back exactly.
    /// What it calls beside `math.h` stands in [`Source::called`].
    pub fn to_c(&self, name: &str, inputs: &[Block<'_>], outputs: &[Block<'_>]) -> Source {
        let writer = Writer::new(self, inputs, outputs);
        let mut text = String::new();
        let pieces = writer.pieces();
        let alone = pieces.len() == 1;
        for (number, piece) in pieces.iter().enumerate() {
            let piece_name = if alone { name.to_owned() } else { format!("{name}_{number}") };
            text.push_str(&writer.function(&piece_name, piece));
        }
        if !alone {
            let calls: String = (0..pieces.len())
                .map(|number| format!("    {};\n", writer.call(&format!("{name}_{number}"))))
                .collect();
            let _ = write!(text, "{}{{\n{calls}}}\n\n", writer.signature(name));
        }
        Source { text, work: writer.work, called: called(self.calls()) }
    }
}

/// C source of a number that reads back as the same `f64`.
pub fn literal(value: f64) -> String {
    match value {
        value if value.is_nan() => "NAN".to_owned(),
        f64::INFINITY => "INFINITY".to_owned(),
        f64::NEG_INFINITY => "(-INFINITY)".to_owned(),
        value => format!("{value:?}"),
    }
}

struct Writer<'a> {
    program: &'a Program,
    inputs: &'a [Block<'a>],
    outputs: &'a [Block<'a>],
    /// Which outputs each number is.
    shown: BTreeMap<Node, Vec<usize>>,
    places: Vec<Place>,
    work: usize,
}

impl<'a> Writer<'a> {
    fn new(program: &'a Program, inputs: &'a [Block<'a>], outputs: &'a [Block<'a>]) -> Self {
        let mut shown: BTreeMap<Node, Vec<usize>> = BTreeMap::new();
        for (place, &node) in program.outputs().iter().enumerate() {
            shown.entry(node).or_default().push(place);
        }
        let mut writer =
            Self { program, inputs, outputs, shown, places: vec![Place::Local; program.operations().len()], work: 0 };
        writer.hand_on();
        writer
    }

    fn made(&self, node: usize) -> bool {
        !matches!(self.program.operations()[node], Operation::Constant(_) | Operation::Input(_))
    }

    /// Pieces of C source: the numbers that each function makes, in order. What is known without work is shown by the
    /// last.
    fn pieces(&self) -> Vec<Vec<Node>> {
        let made: Vec<_> =
            (0..self.program.operations().len()).filter(|&node| self.made(node)).map(|node| node as Node).collect();
        let mut pieces: Vec<_> = made.chunks(STATEMENTS).map(<[Node]>::to_vec).collect();
        let known = self.shown.keys().copied().filter(|&node| !self.made(node as usize));
        match pieces.last_mut() {
            Some(last) => last.extend(known),
            None => pieces.push(known.collect()),
        }
        pieces
    }

    /// Places in the C source's working memory for numbers that later pieces need. Each is used again once nothing
    /// needs it any more.
    fn hand_on(&mut self) {
        let pieces = self.pieces();
        let mut piece_of = vec![0; self.places.len()];
        let mut last = vec![0; self.places.len()];
        for (number, piece) in pieces.iter().enumerate() {
            for &node in piece {
                piece_of[node as usize] = number;
                self.program.operations()[node as usize]
                    .arguments(self.program.calls(), |argument| last[argument as usize] = number);
            }
        }
        let mut free = Vec::new();
        let mut ending: Vec<Vec<usize>> = vec![Vec::new(); pieces.len()];
        for (number, piece) in pieces.iter().enumerate() {
            for &node in piece {
                let node = node as usize;
                if self.made(node) && last[node] > piece_of[node] {
                    let place = free.pop().unwrap_or_else(|| {
                        self.work += 1;
                        self.work - 1
                    });
                    self.places[node] = Place::Handed(place);
                    ending[last[node]].push(place);
                }
            }
            free.append(&mut ending[number]);
        }
    }

    fn arguments(&self) -> impl Iterator<Item = (&'a str, &'static str)> {
        let named = |&&(name, _): &&Block<'a>| !name.is_empty();
        let inputs = self.inputs.iter().filter(named).map(|&(name, _)| (name, "const double *"));
        let outputs = self.outputs.iter().filter(named).map(|&(name, _)| (name, "double *"));
        inputs.chain([("w", "double *")]).chain(outputs)
    }

    fn signature(&self, name: &str) -> String {
        let arguments: Vec<_> = self.arguments().map(|(name, kind)| format!("{kind}{name}")).collect();
        format!("static void {name}({})\n", arguments.join(", "))
    }

    fn call(&self, name: &str) -> String {
        let arguments: Vec<_> = self.arguments().map(|(name, _)| name).collect();
        format!("{name}({})", arguments.join(", "))
    }

    fn function(&self, name: &str, piece: &[Node]) -> String {
        let mut body = String::new();
        let (first, end) = (piece.first().copied().unwrap_or(0), piece.len());
        let local = |node: Node| node >= first && self.made(node as usize);
        for &node in &piece[..end] {
            let operation = self.program.operations()[node as usize];
            let term = |argument: Node| self.term(argument, local(argument));
            if self.made(node as usize) {
                let _ =
                    writeln!(body, "    const double a{node} = {};", expression(operation, self.program.calls(), term));
                if let Place::Handed(place) = self.places[node as usize] {
                    let _ = writeln!(body, "    w[{place}] = a{node};");
                }
            }
            for &place in self.shown.get(&node).into_iter().flatten() {
                let _ = writeln!(body, "    {} = {};", entry(self.outputs, place), self.term(node, true));
            }
        }
        // A piece need not touch every argument.
        let unused: String = self.arguments().map(|(name, _)| format!("    (void){name};\n")).collect();
        format!("{}{{\n{unused}{body}}}\n\n", self.signature(name))
    }

    /// C source of a number as part of an expression.
    fn term(&self, node: Node, local: bool) -> String {
        match (self.program.operations()[node as usize], self.places[node as usize]) {
            (Operation::Constant(bits), _) => literal(f64::from_bits(bits)),
            (Operation::Input(number), _) => entry(self.inputs, number as usize),
            (_, Place::Handed(place)) if !local => format!("w[{place}]"),
            _ => format!("a{node}"),
        }
    }
}

/// C source of entry `place` of all blocks in a row.
fn entry(blocks: &[Block<'_>], mut place: usize) -> String {
    for &(name, length) in blocks {
        if place < length {
            return format!("{name}[{place}]");
        }
        place -= length;
    }
    "NAN".to_owned()
}

fn expression(operation: Operation, calls: &[Call], term: impl Fn(Node) -> String) -> String {
    match operation {
        Operation::Constant(bits) => literal(f64::from_bits(bits)),
        Operation::Input(_) => "NAN".to_owned(),
        Operation::Add(a, b) => format!("{} + {}", term(a), term(b)),
        Operation::Subtract(a, b) => format!("{} - {}", term(a), term(b)),
        Operation::Multiply(a, b) => format!("{} * {}", term(a), term(b)),
        Operation::Divide(a, b) => format!("{} / {}", term(a), term(b)),
        Operation::Apply(Function::Negative, a) => format!("-{}", term(a)),
        Operation::Apply(function, a) => format!("{}({})", in_c(function), term(a)),
        Operation::Select([a, b, yes, no]) => {
            format!("{} < {} ? {} : {}", term(a), term(b), term(yes), term(no))
        }
        Operation::Search(call) => {
            let Call { search, arguments } = &calls[call as usize];
            let arguments: Vec<_> = arguments.iter().map(|&argument| term(argument)).collect();
            format!("{}({})", search.name, arguments.join(", "))
        }
    }
}

/// Functions behind searches in the C source, each once.
fn called(calls: &[Call]) -> Vec<&'static str> {
    let mut texts = Vec::new();
    for &text in calls.iter().flat_map(|call| call.search.source) {
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    texts
}

/// Name of a C source function in `math.h`; a sign has none.
fn in_c(function: Function) -> &'static str {
    match function {
        Function::Negative => "-",
        Function::Root => "sqrt",
        Function::Exp => "exp",
        Function::ExpM1 => "expm1",
        Function::Ln => "log",
        Function::Sine => "sin",
        Function::Cosine => "cos",
        Function::Tanh => "tanh",
        Function::Atan => "atan",
        Function::Frozen => "",
    }
}
