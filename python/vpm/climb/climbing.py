"""Model refinement: at each level of detail the new parameters first, then all; validation decides if it pays."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vpm.climb.result import Climb, Level
from vpm.errors import IdentificationError, VpmError
from vpm.experiment import Experiment, as_records
from vpm.identify import Estimate, OutputErrorProblem, estimate, gain, gaps, segments
from vpm.model import Model
from vpm.model.beams.level import size_of
from vpm.numbers import Array
from vpm.simulate import Setup, judging_mode

#: A level pays where it predicts validation records better by so many standard deviations, and by more than this share.
SURE, WORTH = 2.0, 0.02
#: A parameter is seen at a level where the residual moves by more than this share when it changes by its own size.
SEEN = 1e-6
#: What the lowest level is called, and the one with what the actuators do besides following their commands.
RIGID, ACTUATORS = "rigid", "rigid with its actuators"
#: Families of levels that flexible links climb through, where they have fewer coordinates than the model's own.
LINKS = (
    ("lumped(1)", "lumped(2)", "lumped(4)"),
    ("modal(1)", "modal(2)", "modal(3)"),
    ("bezier(2)", "bezier(3)", "bezier(4)"),
    ("elements(2)", "elements(4)", "elements(8)"),
)
#: Levels of one kind, each with its name, the coarsest first.
Family = list[tuple[str, Model]]


class _Remembered(OutputErrorProblem):
    """A problem that remembers its last derivatives: what a level shows at its start is where its fit begins."""

    _last: tuple[Model, Array, tuple[int, ...], tuple[Array, Array]] | None = None

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual and derivative while climbing, see `Problem`; from memory for the same question."""
        if self._last is not None:
            of, at, known, (residual, jacobian) = self._last
            if of is model and set(columns) <= set(known) and np.array_equal(at, theta):
                return residual.copy(), jacobian[:, [known.index(column) for column in columns]]
        found = super().evaluate(model, theta, columns)
        if columns:
            self._last = (model, theta.copy(), tuple(columns), found)
        return found


@dataclass(frozen=True)
class _Data:
    """Training and validation problem of a level: one is fitted, the other judges."""

    train: OutputErrorProblem
    validation: OutputErrorProblem


@dataclass(frozen=True)
class _Reached:
    """A level with its residual on validation records."""

    level: Level
    model: Model
    residual: Array
    #: Parameters that the data know here: where the level above begins. What rests on a bound is not among them.
    known: dict[str, float]


def climb(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    *,
    validate: Experiment | Sequence[Experiment],
    mode: str | None = None,
    channels: Sequence[str] | None = None,
    setup: Setup | None = None,
    patience: int = 2,
    tell: Callable[[str], None] | None = None,
) -> Climb:
    """Climb in detail: identify a model at each level, as far up as validation records tell that it pays.

    The levels are: rigid with ideal actuators, rigid with what the actuators do, then the flexible links from springs
    between rigid segments over modes, Bezier curves and elements to the model's own; of each kind finer ones while the
    error falls. At each the parameters that the data see
    for the first time are fitted alone, then all adjustable ones, from where the level below left them. Ctrl-C ends
    the climb with what is known.

    Parameters
    ----------
    model : Model
        The most detailed one; its adjustable parameters are fitted.
    experiments : Experiment or sequence of Experiment
        To fit on.
    validate : Experiment or sequence of Experiment
        To judge on; the fit does not see them.
    mode : str, optional
        Mode of simulation; by default closed loop or restarts, see `vpm.simulate.judging_mode`.
    channels : sequence of str, optional
        What is compared; by default all measured outputs.
    setup : Setup, optional
        How it steps.
    patience : int
        Kinds of levels in a row of which none pays before it ends.
    tell : callable, optional
        Called with a sentence at every level.

    Raises
    ------
    IdentificationError
        Nothing is adjustable, or not even the lowest level can be simulated.

    Notes
    -----
    A level pays if its residual on validation records is smaller than that of the best level below by `SURE` standard
    deviations, which count how long residuals resemble themselves (`vpm.identify.gain`), and by a share of `WORTH` of
    the mean square.
    """
    if patience < 1:
        raise IdentificationError(f"a patience of {patience} kinds of levels ends before the first; give at least 1")
    if not any(parameter.adjustable for parameter in model.parameters.values()):
        raise IdentificationError(
            f"{model.name}: no parameter is adjustable; give some an uncertainty in the model file"
        )
    say = tell or (lambda _: None)
    records, validation = as_records(experiments), as_records(validate)
    mode = mode or judging_mode(model, records)
    data = _Data(*(_Remembered(model, each, mode, channels=channels, setup=setup) for each in (records, validation)))
    offered = families(model)
    reached: list[_Reached] = []
    vain = 0
    try:
        for family in offered:
            paid = _through(family, data, reached, say)
            vain = 0 if paid else vain + 1
            if vain >= patience:
                break
    except KeyboardInterrupt:
        if not reached:
            raise
        say("interrupted: the levels until here")
    best = _best(reached)
    if best is None:
        raise IdentificationError(
            f"{model.name}: no level can be simulated on these records; look at `vpm compare` first"
        )
    tried = {step.level.name for step in reached}
    left = tuple(name for family in offered for name, _ in family if name not in tried)
    return Climb(tuple(step.level for step in reached), best.level.name, left, mode, best.model)


