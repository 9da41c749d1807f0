"""Deviations of what records show only together, where the model file states one of it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import vpm
from vpm.discrepancy.diagnosis_fields import fit_beside
from vpm.identify.comparison import comparison
from vpm.identify.estimation import beside_held, beside_stated, standing

SLIDE = """
name = "slide"
gravity = [0.0, 0.0, 0.0]
bodies.load = {{ mass = {{ value = 2.0, uncertainty = {mass} }} }}
joints.axis = {{ type = "prismatic", parent = "world", child = "load", axis = [1, 0, 0] }}
actuators.drive = {{ joint = "axis", gain = {{ value = 3.0, uncertainty = inf }}, command_unit = "A" }}
effects = [{{ type = "viscous_friction", at = "axis", viscous = {{ value = 4.0, uncertainty = inf }} }}]
"""
NAMES = ("load.mass", "drive.gain", "axis.friction.viscous")


def swung(model: vpm.Model) -> vpm.Experiment:
    """Steady swing under m a = k u - c v, by its phasors, with the noise of an encoder."""
    time, random = np.arange(4000) / 1000.0, np.random.default_rng(1)
    rates = np.array([3.0, 8.0, 21.0])
    phasors = np.array([1.0, 2.0, 4.0]) * 3.0 / (4.0j * rates - 2.0 * rates**2)
    waves = np.exp(1j * np.outer(time, rates))
    position = np.real(waves @ phasors) + 1e-6 * random.standard_normal(len(time))
    command = np.real(np.exp(1j * np.outer(time + 5e-4, rates)) @ np.array([1.0, 2.0, 4.0]))  # held: its mean
    columns = {
        "axis.position": position,
        "axis.velocity": np.real(waves @ (1j * rates * phasors)),
        "drive.command": command,
    }
    return vpm.Experiment.from_arrays(time, columns, model=model)


@pytest.mark.parametrize(("stated", "expected"), [(0.1, 0.05), ("inf", np.inf)])
def test_where_positions_show_ratios_alone_all_are_as_sure_as_the_stated_mass(stated: object, expected: float) -> None:
    model = vpm.Model.from_toml(SLIDE.format(mass=stated))
    data = comparison(model, [swung(model)], "free_run")
    found = standing(model, data, NAMES)
    assert np.all(np.isinf(found.std))
    np.testing.assert_allclose(beside_stated(found, model, data).std / found.values, expected, rtol=0.02)


def test_what_records_show_worse_than_the_file_is_as_sure_as_the_file() -> None:
    """Noise passes for a trace of the gain, so that records alone tell all three to some 60 %."""
    model = vpm.Model.from_toml(SLIDE.format(mass=0.1))
    data = comparison(model, [swung(model)], "free_run")
    found, random = standing(model, data, NAMES), np.random.default_rng(2)
    trace = 1e-2 * np.std(found.residual) * random.standard_normal(len(found.residual))
    weak = replace(found, jacobian=found.jacobian + np.outer(trace, [0.0, 1.0, 0.0]), unseen=())
    np.testing.assert_allclose(beside_stated(weak, model, data).std / found.values, 0.05, rtol=0.02)


@pytest.mark.parametrize(("stated", "expected"), [(0.1, 0.05), ("inf", np.inf)])
def test_what_was_fitted_beside_a_held_gain_is_no_surer_than_the_stated_mass_makes_that(
    stated: object, expected: float
) -> None:
    model = vpm.Model.from_toml(SLIDE.format(mass=stated))
    data = comparison(model, [swung(model)], "free_run")
    mass, gain, viscous = NAMES
    found = standing(model, data, (mass, viscous))
    assert np.all(found.std < 1e-3 * found.values)
    std = beside_held(found, model, data, [gain]).deviations
    np.testing.assert_allclose([std[name] / model.parameters[name].value for name in NAMES], expected, rtol=0.02)


def test_a_diagnosis_tells_what_was_held_where_it_had_moved_and_how_sure_all_is_with_that() -> None:
    """The file has another gain; an observer moved that, and the residual fitted the others to it."""
    found = vpm.Model.from_toml(SLIDE.format(mass=0.1))
    model, data = found.with_parameters({"drive.gain": 2.9}), comparison(found, [swung(found)], "free_run")
    mass, gain, viscous = NAMES
    final: Any = SimpleNamespace(model=found, free=(mass, viscous), fit=standing(found, data, (mass, viscous)))
    nothing: Any = SimpleNamespace(accepted=())
    fit = fit_beside(model, final, data, final, nothing, ["swing"])
    assert fit.names == (mass, viscous, gain)
    np.testing.assert_allclose(fit.std / fit.values, 0.05, rtol=0.02)
    np.testing.assert_allclose(fit.correlation, 1.0, atol=1e-3)  # only their ratios show
    assert fit_beside(found, final, data, final, nothing, ["swing"]).names == (mass, viscous)
