"""How sure a load is that a diagnosis names at a body of which the model file states the mass."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from model_texts import effect_text, on_rail
from sledge import MASS, OIL, pushed
from vpm import Model, diagnose
from vpm.discrepancy.ranked_effects import _shows
from vpm.ranking.by_tracker import deviations_by_tracker
from vpm.simulate import Setup

UNCERTAIN = 0.05  #: Stated uncertainty of the sledge's mass, kg.


def test_a_load_is_no_surer_than_the_mass_of_its_body() -> None:
    """Records show the sum of both masses alone, however well."""
    mass = f"{{ value = 2.0, uncertainty = {UNCERTAIN} }}"
    oil = effect_text("viscous_friction", "way", viscous="{ value = 7.0, uncertainty = 1.5 }")
    model = Model.from_toml(on_rail("sledge", mass, joint="way", drive="motor", gain="4.0") + oil)
    first, second = (pushed(seed=seed, duration=5.0) for seed in (1, 2))
    (load,) = diagnose(model, first, second, workers=1).effects
    (weight,) = (one for one in load.parameters if one.name == "mass")
    assert (load.name, load.site) == ("payload", "sledge")
    assert UNCERTAIN < weight.std < 1.2 * UNCERTAIN
    assert abs(weight.value - (MASS - 2.0)) < 3.0 * weight.std


def test_a_load_that_an_observer_alone_shows_is_as_sure_as_the_mass_beside_it() -> None:
    """Records show the sum of both masses alone, and the model file the one of them."""
    mass = f"{{ value = 2.0, uncertainty = {UNCERTAIN} }}"
    oil = effect_text("viscous_friction", "way", viscous=str(OIL))
    model = Model.from_toml(on_rail("sledge", mass, joint="way", drive="motor", gain="4.0") + oil)
    loaded = model.with_effect("payload", at="sledge", mass=MASS - 2.0)
    ranking: Any = SimpleNamespace(model=loaded, recalibrated=model)
    records = (pushed(seed=1, duration=5.0),), (pushed(seed=2, duration=5.0),), list[str]()
    names = [f"sledge.payload.{name}" for name in ("mass", "z")]
    told = deviations_by_tracker(ranking, model, records, Setup(), names)
    assert UNCERTAIN < told["sledge.payload.mass"] < 1.2 * UNCERTAIN
    assert told["sledge.payload.z"] == np.inf


def test_a_height_of_which_records_say_less_than_how_far_bodies_reach_is_not_fitted() -> None:
    """A load on a table: places 0.1 m out would show as 1000, 50 and 1e-5 times the noise."""
    table = Model.from_toml("""
        name = "table"
        gravity = [0.0, 0.0, -9.81]
        bodies.plate = { mass = 2.0, inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0] }
        joints.turn = { type = "revolute", parent = "world", child = "plate", axis = [0.0, 0.0, 1.0] }
        actuators.motor = { joint = "turn", gain = 1.0, command_unit = "N m" }
    """)
    loaded = table.with_effect("payload", at="plate", mass=1.0, x=0.05)
    names = [f"plate.payload.{name}" for name in ("mass", "x", "y", "z")]
    one: Any = SimpleNamespace(key=("payload", "plate"), site="plate", side="motor")
    noise = np.resize([1.0, -1.0], 100)
    columns = np.outer(np.ones(100) / 10.0, [1e-9, 1e4, 5e2, 1e-4])
    assert _shows(loaded, one, names, columns, noise).tolist() == [True, True, True, False]
