"""The boom of the second suite moves as its model file does, whatever is hidden in both."""

import warnings
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import vpm
from nightly import at_night
from second_suite import boom
from second_suite.cases import CLEAN, hidden_of, requests
from second_suite.cases import _log as log_of
from second_suite.cases import _records as records_of
from second_suite.loop import Signals
from second_suite.plant import Hidden
from vpm import Model
from vpm.errors import ValidityWarning
from vpm.numbers import Array

#: Short records in steps of a millisecond, twice those of the cases.
M = replace(boom.MACHINE, lengths=(2.2,) * 4, substeps=2)
V = dict(boom.VALUES)
SMOOTH = V | {"luff.coulomb": 0.0, "seals.coulomb": 0.0}
#: Speeds over which dry friction of the file turns round: of the pin [rad/s], of the seals [m/s].
CREEP = {"luff.friction": 1e-4, "lifter.friction": 5e-5, "lifter.seal_friction": 5e-5}
#: Effects whose law is the same in both programs, and a short record that shows them.
SAME = {
    "bias_force@luff": 1,
    "spring@luff": 1,
    "end_stop@luff": 0,
    "payload@boom": 1,
    "gravity_tilt@world": 1,
    "dead_zone@lifter": 1,
    "saturation@lifter": 1,
    "valve_dynamics@lifter": 1,
    "internal_leakage@lifter": 1,
    "entrained_air@pump": 1,
    "supply_drop@pump": 1,
    "sensor_gain@inclinometer": 1,
    "sensor_offset@inclinometer": 1,
    "sensor_gain@gauge_a": 1,
    "sensor_offset@gauge_b": 1,
    "quadratic_drag@luff": 1,
}
#: Delays are whole steps in the generator, and a lag answers a step late at most: share of the effect that may be left.
LATE = {"input_delay@lifter": 0.04, "actuator_lag@lifter": 0.05, "sensor_delay@inclinometer": 0.04}
#: Dry friction that is the same in both, and friction of another law: share of the effect that may be left.
DRY = {"none": 0.02, "asymmetric_friction@luff": 0.02, "hysteresis@luff": 0.2, "stribeck_friction@luff": 0.4}
#: In the generator friction follows the torque of oil and viscous seals, in the file that of all seals besides.
DRY["load_dependent_friction@luff"] = 0.07
DRY["seal_friction@lifter"] = 0.02
#: Of the joint, of the drive, of a sensor, late, dry: those that are compared outside of `make test-nightly`.
FEW = {"end_stop@luff", "valve_dynamics@lifter", "sensor_offset@gauge_b", "input_delay@lifter", "none"}
FEW |= {"load_dependent_friction@luff", "seal_friction@lifter"}
#: What the catalogue has no law for.
NOWHERE = {"uneven_edges@lifter"}


def written(values: dict[str, float], *entries: dict[str, object]) -> Model:
    """The model file with these numbers and entries more, without losses that are zero."""
    document = M.document(lambda key: values[key], frozenset(key for key, value in values.items() if not value))
    effects = document["effects"]
    assert isinstance(effects, list)
    model = Model.from_dict({**document, "effects": [*effects, *entries]})
    bends = [name for name in model.parameters if name.endswith("transition_velocity") and "valve" not in name]
    return model.with_parameters({
        name: next(v for start, v in CREEP.items() if name.startswith(start)) for name in bends
    })  # fmt: skip


def described(hidden: Hidden, values: dict[str, float]) -> Model:
    """The model file with what is hidden, by its true numbers."""
    numbers: dict[str, float] = dict(hidden.values)
    if hidden.effect == "asymmetric_friction":
        for name in ("coulomb", "viscous"):
            up, down = numbers.pop(f"{name}_up"), numbers.pop(f"{name}_down")
            values = values | {f"luff.{name}": values[f"luff.{name}"] + 0.5 * (up + down)}
            numbers[f"{name}_difference"] = up - down
    elif hidden.effect == "gravity_tilt":
        numbers = {"second": numbers["angle"]}
    elif hidden.effect == "payload":
        numbers |= {"x": boom.TIP}
    elif hidden.effect == "actuator_lag":
        numbers = {"time_constant": numbers["time"]}
    elif hidden.effect == "end_stop":
        numbers = {"high": numbers["end"]} | {key: numbers[key] for key in ("stiffness", "damping")}
    elif hidden.effect == "stribeck_friction":
        numbers["stribeck_velocity"] = numbers.pop("speed")
    elif hidden.effect == "hysteresis":
        numbers["displacement"] = numbers.pop("way")
    elif hidden.effect == "load_dependent_friction":  # on the one joint that the line moves
        loss = {"driving": numbers["share"], "driven": numbers["share"]}
        return written(values, {"type": "drive_friction", "at": "lifter", **loss})
    return written(values, {"type": hidden.effect, "at": hidden.site, **numbers})


