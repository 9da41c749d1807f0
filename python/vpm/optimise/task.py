"""Tasks: what a motion shall do and what limits it, read from TOML and fitted to a model."""

import math
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NoReturn, Self

from pydantic import ValidationError

from vpm.errors import ModelError, OptimisationError, UnitError, near_match
from vpm.model import Model
from vpm.model.messages import place
from vpm.model.reading import check_plain, parse_toml, read_toml
from vpm.optimise.schema import GOALS, Boundary, Document, PhaseEntry, Range, schema_problems
from vpm.units import convert

RATE = ".rate"
#: Samples that a log may have.
MOST_SAMPLES = 1_000_000
Keys = tuple[str | int, ...]


@dataclass(frozen=True)
class Limit:
    """A channel between two numbers, SI."""

    channel: str
    unit: str
    #: Infinite where there is none.
    least: float
    most: float

    def near(self, value: float) -> float:
        """Value of a task's limit where a search may begin: its middle, or the nearest to another."""
        if math.isfinite(self.least) and math.isfinite(self.most):
            return 0.5 * (self.least + self.most)
        return min(max(value, self.least), self.most)

    @property
    def size(self) -> float:
        """Largest finite end of a task's limit, or zero."""
        return max((abs(end) for end in (self.least, self.most) if math.isfinite(end)), default=0.0)


@dataclass(frozen=True)
class End:
    """Conditions at the beginning of a motion or at the end of a phase."""

    rest: bool  #: Every rate of the machine is zero under some constant command, so elastic parts are at rest too.
    conditions: tuple[Limit, ...]


@dataclass(frozen=True)
class Phase:
    """A part of the motion."""

    name: str
    #: Bounds of its duration, s.
    shortest: float
    longest: float
    intervals: int  #: Of the first mesh.
    limits: tuple[Limit, ...]
    end: End
    #: Constant commands whose motion the search begins with; a smooth way between the ends without them.
    guess: tuple[Limit, ...] = ()


@dataclass(frozen=True)
class Fitted:
    """A task in the numbers and names of one model."""

    begin: End
    phases: tuple[Phase, ...]
    weights: dict[str, float]  #: Of time, energy and channels at the end, in what is made least.
    obstacles: tuple[tuple[str, tuple[float, ...], float], ...]  #: Marker, center (m) and radius (m) of each ball.
    periodic: bool
    tolerance: float
    refinements: int
    time_step: float
    before: float
    after: float


