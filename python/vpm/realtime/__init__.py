"""Models in the loop: a runner at a fixed rate, and compiled models for controllers in C and C++."""

from vpm.realtime.compiled import CompiledModel, compile_model
from vpm.realtime.loop import QUANTILES, Loop, LoopReport, Tick

__all__ = ["QUANTILES", "CompiledModel", "Loop", "LoopReport", "Tick", "compile_model"]
