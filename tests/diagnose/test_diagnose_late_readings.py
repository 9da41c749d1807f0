"""A late encoder beside one drive: it passes for a late drive, and the answer says so."""

from __future__ import annotations

import numpy as np
import pytest

import vpm

#: Slide: mass, kg; viscous friction, N s/m; force per ampere, N/A; step of the log, s; delay in samples.
MASS, DRAG, GAIN, STEP, LATE = 4.0, 12.0, 20.0, 2e-3, 5
#: Standard deviation of the encoder's noise, m.
READ = 2e-6

SLIDE = f"""
name = "slide"
gravity = [0.0, 0.0, -9.81]
[bodies.table]
mass = {{ value = 4.5, uncertainty = 0.6, min = 0.5 }}
[joints.slide]
type = "prismatic"
parent = "world"
child = "table"
axis = [1.0, 0.0, 0.0]
[actuators.drive]
joint = "slide"
gain = {GAIN}
command_unit = "A"
[[effects]]
type = "viscous_friction"
at = "slide"
viscous = {{ value = 10.0, uncertainty = 4.0 }}
"""
SENSOR = '[sensors.encoder]\nmeasures = "slide.position"\n'


def driven(seed: int, model: vpm.Model, tacho: float | None = None) -> vpm.Experiment:
    """Record of a mass with viscous friction, whose equation has a closed solution over each held command.

    - ``tacho``: samples by which a speedometer beside an encoder in time is late; None without it, the encoder late
    """
    random = np.random.default_rng(seed)
    time = STEP * np.arange(4000)
    waves = [(0.7, 1.2), (1.9, 0.9), (5.3, 0.8), (11.0, 0.6)]
    current = sum(size * np.sin(2.0 * np.pi * rate * time + random.uniform(0.0, 6.0)) for rate, size in waves)
    decay = np.exp(-DRAG / MASS * STEP)
    place, speed = np.zeros(len(time)), np.zeros(len(time))
    for k, force in enumerate(GAIN * np.asarray(current)[:-1]):
        place[k + 1] = place[k] + force / DRAG * STEP + (speed[k] - force / DRAG) * MASS / DRAG * (1.0 - decay)
        speed[k + 1] = force / DRAG + (speed[k] - force / DRAG) * decay
    late = LATE if tacho is None else 0
    read = place[np.maximum(np.arange(len(time)) - late, 0)] + READ * random.standard_normal(len(time))
    columns = {"slide.position": read, "drive.command": np.asarray(current)}
    if tacho is not None:
        shown = np.interp(time - tacho * STEP, time, speed)
        columns["slide.velocity"] = shown + 20.0 * READ * random.standard_normal(len(time))
    return vpm.Experiment.from_arrays(time, columns, model=model, name=f"slide {seed}")


@pytest.mark.parametrize("described", [False, True])
def test_a_late_drive_may_be_a_late_encoder_that_nobody_described(described: bool) -> None:
    model = vpm.Model.from_toml(SLIDE + SENSOR * described)
    why = vpm.diagnose(
        model,
        driven(1, model),
        driven(2, model),
        effects=["input_delay", "actuator_lag", "sensor_delay"],
        check=False,
        workers=1,
    )
    (effect,) = why.effects
    assert effect.name in {"input_delay", "sensor_delay"}
    assert effect.parameters[0].value == pytest.approx(LATE * STEP, rel=0.05)
    assert ("A late reading of slide.position would look alike" in why.summary) is not described


@pytest.mark.parametrize(("samples", "names"), [(0.3, []), (3.0, ["sensor_delay"])])
def test_a_reading_within_its_sampling_interval_is_no_effect(samples: float, names: list[str]) -> None:
    model = vpm.Model.from_toml(SLIDE + '[sensors.tacho]\nmeasures = "slide.velocity"\n')
    why = vpm.diagnose(model, driven(1, model, samples), driven(2, model, samples), check=False, workers=1)
    assert [effect.name for effect in why.effects] == names
    assert all(effect.parameters[0].value == pytest.approx(samples * STEP, rel=0.05) for effect in why.effects)
    told = [one.reason for one in why.refused if (one.name, one.site) == ("sensor_delay", "tacho")]
    assert all("within their sampling interval" in reason for reason in told)
