"""Errors: one sentence each, and the facts of that sentence as attributes.

The sentence says which (path, name, channel, time), the failing condition, the numbers and the repair.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from difflib import SequenceMatcher, get_close_matches

#: Exit code of a command after Ctrl-C, as shells have it: 128 and the number of the signal.
INTERRUPTED = 130


class VpmError(ValueError):
    """Something in the input cannot be right; the message is one sentence with the repair in it."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.message = message


class CoreError(VpmError):
    """The compiled core refused what it was given: a wrong length, a number that is not finite, a state without rest.

    The core raises it itself, so that nothing it says reaches a user as a plain ``ValueError``.
    """


class ModelError(VpmError):
    """A model description is wrong.

    Attributes
    ----------
    where : str or None
        Place in the model, for example ``"bodies.carriage.mass"``.
    path : str or None
        File that the model was read from.
    line, column : int or None
        Place in the text, for syntax errors; both count from 1.
    more : int
        How many further problems the model has.
    """

    def __init__(
        self,
        message: str,
        *,
        where: str | None = None,
        path: str | None = None,
        line: int | None = None,
        column: int | None = None,
        more: int = 0,
    ) -> None:
        super().__init__(message)
        self.where = where
        self.path = path
        self.line = line
        self.column = column
        self.more = more


class UnitError(VpmError):
    """A unit cannot be read, or is of another kind than the quantity.

    Attributes
    ----------
    unit : str
        The unit as it was written.
    expected : str or None
        A unit of the right kind.
    """

    def __init__(self, message: str, *, unit: str = "", expected: str | None = None) -> None:
        super().__init__(message)
        self.unit = unit
        self.expected = expected


class ExperimentError(VpmError):
    """A measured record cannot be used as it is.

    Attributes
    ----------
    path : str or None
        File of the record.
    channel : str or None
        Channel that is at fault.
    time : float or None
        First time at which the condition fails (s).
    """

    def __init__(
        self, message: str, *, path: str | None = None, channel: str | None = None, time: float | None = None
    ) -> None:
        super().__init__(message)
        self.path = path
        self.channel = channel
        self.time = time


class ScenarioError(VpmError):
    """A scenario file is wrong, or does not fit its models.

    Attributes
    ----------
    where : str or None
        Place in the file, for example ``"runs[0].model"``.
    path : str or None
        File that the scenario was read from.
    more : int
        How many further problems it has.
    """

    def __init__(self, message: str, *, where: str | None = None, path: str | None = None, more: int = 0) -> None:
        super().__init__(message)
        self.where = where
        self.path = path
        self.more = more


class SimulationError(VpmError):
    """A simulation was asked for in a way that cannot be done: unknown mode, integrator, channel or horizon."""


class DiagnosisError(VpmError):
    """A diagnosis was asked for in a way that cannot be done: no record, unknown effect, no motion measured."""


class ExcitationError(VpmError):
    """An excitation was asked for that cannot be: a band that samples do not carry, limits that allow no motion."""


class ReductionError(VpmError):
    """A solid or its matrices cannot be reduced to a flexible link."""


class OptimisationError(VpmError):
    """A task of an optimisation is wrong, does not fit its model, or no motion fulfils it.

    Attributes
    ----------
    where : str or None
        Place in the file, for example ``limits."motor.command"``.
    path : str or None
        File that the task was read from.
    """

    def __init__(self, message: str, *, where: str | None = None, path: str | None = None) -> None:
        super().__init__(message)
        self.where = where
        self.path = path


class ExecutorError(VpmError):
    """Work cannot be given to an executor, a worker refused it, or its worker died with it again and again.

    Attributes
    ----------
    worker : str or None
        Host and process that refused it.
    path : str or None
        File that the worker cannot read as it was read here.
    """

    def __init__(self, message: str, *, worker: str | None = None, path: str | None = None) -> None:
        super().__init__(message)
        self.worker = worker
        self.path = path


class IdentificationError(VpmError):
    """The asked parameters cannot be found from the given records.

    Attributes
    ----------
    parameters : tuple of str
        The parameters in question.
    """

    def __init__(self, message: str, *, parameters: Iterable[str] = ()) -> None:
        super().__init__(message)
        self.parameters = tuple(parameters)


