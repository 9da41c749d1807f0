"""A tachometer that reads too much: efforts say nothing of it, the verdict's numbers do."""

import numpy as np

import vpm

SLIDE = """
name = "slide"
gravity = [0.0, 0.0, 0.0]
bodies.load = { mass = { value = 2.0, uncertainty = 0.1 } }
joints.axis = { type = "prismatic", parent = "world", child = "load", axis = [1, 0, 0] }
actuators.drive = { joint = "axis", gain = 3.0, command_unit = "A" }
sensors.tacho = { measures = "axis.velocity" }
effects = [{ type = "viscous_friction", at = "axis", viscous = { value = 4.0, uncertainty = 0.2 } }]
"""


def swung(model: vpm.Model, seed: int, reads: float) -> vpm.Experiment:
    """Steady swing under m a = k u - c v, by its phasors, with the noise of both sensors."""
    time, random = np.arange(3000) / 500.0, np.random.default_rng(seed)
    rates = np.array([3.0, 8.0, 21.0])
    sizes = np.array([1.0, 2.0, 4.0]) * np.exp(1j * random.uniform(0.0, 6.0, 3))
    phasors = sizes * 3.0 / (4.0j * rates - 2.0 * rates**2)
    waves = np.exp(1j * np.outer(time, rates))
    columns = {
        "axis.position": np.real(waves @ phasors) + 1e-6 * random.standard_normal(len(time)),
        "axis.velocity": reads * np.real(waves @ (1j * rates * phasors)) + 1e-3 * random.standard_normal(len(time)),
        "drive.command": np.real(np.exp(1j * np.outer(time + 1e-3, rates)) @ sizes),  # held: its mean
    }
    return vpm.Experiment.from_arrays(time, columns, model=model, name=f"swing {seed}")


def test_numbers_of_a_reading_that_efforts_do_not_show_are_those_of_that_reading() -> None:
    model = vpm.Model.from_toml(SLIDE)
    train, test = swung(model, 1, 1.12), swung(model, 2, 1.12)
    why = vpm.diagnose(model, [train], [test], effects=["sensor_gain", "coulomb_friction"], workers=1)
    assert [(one.name, one.site) for one in why.effects] == [("sensor_gain", "tacho")]
    reading = why.gap["axis.velocity (observed)"]
    assert reading.after < 0.1 * reading.recalibrated
    share = 100.0 * reading.recalibrated / reading.signal
    assert 5.0 < share < 15.0
    assert f"{share:.2f} % recalibrated" in why.summary
    (gain,) = why.effects[0].parameters
    assert 0.0 < gain.std < 0.01
    assert abs(gain.value - 1.12) < 1e-3  # of held commands, of which the record has the mean
