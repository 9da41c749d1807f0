"""Options of ``vpm identify``: what they are called and what their help says."""

from __future__ import annotations

from typing import Annotated

import typer

Words = list[str] | None


def _option(words: str, *names: str) -> object:
    return typer.Option(*names, help=words)


Free = Annotated[Words, _option("Dotted parameter name; repeat. Default: all with an uncertainty.")]
Substeps = Annotated[int, _option("Integration steps per sample, in simulated modes.")]
Horizon = Annotated[float, _option("Length of each restart, s.")]
Compared = Annotated[Words, _option("Compared output; repeat. Default: all that are measured.", "--compare")]
Log = Annotated[bool, _option("Move logarithms of positive parameters.", "--log")]
Bound = Annotated[Words, _option("NAME=LOW:HIGH in SI units; repeat.")]
Noise = Annotated[str | None, _option("Weights of the outputs: spread (of the signal, the default) or estimated.")]
NoiseLevel = Annotated[Words, _option("CHANNEL=STD in SI units: weights by known noise; repeat.")]
Loss = Annotated[str | None, _option("squares (the default), huber or soft_l1; the last two bear outliers.")]
Priors = Annotated[bool, _option("Count uncertainties of the model file as data.", "--priors")]
Starts = Annotated[int, _option("Fits from so many starts; says how many agree.")]
Seed = Annotated[int, _option("Of starts and bootstrap.")]
FitState = Annotated[Words, _option("First state to fit, of each record or piece; repeat.")]
KnownState = Annotated[Words, _option("STATE=VALUE in SI units: first state that is known; repeat.")]
Piece = Annotated[float, _option("Length of the pieces of multiple shooting, s; 0 for none.")]
ProfileOf = Annotated[Words, _option("Parameter whose interval comes from its profile; repeat.")]
Replicates = Annotated[int, _option("Replicates of a block bootstrap.", "--bootstrap")]
Workers = Annotated[int, _option("Threads; 0 for one per core.")]
