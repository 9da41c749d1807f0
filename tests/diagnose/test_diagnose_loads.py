"""How sure a load is that a diagnosis names at a body of which the model file states the mass."""

from model_texts import effect_text, on_rail
from sledge import MASS, pushed
from vpm import Model, diagnose

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