def _through(family: Family, data: _Data, reached: list[_Reached], say: Callable[[str], None]) -> bool:
    """Climb through levels of one kind, finer as long as that lowers the error; whether one paid."""
    paid, error = False, np.inf
    for name, machine in family:
        say(name)
        step = _climbed(name, machine, data, reached[-1] if reached else None, _best(reached))
        if step is None:
            continue
        reached.append(step)
        paid = paid or step.level.pays
        if not step.level.error < error:
            break
        error = step.level.error
    return paid


def _best(reached: Sequence[_Reached]) -> _Reached | None:
    """The last level of a climb that paid."""
    return next((step for step in reversed(reached) if step.level.pays), None)


def _climbed(name: str, machine: Model, data: _Data, below: _Reached | None, best: _Reached | None) -> _Reached | None:
    """Level climbed, fitted and judged on validation records; None where it cannot be simulated."""
    known = {} if below is None else below.known
    try:
        start = _start(machine, known, data.train)
        seen = _seen(start, data.train)
        unknown = tuple(key for key in seen if key not in known)
        fitted = start
        # What is new would otherwise begin where it was guessed, and pull what is known away from where it belongs.
        if known and unknown:
            fitted = _fitted(start, data.train, unknown)[0]
        fitted, found = _fitted(fitted, data.train, seen) if seen else (fitted, None)
        residual, _ = data.validation.evaluate(fitted, fitted.theta)
    except VpmError:
        return None
    touching = () if found is None else found.at_bounds
    score, pays = np.inf, True
    if best is not None:
        change = gain(best.residual, residual, segments(data.validation))
        score, pays = -change.harm, -change.harm > SURE and change.relative > WORTH
    level = Level(
        name=name,
        states=machine.core.n_states,
        freed=tuple(key for key in seen if below is None or key not in below.level.values),
        values={} if found is None else dict(zip(found.names, map(float, found.values), strict=True)),
        std={} if found is None else dict(zip(found.names, map(float, found.std), strict=True)),
        errors={channel: share for channel, (_, share, _) in gaps(data.validation, residual).items()},
        score=float(score),
        pays=bool(pays),
    )
    known = {key: value for key, value in level.values.items() if level.std[key] < abs(value) and key not in touching}
    return _Reached(level, fitted, residual, known)


def _start(machine: Model, known: dict[str, float], problem: OutputErrorProblem) -> Model:
    """Start of a climbed level: parameters of the level below, or its own where nearer to the data."""
    learnt = machine.with_parameters({key: value for key, value in known.items() if key in machine.parameters})
    if np.array_equal(learnt.theta, machine.theta):
        return machine
    costs = []
    for each in (learnt, machine):
        residual, _ = problem.evaluate(each, each.theta)
        costs.append(float(residual @ residual))
    return learnt if costs[0] <= costs[1] else machine


def _seen(machine: Model, problem: OutputErrorProblem) -> tuple[str, ...]:
    """Adjustable parameters that the data show at a climbed level."""
    free = [parameter for parameter in machine.parameters.values() if parameter.adjustable]
    residual, jacobian = problem.evaluate(machine, machine.theta, [machine.index(each.name) for each in free])
    size = np.linalg.norm(residual)
    scales = [abs(each.value) or 1.0 for each in free]
    moves = np.linalg.norm(jacobian, axis=0) * scales
    return tuple(each.name for each, move in zip(free, moves, strict=True) if move > SEEN * size)


def _fitted(machine: Model, problem: OutputErrorProblem, free: Sequence[str]) -> tuple[Model, Estimate]:
    found = estimate(machine, problem, free)
    return found.on(machine), found


def families(model: Model) -> list[Family]:
    """Levels to climb, by kind, the simplest first, the machine's own last.

    Effects at actuators (a lag, a delay, a dead zone) are left out of the lowest one; flexible links are rigid in it.
    Levels of links whose model would not be a valid one are skipped.
    """
    content = model.to_dict()
    beams: Mapping[str, Any] = content.get("beams", {})
    stiff = model.at(dict.fromkeys(beams, "rigid")) if beams else model
    ideal = stiff
    for effect in stiff.effects:
        if effect.at in model.actuators:
            ideal = ideal.without_effect(*effect.key)
    found = [[(RIGID, ideal)]]
    if len(ideal.effects) < len(stiff.effects):
        found.append([(ACTUATORS, stiff)])
    if not any(size_of(beam["level"], beam) for beam in beams.values()):
        return found
    for family in LINKS:
        made = [(level, each) for level in family if (each := _made(model, beams, level)) is not None]
        found += [made] if made else []
    own = ", ".join(dict.fromkeys(str(beam["level"]) for beam in beams.values()))
    return [*found, [(own, model)]]


def _made(model: Model, beams: Mapping[str, Any], level: str) -> Model | None:
    """Model of a climbed level, links at most as fine as their own; None where nothing changes."""
    finer = {name: level for name, beam in beams.items() if 0 < size_of(level, beam) < size_of(beam["level"], beam)}
    if not finer:
        return None
    try:
        made = model.at(finer)
        _ = made.core
    except VpmError:
        return None
    return made
