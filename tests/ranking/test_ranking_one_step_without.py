"""Effects judged by one step of a fit without them, beside a new fit; velocities that were computed from an encoder."""

import numpy as np
import pytest

import vpm
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking import Settings
from vpm.ranking.one_step_without import beside_others, shown_in_efforts
from vpm.ranking.ranking_search import Search

STEP, COUNT, MASS, OIL = 4e-3, 4000, 4.0, 1.1
SLED = """
name = "sled"
gravity = [0.0, 0.0, 0.0]
[bodies.block]
mass = { value = 4.2, uncertainty = 0.3 }
[joints.way]
type = "prismatic"
parent = "world"
child = "block"
axis = [1.0, 0.0, 0.0]
[actuators.motor]
joint = "way"
gain = 1.0
command_unit = "N"
[sensors.encoder]
measures = "way.position"
[sensors.speed]
measures = "way.velocity"
"""


def driven(seed: int, oil: float = OIL) -> tuple[Array, Array]:
    """Position and force of a sled in oil: a held force moves it as ``exp(-t oil/mass)`` tells."""
    random, time = np.random.default_rng(seed), STEP * np.arange(COUNT)
    force = sum(a * np.sin(2.0 * np.pi * f * time + random.uniform(0.0, 6.0)) for a, f in ((3.0, 0.3), (2.0, 1.1)))
    fade, place, speed, places = np.exp(-STEP * oil / MASS), 0.0, 0.0, []
    for push in np.asarray(force):
        places.append(place)
        final = push / oil
        place += final * STEP + (speed - final) * (1.0 - fade) * MASS / oil
        speed = final + (speed - final) * fade
    return np.array(places) + 1e-4 * random.standard_normal(COUNT), np.asarray(force)


def logged(seed: int, *, speed: bool = False) -> Experiment:
    place, force = driven(seed)
    values = {"way.position": place, "motor.command": force}
    if speed:
        values["way.velocity"] = np.append(0.0, np.diff(place)) / STEP
    return Experiment.from_arrays(STEP * np.arange(COUNT), values, model=Model.from_toml(SLED), name=f"log {seed}")


def test_one_step_tells_what_a_new_fit_does() -> None:
    """Efforts are linear in the friction of oil, and what it leaves of a slow tracker nearly so."""
    search = Search(
        Model.from_toml(SLED),
        [logged(1)],
        ["viscous_friction"],
        Settings(),
        None,
        ParallelCandidates(1),
        lambda _: None,
    )
    looks = search.looks(search.start)
    search.first = {look.fitted.tracker.band: look for look in looks}
    (trial, *_) = search.finished(search.tried(looks[0], looks[0]))
    look, key = search.look(trial.fitted), trial.key
    (step,) = beside_others(search, look, [key])
    fitted = search.weighed_beside_others(key, look)
    assert step.judgement.removed == pytest.approx(fitted.judgement.removed, abs=0.01)
    assert step.evidence == pytest.approx(fitted.evidence, rel=0.2)
    assert shown_in_efforts(search, look.fitted.structure, [key]) == [key]
    idle = look.fitted.structure.at(
        np.where([n.endswith("viscous") for n in look.fitted.structure.priors], 0.0, look.fitted.structure.standard)
    )
    assert shown_in_efforts(search, idle, [key]) == []


def test_a_speed_that_repeats_the_encoder_is_not_called_late() -> None:
    """Differences come half a sample late, and no sensor does."""
    ranking = vpm.rank(Model.from_toml(SLED), [logged(1, speed=True)], logged(2, speed=True), workers=1)
    assert [(one.effect, one.site) for one in ranking.effects] == [("viscous_friction", "way")]
    assert ranking.notes == (
        "way.velocity repeats the noise of way.position, from which it was computed: it tells nothing more",
    )
    assert list(ranking.gaps) == ["way.position"]
