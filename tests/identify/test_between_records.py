"""Fits to records of a machine that somebody changed between them, such as a slide that carries a load in one alone.

The drive's force is that of a textbook, m a + c v, with dry friction where a test says so.
"""

import numpy as np

import vpm

FILE = """
    name = "slide"
    gravity = [0.0, 0.0, -9.81]
    bodies.table = { mass = { value = 2.5, uncertainty = 0.5 } }
    joints.slide = { type = "prismatic", parent = "world", child = "table", axis = [1.0, 0.0, 0.0] }
    actuators.drive = { joint = "slide", gain = 1.0, command_unit = "N" }
    effects = [{ type = "viscous_friction", at = "slide", viscous = { value = 8.0, uncertainty = 3.0 } }]
"""
MODEL = vpm.Model.from_toml(FILE)
DAMPING = 10.0  # N s/m


def record(name: str, mass: float, rhythm: float = 1.0, dry: float = 0.0) -> vpm.Experiment:
    """The slide moves by two sines; position and force are noisy."""
    time, drawn = np.arange(3000) / 500.0, np.random.default_rng(sum(map(ord, name)))
    rates = np.array([[2.0], [5.0]]) * rhythm
    position = np.array([0.3, 0.1]) @ np.sin(rates * time)
    velocity = (np.array([0.3, 0.1]) * rates[:, 0]) @ np.cos(rates * time)
    acceleration = -(np.array([0.3, 0.1]) * rates[:, 0] ** 2) @ np.sin(rates * time)
    force = mass * acceleration + DAMPING * velocity + dry * np.tanh(velocity / 1e-3)
    values = {
        "slide.position": position + 1e-6 * drawn.standard_normal(time.size),
        "drive.command": force + 0.02 * drawn.standard_normal(time.size),
    }
    return vpm.Experiment.from_arrays(time, values, name=name, model=MODEL)


def warned(*records: vpm.Experiment) -> list[str]:
    return [sentence for sentence in vpm.identify(MODEL, records).warnings if "differs between records" in sentence]


def test_a_load_in_one_record_is_a_mass_of_that_record() -> None:
    fit = vpm.identify(MODEL, [record("first", 2.0), record("loaded", 3.0, 1.3), record("last", 2.0, 0.8)])
    (sentence, *others) = fit.warnings
    assert sentence.startswith("table.mass differs between records: ")
    assert "kg in loaded and" in sentence
    there, elsewhere = [float(word) for word in sentence.split() if word[0].isdigit()][:2]
    # Filters of the motion make masses up to half a percent too small.
    np.testing.assert_allclose([there, elsewhere], [3.0, 2.0], rtol=0.01)
    assert not any("an effect may be missing" in other for other in others)


def test_records_of_one_machine_say_nothing_of_it() -> None:
    assert warned(record("first", 2.0), record("second", 2.0, 1.3)) == []


def test_a_missing_effect_is_no_change_between_records() -> None:
    """Dry friction hides in another damping where the motion is faster, but leaves most of itself."""
    fit = vpm.identify(MODEL, [record("slow", 2.0, 0.5, 3.0), record("fast", 2.0, 2.0, 3.0)])
    assert not any("differs between records" in sentence for sentence in fit.warnings)
    assert any("an effect may be missing" in sentence for sentence in fit.warnings)
