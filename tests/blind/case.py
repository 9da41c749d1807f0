"""A case: a nominal model as text, records of a machine that is not quite like that, and the truth about it.

Cases are made in batches, because many records side by side cost hardly more than one: every record is a column of the
state arrays. Each case brings columns for the oracle: the same motion without noise, without the hidden effect, and
with each calibratable parameter a little different. All cases of a seed have one machine and one set of motions, so the
columns without an effect, which are most of them, are simulated once for all (`blind.batch`).
"""

import json
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.random import Generator

from blind.batch import NUDGE, Hidden, Plan, Truth, batches, simulated
from blind.effects import EFFECTS
from blind.machine import Draft, Layout, Machine
from blind.machines import MACHINES
from blind.oracle import Oracle, judge
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array

#: Kinds of the records of a case.
RECORDS = ("train", "train", "validate")
#: Largest error of a nominal parameter where an effect is hidden, and range of it where nothing but that is wrong.
OFF, CLEARLY_OFF = 0.1, (0.1, 0.25)
#: Shortest and longest record [s].
SHORTEST, LONGEST = 9.0, 12.0
NOTHING, PARAMETERS = "none", "parameters"
#: Effects that others refine.
NEEDED = frozenset(need for effect in EFFECTS.values() for need in effect.needs)


@dataclass(frozen=True)
class Case:
    """One case of the proving ground."""

    #: As asked for.
    machine: str
    seed: int
    noise_level: float
    #: The nominal model, and the same with the true values of its parameters: both lack the hidden effects.
    model_text: str
    true_text: str
    #: Records to fit and to judge.
    train: tuple[Experiment, ...]
    validate: tuple[Experiment, ...]
    truth: Truth
    oracle: Oracle

    def model(self) -> Model:
        """The nominal model."""
        return Model.from_toml(self.model_text)

    def write(self, folder: Path) -> None:
        """Write model.toml, train_1.csv, train_2.csv, validate.csv for ``vpm diagnose``, and truth.json."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "model.toml").write_text(self.model_text, encoding="utf-8")
        for k, record in enumerate(self.train, 1):
            record.to_csv(folder / f"train_{k}.csv")
        for record in self.validate:
            record.to_csv(folder / "validate.csv")
        truth = {"machine": self.machine, "seed": self.seed, "strength": self.oracle.strength, **asdict(self.truth)}
        (folder / "truth.json").write_text(json.dumps(truth, indent=2) + "\n", encoding="utf-8")


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

    - ``machine``: one of ``MACHINES``
    - ``requests``: what to hide: ``"none"`` (the nominal model is exact), ``"parameters"`` (it has wrong parameters, no
      more), the name of an effect, or several. ``"coulomb_friction@elbow"`` says where; otherwise the seed does.
    - ``noise_level``: factor of the noise of all sensors and drives; the counts of encoders stay
    - ``recalibrate``: whether the oracle allows for other values of the calibratable parameters. That takes a column
      for each of them, which makes machines with many parameters three times as slow; without it, its recalibrated gap
      is the plain one.

    Raises
    ------
    ValueError
        An effect makes no sense on the machine.
    """
    made = try_cases(machine, requests, noise_level, recalibrate=recalibrate)
    for case in made:
        if isinstance(case, FloatingPointError):
            raise case
    return [case for case in made if isinstance(case, Case)]


def try_cases(
    machine: str,
    requests: Iterable[tuple[str | Sequence[str], int]],
    noise_level: float = 1.0,
    *,
    recalibrate: bool = True,
) -> list[Case | FloatingPointError]:
    """The same, but a case whose simulation does not stay finite gives its error in its place."""
    return _cases(
        [_plan(MACHINES[machine], hidden, seed, noise_level, recalibrate=recalibrate) for hidden, seed in requests]
    )


