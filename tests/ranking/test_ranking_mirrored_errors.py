"""What an effect explains: the error, and not its mirror image, which noise is as well."""

from dataclasses import replace

import numpy as np
import pytest

import vpm
from model_texts import effect_text, on_rail
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.fit import Fitter
from vpm.ranking.judgement import Judgement
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.settings import Settings
from vpm.ranking.tracked_records import TrackedRecords, Tracker

RATE = 500.0
#: A slide on a rail in oil.
AXIS = on_rail("slide", "8.0", joint="axis", drive="motor", gain="1.0") + effect_text(
    "viscous_friction", "axis", viscous="40.0"
)
#: Counts, and what an effect would have to remove to count otherwise.
COUNTING = Judgement(0.5, 0.5, 9.0, 1.0, 1.0, 1.0)


def moved(machine: Model, sent: Array, push: Array, seed: int) -> Experiment:
    """Log of a machine under forces that were sent, and others that no log holds."""
    time = np.arange(len(sent)) / RATE
    command = Experiment.from_arrays(time, {"motor.command": sent + push}, model=machine, name="slide")
    ran = vpm.simulate(machine, command, mode="free_run")
    read = ran["axis.position"] + 1e-6 * np.random.default_rng(seed).standard_normal(len(time))
    return Experiment.from_arrays(time, {"motor.command": sent, "axis.position": read}, model=machine, name="slide")


def sweep(seconds: float = 8.0) -> Array:
    time = np.arange(0.0, seconds, 1.0 / RATE)
    return np.asarray(30.0 * np.sin(2.0 * np.pi * (0.3 + 0.1 * time) * time))


def look_at(record: Experiment, band: float) -> tuple[Look, Fitter]:
    model = Model.from_toml(AXIS)
    fitter = Fitter(TrackedRecords(model, [record], Settings()), Settings())
    return Look(fitter.unfitted(Structure(model, model.theta, {}), Tracker(band)), fitter), fitter


def explained(other: Model, record: Experiment, band: float) -> tuple[float, float]:
    """Share of error power that another model removes, and what it explains of it."""
    look, fitter = look_at(record, band)
    fitted = fitter.unfitted(Structure(other, other.theta, {}), look.fitted.tracker)
    return look.judged(fitted).removed, look.explained_by(fitted, COUNTING).explained


def test_a_model_leaves_the_mirror_image_of_its_error() -> None:
    machine = Model.from_toml(AXIS).with_effect("coulomb_friction", "axis", coulomb=5.0)
    look, fitter = look_at(moved(machine, sweep(), np.zeros(4000), 1), 2.0)
    fitted = look.fitted
    own = fitted.structure
    mirrored = fitter.tracked.mirrored(own.model, own.theta, fitted.tracker, fitted.residual)
    again, _ = mirrored.follow(own.model, own.theta, fitted.tracker)
    assert np.max(np.abs(fitted.residual)) > 1e-4
    np.testing.assert_allclose(again, -fitted.residual, atol=1e-12)


def test_a_linear_machine_that_noise_alone_moves_has_nothing_to_explain() -> None:
    """Its record and the mirror image differ by their sign: what oil that is thicker takes from one goes from both."""
    machine = Model.from_toml(AXIS).with_parameters({"axis.friction.viscous": 400.0})
    push = 100.0 * np.random.default_rng(3).standard_normal(4000)
    removed, told = explained(machine, moved(machine, np.zeros(4000), push, 1), 10.0)
    assert removed > 0.1
    assert told == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("push", [0.0, 20.0])
@pytest.mark.parametrize("band", [1.0, 10.0])
def test_what_is_missing_is_explained_beside_noise_of_a_drive(band: float, push: float) -> None:
    machine = Model.from_toml(AXIS).with_effect("spring", "axis", stiffness=300.0)
    noise = push * np.random.default_rng(4).standard_normal(4000)
    removed, told = explained(machine, moved(machine, sweep(), noise, 2), band)
    assert told == pytest.approx(removed, rel=0.1)
    assert removed > 0.9


def test_what_lessens_the_mirror_image_as_well_does_not_count() -> None:
    settings = Settings()
    assert COUNTING.counts(settings)
    answers = replace(COUNTING, explained=0.01)
    assert "mirror image" in answers.lacks(settings)
