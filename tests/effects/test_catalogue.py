"""The catalogue: complete, consistent, in agreement with the laws of the core, and listed in the documents."""

import json
import math
import re

import numpy as np
import pytest

from places import ROOT
from vpm.catalogue import EFFECTS, SITE_KINDS, EffectParameter, EffectType, effect_type, effects_for_site
from vpm.errors import ModelError
from vpm.model import Model
from vpm.units import parse_unit

PARAMETERS = [(effect, parameter) for effect in EFFECTS.values() for parameter in effect.parameters]


def name_of(value: EffectType | EffectParameter) -> str:
    return value.name


BOOM = {
    "parent": "link",
    "length": 1.0,
    "level": "modal(1)",
    "deforms": ["bending_x"],
    "material": {"young": 7e10, "poisson": 0.3, "density": 2700.0},
    "section": {"shape": "rectangle", "width": 0.02, "height": 0.03},
}
#: Effects that put a joint behind the one they sit at, or say nothing about an effort at a coordinate and rate.
ELSEWHERE = {
    *("empirical_force", "hysteresis", "joint_compliance", "rotor_inertia", "end_stop"),
    *("current_ripple", "load_dependent_friction", "lugre_friction", "warming_friction"),
}


def machine(kind: str, sensed: str = "position", site: str = "joint") -> Model:
    """One body of mass 2 and inertia 2 on one joint without gravity, with an actuator and a sensor.

    For effects of beams and of the world it has a beam, or gravity.
    """
    return Model.from_dict(
        {
            "name": "rig",
            "gravity": [0, 0, -9.81 if site == "world" else 0],
            "bodies": {"link": {"mass": 2.0, "inertia": [2.0, 2.0, 2.0, 0, 0, 0]}},
            "joints": {"axis": {"type": kind, "parent": "world", "child": "link", "axis": [0, 0, 1]}},
            "beams": {"boom": BOOM} if site == "beam" else {},
            "actuators": {"drive": {"joint": "axis", "gain": 1.0, "command_unit": "V"}},
            "sensors": {"encoder": {"measures": f"axis.{sensed}"}},
        }
    )


def servo() -> Model:
    """A slide that a servo-cylinder pushes."""
    valve = {"flow_gain": 6.7e-6, "frequency": 1500.0, "stroke": 0.01}
    cylinder = {"bore": 0.016, "rod": 0.01, "stroke": 0.08, "line_a": 2.9e-6, "line_b": 2.9e-6}
    return Model.from_dict(
        {
            "name": "servo",
            "gravity": [0, 0, 0],
            "bodies": {"slide": {"mass": 2.0}},
            "joints": {"axis": {"type": "prismatic", "parent": "world", "child": "slide", "axis": [1, 0, 0]}},
            "supplies": {"pump": {"pressure": 16e6, "tank_pressure": 1e5, "oil": {"bulk_modulus": 1.2e9}}},
            "actuators": {
                "ram": {
                    "type": "hydraulic",
                    "joint": "axis",
                    "supply": "pump",
                    "retracted_length": -0.04,
                    "valve": valve,
                    "cylinder": cylinder,
                }
            },
        }
    )


def home(effect: EffectType, kind: str) -> Model:
    """A machine that has a site for an effect."""
    return servo() if effect.site in {"cylinder", "supply"} else machine(kind, site=effect.site)


SITES = {
    "joint": "axis",
    "body": "link",
    "link": "link",
    "beam": "boom",
    "actuator": "drive",
    "sensor": "encoder",
    "world": "world",
    "cylinder": "ram",
    "supply": "pump",
}


