//! Machine code in the memory of the process: how it is made, called and given back.
#![allow(unsafe_code)]

use std::sync::{Mutex, PoisonError};

use cranelift_codegen::Context;
use cranelift_codegen::cursor::{Cursor, FuncCursor};
use cranelift_codegen::ir::{AbiParam, InstBuilder, Signature, Type, types};
use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_codegen::settings::{self, Configurable, SetError};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Linkage, Module, ModuleError, default_libcall_names};

use super::super::operation::Function;
use super::emit::{Arrays, Emitter, Pool};
use super::plan::Plan;
use super::{Lanes, Unavailable};
use crate::scalar::{ARGUMENTS, Search};

type Called = extern "C" fn(f64) -> f64;

/// Functions that the code calls; the others are instructions.
pub(super) const CALLED: [(Function, Called); 5] = [
    (Function::Exp, exp),
    (Function::ExpM1, exp_m1),
    (Function::Ln, ln),
    (Function::Tanh, tanh),
    (Function::Atan, atan),
];

extern "C" fn exp(x: f64) -> f64 {
    x.exp()
}
extern "C" fn exp_m1(x: f64) -> f64 {
    x.exp_m1()
}
extern "C" fn ln(x: f64) -> f64 {
    x.ln()
}
extern "C" fn tanh(x: f64) -> f64 {
    x.tanh()
}
extern "C" fn atan(x: f64) -> f64 {
    x.atan()
}

/// What a search finds with the arguments that the code has put first into the work array.
extern "C" fn search(search: &'static Search, arguments: &[f64; ARGUMENTS]) -> f64 {
    search.value(arguments.iter().copied().take(search.arguments))
}
const SEARCH: &str = "vpm_search";

/// One piece: inputs, outputs, work, constants.
type Piece = unsafe extern "C" fn(*const f64, *mut f64, *mut f64, *const f64);

/// The code of a program, its constants and the lengths of the arrays that it needs.
pub(super) struct Code {
    /// Holds the memory of the code; `None` once it is given back.
    module: Mutex<Option<JITModule>>,
    pieces: Vec<Piece>,
    constants: Box<[f64]>,
    /// Numbers of each array, lanes counted.
    pub inputs: usize,
    pub outputs: usize,
    pub work: usize,
}

impl Code {
    /// Makes the code of `plan` for a program with so many `numbers`, of one lane or two.
    pub fn new(plan: &Plan, numbers: usize, lengths: [usize; 2], lanes: Lanes) -> Result<Self, Unavailable> {
        let module = Mutex::new(Some(module()?));
        let (pieces, constants) = (Vec::new(), Box::default());
        let [inputs, outputs, work] = [lengths[0], lengths[1], plan.work].map(|length| length * lanes as usize);
        let mut code = Self { module, pieces, constants, inputs, outputs, work };
        code.fill(plan, numbers, lanes)?;
        Ok(code)
    }

    fn fill(&mut self, plan: &Plan, numbers: usize, lanes: Lanes) -> Result<(), Unavailable> {
        let number = match lanes {
            Lanes::One => types::F64,
            Lanes::Two => types::F64X2,
        };
        let slot = self.module.get_mut().unwrap_or_else(PoisonError::into_inner);
        let Some(module) = slot else { return Ok(()) };
        let (mut pool, mut registers) = (Pool::default(), vec![None; numbers]);
        let (called, search) = declare(module)?;
        let mut context = module.make_context();
        let mut pieces = Vec::with_capacity(plan.pieces.len());
        for steps in &plan.pieces {
            context.func.signature = signature(module, 4, types::I64, None);
            let calls: Vec<_> = called.iter().map(|&id| module.declare_func_in_func(id, &mut context.func)).collect();
            let search = module.declare_func_in_func(search, &mut context.func);
            emit(&mut context, |code, arrays| {
                let registers = &mut registers;
                let mut emitter = Emitter { code, arrays, pool: &mut pool, registers, called: &calls, search, number };
                let sound = steps.iter().all(|step| emitter.step(step).is_some());
                emitter.code.ins().return_(&[]);
                sound
            })
            .ok_or_else(|| Unavailable::Failed { message: "a number is needed before it stands".into() })?;
            let id = module.declare_anonymous_function(&context.func.signature).map_err(failed)?;
            module.define_function(id, &mut context).map_err(failed)?;
            module.clear_context(&mut context);
            pieces.push(id);
        }
        module.finalize_definitions().map_err(failed)?;
        // SAFETY: each is a finished function of this module with the signature of `Piece` in the C convention of the host; it is
        // called by `run` alone, which borrows `self`, and so before `drop` frees its memory.
        let piece = |id| unsafe { std::mem::transmute::<*const u8, Piece>(module.get_finalized_function(id)) };
        self.pieces = pieces.into_iter().map(piece).collect();
        self.constants = pool.values.into_iter().flat_map(|value| std::iter::repeat_n(value, lanes as usize)).collect();
        Ok(())
    }

