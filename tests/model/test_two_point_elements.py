"""Lines between two points in a model file: ends, masses, drives, channels, and what is refused."""

import pytest

from model_texts import TWO_LINKS, changed, described, refused
from vpm.errors import ModelError
from vpm.model import Model

LEG = f"""
name = "leg"
gravity = [0.0, 0.0, -9.81]

{TWO_LINKS}
[lines.cylinder]
from = {{ parent = "thigh", point = [0.05, 0.0, -0.1] }}
to = {{ parent = "shank", point = [0.05, 0.0, -0.1] }}
barrel = {{ mass = {{ value = 900.0, unit = "g" }}, center = 0.08, inertia = 2e-3 }}
rod = {{ mass = 0.3, center = 0.1 }}

[actuators.valve]
line = "cylinder"
gain = {{ value = 2.0, unit = "kN/V" }}
command_unit = "V"

[sensors.stroke]
measures = "cylinder.length"

[channels]
"cylinder.tension" = {{ column = "F_kN", unit = "kN" }}
"""


def leg(*changes: tuple[str, str]) -> Model:
    return changed(LEG, *changes)


def test_a_line_reaches_the_core_as_it_is_written() -> None:
    model = leg()
    told = described(model)
    (line,) = told["lines"]
    assert line["from"] == {"on": {"body": 0}, "point": [0.05, 0.0, -0.1]}
    assert line["to"]["on"] == {"body": 1}
    assert line["barrel"] == {key: model.index(f"cylinder.barrel.{key}") for key in ("mass", "center", "inertia")}
    assert model.parameters["cylinder.barrel.mass"].value == pytest.approx(0.9)
    assert model.parameters["cylinder.rod.inertia"].unit == "kg m^2"
    assert told["actuators"][0]["on"] == {"line": 0}
    assert told["sensors"][0]["channel"] == {"kind": "length", "line": 0}
    assert Model.from_toml(model.to_toml()) == model


def test_drives_of_lines_push_with_a_force() -> None:
    model = leg()
    assert model.parameters["valve.gain"].unit == "N/V"
    assert model.parameters["valve.gain"].value == 2000.0
    assert model.channel_unit("valve.force") == "N"
    assert model.channel_unit("cylinder.tension") == "N"
    assert model.channels[-3:] == ("cylinder.length", "cylinder.rate", "cylinder.tension")
    assert (model.lines, model.line_of_actuator("valve")) == (("cylinder",), "cylinder")
    with pytest.raises(ModelError, match='drives the line "cylinder"'):
        model.joint_of_actuator("valve")
    slow = model.with_effect("actuator_lag", at="valve", time_constant=0.01)
    assert slow.state_names[-1] == "valve.lag"


def test_a_line_may_have_no_mass() -> None:
    model = leg(('barrel = { mass = { value = 900.0, unit = "g" }, center = 0.08, inertia = 2e-3 }\n', ""))
    assert described(model)["lines"][0]["barrel"] is None
    assert "cylinder.barrel.mass" not in model.parameters


WRONG = [
    ('from = { parent = "thigh"', 'from = { parent = "tigh"', "lines.cylinder.from.parent", 'did you mean "thigh"'),
    ('to = { parent = "shank", point = [0.05, 0.0, -0.1] }\n', "", "lines.cylinder.to", "to = { parent ="),
    ('to = { parent = "shank"', 'to = { parent = "thigh"', "lines.cylinder", "its length cannot change"),
    ('to = { parent = "shank"', 'to = { parent = "shank", at = 0.1', "lines.cylinder.to.at", "is no beam"),
    ("rod = { mass", "rod = { mas", "lines.cylinder.rod.mas", 'did you mean "mass"'),
    ("rod = { mass = 0.3", "rod = { mass = -0.3", "lines.cylinder.rod.mass", "only 0 kg or more is physically"),
    ("point = [0.05, 0.0, -0.1] }\nto", "pont = [0.05, 0.0, -0.1] }\nto", "lines.cylinder.from.pont", '"point"'),
    ('line = "cylinder"', 'line = "cilinder"', "actuators.valve.line", 'did you mean "cylinder"'),
    ('line = "cylinder"\n', "", "actuators.valve.joint", "or line with the name of a line"),
    ('line = "cylinder"', 'line = "cylinder"\njoint = "knee"', "actuators.valve", "drives a joint and a line"),
    ('"kN/V"', '"N m/V"', "actuators.valve.gain", "wrong unit"),
    ('"cylinder.length"', '"cylinder.lenght"', "sensors.stroke.measures", 'did you mean "cylinder.length"'),
]


@pytest.mark.parametrize(("old", "new", "where", "says"), WRONG, ids=[f"{w}: {s}" for _, _, w, s in WRONG])
def test_what_cannot_be_right_is_refused(old: str, new: str, where: str, says: str) -> None:
    refused(where, says, LEG, (old, new))