def given(effect: EffectType) -> dict[str, float]:
    """Values for what a file has to give."""
    return {parameter.name: 0.5 for parameter in effect.parameters if parameter.start is None or parameter.optional}


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=name_of)
def test_texts_are_complete(effect: EffectType) -> None:
    texts = {parameter.name: f"<{parameter.name}>" for parameter in effect.parameters}
    sentence = effect.sentence.format(at="<at>", **texts)
    assert "<at>" in sentence
    assert all(texts[p.name] in sentence for p in effect.parameters if not p.shape and not p.optional)
    assert sentence.endswith(".")
    assert effect.impossible
    assert all(p.name in effect.law for p in effect.parameters if effect.name != "payload" and p.scale != "inertia")
    assert effect.requires is None or effect_type(effect.requires).site == effect.site


def test_confusion_is_mutual() -> None:
    for effect in EFFECTS.values():
        for other in effect.confused_with:
            assert effect.name in effect_type(other).confused_with, (effect.name, other)


@pytest.mark.parametrize(("effect", "parameter"), PARAMETERS, ids=name_of)
def test_ranges_hold_each_other(effect: EffectType, parameter: EffectParameter) -> None:
    assert parameter.suffix.startswith(f"{effect.group}.")
    assert parameter.evaluable[0] <= parameter.physical[0] < parameter.physical[1] <= parameter.evaluable[1]
    for value in (parameter.neutral, parameter.default("prismatic"), parameter.default("revolute")):
        assert value is None or (math.isfinite(value) and parameter.physical[0] <= value <= parameter.physical[1])
    assert not (parameter.linear and parameter.shape)
    assert parameter.neutral is not None or parameter.shape


@pytest.mark.parametrize("site", SITE_KINDS)
def test_dotted_names_do_not_meet_at_a_site(site: str) -> None:
    suffixes = [parameter.suffix for effect in effects_for_site(site) for parameter in effect.parameters]
    assert len(suffixes) == len(set(suffixes)) > 0


@pytest.mark.parametrize("kind", ["prismatic", "revolute"])
@pytest.mark.parametrize("effect", EFFECTS.values(), ids=name_of)
def test_every_effect_can_be_added_and_its_units_fit_its_law(effect: EffectType, kind: str) -> None:
    if (effect.site, kind) == ("link", "prismatic"):
        pytest.skip("a link bends about the axis that turns it")
    bare = home(effect, kind)
    model = bare.with_effect(effect.name, at=SITES[effect.site], **given(effect))
    added = model.effects[-1]
    for short, dotted in added.parameter_names.items():
        parameter = model.parameters[dotted]
        assert parameter.kind == ("linear" if effect.parameter(short).linear else "shape")
        bends = effect.parameter(short).learnt and short not in given(effect)
        assert parameter.adjustable is (bends or not effect.parameter(short).shape)
    joint_unit = {"prismatic": "m", "revolute": "rad"}[kind]
    effort_unit = {"prismatic": "N", "revolute": "N m"}[kind]
    # Every size of a joint effect times the state quantity that its scale names is an effort.
    states = {
        "effort": "1",
        "effort_per_speed": f"{joint_unit}/s",
        "effort_per_speed_squared": f"{joint_unit}^2/s^2",
        "effort_per_coordinate": joint_unit,
        "effort_per_coordinate_cubed": f"{joint_unit}^3",
    }
    for size in effect.parameters:
        if size.scale in states:
            unit = model.parameters[added.parameter_names[size.name]].unit
            product = parse_unit(f"({unit})({states[size.scale]})")
            assert product.dimension == parse_unit(effort_unit).dimension
    assert model.without_effect(effect.name, at=SITES[effect.site]) == bare


def law_of(effect: EffectType) -> str:
    """Right-hand side of a law as a Python expression in q, v and the parameters."""
    text = effect.law.removeprefix("tau = ").replace("2 pi q", "2*pi*q").replace("1/2 ", "0.5*").replace("^", "**")
    text = re.sub(r"\|(\w)\|", r"abs(\1)", text)
    text = re.sub(r"(?<=[\w)]) (?=[\w(])", "*", text)
    return re.sub(r"\b(tanh|exp|cos|sin|sqrt)\*\(", r"\1(", text)