class DivergedError(SimulationError):
    """A simulation left the bounds of its states: numbers that are none, or larger than the machine allows.

    Attributes
    ----------
    run : object or None
        The partial run, up to the last sample before.
    time : float or None
        Time of the first sample that is missing (s).
    """

    def __init__(self, message: str, *, run: object = None, time: float | None = None) -> None:
        super().__init__(message)
        self.run = run
        self.time = time


class ValidityWarning(UserWarning):
    """A simulation left the range in which a flexible link's kinematics are right.

    Attributes
    ----------
    beam : str
        The flexible link.
    slope : float
        Largest slope of its axis against the tangent at its root (rad).
    time : float
        When that was (s).
    """

    def __init__(
        self, beam: str, slope: float, time: float, limit: float, level: str, *, second_order: bool = True
    ) -> None:
        exact = (
            "use a level that is exact at any deflection: "
            f'level = "bezier(4)" in the model file, or model.at({{"{beam}": "bezier(4)"}})'
            if not level.startswith("reduced")
            else "cut the reduced solid into several links, each of which bends less"
        )
        what, repair = (
            (f"its level {level}", exact)
            if second_order
            else ("a deflection to first order", f"remove second_order = false from [beams.{beam}]")
        )
        super().__init__(
            f"{beam} bends by {slope:.3g} rad at t = {time:.4g} s, but {what} is right within 1 % up to "
            f"{limit:.3g} rad only; {repair}"
        )
        self.beam = beam
        self.slope = slope
        self.time = time


class MissingExtraWarning(UserWarning):
    """A part of what was asked for is left out, because it needs an optional extra of vpm; the rest is there."""


class PluginWarning(UserWarning):
    """Another package offers something to vpm that cannot be used; all else works without it."""


class MissingExtraError(VpmError, ImportError):
    """A feature needs a package that is an optional extra of vpm.

    Attributes
    ----------
    package : str
        The package that is not there.
    extra : str
        The extra of ``vpm-dynamics`` that brings it.
    """

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(
            f'this needs the package {package}, which is not installed: pip install "vpm-dynamics[{extra}]"'
        )
        self.package = package
        self.extra = extra

    def __reduce__(self) -> tuple[type[MissingExtraError], tuple[str, str]]:
        return type(self), (self.package, self.extra)


@contextmanager
def refused_as(error: type[VpmError], owner: str = "") -> Iterator[None]:
    """Error of another kind for what the compiled core or a file refuses, after the name of whose fault it is."""
    try:
        yield
    except (ValueError, OverflowError) as cause:
        raise error(f"{owner}: {cause}" if owner else str(cause)) from cause


@contextmanager
def needs(package: str, extra: str) -> Iterator[None]:
    """Error where an optional package is missing: one sentence names the extra that brings it."""
    try:
        yield
    except ImportError as error:
        raise MissingExtraError(package, extra) from error


def near_match(name: str, candidates: Iterable[str], *, what: str = "the choices are") -> str:
    """Repair in an error for an unknown name: the nearest candidate, or the list of them.

    Parameters
    ----------
    what : str
        How the list is announced when nothing is near.

    Returns
    -------
    str
        ``'did you mean "carriage"?'`` or ``'the choices are a, b, c'`` (at most twelve of them).
    """
    known = sorted(set(candidates))
    near = get_close_matches(name, known, n=2, cutoff=0.6)
    if len(near) == 2 and _likeness(name, near[1]) < _likeness(name, near[0]) - 0.1:
        near = near[:1]
    if not near:
        # A part that is right says more than the spelling of the whole: "axis.viscous" of "axis.friction.viscous".
        parts = set(name.split("."))
        near = [candidate for candidate in known if parts <= set(candidate.split("."))][:2]
    if near:
        return "did you mean " + " or ".join(f'"{candidate}"' for candidate in near) + "?"
    if not known:
        return "there are none here"
    shown = known[:12]
    rest = f" and {len(known) - len(shown)} more" if len(known) > len(shown) else ""
    return f"{what} " + ", ".join(shown) + rest


def check_known(
    names: Iterable[str],
    known: Collection[str],
    error: type[VpmError],
    before: str,
    after: str = "",
    *,
    what: str = "the choices are",
) -> None:
    """Error for the first unknown name: what stands ``before`` and ``after`` it in the sentence, and near ones."""
    for name in names:
        if name not in known:
            sentence = f'{before} "{name}" {after}'.strip()
            raise error(f"{sentence}; {near_match(name, known, what=what)}")


def _likeness(left: str, right: str) -> float:
    return SequenceMatcher(None, left, right).ratio()
