"""A slide with a spring that nobody described: what counts under one tracker alone is weighed under the best one's."""

import numpy as np

import vpm
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.ranking import Settings
from vpm.ranking.ranking_search import Search

MASS, VISCOUS, STIFFNESS, REST = 3.0, 20.0, 10.0, -0.4  # kg, N s/m, N/m, m
STEP, NOISE = 2e-3, 1e-5  # s, m
MODEL = vpm.Model.from_toml("""
name = "slide"
gravity = [0.0, 0.0, -9.81]
bodies.carriage.mass = 3.0
joints.axis = { type = "prismatic", parent = "world", child = "carriage", axis = [1.0, 0.0, 0.0] }
actuators.drive = { joint = "axis", gain = 1.0, command_unit = "N" }
sensors.encoder = { measures = "axis.position" }

[[effects]]
type = "viscous_friction"
at = "axis"
viscous = { value = 18.0, uncertainty = 5.0 }
""")


def _log() -> vpm.Experiment:
    """Log of the slide under proportional and derivative control, by Newton's law in small steps."""
    dice, place, speed = np.random.default_rng(1), 0.0, 0.0
    time = STEP * np.arange(4000)
    read, command = np.zeros(len(time)), np.zeros(len(time))
    for sample, now in enumerate(time):
        read[sample] = place + NOISE * dice.normal()
        command[sample] = 300.0 * (0.2 * np.sin(2.1 * now) + 0.1 * np.sin(5.3 * now) - place) - 30.0 * speed
        for _ in range(10):
            speed += (command[sample] - VISCOUS * speed - STIFFNESS * (place - REST)) / MASS * STEP / 10
            place += speed * STEP / 10
    return vpm.Experiment.from_arrays(time, {"axis.position": read, "drive.command": command}, model=MODEL)


def test_an_effect_that_counts_under_the_other_tracker_alone_is_weighed_with_the_best() -> None:
    """A spring that rests far away is nearly a constant load; a race under one tracker may give either of them up."""
    names = ["bias_force", "spring"]
    search = Search(MODEL, [_log()], names, Settings(), None, ParallelCandidates(1, None), lambda _: None)
    slow, fast = search.looks(search.start)
    (spring, *_) = [one for one in search.tried(slow, slow, ["spring"]) if one.counts]
    (load,) = search.tried(fast, fast, ["bias_force"])
    first, other = sorted((spring, load), key=lambda trial: trial.left)
    (found,) = search._counting_elsewhere([first, other])
    assert (found.key, found.look) == (other.key, first.look)
    assert found.counts
