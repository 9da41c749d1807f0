//! The steps of one piece as instructions for the code generator.

use std::collections::HashMap;

use cranelift_codegen::cursor::FuncCursor;
use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{FuncRef, InstBuilder, MemFlagsData, Type, Value, types};

use super::super::operation::Function;
use super::plan::{Place, Step};
use super::task::{Kind, NONE};
use crate::scalar::{ARGUMENTS, Search};

/// Memory that is there, on the boundaries of `f64`: vectors may begin at any of them.
const NOTRAP: MemFlagsData = MemFlagsData::new().with_notrap();

/// The constants of a program, each once.
#[derive(Debug, Default)]
pub(super) struct Pool {
    places: HashMap<u64, u32>,
    pub values: Vec<f64>,
}

impl Pool {
    fn place(&mut self, value: f64) -> u32 {
        *self.places.entry(value.to_bits()).or_insert_with(|| {
            self.values.push(value);
            self.values.len() as u32 - 1
        })
    }
}

/// The four arrays that a piece is called with.
#[derive(Clone, Copy)]
pub(super) struct Arrays {
    pub inputs: Value,
    pub outputs: Value,
    pub work: Value,
    pub constants: Value,
}

/// What the instructions of one piece are made with.
pub(super) struct Emitter<'a> {
    pub code: FuncCursor<'a>,
    pub arrays: Arrays,
    pub pool: &'a mut Pool,
    /// The register of each number of the program.
    pub registers: &'a mut [Option<Value>],
    /// The functions that are called, in the order of [`CALLED`](super::code::CALLED).
    pub called: &'a [FuncRef],
    /// The function that calls a search.
    pub search: FuncRef,
    /// The type of a number: it has one lane or two.
    pub number: Type,
}