def strengths_beside(
    machine: str, requests: Iterable[tuple[Sequence[str], str, int]], noise_level: float = 1.0
) -> list[float]:
    """How far one effect stands clear of the noise where another one is there, whose parameters nobody knows either.

    ``requests``: the two that are hidden, and which of them is judged.
    Result: as `Oracle.strength`, NaN where the simulation does not stay finite.
    """
    plans = [_plan(MACHINES[machine], hidden, seed, noise_level, judged=name) for hidden, name, seed in requests]
    return [case.oracle.strength if isinstance(case, Case) else np.nan for case in _cases(plans)]


def _cases(plans: Sequence[Plan]) -> list[Case | FloatingPointError]:
    cases: dict[int, Case | FloatingPointError] = {}
    for batch in batches(plans):
        for k, pieces in simulated([plans[k] for k in batch]):
            cases[batch[k]] = _case(plans[batch[k]], pieces)
    return [cases[k] for k in range(len(plans))]


def _plan(
    machine: Machine,
    hidden: str | Sequence[str],
    seed: int,
    noise_level: float,
    *,
    recalibrate: bool = True,
    judged: str = "",
) -> Plan:
    """Draw everything that a case needs; with ``judged``, the oracle is asked for that one of the hidden effects."""
    names = (hidden,) if isinstance(hidden, str) else tuple(hidden)
    drawn = np.random.default_rng([seed, zlib.crc32(machine.name.encode())])
    effects = [_placed(machine, name, seed) for name in names if name not in {NOTHING, PARAMETERS}]
    needs = [f"{need}@{site}" for name, site in effects for need in EFFECTS[name].needs]
    draft = machine.draft(drawn, needs)
    found = _drawn(machine, draft, effects, seed)
    absent = {f"{name}@{site}" for name, site in effects}
    base = tuple((name, site) for name, site in draft.base if f"{name}@{site}" not in absent)
    keys = _keys(found)
    given = _keys(
        [h for (name, _), h in zip(effects, found, strict=True) if judged and name != judged.partition("@")[0]]
    )
    without = {k: v for k, v in draft.values.items() if k not in keys}
    for hidden_effect in found:
        for parameter, value in machine.layout.absent.get(hidden_effect.name, {}).items():
            without[f"{hidden_effect.site}.{hidden_effect.name}.{parameter}"] = value
    stiff = {f"{h.site}.bending" for h in found if h.name == "link_flexibility"}
    free = {k: v for k, v in without.items() if k in draft.calibratable and k not in stiff}
    own = _own_generator(machine, f"case of {' '.join(names)}", seed)
    nominal, wrong = _nominal(own, free, names)
    truth = Truth(tuple(_as_catalogued(h, draft.values) for h in found), free, nominal, wrong)
    paths = _paths(machine, draft, _own_generator(machine, "motion", seed))
    varied = (*nominal, *given) if recalibrate else ()
    missing = {key: value for key, value in keys.items() if key not in given}
    there, bare = {**without, **keys}, {**without, **given, **_starts(machine.layout, missing)}
    return Plan(machine, seed, noise_level, draft, base, truth, there, bare, varied, paths, own)


def _keys(hidden: Sequence[Hidden]) -> dict[str, float]:
    """Parameters of effects under the names that the generators know them by."""
    return {f"{h.site}.{h.name}.{p}": value for h in hidden for p, value in h.parameters.items()}


def _starts(layout: Layout, keys: Mapping[str, float]) -> dict[str, float]:
    """Where the machine without the effect begins: where its encoders read what those with an offset read.

    What the loop makes of a first error of the place says where the machine was put, which no log knows, and nothing of
    where its encoder has its zero.
    """
    shifts = {s.channel: keys.get(f"{s.name}.sensor_offset.value", 0.0) for s in layout.sensors}
    moved = {channel.rpartition(".position")[0]: shift for channel, shift in shifts.items() if shift}
    return {f"{joint}.start": shift for joint, shift in moved.items() if joint}


