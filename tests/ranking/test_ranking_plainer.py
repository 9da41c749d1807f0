"""One effect from what the file states, in the place of several that were led on from values gone astray."""

from collections.abc import Sequence

import numpy as np
import pytest

from model_texts import effect_text, rod
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.ranking.look import Look
from vpm.ranking.ranking_search import Search
from vpm.ranking.settings import Settings

#: A rod that hangs on a hinge, turned by a motor; its mass is a tenth uncertain.
ROD = rod(-0.15, "{ value = 1.0, uncertainty = 0.1 }")
ROD += '[sensors.encoder]\nmeasures = "hinge.position"\n'
ROD += effect_text("viscous_friction", "hinge", viscous="{ value = 0.03, uncertainty = 0.006 }")
MASS, OIL, REST, STEP, FINE = 1.06, 0.032, 0.11, 2e-3, 10


def turned(seed: int, *, spring: float, dry: float = 0.0) -> Experiment:
    """The rod by small explicit steps under a controller, with a spring that rests aside and dry friction."""
    random, h, inertia = np.random.default_rng(seed), STEP / FINE, 0.002 + MASS * 0.15**2
    time, phases = STEP * np.arange(3000), random.uniform(0.0, 2.0 * np.pi, 3)
    swing = sum(
        size * np.sin(rate * time + p) for size, rate, p in zip((0.5, 0.3, 0.1), (1.1, 2.9, 11.0), phases, strict=True)
    )
    angle, speed, told = 0.0, 0.0, []
    for wanted in swing * np.minimum(time, 1.0):
        torque = 6.0 * (wanted - angle) - 0.5 * speed
        told.append((torque, angle + random.normal(0.0, 2e-5)))
        for _ in range(FINE):
            pull = 9.81 * 0.15 * MASS * np.sin(angle) + OIL * speed + spring * (angle - REST)
            speed += h * (torque - pull) / inertia
            speed -= np.clip(speed, -h * dry / inertia, h * dry / inertia)
            angle += h * speed
    torques, angles = np.array(told).T
    motion = {"motor.command": torques, "hinge.position": angles}
    return Experiment.from_arrays(time, motion, model=Model.from_toml(ROD), name=f"turned {seed}")


def after(own: Search, names: Sequence[str]) -> list[Look]:
    """Looks of a search that was led to some effects, one after the other."""
    looks = own.looks(own.start)
    own.first = {look.fitted.tracker.band: look for look in looks}
    for name in names:
        ends = own.finished(own.tried(looks[0], looks[0], [name]))
        best = min(ends, key=lambda trial: trial.fitted.cost)
        looks = own.all_looks(own.look(best.fitted))
    return looks


@pytest.mark.parametrize(
    ("dry", "led", "right"),
    [
        (0.0, ("bias_force", "sensor_gain"), [("spring", "hinge")]),
        (0.06, ("spring", "coulomb_friction"), [("spring", "hinge"), ("coulomb_friction", "hinge")]),
    ],
)
def test_one_effect_takes_the_place_of_several_that_explain_less(
    dry: float, led: tuple[str, ...], right: list[tuple[str, str]]
) -> None:
    """A constant pull, a wrong gain and a wrong mass do nearly what a spring does. Two true effects stay two."""
    names = ("spring", "bias_force", "sensor_gain", "coulomb_friction")
    records = (turned(1, spring=0.3, dry=dry), turned(2, spring=0.3, dry=dry))
    own = Search(Model.from_toml(ROD), records, names, Settings(), None, ParallelCandidates(1, None), lambda _: None)
    looks = after(own, led)
    assert len(looks[0].fitted.structure.effects) == 2
    found, rounds = own._plainer(looks, [], {})
    assert list(found[0].fitted.structure.effects) == right
    assert len(rounds) == (found[0].fitted.structure.effects != looks[0].fitted.structure.effects)
