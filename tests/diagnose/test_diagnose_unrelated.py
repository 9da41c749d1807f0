"""Records in which commands do not cause the motion: a machine moved by hand, or an encoder that counts backwards.

Nothing of the catalogue is missing there, and no answer may name it. A model explains a motion if it follows the record
better than masses on which nothing acts, which an observer draws along, and if the efforts that the motion needs are
those that were measured.
"""

import numpy as np
import pytest

import vpm
from vpm import Diagnosis, Experiment, diagnose
from vpm.errors import ExperimentError
from vpm.numbers import Array

#: Time between samples, s, and error of the encoder, rad.
DT, NOISE = 5e-3, 2e-5
ARM = """
name = "arm in gravity"
gravity = [0.0, 0.0, -9.81]
bodies.arm = { mass = { value = 1.0, unit = "kg", uncertainty = 0.3, min = 0.1, max = 4.0 }, center_of_mass = [0.2, 0.0, 0.0], inertia = [1e-3, 0.01, 0.01, 0.0, 0.0, 0.0] }
joints.axis = { type = "revolute", parent = "world", child = "arm", axis = [0.0, -1.0, 0.0] }
actuators.drive = { joint = "axis", gain = GAIN, command_unit = "A" }
sensors.encoder = { measures = "axis.position" }
effects = [{ type = "viscous_friction", at = "axis", viscous = { value = 0.2, uncertainty = 0.2, min = 0.0 } }FRICTION]
"""  # noqa: E501
KNOWN, FREE = "3.0", "{ value = 3.0, unit = 'N m/A', uncertainty = 2.0, min = 0.05, max = 30.0 }"
DRY = ', { type = "coulomb_friction", at = "axis", coulomb = { value = 0.5, uncertainty = 0.5, min = 0.0 } }'


def swing(seed: int, length: float) -> tuple[Array, Array]:
    """Slow sines of other frequencies for each seed, and the time, s."""
    time, drawn = np.arange(0.0, length, DT), np.random.default_rng(seed)
    frequencies, phases = drawn.uniform(0.05, 0.5, 5), drawn.uniform(0.0, 2.0 * np.pi, 5)
    shapes = np.sin(2.0 * np.pi * np.outer(time, frequencies) + phases)
    return time, np.asarray(shapes @ drawn.uniform(0.1, 0.3, 5))


def moved_by_hand(name: str, seed: int, length: float) -> Experiment:
    """A motion, and the current of a drive that had no part in it."""
    time, angle = swing(seed, length)
    _, current = swing(seed + 1000, length)
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(time))
    columns = np.column_stack([angle + noise, current])
    return Experiment(name, time, columns, ("axis.position", "drive.command"), ("rad", "A"))


def told(gain: str, friction: str, seed: int) -> Diagnosis:
    model = vpm.Model.from_toml(ARM.replace("GAIN", gain).replace("FRICTION", friction))
    records = [moved_by_hand(f"hand {k}", 10 * seed + k, 12.0) for k in range(2)]
    return diagnose(model, records[:1], records[1:], workers=1)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("gain", "friction", "seed"),
    [
        pytest.param(KNOWN, DRY, 1, marks=pytest.mark.nightly),
        pytest.param(FREE, "", 1, marks=pytest.mark.nightly),
        (FREE, "", 2),
    ],
)
def test_nothing_is_named_where_a_drive_does_not_cause_the_motion(gain: str, friction: str, seed: int) -> None:
    why = told(gain, friction, seed)
    assert why.verdict == "unexplained", why.summary
    # Of what was measured most stays open, whatever the drive is believed to give.
    assert why.gap["axis.effort"].recalibrated > 0.5 * why.gap["axis.effort"].signal


SLIDE = """
name = "slide"
gravity = [0.0, 0.0, 0.0]
bodies.load = { mass = { value = 2.0, unit = "kg", uncertainty = 0.2 } }
joints.axis = { type = "prismatic", parent = "world", child = "load", axis = [1.0, 0.0, 0.0] }
actuators.drive = { joint = "axis", gain = 4.0, command_unit = "A" }
sensors.encoder = { measures = "axis.position" }
effects = [{ type = "viscous_friction", at = "axis", viscous = { value = 3.0, uncertainty = 0.3, min = 0.0 } }]
"""


def servoed(seed: int, length: float) -> tuple[Array, Array, Array]:
    """Time, place and current of 2 kg on a slide that follow sines: `2 a = 4 u - 3 v`, `u` held for a sample."""
    time, wanted = swing(seed, length)
    x, v = wanted[0], 0.0
    places, currents = np.empty_like(time), np.empty_like(time)
    for sample in range(len(time)):
        places[sample], currents[sample] = x, 40.0 * (wanted[sample] - x) - 8.0 * v
        rest = 4.0 * currents[sample] / 3.0  # speed at which friction holds the drive
        fading = np.exp(-1.5 * DT)
        x += rest * DT + (v - rest) * (1.0 - fading) / 1.5
        v = rest + (v - rest) * fading
    return time, places, currents


@pytest.mark.parametrize(("sign", "verdict"), [(1.0, "no_disagreement"), (-1.0, "unexplained")])
def test_an_encoder_that_counts_backwards_is_no_missing_effect(sign: float, verdict: str) -> None:
    model = vpm.Model.from_toml(SLIDE)
    records = []
    for seed in (7, 8):
        time, place, current = servoed(seed, 12.0)
        noise = NOISE * np.random.default_rng(seed).standard_normal(len(time))
        columns = np.column_stack([sign * place + noise, current])
        records.append(Experiment(f"slide {seed}", time, columns, ("axis.position", "drive.command"), ("m", "A")))
    assert diagnose(model, records[:1], records[1:], workers=1, check=False).verdict == verdict
    if sign < 0.0:
        with pytest.raises(ExperimentError, match="has the opposite sign"):
            diagnose(model, records[:1], records[1:], workers=1)
