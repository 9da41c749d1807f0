"""A case: a nominal model as text, records of a machine that is not quite like that, and the truth about it.

Cases are made in batches, because many records side by side cost hardly more than one: every record is a column of the
state arrays. Each case brings columns of its own for the oracle: the same motion without noise, without the hidden
effect, and with each calibratable parameter a little different.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from blind.effects import EFFECTS
from blind.loop import Actuators, Inputs, Sensors, closed_loop
from blind.machine import Draft, Layout, Machine
from blind.machines import MACHINES
from blind.noise import normal
from blind.oracle import Oracle, judge
from vpm.experiment import Experiment
from vpm.model import Model

Array = NDArray[np.float64]

#: Kinds of the records of a case.
RECORDS = ("train", "train", "validate")
#: Largest error of a nominal parameter where an effect is hidden, and range of it where nothing but that is wrong.
OFF, CLEARLY_OFF = 0.1, (0.1, 0.25)
#: Relative step of the oracle's sensitivities.
NUDGE = 0.02
#: Numbers that the outputs of one batch may have, for the sake of memory, and columns beyond which nothing is won.
LARGEST_BATCH, MOST_COLUMNS = 4e7, 1200
#: Longest record [s].
LONGEST = 12.0
NOTHING, PARAMETERS = "none", "parameters"


@dataclass(frozen=True)
class Hidden:
    """An effect that the nominal model lacks: name, site as in the model, parameters; known to the catalogue or not."""

    name: str
    site: str
    parameters: Mapping[str, float]
    known: bool


@dataclass(frozen=True)
class Truth:
    """What is really there: hidden effects, and true and nominal values of what may be calibrated."""

    hidden: tuple[Hidden, ...]
    parameters: Mapping[str, float]
    nominal: Mapping[str, float]
    wrong: tuple[str, ...] = ()


@dataclass(frozen=True)
class Case:
    """One case of the proving ground."""

    machine: str
    seed: int
    noise_level: float
    model_text: str
    train: tuple[Experiment, ...]
    validate: tuple[Experiment, ...]
    truth: Truth
    oracle: Oracle

    def model(self) -> Model:
        """The nominal model."""
        return Model.from_toml(self.model_text)


@dataclass
class _Plan:
    """A case before it is simulated."""

    machine: Machine
    seed: int
    noise_level: float
    draft: Draft
    base: tuple[tuple[str, str], ...]
    truth: Truth
    with_effect: dict[str, float]
    without: dict[str, float]
    generator: Generator
    references: list[Array] = field(default_factory=list)
    free: tuple[str, ...] = ()
    """Parameters that the oracle recalibrates."""


def sites_of(machine: str, effect: str) -> tuple[str, ...]:
    """Sites of a machine at which an effect can be hidden; none if it makes no sense there."""
    layout = MACHINES[machine].layout
    return () if effect in layout.without else layout.sites.get(EFFECTS[effect].site, ())


def hideable(machine: str, *, known: bool | None = None) -> tuple[str, ...]:
    """Effects that can be hidden in a machine; only those that the catalogue has, or has not, if that is said."""
    names = (name for name, effect in EFFECTS.items() if known is None or effect.known == known)
    return tuple(name for name in names if sites_of(machine, name))


def make_case(
    machine: str, hidden: str | Sequence[str], seed: int, noise_level: float = 1.0, *, recalibrate: bool = True
) -> Case:
    """One case; see `make_cases`, which is much quicker for many."""
    return make_cases(machine, [(hidden, seed)], noise_level, recalibrate=recalibrate)[0]


def make_cases(
    machine: str,
    requests: Iterable[tuple[str | Sequence[str], int]],
    noise_level: float = 1.0,
    *,
    recalibrate: bool = True,
) -> list[Case]:
    """Cases of one machine.

    Parameters
    ----------
    machine : str
        One of ``MACHINES``.
    requests : iterable of (hidden, seed)
        What to hide: ``"none"`` (the nominal model is exact), ``"parameters"`` (it has wrong parameters, no more), the
        name of an effect, or several. ``"coulomb_friction@elbow"`` says where; otherwise the seed does.
    noise_level : float
        Factor of the noise of all sensors and drives; the counts of encoders stay.
    recalibrate : bool
        Whether the oracle allows for other values of the calibratable parameters. That takes a column for each of them,
        which makes machines with many parameters three times as slow; without it, its recalibrated gap is the plain
        one.

    Raises
    ------
    ValueError
        An effect makes no sense on the machine.
    """
    plans = [_plan(MACHINES[machine], hidden, seed, noise_level) for hidden, seed in requests]
    for plan in plans:
        plan.free = tuple(plan.truth.nominal) if recalibrate else ()
    cases: dict[int, Case] = {}
    for rate in sorted({plan.draft.rate for plan in plans}):
        chosen = [k for k, plan in enumerate(plans) if plan.draft.rate == rate]
        layout = MACHINES[machine].layout
        width = len(RECORDS) * max(3 + len(plans[k].free) for k in chosen)
        numbers = LONGEST * rate * (len(layout.sensors) + len(layout.commands))
        size = max(1, int(min(MOST_COLUMNS, LARGEST_BATCH / numbers) / width))
        for begin in range(0, len(chosen), size):
            part = chosen[begin : begin + size]
            cases.update(zip(part, _simulate([plans[k] for k in part]), strict=True))
    return [cases[k] for k in range(len(plans))]


def _plan(machine: Machine, hidden: str | Sequence[str], seed: int, noise_level: float) -> _Plan:
    """Draw everything that a case needs."""
    names = (hidden,) if isinstance(hidden, str) else tuple(hidden)
    generator = np.random.default_rng([seed, zlib.crc32(machine.name.encode())])
    effects = [_placed(machine, name, seed) for name in names if name not in {NOTHING, PARAMETERS}]
    needs = [f"{need}@{site}" for name, site in effects for need in EFFECTS[name].needs]
    draft = machine.draft(generator, needs)
    found = []
    for name, site in effects:
        drawn = EFFECTS[name].draw(_own_generator(machine, name, seed), draft.scales[site])
        found.append(Hidden(name, site, drawn, EFFECTS[name].known))
    absent = {f"{name}@{site}" for name, site in effects} - set(needs)
    base = tuple((name, site) for name, site in draft.base if f"{name}@{site}" not in absent)
    keys = {f"{h.site}.{h.name}.{p}": value for h in found for p, value in h.parameters.items()}
    without = {k: v for k, v in draft.values.items() if k not in keys}
    for hidden_effect in found:
        for parameter, value in machine.layout.absent.get(hidden_effect.name, {}).items():
            without[f"{hidden_effect.site}.{hidden_effect.name}.{parameter}"] = value
    stiff = {f"{h.site}.bending" for h in found if h.name == "link_flexibility"}
    free = {k: v for k, v in without.items() if k in draft.calibratable and k not in stiff}
    nominal, wrong = _nominal(generator, free, names)
    truth = Truth(tuple(_as_catalogued(h, draft.values) for h in found), free, nominal, wrong)
    return _Plan(machine, seed, noise_level, draft, base, truth, {**without, **keys}, without, generator)


def _own_generator(machine: Machine, name: str, seed: int) -> Generator:
    """Numbers for one effect: all effects of a seed act on one machine, but are not all large or all small."""
    return np.random.default_rng([seed, zlib.crc32(f"{machine.name} {name}".encode())])


def _placed(machine: Machine, name: str, seed: int) -> tuple[str, str]:
    """Effect and site of a request such as ``"coulomb_friction@elbow"``; without a site, the seed says where."""
    effect, _, site = name.partition("@")
    sites = sites_of(machine.name, effect) if effect in EFFECTS else ()
    if not sites or (site and site not in sites):
        raise ValueError(f'"{name}" makes no sense on {machine.name}; it has {", ".join(hideable(machine.name))}')
    return effect, site or str(_own_generator(machine, f"place of {effect}", seed).choice(sites))


def _nominal(
    generator: Generator, true: Mapping[str, float], names: tuple[str, ...]
) -> tuple[dict[str, float], tuple[str, ...]]:
    """What the model file believes of the calibratable parameters, and which of them are clearly wrong."""
    if names == (NOTHING,):
        return dict(true), ()
    off = {key: float(generator.uniform(-OFF, OFF)) for key in true}
    wrong: tuple[str, ...] = ()
    if names == (PARAMETERS,):
        wrong = (str(generator.choice(list(true))),)
        off[wrong[0]] = float(generator.choice((-1.0, 1.0)) * generator.uniform(*CLEARLY_OFF))
    return {key: value * (1.0 + off[key]) for key, value in true.items()}, wrong


def _as_catalogued(hidden: Hidden, values: Mapping[str, float]) -> Hidden:
    """The same with parameters that say what is there: the gain of a sensor, the stiffness of a link [N m^2]."""
    if hidden.name == "sensor_gain":
        return Hidden(hidden.name, hidden.site, {"value": 1.0 + hidden.parameters["excess"]}, hidden.known)
    if hidden.name == "link_flexibility":
        bending = values[f"{hidden.site}.bending"] * hidden.parameters["share"]
        return Hidden(hidden.name, hidden.site, {"bending": bending}, hidden.known)
    return hidden


def _simulate(plans: Sequence[_Plan]) -> list[Case]:
    """Run all records of plans with one sampling rate side by side."""
    machine, dt = plans[0].machine, 1.0 / plans[0].draft.rate
    fine = max(5, round(dt / machine.step))
    columns: list[dict[str, float]] = []
    references: list[Array] = []
    noise: list[Array] = []
    owner: list[int] = []
    loud: list[int] = []
    noisy = [signal.name for signal in (*machine.layout.commands, *machine.layout.sensors)]
    for plan in plans:
        for kind in RECORDS:
            time = np.arange(round(float(plan.generator.uniform(9.0, LONGEST)) / dt), dtype=np.float64) * dt
            path = machine.reference(plan.generator, plan.draft, time, kind)
            plan.references.append(path)
            members = _columns(plan, noisy)
            loud.append(len(columns))
            owner += [len(references)] * len(members)
            columns += members
            references.append(path)
            noise.append(normal(plan.generator, len(time), len(noisy)))
    longest = max(len(n) for n in noise)
    held = np.stack([np.pad(path, ((0, 0), (0, longest - path.shape[1])), mode="edge").T for path in references], -1)
    padded = np.stack([np.pad(n, ((0, longest - len(n)), (0, 0))) for n in noise], -1)
    drives = [signal.name for signal in machine.layout.commands]
    sensors = [signal.name for signal in machine.layout.sensors]
    with np.errstate(all="ignore"):
        both = closed_loop(
            machine.plant(columns, dt / fine),
            machine.controller(columns, dt),
            Actuators(drives, columns, dt, fine),
            Sensors(sensors, columns, dt, fine),
            Inputs(held, np.array(owner), padded, np.array(loud)),
            dt,
            fine,
        )
    cases, place = [], 0
    for plan in plans:
        width = 3 + len(plan.free)
        pieces = []
        for path in plan.references:
            pieces.append(both[: path.shape[1], :, place : place + width])
            place += width
        cases.append(_case(plan, pieces, dt))
    return cases


def _columns(plan: _Plan, noisy: Sequence[str]) -> list[dict[str, float]]:
    """As measured, without noise, without the effect, and that with each parameter a little different."""
    loud = {f"{name}.noise": plan.with_effect[f"{name}.noise"] * plan.noise_level for name in noisy}
    silent = {f"{name}.{what}": 0.0 for name in noisy for what in ("noise", "quantum")}
    bare = {**plan.without, **silent}
    nudged = [{**bare, key: bare[key] * (1.0 + NUDGE)} for key in plan.free]
    return [{**plan.with_effect, **loud}, {**plan.with_effect, **silent}, bare, *nudged]


def _case(plan: _Plan, pieces: list[Array], dt: float) -> Case:
    layout = plan.machine.layout
    if not all(np.isfinite(piece).all() for piece in pieces):
        raise FloatingPointError(
            f"{plan.machine.name} with {plan.truth.hidden} and seed {plan.seed} does not stay finite"
        )
    records = [
        _experiment(layout, piece[:, :, 0], path, dt, f"{kind} {k}")
        for k, (kind, piece, path) in enumerate(zip(RECORDS, pieces, plan.references, strict=True))
    ]
    channels = [signal.channel for signal in (*layout.sensors, *layout.commands)]
    quanta = np.array([plan.without[f"{signal.name}.quantum"] for signal in layout.sensors])
    deviations = np.array([plan.without[f"{signal.name}.noise"] for signal in layout.sensors]) * plan.noise_level
    sensed = np.hypot(deviations, quanta / np.sqrt(12.0))
    nominal = {**plan.without, **plan.truth.nominal}
    mixed = plan.machine.mixed(plan.without)
    return Case(
        machine=plan.machine.name,
        seed=plan.seed,
        noise_level=plan.noise_level,
        model_text=plan.machine.text(nominal, plan.draft, plan.base),
        train=tuple(r for r, kind in zip(records, RECORDS, strict=True) if kind == "train"),
        validate=tuple(r for r, kind in zip(records, RECORDS, strict=True) if kind == "validate"),
        truth=plan.truth,
        oracle=judge(channels, sensed, pieces, [kind == "train" for kind in RECORDS], NUDGE, dt, mixed),
    )


def _experiment(layout: Layout, values: Array, path: Array, dt: float, name: str) -> Experiment:
    signals = (*layout.sensors, *layout.commands)
    data = {signal.channel: values[:, k] for k, signal in enumerate(signals)}
    data |= {signal.channel: path[k] for k, signal in enumerate(layout.references)}
    units = {signal.channel: signal.unit for signal in (*signals, *layout.references)}
    return Experiment.from_arrays(dt * np.arange(len(values)), data, units=units, name=name)