def _drawn(machine: Machine, draft: Draft, effects: Sequence[tuple[str, str]], seed: int) -> list[Hidden]:
    """Effects with their sizes, in the order asked for; what refines another hidden one is drawn beside its true size.

    A difference between directions, say, is bounded by the friction that is there, hidden or not.
    """
    scales = dict(draft.scales)
    hidden: dict[tuple[str, str], Hidden] = {}
    for name, site in sorted(effects, key=lambda effect: len(EFFECTS[effect[0]].needs)):
        parameters = EFFECTS[name].draw(_own_generator(machine, name, seed), scales[site])
        hidden[name, site] = Hidden(name, site, parameters, EFFECTS[name].known)
        same = {key: value for key, value in parameters.items() if key in {"coulomb", "viscous"}}
        if name in NEEDED:
            scales[site] = replace(scales[site], **same)
    return [hidden[effect] for effect in effects]


def _paths(machine: Machine, draft: Draft, generator: Generator) -> tuple[Array, ...]:
    """References of the records: all cases of a seed have the same."""
    paths = []
    for kind in RECORDS:
        time = np.arange(round(float(generator.uniform(SHORTEST, LONGEST)) * draft.rate), dtype=np.float64) / draft.rate
        paths.append(machine.reference(generator, draft, time, kind))
    return tuple(paths)


def _own_generator(machine: Machine, name: str, seed: int) -> Generator:
    """Numbers of their own: all effects of a seed act on one machine, but are not all large or all small."""
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
    """The same with names that say what is there: gain, stiffness of a link [N m^2], loss in a contact or stop."""
    name, parameters = _in_words_of_the_catalogue(hidden.name, hidden.site, hidden.parameters, values)
    return replace(hidden, name=name, parameters=parameters)


def _in_words_of_the_catalogue(
    name: str, site: str, by: Mapping[str, float], values: Mapping[str, float]
) -> tuple[str, dict[str, float]]:
    if name == "cubic_spring":
        return name, {**by, "rest": 0.0}
    if name == "load_dependent_friction":
        return name, {"driving": by["share"], "driven": by["share"]}
    if name == "position_dependent_friction":
        half, phase = 0.5 * by["coulomb"], by["phase"]
        wave = {"cosine": half * float(np.cos(phase)), "sine": -half * float(np.sin(phase))}
        return name, {"period": by["period"], **wave}
    if name == "friction_drift":
        # What friction loses in time is what it has more while it is cold.
        levels = {kind: values.get(f"{site}.{kind}_friction.{kind}", 0.0) for kind in ("coulomb", "viscous")}
        cold = {kind: -by["share"] * level for kind, level in levels.items()}
        return "warming_friction", {**cold, "time_constant": by["time"]}
    if name == "backlash":
        return name, {"contact_damping" if key == "damping" else key: v for key, v in by.items()}
    if name == "end_stop":
        return name, {**by, "damping": by["damping"] / by["stiffness"]}
    if name == "seal_friction":
        return name, {"share": by["area"] / values[f"{site}.area"]}
    if name == "sensor_gain":
        return name, {"value": 1.0 + by["excess"]}
    if name == "link_flexibility":
        return name, {"bending": values[f"{site}.bending"] * by["share"]}
    return name, dict(by)


def _case(plan: Plan, pieces: Sequence[Array]) -> Case | FloatingPointError:
    layout, dt = plan.machine.layout, 1.0 / plan.draft.rate
    if not all(np.isfinite(piece).all() for piece in pieces):
        what = ", ".join(f"{hidden.name} at {hidden.site}" for hidden in plan.truth.hidden) or "nothing hidden"
        return FloatingPointError(f"{plan.machine.name} with {what} and seed {plan.seed} does not stay finite")
    records = [
        _experiment(layout, piece[:, :, 0], path, dt, f"{kind} {k}")
        for k, (kind, piece, path) in enumerate(zip(RECORDS, pieces, plan.paths, strict=True))
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
        true_text=plan.machine.text(plan.without, plan.draft, plan.base),
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
