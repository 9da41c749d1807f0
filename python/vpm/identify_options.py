"""Options of ``vpm identify``: what they are called, what their help says, and how their words are read."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.errors import IdentificationError

Words = list[str] | None


def _option(words: str, *names: str) -> object:
    return typer.Option(*names, help=words)


FitMode = Annotated[
    str,
    typer.Option(
        help="inverse_dynamics, free_run, restarts, closed_loop, prescribed_motion, input_error or prediction_error.",
        metavar="MODE",
        show_default=True,
    ),
]
Free = Annotated[Words, _option("Dotted parameter name; repeat. Default: all with an uncertainty.")]
Fixed = Annotated[Words, _option("Parameter that stays where it is although it has an uncertainty; repeat.", "--fix")]
Tie = Annotated[Words, _option("FOLLOWER=LEADER: two parameters that share one value; repeat.")]
Substeps = Annotated[int, _option("Integration steps per sample, in simulated modes.")]
Horizon = Annotated[float, _option("Length of each restart, or stretch of input_error, s.")]
Settling = Annotated[float, _option("Time at the beginning of each record that is not compared, s.")]
Compared = Annotated[Words, _option("Compared output; repeat. Default: all that are measured.", "--compare")]
Log = Annotated[bool, _option("Move logarithms of positive parameters.", "--log")]
Bound = Annotated[Words, _option("NAME=LOW:HIGH in SI units; repeat.")]
Noise = Annotated[str | None, _option("Weights of the outputs: spread (of the signal, the default) or estimated.")]
NoiseLevel = Annotated[Words, _option("CHANNEL=STD in SI units: weights by known noise; repeat.")]
Loss = Annotated[str | None, _option("squares (the default), huber or soft_l1; the last two bear outliers.")]
LossScale = Annotated[float, _option("Standard deviations beyond which a robust loss bends.")]
Priors = Annotated[bool, _option("Count uncertainties of the model file as data.", "--priors")]
Starts = Annotated[int, _option("Fits from so many starts; says how many agree.")]
Spread = Annotated[float, _option("Factor by which starts differ where neither uncertainty nor bounds say it.")]
Seed = Annotated[int, _option("Of starts and bootstrap.")]
FitState = Annotated[Words, _option("First state to fit, of each record or piece; repeat.")]
KnownState = Annotated[Words, _option("STATE=VALUE in SI units: first state that is known; repeat.")]
Offset = Annotated[Words, _option("Compared channel that is off by an unknown constant in each log; repeat.")]
Piece = Annotated[float, _option("Length of the pieces of multiple shooting, s; 0 for none.")]
Continuity = Annotated[float, _option("Weight of the gap between two pieces, in samples of it.")]
Evaluations = Annotated[int, _option("Simulations after which a fit with settings is ended as it stands.")]
ProfileOf = Annotated[Words, _option("Parameter whose interval comes from its profile; repeat.")]
Replicates = Annotated[int, _option("Replicates of a block bootstrap.", "--bootstrap")]
Workers = Annotated[int, _option("Threads; 0 for one per core.")]
Validate = Annotated[
    list[Path] | None, typer.Option(help="Record that is never fitted, on which the fit is judged; repeat.")
]


def numbers(words: Words, option: str, form: str) -> dict[str, float]:
    """Read ``NAME=NUMBER`` words of an option.; another form is an error."""
    return {name: _number(value) for name, value in _pairs(words, option, form)}


def ranges(words: Words, option: str, form: str) -> dict[str, tuple[float, float]]:
    """Read ``NAME=LOW:HIGH`` words of an option.; another form is an error."""
    found = {}
    for name, word in _pairs(words, option, form):
        low, sign, high = word.partition(":")
        if not sign:
            raise IdentificationError(f"{option} has '{word}' where a range belongs; write it as {form}")
        found[name] = (_number(low), _number(high))
    return found


def names(words: Words, option: str, form: str) -> dict[str, str]:
    """Read ``NAME=NAME`` words of an option.; another form is an error."""
    return dict(_pairs(words, option, form))


def _pairs(words: Words, option: str, form: str) -> list[tuple[str, str]]:
    pairs = [word.partition("=") for word in words or []]
    for name, sign, value in pairs:
        if not (name and sign and value):
            raise IdentificationError(f"{option} is '{name}{sign}{value}'; write it as {form}")
    return [(name, value) for name, _, value in pairs]


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        raise IdentificationError(f"'{word}' is no number; write one like 1e-3, in SI units") from None
