"""Tasks: what a motion shall do and what limits it, read from TOML and fitted to a model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NoReturn, Self

from pydantic import ValidationError

from vpm.errors import ModelError, OptimisationError, UnitError, near_match
from vpm.model import Model
from vpm.model.messages import check_plain, parse_toml, place, read_toml
from vpm.optimise.schema import GOALS, Boundary, Document, PhaseEntry, Range, schema_problems
from vpm.units import convert

RATE = ".rate"
Keys = tuple[str | int, ...]


@dataclass(frozen=True)
class Limit:
    """A channel between two numbers, SI.

    Attributes
    ----------
    channel, unit : str
    least, most : float
        Infinite where there is none.
    """

    channel: str
    unit: str
    least: float
    most: float

    @property
    def size(self) -> float:
        """The largest finite end, or zero."""
        return max((abs(end) for end in (self.least, self.most) if math.isfinite(end)), default=0.0)


@dataclass(frozen=True)
class End:
    """What holds at an instant.

    Attributes
    ----------
    rest : bool
        Every rate of the machine is zero under some constant command, so elastic parts are at rest too.
    conditions : tuple of Limit
    """

    rest: bool
    conditions: tuple[Limit, ...]


@dataclass(frozen=True)
class Phase:
    """A part of the motion.

    Attributes
    ----------
    name : str
    shortest, longest : float
        Bounds of its duration, s.
    intervals : int
        Of the first mesh.
    limits : tuple of Limit
    end : End
    """

    name: str
    shortest: float
    longest: float
    intervals: int
    limits: tuple[Limit, ...]
    end: End


@dataclass(frozen=True)
class Fitted:
    """A task in the numbers and names of one model.

    Attributes
    ----------
    begin : End
    free : tuple of str
        States that the optimisation chooses at the beginning.
    phases : tuple of Phase
    weights : dict of str to float
        Of time, energy and channels at the end, in what is made least.
    obstacles : tuple
        Marker, center (m) and radius (m) of each ball.
    """

    begin: End
    free: tuple[str, ...]
    phases: tuple[Phase, ...]
    weights: dict[str, float]
    obstacles: tuple[tuple[str, tuple[float, ...], float], ...]
    periodic: bool
    tolerance: float
    refinements: int
    time_step: float
    after: float


class Task:
    """What a motion shall do: from where to where, within which limits, and what is made least.

    Parameters
    ----------
    content : mapping
        As a task file has it, see docs/optimisation.md.

    Raises
    ------
    OptimisationError
        A key is unknown or missing, or a value is of the wrong kind.
    """

    def __init__(self, content: Mapping[str, object], *, path: str | None = None) -> None:
        self._path = path
        try:
            check_plain(content, path)
            self._document = Document.model_validate(content)
        except ModelError as error:
            raise OptimisationError(str(error), path=path) from None
        except ValidationError as error:
            problem = schema_problems(error)[0]
            self._refuse(problem.where, problem.rest)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Task of a TOML file."""
        try:
            return cls(read_toml(path), path=str(Path(path)))
        except ModelError as error:
            raise OptimisationError(str(error), path=str(path)) from None

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Task of a TOML text."""
        try:
            return cls(parse_toml(text))
        except ModelError as error:
            raise OptimisationError(str(error)) from None

    @property
    def name(self) -> str:
        """What the file calls it."""
        return self._document.task

    def __repr__(self) -> str:
        goal = ", ".join(self._weights())
        return f"Task({self.name!r}: least {goal}, {max(1, len(self._document.phases))} phase(s))"

    # ---- fitting to a model ------------------------------------------------------------------------------------------

    def fitted(self, model: Model) -> Fitted:
        """The task in the numbers of a model.

        Raises
        ------
        OptimisationError
            A channel is unknown, a unit is wrong, a range is empty, or a limit is missing without which nothing is least.
        """
        document = self._document
        phases = tuple(self._phases(model))
        weights = self._weights()
        for name in weights:
            if name not in GOALS:
                self._unit(model, name, ("minimise",))
        known = {*model.state_names}
        for name in document.begin.free:
            if name not in known:
                self._refuse(place("begin", "free"), f'names "{name}", no state; {near_match(name, known)}')
        fitted = Fitted(
            begin=self._end(model, document.begin, ("begin",)),
            free=document.begin.free,
            phases=phases,
            weights=weights,
            obstacles=tuple((one.marker, one.center, one.radius) for one in document.obstacles),
            periodic=document.periodic,
            tolerance=document.tolerance,
            refinements=document.refinements,
            time_step=self._time(document.time_step, "time_step"),
            after=self._limit(document.after, "s", ("after",), "after").least,
        )
        self._check_obstacles(model)
        self._check_commands(model, fitted)
        return fitted

    def _phases(self, model: Model) -> Iterator[Phase]:
        document = self._document
        own = [("phases", at) for at in range(len(document.phases))]
        entries = document.phases
        if not entries:
            if document.duration is None:
                self._refuse("duration", "is missing; add for example duration = { least = 0.1, most = 2.0 }")
            entries = (PhaseEntry(name="motion", duration=document.duration, intervals=document.intervals),)
        elif document.duration is not None:
            self._refuse("duration", "stands beside phases, which have durations of their own; remove it")
        for at, entry in enumerate(entries):
            keys: Keys = own[at] if own else ()
            duration = self._limit(entry.duration, "s", (*keys, "duration"), "duration")
            if not 0.0 < duration.least <= duration.most < math.inf:
                self._refuse(place(*keys, "duration"), "has to lie between two positive times; give least and most")
            limits = {name: self._channel(model, name, given, ("limits", name)) for name, given in document.limits.items()}
            for name, given in entry.limits.items():
                limits[name] = self._channel(model, name, given, (*keys, "limits", name))
            end = entry.end
            if at == len(entries) - 1:
                both = {**end.channels, **document.end.channels}
                end = Boundary(rest=end.rest or document.end.rest, channels=both)
            found = self._end(model, end, (*keys, "end"))
            yield Phase(entry.name, duration.least, duration.most, entry.intervals, tuple(limits.values()), found)

    def _end(self, model: Model, given: Boundary, keys: Keys) -> End:
        found = (self._channel(model, name, one, (*keys, name)) for name, one in given.channels.items())
        return End(given.rest, tuple(found))

    def _weights(self) -> dict[str, float]:
        document = self._document
        if (document.minimise is None) == (document.maximise is None):
            self._refuse("minimise", 'or maximise has to stand in the file, one of them; write minimise = "time"')
        if document.maximise is not None:
            return {document.maximise: -1.0}
        given = document.minimise
        return {given: 1.0} if isinstance(given, str) else dict(given or {})

    def _channel(self, model: Model, name: str, given: Range, keys: Keys) -> Limit:
        return self._limit(given, self._unit(model, name, keys), keys, name)

    def _limit(self, given: Range, unit: str, keys: Keys, name: str) -> Limit:
        least = given.least if given.value is None else given.value
        most = given.most if given.value is None else given.value
        ends = []
        for end, none in ((least, -math.inf), (most, math.inf)):
            try:
                ends.append(none if end is None else convert(end, given.unit, unit) if given.unit else end)
            except UnitError as error:
                self._refuse(place(*keys), f"is wrong: {error}")
        if ends[0] > ends[1]:
            self._refuse(place(*keys), f"has the least value {least} above the most, {most}; exchange them")
        return Limit(name, unit, ends[0], ends[1])

    def _time(self, given: Range, name: str) -> float:
        found = self._limit(given, "s", (name,), name).least
        if not 0.0 < found < math.inf:
            self._refuse(name, f"is {found:g} s, but has to be above 0 s; correct it")
        return found

    def _unit(self, model: Model, name: str, keys: Keys) -> str:
        """Unit of a channel, a state, or the rate of one of them."""
        states = dict(zip(model.state_names, model.state_units, strict=True))
        if name in model.output_channels:
            return str(model.channel_unit(name))
        if name in states:
            return states[name]
        if name.endswith(RATE):
            unit = self._unit(model, name.removesuffix(RATE), keys)
            return "1/s" if unit == "1" else f"{unit}/s"
        self._refuse(place(*keys), f"is no channel of {model.name}; {near_match(name, (*model.output_channels, *states))}")

    def _check_obstacles(self, model: Model) -> None:
        markers = {name.removesuffix(".x") for name in model.output_channels if name.endswith(".x")}
        for at, one in enumerate(self._document.obstacles):
            if one.marker not in markers:
                rest = f'is "{one.marker}", no marker; {near_match(one.marker, markers)}'
                self._refuse(place("obstacles", at, "marker"), rest)

    def _check_commands(self, model: Model, fitted: Fitted) -> None:
        """Nothing is least where a command may grow without end."""
        if fitted.weights.get("energy", 0.0) > 0.0:
            return
        for name in model.input_channels:
            for phase in fitted.phases:
                found = next((one for one in phase.limits if one.channel == name), None)
                if found is None or not math.isfinite(found.least) or not math.isfinite(found.most):
                    rest = "has no least or no most, and without energy in minimise a command may grow without end"
                    self._refuse(place("limits", name), f"{rest}; give both")

    def _refuse(self, where: str, rest: str) -> NoReturn:
        head = f"{self._path}: " if self._path else ""
        raise OptimisationError(f"{head}{where} {rest}", where=where, path=self._path)


def as_task(given: Task | Mapping[str, Any] | str | PathLike[str]) -> Task:
    """A task, the content of one, or the path of its file."""
    if isinstance(given, Task):
        return given
    return Task(given) if isinstance(given, Mapping) else Task.load(given)