    /// Runs the code; false if an array has the wrong length.
    pub fn run(&self, inputs: &[f64], outputs: &mut [f64], work: &mut [f64]) -> bool {
        if inputs.len() != self.inputs || outputs.len() != self.outputs || work.len() != self.work {
            return false;
        }
        for piece in &self.pieces {
            // SAFETY: the code reads inputs below `self.inputs` and constants below their length, reads and writes outputs below
            // `self.outputs` and work below `self.work`: so `Plan` made it from a checked program, and these are the lengths of
            // the arrays. The borrows keep the arrays apart and alive. The code calls functions that cannot unwind only; `search` it
            // hands the address of a static and, in the work array, the arguments of its lane, with which `Plan` begins it.
            unsafe { piece(inputs.as_ptr(), outputs.as_mut_ptr(), work.as_mut_ptr(), self.constants.as_ptr()) };
        }
        true
    }
}

impl Drop for Code {
    fn drop(&mut self) {
        if let Some(module) = self.module.get_mut().unwrap_or_else(PoisonError::into_inner).take() {
            // SAFETY: nobody else has `self`, so none of the functions runs, and the pointers to them go with it.
            unsafe { module.free_memory() };
        }
    }
}

fn module() -> Result<JITModule, Unavailable> {
    Ok(JITModule::new({
        let mut builder = JITBuilder::with_isa(processor()?, default_libcall_names());
        for (function, pointer) in CALLED {
            builder.symbol(name(function), pointer as *const u8);
        }
        builder.symbol(SEARCH, search as *const u8);
        builder
    }))
}

/// Processor for machine code: the one that this process runs on, with all that it can do.
fn processor() -> Result<OwnedTargetIsa, Unavailable> {
    let unknown = |message: String| Unavailable::Processor { message };
    let builder = cranelift_native::builder().map_err(|message| unknown(message.into()))?;
    let flags = flags().map_err(|error| unknown(error.to_string()))?;
    let processor = builder.finish(flags).map_err(|error| unknown(error.to_string()))?;
    for (flag, what) in [("has_fma", "FMA"), ("has_sse41", "SSE4.1")] {
        // Another family of processors has no such flag, and fused products always.
        if processor.isa_flags().iter().any(|value| value.name == flag && value.as_bool() == Some(false)) {
            return Err(unknown(format!("it has no {what} instructions")));
        }
    }
    Ok(processor)
}

/// Flags for machine code without the generator's own optimisation. It would merge the loads that the plan wants apart,
/// and takes three times as long.
fn flags() -> Result<settings::Flags, SetError> {
    let mut flags = settings::builder();
    flags.set("opt_level", "none")?;
    flags.set("regalloc_algorithm", "backtracking")?;
    flags.set("is_pic", "false")?;
    flags.set("use_colocated_libcalls", "false")?;
    flags.set("enable_verifier", "false")?;
    Ok(settings::Flags::new(flags))
}

/// Declares for machine code the functions of [`CALLED`], and the one that calls a search.
fn declare(module: &mut JITModule) -> Result<(Vec<FuncId>, FuncId), Unavailable> {
    let of_search = signature(module, 2, types::I64, Some(types::F64));
    let signature = signature(module, 1, types::F64, Some(types::F64));
    let mut ids = Vec::with_capacity(CALLED.len());
    for (function, _) in CALLED {
        ids.push(module.declare_function(name(function), Linkage::Import, &signature).map_err(failed)?);
    }
    let search = module.declare_function(SEARCH, Linkage::Import, &of_search).map_err(failed)?;
    Ok((ids, search))
}

fn failed(error: ModuleError) -> Unavailable {
    Unavailable::Failed { message: error.to_string() }
}

fn name(function: Function) -> &'static str {
    match function {
        Function::Exp => "vpm_exp",
        Function::ExpM1 => "vpm_exp_m1",
        Function::Ln => "vpm_ln",
        Function::Tanh => "vpm_tanh",
        _ => "vpm_atan",
    }
}

fn signature(module: &JITModule, count: usize, of: Type, result: Option<Type>) -> Signature {
    let mut signature = module.make_signature();
    signature.params.extend((0..count).map(|_| AbiParam::new(of)));
    signature.returns.extend(result.map(AbiParam::new));
    signature
}

/// Fills the one block of a function's machine code; `None` if that fails.
fn emit(context: &mut Context, fill: impl FnOnce(FuncCursor<'_>, Arrays) -> bool) -> Option<()> {
    let mut code = FuncCursor::new(&mut context.func);
    let block = code.func.dfg.make_block();
    let mut array = || code.func.dfg.append_block_param(block, types::I64);
    let arrays = Arrays { inputs: array(), outputs: array(), work: array(), constants: array() };
    code.insert_block(block);
    fill(code, arrays).then_some(())
}