@pytest.mark.parametrize("kind", ["prismatic", "revolute"])
@pytest.mark.parametrize("effect", [e for e in effects_for_site("joint") if e.name not in ELSEWHERE], ids=name_of)
def test_the_core_computes_the_law_as_it_is_written(effect: EffectType, kind: str) -> None:
    values = {parameter.name: 0.9 * 0.8**i for i, parameter in enumerate(effect.parameters)}
    content = machine(kind).to_dict()
    free = {key: table for key, table in content.items() if key not in {"actuators", "sensors"}}
    model = Model.from_dict(free).with_effect(effect.name, at="axis", **values)
    inertia = model.mass_matrix(np.zeros(1))[0, 0]
    functions = {"tanh": math.tanh, "exp": math.exp, "cos": math.cos, "sin": math.sin, "sqrt": math.sqrt, "pi": math.pi}
    seen = []
    for q, v in [(0.4, -0.9), (-0.2, 0.05), (1.3, 0.7), (0.1, 0.0)]:
        expected = eval(law_of(effect), {"q": q, "v": v, **values, **functions})
        acceleration = model.core.forward_dynamics(model.theta, np.array([q]), np.array([v]), np.array([0.0]))
        assert inertia * acceleration[0] == pytest.approx(expected, rel=1e-12, abs=1e-14)
        seen.append(expected)
    assert max(map(abs, seen)) > 0.1


@pytest.mark.parametrize("effect", effects_for_site("joint"), ids=name_of)
def test_the_physical_range_is_where_friction_takes_energy_out(effect: EffectType) -> None:
    values = {parameter.name: 0.5 for parameter in effect.parameters}
    functions = {"tanh": math.tanh, "exp": math.exp, "cos": math.cos, "sin": math.sin, "sqrt": math.sqrt, "pi": math.pi}
    signed = [p for p in effect.parameters if p.linear and p.physical[0] == 0.0 and effect.group == "friction"]
    for parameter in signed:
        powers = {
            sign: [
                v * eval(law_of(effect), {"q": 0.3, "v": v, **values, parameter.name: sign * 0.5, **functions})
                for v in (-0.6, -0.01, 0.02, 0.8)
            ]
            for sign in (1.0, -1.0)
        }
        assert max(powers[1.0]) < 0.0 < min(powers[-1.0])


def test_unknown_names_get_a_repair() -> None:
    with pytest.raises(ModelError, match="coulomb_friction"):
        effect_type("coulomb_fricton")
    with pytest.raises(ModelError, match="the catalogue has"):
        effect_type("zzz")
    with pytest.raises(ModelError, match="actuator"):
        effects_for_site("actuators")
    with pytest.raises(ModelError, match='"stribeck_velocity"'):
        effect_type("stribeck_friction").parameter("stribek_velocity")


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=name_of)
def test_the_page_of_the_catalogue_has_what_a_model_file_needs(effect: EffectType) -> None:
    page = (ROOT / "docs" / "catalogue.md").read_text(encoding="utf-8")
    section = page.split(f"\n## {effect.name}\n", 1)[1].split("\n## ", 1)[0]
    assert effect.site in section
    assert effect.law in section
    for parameter in effect.parameters:
        unit = parameter.unit.replace("{", "").replace("}", "")
        name = f"*`{parameter.name}`*" if parameter.shape else f"`{parameter.name}`"
        line = next(line for line in section.splitlines() if line.startswith("- ") and name in line.split(": ")[0])
        assert f"`{parameter.suffix}`, {unit}" in line or f"`{effect.group}.` and the name, {unit}" in line


def test_descriptions_name_every_effect_of_joints_and_bodies() -> None:
    for effect in (*effects_for_site("joint"), *effects_for_site("body")):
        model = machine("prismatic").with_effect(effect.name, at=SITES[effect.site], **given(effect))
        entry = json.loads(model.description())["effects"][0]
        assert entry["type"] == effect.name
        assert entry[effect.site] == (1 if model.added_joints else 0)