class Task:
    """What a motion shall do: from where to where, within which limits, and what is made least.

    ``content``: as a task file has it, see docs/optimisation.md.

    Raises
    ------
    OptimisationError
        A key is unknown or missing, or a value is of the wrong kind.
    """

    def __init__(self, content: Mapping[str, object], *, path: str | None = None) -> None:
        self._path = path
        self._content = dict(content)
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
        """Name of the task in its file."""
        return self._document.task

    @property
    def content(self) -> dict[str, Any]:
        """What the file holds, to be changed into another task."""
        return deepcopy(self._content)

    def machine(self, model: Model) -> Model:
        """The model at the level of detail and with the values that the task asks for.

        Raises
        ------
        OptimisationError
            The model has no such level or parameter.
        """
        where = "level"
        try:
            if self._document.level is not None:
                model = model.at(self._document.level)
            where, values = "set", {}
            for name, given in self._document.set.items():
                unit = model.parameters[name].unit if name in model.parameters else "1"
                values[name] = self._limit(given, unit, ("set", name), name).least
            return model.with_parameters(values) if values else model
        except ModelError as error:
            self._refuse(where, f"is wrong: {error}")

    def __repr__(self) -> str:
        goal = ", ".join(self._weights())
        return f"Task({self.name!r}: least {goal}, {max(1, len(self._document.phases))} phase(s))"

    # ---- fitting to a model ------------------------------------------------------------------------------------------

    def fitted(self, model: Model) -> Fitted:
        """The task in the numbers of a model.

        Raises
        ------
        OptimisationError
            A channel is unknown, a unit is wrong, a range is empty, or a limit is missing.
        """
        document = self._document
        phases = tuple(self._phases(model))
        weights = self._weights()
        for name in weights:
            if name not in GOALS:
                self._unit(model, name, ("minimise",))
        fitted = Fitted(
            begin=self._end(model, document.begin, ("begin",)),
            phases=phases,
            weights=weights,
            obstacles=tuple((one.marker, one.center, one.radius) for one in document.obstacles),
            periodic=document.periodic,
            tolerance=document.tolerance,
            refinements=document.refinements,
            time_step=self._time(document.time_step, "time_step"),
            before=self._limit(document.before, "s", ("before",), "before").least if document.begin.rest else 0.0,
            after=self._limit(document.after, "s", ("after",), "after").least,
        )
        self._check_samples(fitted)
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
            one = PhaseEntry(name="motion", duration=document.duration, intervals=document.intervals)
            entries = (one.model_copy(update={"guess": document.guess}),)
        elif document.duration is not None:
            self._refuse("duration", "stands beside phases, which have durations of their own; remove it")
        for at, entry in enumerate(entries):
            keys: Keys = own[at] if own else ()
            duration = self._limit(entry.duration, "s", (*keys, "duration"), "duration")
            if not 0.0 < duration.least <= duration.most < math.inf:
                self._refuse(place(*keys, "duration"), "has to lie between two positive times; give least and most")
            limits = {
                name: self._channel(model, name, given, ("limits", name)) for name, given in document.limits.items()
            }
            for name, given in entry.limits.items():
                limits[name] = self._channel(model, name, given, (*keys, "limits", name))
            end = entry.end
            if at == len(entries) - 1:
                both = {**end.channels, **document.end.channels}
                end = Boundary(rest=end.rest or document.end.rest, channels=both)
            found = self._end(model, end, (*keys, "end"))
            guess = tuple(self._guess(model, name, one, (*keys, "guess", name)) for name, one in entry.guess.items())
            times = (duration.least, duration.most)
            yield Phase(entry.name, *times, entry.intervals, tuple(limits.values()), found, guess)

    def _guess(self, model: Model, name: str, given: Range, keys: Keys) -> Limit:
        if name not in model.input_channels:
            self._refuse(place(*keys), f"is no command; {near_match(name, model.input_channels)}")
        return self._channel(model, name, given, keys)

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

    def _check_samples(self, fitted: Fitted) -> None:
        around = fitted.before + fitted.after
        count = (sum(phase.longest for phase in fitted.phases) + around) / fitted.time_step
        if not (min(fitted.before, fitted.after) >= 0.0 and count <= MOST_SAMPLES):
            rest = f"makes a log of {count:.3g} samples with the longest duration, and {MOST_SAMPLES} fit"
            self._refuse("time_step", f"{rest}; make it longer")

    def _unit(self, model: Model, name: str, keys: Keys) -> str:
        """Unit of a task's channel, state, or rate of one of them."""
        known = {channel: str(model.channel_unit(channel)) for channel in model.output_channels}
        known |= dict(zip(model.state_names, model.state_units, strict=True))
        base = name
        while base not in known and base.endswith(RATE):
            base = base.removesuffix(RATE)
        if base not in known:
            self._refuse(place(*keys), f"is no channel of {model.name}; {near_match(name, known)}")
        rates = (len(name) - len(base)) // len(RATE)
        return known[base] + "/s" * rates if known[base] != "1" or not rates else "1/s" + "/s" * (rates - 1)

    def _check_obstacles(self, model: Model) -> None:
        markers = {name.removesuffix(".x") for name in model.output_channels if name.endswith(".x")}
        for at, one in enumerate(self._document.obstacles):
            if one.marker not in markers:
                rest = f'is "{one.marker}", no marker; {near_match(one.marker, markers)}'
                self._refuse(place("obstacles", at, "marker"), rest)

    def _check_commands(self, model: Model, fitted: Fitted) -> None:
        """Refuse a task without commands, or with a goal that grows without end."""
        if not model.input_channels:
            raise OptimisationError(f"{model.name} has no actuator, so there is no command to find; add one")
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
