"""Models in the loop: a runner at a fixed rate, compiled models for C and C++, models as C99 and FMUs."""

from vpm.realtime.compiled import CompiledModel, compile_model
from vpm.realtime.fmu import Fmu, write_fmu
from vpm.realtime.loop import QUANTILES, Loop, LoopReport, Tick
from vpm.realtime.source import CSource, c_source

__all__ = [
    "QUANTILES",
    "CSource",
    "CompiledModel",
    "Fmu",
    "Loop",
    "LoopReport",
    "Tick",
    "c_source",
    "compile_model",
    "write_fmu",
]