impl Emitter<'_> {
    /// Emits one step; `None` if the plan is not sound.
    pub fn step(&mut self, step: &Step) -> Option<()> {
        match *step {
            Step::Store { from, to } => {
                let value = self.read(from)?;
                let (array, place) = match to {
                    Place::Output(place) => (self.arrays.outputs, place),
                    Place::Work(place) => (self.arrays.work, place),
                    _ => return None,
                };
                let place = self.offset(place)?;
                self.code.ins().store(NOTRAP, value, array, place);
            }
            Step::Do { task, arguments } => {
                let mut values = [Value::from_u32(0); 4];
                for ((value, place), _) in values.iter_mut().zip(arguments).zip(task.arguments()) {
                    *value = self.read(place)?;
                }
                let made = self.compute(task.kind, values)?;
                for (node, value) in task.results().into_iter().zip(made).filter(|&(node, _)| node != NONE) {
                    *self.registers.get_mut(node as usize)? = Some(value);
                }
            }
        }
        Some(())
    }

    /// Emits the read of a number; one in memory is loaded for this use only. So it becomes an operand of the
    /// instruction.
    fn read(&mut self, place: Place) -> Option<Value> {
        let (array, place) = match place {
            Place::Register(node) => return *self.registers.get(node as usize)?,
            Place::Constant(value) => return self.constant(value),
            Place::Input(place) => (self.arrays.inputs, place),
            Place::Output(place) => (self.arrays.outputs, place),
            Place::Work(place) => (self.arrays.work, place),
        };
        let place = self.offset(place)?;
        Some(self.code.ins().load(self.number, NOTRAP, array, place))
    }

    /// Emits a constant, from memory: cheaper than to make it from its bits.
    pub fn constant(&mut self, value: f64) -> Option<Value> {
        let place = self.pool.place(value);
        let place = self.offset(place)?;
        Some(self.code.ins().load(self.number, NOTRAP, self.arrays.constants, place))
    }

    fn compute(&mut self, kind: Kind, [a, b, c, d]: [Value; 4]) -> Option<[Value; 2]> {
        let value = match kind {
            Kind::Add => self.code.ins().fadd(a, b),
            Kind::Subtract => self.code.ins().fsub(a, b),
            Kind::Multiply => self.code.ins().fmul(a, b),
            Kind::Divide => self.code.ins().fdiv(a, b),
            Kind::ProductPlus => self.code.ins().fma(a, b, c),
            Kind::ProductMinus => {
                let c = self.code.ins().fneg(c);
                self.code.ins().fma(a, b, c)
            }
            Kind::MinusProduct => {
                let a = self.code.ins().fneg(a);
                self.code.ins().fma(a, b, c)
            }
            Kind::Negative => self.code.ins().fneg(a),
            Kind::Root => self.code.ins().sqrt(a),
            Kind::SineCosine => return self.sine_cosine(a),
            Kind::Call(function) => self.call(function, a)?,
            Kind::Select => self.select([a, b, c, d]),
            Kind::Argument(place) => self.by_lane(a, |own, value, lane| {
                let place = argument(place, lane)?;
                own.code.ins().store(NOTRAP, value, own.arrays.work, place);
                Some(value)
            })?,
            Kind::Search(search) => {
                let zero = self.constant(0.0)?;
                self.by_lane(zero, |own, _, lane| own.search(search, lane))?
            }
        };
        Some([value, value])
    }

    /// Emits what `each` makes of a number, lane by lane.
    fn by_lane(&mut self, number: Value, each: impl Fn(&mut Self, Value, u8) -> Option<Value>) -> Option<Value> {
        if self.number == types::F64 {
            return each(self, number, 0);
        }
        let mut made = number;
        for lane in 0..2 {
            let value = self.code.ins().extractlane(number, lane);
            let value = each(self, value, lane)?;
            made = self.code.ins().insertlane(made, value, lane);
        }
        Some(made)
    }

    fn call(&mut self, function: Function, argument: Value) -> Option<Value> {
        let place = super::code::CALLED.iter().position(|&(known, _)| known == function)?;
        let called = *self.called.get(place)?;
        self.by_lane(argument, |own, value, _| {
            let call = own.code.ins().call(called, &[value]);
            own.code.func.dfg.inst_results(call).first().copied()
        })
    }

    fn search(&mut self, search: &'static Search, lane: u8) -> Option<Value> {
        let address = std::ptr::from_ref(search).expose_provenance();
        let address = self.code.ins().iconst(types::I64, i64::try_from(address).ok()?);
        let arguments = self.code.ins().iadd_imm_s(self.arrays.work, i64::from(argument(0, lane)?));
        let call = self.code.ins().call(self.search, &[address, arguments]);
        self.code.func.dfg.inst_results(call).first().copied()
    }

    /// Emits a < b ? yes : no, without a branch: the comparison makes a mask.
    fn select(&mut self, [a, b, yes, no]: [Value; 4]) -> Value {
        let [a, b, yes, no] = [a, b, yes, no].map(|value| self.wide(value));
        let mask = self.code.ins().fcmp(FloatCC::LessThan, a, b);
        let mask = self.seen_as(types::F64X2, mask);
        let chosen = self.code.ins().bitselect(mask, yes, no);
        self.narrow(chosen)
    }

    /// Emits a number as a vector of two lanes, of which the last may be unused.
    pub fn wide(&mut self, value: Value) -> Value {
        if self.number == types::F64 { self.code.ins().scalar_to_vector(types::F64X2, value) } else { value }
    }

    /// Emits the number that [`Self::wide`] made a vector of.
    pub fn narrow(&mut self, value: Value) -> Value {
        if self.number == types::F64 { self.code.ins().extractlane(value, 0) } else { value }
    }

    /// Bytes from the beginning of an array to the number at this place.
    fn offset(&self, place: u32) -> Option<i32> {
        i32::try_from(place).ok()?.checked_mul(i32::try_from(self.number.bytes()).ok()?)
    }

    /// Emits the bits of `value` as the type `to`, without changing them.
    pub fn seen_as(&mut self, to: Type, value: Value) -> Value {
        self.code.ins().bitcast(to, MemFlagsData::new(), value)
    }
}

/// Bytes from the beginning of the work array to an argument of a search: those of one lane stand together.
fn argument(place: u32, lane: u8) -> Option<i32> {
    i32::try_from(usize::from(lane) * ARGUMENTS + place as usize).ok()?.checked_mul(8)
}