def start(model: Model, signals: Signals, hidden: tuple[Hidden, ...], record: int) -> Array:
    """The true state at first: at rest, with the pressures that sensors read wrong."""
    first = np.array([signals.position[0, 0, record], *signals.pressure[0, :, record]])
    for h in hidden:
        place = {"inclinometer": 0, "gauge_a": 1, "gauge_b": 2}.get(h.site)
        if place is not None and h.effect == "sensor_gain":
            first[place] /= h.values["value"]
        elif place is not None and h.effect == "sensor_offset":
            first[place] -= h.values["value"]
    state, names = np.zeros(model.core.n_states), list(model.state_names)
    for name, value in zip(("luff.position", "lifter.chamber_a", "lifter.chamber_b"), first, strict=True):
        state[names.index(name)] = value
    return state


def gap(model: Model, signals: Signals, hidden: tuple[Hidden, ...], record: int) -> float:
    """Of a free run from the log's commands: largest rms difference of angle and pressures, over their noise."""
    log = log_of(M, 0, signals, record)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)
        run = vpm.simulate(model, log, "free_run", substeps=4, initial_state=start(model, signals, hidden, record))
    noises = {"luff.position": M.joints[0].noise, **{gauge.channel: gauge.noise for gauge in M.gauges}}
    return max(float(np.sqrt(np.mean((run[c] - log[c]) ** 2)) / noise) for c, noise in noises.items())


@lru_cache
def recorded(word: str, dry: bool) -> tuple[Signals, tuple[Hidden, ...]]:
    """Records without noise."""
    hidden = () if word in CLEAN else hidden_of(M, word, 0)
    values = V if dry else SMOOTH
    return records_of(M, 0, values, hidden, noisy=False, rng=np.random.default_rng(0)), hidden


@pytest.mark.parametrize("record", [0, 1, 2, 3])
def test_it_moves_as_its_model_file_does(record: int) -> None:
    signals, _ = recorded("none", dry=False)
    assert gap(written(SMOOTH), signals, (), record) < 0.02


@pytest.mark.parametrize("word", at_night(SAME, but=FEW & SAME.keys()))
def test_a_hidden_effect_is_that_of_the_catalogue(word: str) -> None:
    signals, hidden = recorded(word, dry=False)
    assert gap(written(SMOOTH), signals, hidden, SAME[word]) > 4.0
    assert gap(described(hidden[0], SMOOTH), signals, hidden, SAME[word]) < 0.03


@pytest.mark.parametrize("word", at_night(LATE, but=FEW & LATE.keys()))
def test_what_is_late_is_so_but_for_a_part_of_a_step(word: str) -> None:
    signals, hidden = recorded(word, dry=False)
    without = gap(written(SMOOTH), signals, hidden, 1)
    assert without > 4.0
    assert gap(described(hidden[0], SMOOTH), signals, hidden, 1) < LATE[word] * without


@pytest.mark.parametrize("word", at_night(DRY, but=FEW & DRY.keys()))
def test_dry_friction_is_that_of_the_model_file_if_it_hardly_creeps(word: str) -> None:
    signals, hidden = recorded(word, dry=True)
    without = gap(written(V) if hidden else written(SMOOTH), signals, hidden, 1)
    assert without > 4.0
    assert gap(described(hidden[0], V) if hidden else written(V), signals, hidden, 1) < DRY[word] * without


def test_all_that_is_hidden_is_compared_or_has_no_law_in_the_catalogue() -> None:
    own = {"coulomb_friction@luff", "viscous_friction@luff"}
    compared = {*SAME, *LATE, *DRY, *own, *NOWHERE}
    assert {word for word, kind in requests("boom").items() if kind in {"single", "outside"}} == compared - {"none"}
