"""The model file: what it says reaches the core, it survives being written, and what cannot be right is refused."""

import json
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from model_texts import refused
from places import EXAMPLES
from vpm.catalogue import EFFECTS, EffectType
from vpm.errors import ModelError, UnitError
from vpm.model import Model, Parameter, load_channel_table, parse_channel_table

EMPS = (EXAMPLES / "emps" / "model.toml").read_text(encoding="utf-8")

moderate = st.floats(-100.0, 100.0)
positive = st.floats(1e-3, 1e3)


@st.composite
def quantities(draw: st.DrawFn, unit: str, low: float, high: float) -> float | dict[str, Any]:
    """A parameter in [low, high]: bare, or a table with some of unit, uncertainty and bounds around the value."""
    least = 1e-3 if 0.0 < low < 1e-3 else low  # well inside, for the unit may be a part of the base unit
    value = draw(st.floats(max(least, -1e3), min(high, 1e3)))
    if draw(st.booleans()):
        return value
    table: dict[str, Any] = {"value": value, "unit": unit}
    if draw(st.booleans()):
        table["uncertainty"] = draw(st.one_of(positive, st.just(math.inf)))
    if draw(st.booleans()):
        table["min"] = draw(st.sampled_from([-math.inf, value - 1.0]))
    if draw(st.booleans()):
        table["max"] = draw(st.sampled_from([math.inf, value + 1.0]))
    return table


@st.composite
def inertias(draw: st.DrawFn) -> list[float]:
    """Inertia of a few points about the origin: always one that a body can have."""
    points = draw(st.lists(st.tuples(positive, moderate, moderate, moderate), max_size=4))
    total = np.zeros((3, 3))
    for mass, x, y, z in points:
        r = np.array([x, y, z])
        total += mass * (np.eye(3) * (r @ r) - np.outer(r, r))
    return [float(total[i]) for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


@st.composite
def effects(
    draw: st.DrawFn, sites: dict[str, list[str]], units: dict[tuple[str, str], dict[str, str]], driven: list[str]
) -> list[Any]:
    """Effects of the catalogue at sites, none of them twice; those of an actuator's effort at joints that have one."""
    places = [(effect, at) for effect in EFFECTS.values() for at in sites.get(effect.site, [])]
    places = [(effect, at) for effect, at in places if at in driven or not effect.takes_effort]
    chosen = draw(st.lists(st.sampled_from(places), max_size=5, unique_by=lambda place: (place[0].name, place[1])))

    def entry(effect: EffectType, at: str) -> dict[str, Any]:
        values = {
            p.name: draw(quantities(p.unit.format_map(units[effect.site, at]), *p.physical))
            for p in effect.parameters
            if p.name != "low" and (not p.shape or p.start is None or draw(st.booleans()))
        }
        if "inertia" in {p.name for p in effect.parameters}:
            values["inertia"] = draw(st.floats(1e-3, 1e3))
        return {"type": effect.name, "at": at, **values}

    split: set[str] = set()
    kept = []
    for effect, at in chosen:  # a joint is split once
        splits = effect.name in {"joint_compliance", "backlash", "link_flexibility"}
        joint = f"j{at[1:]}" if effect.site == "link" else at
        if not (splits and joint in split):
            kept.append(entry(effect, at))
        split |= {joint} if splits else set()
    return kept


@st.composite
def machines(draw: st.DrawFn) -> dict[str, Any]:
    """Content of a model file: a tree of one to four bodies, with drives, sensors, controllers, effects, channels."""
    count = draw(st.integers(1, 4))
    kinds = draw(st.lists(st.sampled_from(["prismatic", "revolute"]), min_size=count, max_size=count))
    coordinate = {f"j{k}": "m" if kind == "prismatic" else "rad" for k, kind in enumerate(kinds)}
    effort = {f"j{k}": "N" if kind == "prismatic" else "N m" for k, kind in enumerate(kinds)}
    joints = {}
    for k, kind in enumerate(kinds):
        axis = np.array(draw(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: math.hypot(*a) > 0.1)))
        joints[f"j{k}"] = {
            "type": kind,
            "parent": draw(st.sampled_from(["world", *(f"b{i}" for i in range(k))])),
            "child": f"b{k}",
            "axis": (axis / np.linalg.norm(axis)).tolist(),
            "rotation": draw(st.lists(st.floats(-4.0, 4.0), min_size=3, max_size=3)),
        }
    bodies = {
        f"b{k}": {
            "mass": draw(quantities("kg", 1e-3, 1e3)),
            "center_of_mass": [draw(quantities("m", -10.0, 10.0)) for _ in range(3)],
            "inertia": draw(inertias()),
        }
        for k in range(count)
    }
    driven = draw(st.lists(st.sampled_from(sorted(joints)), max_size=2))
    commands = draw(st.lists(st.sampled_from(["V", "A", "bar", "1", "%"]), min_size=2, max_size=2))
    actuators = {
        f"a{i}": {"joint": joint, "command_unit": unit, "gain": draw(quantities(f"{effort[joint]}/{unit}", -1e3, 1e3))}
        for i, (joint, unit) in enumerate(zip(driven, commands, strict=False))
    }
    read = draw(st.lists(st.sampled_from(sorted(joints)), max_size=2, unique=True))
    sensors = {f"s{i}": {"measures": f"{joint}.position"} for i, joint in enumerate(read)}
    controllers = {
        f"c{i}": {
            "type": "cascade",
            "actuator": name,
            "measures": "j0.position",
            "position_gain": draw(quantities("1/s", 0.0, 1e3)),
            "velocity_gain": draw(quantities(f"{unit} s/{coordinate['j0']}", 0.0, 1e3)),
        }
        for i, (name, unit) in enumerate(zip(actuators, commands, strict=False))
        if draw(st.booleans())
    }
    sites = {"joint": list(joints), "body": list(bodies), "actuator": list(actuators), "sensor": list(sensors)}
    gravity = draw(st.lists(moderate, min_size=3, max_size=3))
    sites |= {"link": [f"b{k}" for k, kind in enumerate(kinds) if kind == "revolute"], "beam": []}
    sites["world"] = ["world"] if any(gravity) else []
    units: dict[tuple[str, str], dict[str, str]] = {
        ("joint", name): {"E": effort[name], "C": coordinate[name]} for name in joints
    }
    units |= {(kind, name): {} for kind in ("body", "link", "world") for name in (*bodies, "world")}
    moved = zip(actuators, driven, commands, strict=False)
    units |= {("actuator", name): {"U": unit, "C": coordinate[joint]} for name, joint, unit in moved}
    units |= {("sensor", f"s{i}"): {"S": coordinate[joint]} for i, joint in enumerate(read)}
    content = {
        "name": draw(st.text(min_size=1, max_size=10)),
        "gravity": gravity,
        "bodies": bodies,
        "joints": dict(draw(st.permutations(list(joints.items())))),
        "actuators": actuators,
        "sensors": sensors,
        "controllers": controllers,
        "effects": draw(effects(sites, units, driven)),
    }
    if draw(st.booleans()):
        column = draw(st.text(min_size=1, max_size=8))
        content["channels"] = {"j0.position": {"column": column, "unit": coordinate["j0"], "scale": -0.5}}
    return content


# ---- what a file says ------------------------------------------------------------------------------------------------


@given(machines())
def test_written_and_read_again_it_is_the_same_model(content: dict[str, Any]) -> None:
    model = Model.from_dict(content)
    again = Model.from_toml(model.to_toml())
    assert again == model
    assert hash(again) == hash(model)
    assert np.array_equal(again.theta, model.theta)
    assert again.to_toml() == model.to_toml()
    assert pickle.loads(pickle.dumps(model)) == model


@given(machines())
def test_every_parameter_stands_in_the_description_once(content: dict[str, Any]) -> None:
    model = Model.from_dict(content)
    described = json.loads(model.description())
    used: list[int] = []

    def collect(value: object, key: str = "") -> None:
        if key in {"gravity", "parameters", "axis", "translation", "rotation", "on", "body", "channel", "measures"}:
            return
        if isinstance(value, dict):
            for name, item in value.items():
                collect(item, name)
        elif isinstance(value, list):
            for item in value:
                collect(item)
        elif isinstance(value, int) and key not in {"joint", "actuator"}:
            used.append(value)

    collect(described)
    assert sorted(used) == list(range(len(model.parameters)))
    assert described["parameter_names"] == list(model.parameter_names)
    assert described["parameters"] == model.theta.tolist()
    assert [model.index(name) for name in model.parameter_names] == list(range(len(model.theta)))
    for k, body in enumerate(described["bodies"]):
        assert body["on"] == "world" or body["on"]["body"] < k
        name = body["joint"]["name"]
        if name in model.added_joints:  # on the joint that it was split off, at its place
            assert described["bodies"][body["on"]["body"]]["joint"]["name"] in content["joints"]
            assert body["joint"]["translation"] == [0.0, 0.0, 0.0]
            continue
        entry = content["joints"][name]
        parent = "world" if body["on"] == "world" else described["bodies"][body["on"]["body"]]["name"]
        behind = next((other["name"] for other in described["bodies"] if other["on"] == {"body": k}), None)
        split = {f"{name}_deflection", f"{entry['child']}_bending"} & set(model.added_joints)
        assert (entry["child"], entry["parent"]) == (behind if split else body["name"], parent)
        expected = Rotation.from_euler("xyz", entry["rotation"]).as_matrix()  # extrinsic: about fixed axes
        assert np.reshape(body["joint"]["rotation"], (3, 3)) == pytest.approx(expected, abs=1e-12)
    for actuator in described["actuators"]:
        driven = described["bodies"][actuator["on"]["joint"]]["joint"]["name"]
        assert driven == content["actuators"][actuator["name"]]["joint"]


@given(machines(), st.data())
def test_a_changed_parameter_changes_nothing_else(content: dict[str, Any], data: st.DataObject) -> None:
    model = Model.from_dict(content)
    movable = [p for p in model.parameters.values() if "inertia" not in p.name]
    chosen = data.draw(st.sampled_from(movable))
    largest = min(chosen.maximum, 1e9)
    value = data.draw(st.floats(max(chosen.minimum, min(-1e3, largest - 1e3)), largest))
    stop, _, end = chosen.name.rpartition(".")
    if stop.endswith(".end_stop") and end in {"low", "high"}:  # the only two that bound each other
        ends = {name: model.parameters[f"{stop}.{name}"].value for name in ("low", "high")} | {end: value}
        assume(ends["low"] < ends["high"])
    changed = model.with_parameters({chosen.name: value})
    assert changed.theta[model.index(chosen.name)] == value
    others = [name for name in model.parameter_names if name != chosen.name]
    assert [changed.parameters[name] for name in others] == [model.parameters[name] for name in others]
    assert changed.with_parameters({chosen.name: chosen.value}) == model
    assert model.theta[model.index(chosen.name)] == chosen.value
    assert Model.from_toml(changed.to_toml()) == changed


@given(st.floats(0.0, 10.0), st.floats(0.0, 10.0), st.floats(0.0, 30.0), st.integers(0, 2**32 - 1))
def test_an_inertia_is_accepted_exactly_if_a_body_can_have_it(a: float, b: float, c: float, seed: int) -> None:
    low, middle, high = sorted((a, b, c))
    if abs(high - low - middle) < 1e-3 * high or high < 1e-300:
        return  # on the edge, where rounding decides
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    matrix = turn @ np.diag([a, b, c]) @ turn.T
    entries = [float(matrix[i]) for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    text = EMPS.replace("max = 1000.0 }", f"max = 1000.0 }}\ninertia = {entries}", 1)
    if high <= low + middle:
        Model.from_toml(text)
    else:
        with pytest.raises(ModelError, match="the largest cannot exceed the sum of the others"):
            Model.from_toml(text)


def test_units_of_the_file_do_not_matter(emps: Model) -> None:
    other = EMPS
    for old, new in [
        (
            'value = 80.0, unit = "kg", uncertainty = 40.0, min = 1.0, max = 1000.0',
            'value = 80e3, unit = "g", uncertainty = 40e3, min = 1e3, max = 1e6',
        ),
        ('value = 35.15065188248547, unit = "N/V"', 'value = 35.15065188248547e-3, unit = "kN/V"'),
        ('value = 243.45, unit = "V/(m/s)"', 'value = 0.24345, unit = "V s/mm"'),
        ('value = 10.0, unit = "V"', 'value = 1e4, unit = "mV"'),
        ('value = 160.18, unit = "1/s"', 'value = 9610.8, unit = "1/min"'),
    ]:
        assert old in other
        other = other.replace(old, new)
    model = Model.from_toml(other)
    assert model.theta == pytest.approx(emps.theta, rel=1e-12)
    mass = model.parameters["carriage.mass"]
    assert (mass.minimum, mass.maximum, mass.uncertainty) == pytest.approx((1.0, 1000.0, 40.0), rel=1e-12)
    assert [p.unit for p in model.parameters.values()] == [p.unit for p in emps.parameters.values()]


def test_the_table_of_the_emps_drive(emps: Model) -> None:
    assert emps.parameters["carriage.mass"] == Parameter("carriage.mass", 80.0, "kg", 40.0, 1.0, 1000.0, "linear")
    assert emps.parameters["axis.friction.viscous"].unit == "N s/m"
    assert emps.parameters["servo.velocity_gain"] == Parameter(
        "servo.velocity_gain", 243.45, "V s/m", None, -math.inf, math.inf, "shape"
    )
    assert emps.parameters["servo.limit"].minimum > 0.0
    assert [p.name for p in emps.parameters.values() if p.adjustable] == ["carriage.mass", "axis.friction.viscous"]
    assert (emps.joints, emps.bodies, emps.actuators) == (("axis",), ("carriage",), ("drive",))
    assert (emps.sensors, emps.controllers, emps.controlled_actuators) == (("encoder",), ("servo",), ("drive",))
    assert (emps.joint_kind("axis"), emps.joint_of_actuator("drive")) == ("prismatic", "axis")
    assert (emps.sensor_of("axis.position"), emps.sensor_of("axis.velocity")) == ("encoder", None)
    assert [emps.sites(kind) for kind in ("joint", "body", "actuator", "sensor")] == [
        ("axis",),
        ("carriage",),
        ("drive",),
        ("encoder",),
    ]
    assert repr(emps) == (
        "Model('EMPS drive': 1 joint, 1 actuator, 1 sensor, 1 controller, 1 effect, 15 parameters, 2 adjustable)"
    )
    assert "<td>axis.friction.viscous</td><td>300</td><td>N s/m</td>" in emps._repr_html_()


def test_channels_and_their_units(emps: Model) -> None:
    assert emps.input_channels == ("drive.command",)
    assert emps.output_channels == (
        *("axis.position", "axis.velocity", "axis.acceleration", "axis.effort"),
        *("drive.command", "drive.force"),
    )
    units = {channel: emps.channel_unit(channel) for channel in emps.channels}
    assert units == {
        "axis.position": "m",
        "axis.velocity": "m/s",
        "axis.acceleration": "m/s^2",
        "axis.effort": "N",
        "drive.command": "V",
        "drive.force": "N",
        "drive.reference": "m",
        "drive.disturbance": "V",
    }
    assert emps.channel_table["drive.disturbance"].optional
    with pytest.raises(ModelError, match=r'did you mean "axis.position"\?'):
        emps.channel_unit("axis.positon")


def test_commands_in_bar_are_pascal_inside() -> None:
    text = EMPS.replace('command_unit = "V"', 'command_unit = "bar"').partition("[channels]")[0]
    text = text.replace('unit = "N/V"', 'unit = "N/bar"').replace('"V/(m/s)"', '"bar s/m"').replace('"V"', '"bar"')
    model = Model.from_toml(text)
    assert model.channel_unit("drive.command") == "Pa"
    assert model.parameters["drive.gain"].value == pytest.approx(35.15065188248547e-5, rel=1e-14)
    assert model.parameters["drive.gain"].unit == "N/Pa"
    assert model.parameters["servo.limit"].value == pytest.approx(1e6, rel=1e-14)


def test_a_slightly_long_axis_is_normalised() -> None:
    model = Model.from_toml(EMPS.replace("axis = [1.0, 0.0, 0.0]", "axis = [0.6, 0.0, 0.8005]"))
    axis = json.loads(model.description())["bodies"][0]["joint"]["axis"]
    assert math.hypot(*axis) == pytest.approx(1.0, abs=1e-15)


def test_the_core_reads_the_description(emps: Model) -> None:
    assert emps.core.n_joints == 1
    assert emps.core.n_parameters == len(emps.parameters)
    assert emps.core.mass_matrix(emps.theta, np.zeros(1)) == pytest.approx(80.0)
    heavier = emps.with_parameters({"carriage.mass": 90.0})
    assert heavier.core is emps.core
    assert heavier.core.mass_matrix(heavier.theta, np.zeros(1)) == pytest.approx(90.0)


@given(machines())
def test_what_a_file_may_say_the_core_can_use(content: dict[str, Any]) -> None:
    model = Model.from_dict(content)
    try:
        size = model.core.n_parameters
    except ModelError as error:  # the one thing that only the whole mechanism can tell: nothing to accelerate
        assert "give its body a rotational inertia" in str(error)  # noqa: PT017
        return
    assert size == len(model.parameters)


# ---- changes ---------------------------------------------------------------------------------------------------------


def test_an_added_effect_is_adjustable_and_can_be_taken_away(emps: Model) -> None:
    rough = emps.with_effect("coulomb_friction", at="axis", coulomb=20.0)
    coulomb = rough.parameters["axis.friction.coulomb"]
    assert (coulomb.value, coulomb.unit, coulomb.uncertainty, coulomb.minimum) == (20.0, "N", math.inf, 0.0)
    assert rough.parameters["axis.friction.transition_velocity"].uncertainty == math.inf
    told = emps.with_effect("coulomb_friction", at="axis", transition_velocity=1e-3)
    assert told.parameters["axis.friction.transition_velocity"].uncertainty is None
    assert dict(rough.effects[-1].parameter_names) == {
        "coulomb": "axis.friction.coulomb",
        "transition_velocity": "axis.friction.transition_velocity",
    }
    assert emps.parameters.keys() < rough.parameters.keys()
    assert rough.without_effect("coulomb_friction", at="axis") == emps
    assert not emps.has_lag("drive")
    assert emps.with_effect("actuator_lag", at="drive", time_constant=0.01).has_lag("drive")


@pytest.mark.parametrize(
    ("name", "at", "values", "words"),
    [
        ("viscous_friction", "axis", {}, "second viscous_friction"),
        ("coulomb_friction", "drive", {}, "no joint of the model"),
        ("coulomb_fricton", "axis", {}, '"coulomb_friction"'),
        ("coulomb_friction", "axis", {"colomb": 1.0}, '"coulomb"'),
        ("coulomb_friction", "axis", {"coulomb": -1.0}, "feed energy"),
        ("coulomb_friction", "axis", {"coulomb": math.nan}, "finite number"),
        ("torque_ripple", "axis", {}, "period is missing"),
    ],
)
def test_effects_that_cannot_be_added(emps: Model, name: str, at: str, values: dict[str, float], words: str) -> None:
    with pytest.raises(ModelError) as caught:
        emps.with_effect(name, at=at, **values)
    assert words in str(caught.value)


def test_values_that_the_file_leaves_out_can_be_changed(emps: Model) -> None:
    pid = EMPS.replace('"cascade"', '"pid"').replace(
        'position_gain = { value = 160.18, unit = "1/s" }', "proportional = 9"
    )
    pid = pid.replace('velocity_gain = { value = 243.45, unit = "V/(m/s)" }', "")
    values = {"servo.integral": 2.0, "servo.derivative": 3.0}
    changed = Model.from_toml(pid).with_parameters(values)
    assert {name: changed.parameters[name].value for name in values} == values
    assert [changed.parameters[f"servo.{key}"].unit for key in ("proportional", "integral", "derivative")] == [
        *("V/m", "V/(m s)", "V s/m"),
    ]
    values = {f"carriage.inertia.{axes}": 1.0 + 0.1 * i for i, axes in enumerate(("xx", "yy", "zz"))}
    values |= {"carriage.center_of_mass.y": 0.25, "carriage.inertia.yz": 0.05}
    changed = emps.with_parameters(values)
    assert {name: changed.parameters[name].value for name in values} == values
    assert Model.from_toml(changed.to_toml()) == changed
    assert changed.with_parameters(dict.fromkeys(values, 0.0)) == emps
    with pytest.raises(ModelError, match="principal moments"):
        emps.with_parameters({"carriage.inertia.xx": 1.0})


def test_changes_that_cannot_be_made(emps: Model) -> None:
    with pytest.raises(ModelError, match=r'did you mean "axis.friction.viscous"\?'):
        emps.with_parameters({"axis.viscous": 1.0})
    with pytest.raises(ModelError, match=r"bodies.carriage.mass is 1001 kg, outside its bounds 1 to 1000 kg"):
        emps.with_parameters({"carriage.mass": 1001.0})
    with pytest.raises(ModelError, match="its effects are: viscous_friction at axis"):
        emps.without_effect("spring", at="axis")
    with pytest.raises(ModelError, match='has no effect spring at "axis"'):
        emps.effect("spring", at="axis")
    with pytest.raises(AttributeError, match="use with_parameters"):
        emps.name = "other"  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        emps.theta[0] = 1.0
    with pytest.raises(ModelError, match='no joint "axes"'):
        emps.joint_kind("axes")


# ---- refusals --------------------------------------------------------------------------------------------------------

MORE_BODIES = """
[bodies.x]
mass = 1
[bodies.y]
mass = 1
[joints.jx]
parent = "y"
child = "x"
type = "revolute"
axis = [0, 0, 1]
[joints.jy]
parent = "x"
child = "y"
type = "revolute"
axis = [0, 0, 1]
"""
EFFECT = "[[effects]]\nat = 'axis'\n"
END = "[channels]"
MASS = "max = 1000.0 }"

REFUSALS = [
    # unknown and missing keys
    ("mass = {", "mas = {", "bodies.carriage.mas", 'did you mean "mass"?'),
    ("gravity", "gravty", "gravty", 'did you mean "gravity"?'),
    (END, "[foo]\n[channels]", "foo", "actuators, beams, bodies, bushings, channels"),
    ("position_gain", "positiongain", "controllers.servo.positiongain", 'did you mean "position_gain"?'),
    ("viscous =", "viscus =", "effects[0].viscus", 'did you mean "viscous"?'),
    ('"q_m", unit', '"q_m", scal = 1, unit', 'channels."axis.position".scal', 'did you mean "scale"?'),
    ("value = 80.0, ", "", "bodies.carriage.mass.value", "is missing; add it, for example value = 1.0"),
    (
        'time = { column = "time_s", unit = "s"',
        'time = { column = "time_s"',
        "channels.time.unit",
        'for example unit = "s"',
    ),
    ('type = "prismatic"\n', "", "joints.axis.type", 'for example type = "prismatic"'),
    ('at = "axis"\n', "", "effects[0].at", "is missing"),
    ('type = "cascade"\n', "", "controllers.servo", "has no type"),
    (END, f"{EFFECT}type = 'coulomb_friction'\n[channels]", "effects[1].coulomb", "needs coulomb"),
    (END, f"{EFFECT}type = 'torque_ripple'\ncosine = 1\n[channels]", "effects[1].period", "screw lead"),
    # wrong kinds of values
    ("value = 80.0", 'value = "80"', "bodies.carriage.mass", 'is "80", but has to be a number'),
    ("value = 80.0", "value = true", "bodies.carriage.mass", "is true, but has to be a number"),
    ("value = 80.0", "value = nan", "bodies.carriage.mass", "is nan, but has to be a finite number"),
    ("value = 80.0", "value = inf", "bodies.carriage.mass", "is inf, but has to be a finite number"),
    ("viscous = {", "viscous = [3] #", "effects[0].viscous", "a number or a table like"),
    ("axis = [1.0, 0.0, 0.0]", "axis = 1", "joints.axis.axis", "has to be a list"),
    ("axis = [1.0, 0.0, 0.0]", "axis = [1, 0]", "joints.axis.axis", "has 2 entries, but has to have 3"),
    ("axis = [1.0, 0.0, 0.0]", 'axis = [1, "a", 0]', "joints.axis.axis[1]", 'is "a"'),
    ('name = "EMPS drive"', 'name = ""', "name", "is empty text"),
    ("optional = true", "optional = 1", 'channels."drive.disturbance".optional', "true or false"),
    # numbers that cannot be
    ("value = 80.0", "value = -80.0", "bodies.carriage.mass", "is -80 kg, but only more than 0 kg"),
    ("value = 80.0", "value = 2000.0", "bodies.carriage.mass", "is 2000 kg, outside its bounds 1 to 1000 kg"),
    ("min = 1.0, max = 1000.0", "min = 5, max = 5", "bodies.carriage.mass", "has min 5 kg and max 5 kg"),
    ("min = 1.0, max = 1000.0", "min = nan", "bodies.carriage.mass", "a bound that is not a number"),
    ("min = 1.0, max = 1000.0", "max = -1", "bodies.carriage.mass", "leave nothing"),
    ("uncertainty = 40.0", "uncertainty = -1", "bodies.carriage.mass", "uncertainty -1 kg"),
    ("uncertainty = 40.0", "uncertainty = 0", "bodies.carriage.mass", "leave it out if the value is known"),
    ("uncertainty = 40.0", "uncertainty = nan", "bodies.carriage.mass", "uncertainty nan kg"),
    ("value = 300.0", "value = -3", "effects[0].viscous", "only 0 N s/m or more"),
    ("value = 10.0", "value = 0.0", "controllers.servo.limit", "only more than 0 V"),
    ('"q_m", unit', '"q_m", scale = 0, unit', 'channels."axis.position".scale', "would erase the column"),
    ("axis = [1.0, 0.0, 0.0]", "axis = [1.0, 0.5, 0.0]", "joints.axis.axis", "with length 1.11803"),
    ("axis = [1.0, 0.0, 0.0]", "axis = [0, 0, 0]", "joints.axis.axis", "give it a direction"),
    (MASS, f"{MASS}\ninertia = [1, 1, 3, 0, 0, 0]", "bodies.carriage.inertia", "principal moments 1, 1, 3 kg m^2"),
    (MASS, f"{MASS}\ninertia = [1, 1, 1, 2, 0, 0]", "bodies.carriage.inertia", "none can be negative"),
    (MASS, f"{MASS}\ninertia = [-1, 1, 1, 0, 0, 0]", "bodies.carriage.inertia[0]", "is -1 kg m^2"),
    # units
    ('"kg"', '"N"', "bodies.carriage.mass", 'unit "N" is of the kind kg m/s^2, but kg is needed'),
    ('"kg"', '"kgs"', "bodies.carriage.mass", 'unknown symbol "kgs"'),
    ('"N/V"', '"N/A"', "actuators.drive.gain", '"N/V"'),
    ('command_unit = "V"', 'command_unit = "Vlt"', "actuators.drive.command_unit", '"Vlt"'),
    ('"q_m", unit = "m"', '"q_m", unit = "V"', 'channels."axis.position".unit', "but m is needed"),
    ('"q_m", unit = "m"', '"q_m", unit = "mtr"', 'channels."axis.position".unit', '"mtr"'),
    # names and references
    ('type = "prismatic"', 'type = "prismatik"', "joints.axis.type", 'did you mean "prismatic"?'),
    ('type = "cascade"', 'type = "casc"', "controllers.servo", 'did you mean "cascade"?'),
    ('type = "viscous_friction"', 'type = "viscos_friction"', "effects[0].type", '"viscous_friction"'),
    ('at = "axis"', 'at = "drive"', "effects[0].at", "is no joint of the model"),
    ('parent = "world"', 'parent = "wrld"', "joints.axis.parent", 'did you mean "world"?'),
    ('child = "carriage"', 'child = "cariage"', "joints.axis.child", 'did you mean "carriage"?'),
    ('joint = "axis"', 'joint = "axs"', "actuators.drive.joint", 'did you mean "axis"?'),
    ('measures = "axis.position"', 'measures = "axis.positon"', "sensors.encoder.measures", '"axis.position"'),
    ('actuator = "drive"', 'actuator = "drve"', "controllers.servo.actuator", 'did you mean "drive"?'),
    ('"axis.position" =', '"axis.positio" =', 'channels."axis.positio"', 'did you mean "axis.position"?'),
    ('"axis.position" =', '"axis.gauge" =', 'channels."axis.gauge"', "axis has axis.acceleration, axis.effort"),
    ('"axis.position" =', '"carriage.position" =', 'channels."carriage.position"', "carriage has none; a joint has"),
    ("[controllers.servo]", "[controllers.axis]", "controllers.axis", "same name as joints.axis"),
    ("[bodies.carriage]", "[bodies.world]", "bodies.world", "reserved"),
    ("[bodies.carriage]", '[bodies."a b"]', 'bodies."a b"', "after a letter"),
    (END, "[sensors.two]\nmeasures = 'axis.position'\n[channels]", "sensors.two.measures", 'sensor "encoder" already'),
    (END, f"{EFFECT}type = 'viscous_friction'\nviscous = 1\n[channels]", "effects[1]", "second viscous_friction"),
    # the tree
    ('parent = "world"', 'parent = "carriage"', "bodies.carriage", "loop that never reaches the world"),
    (END, f"{MORE_BODIES}\n[channels]", "bodies.x", "x -> y -> x"),
    (END, "[bodies.x]\nmass = 1\n[channels]", "bodies.x", "hangs on no joint"),
    (
        END,
        "[joints.two]\ntype = 'revolute'\nparent = 'world'\nchild = 'carriage'\naxis = [0, 0, 1]\n[channels]",
        "joints.two.child",
        'joint "axis" already carries',
    ),
]


@pytest.mark.parametrize(("old", "new", "where", "words"), REFUSALS, ids=[f"{r[2]}-{r[3]}" for r in REFUSALS])
def test_what_cannot_be_right_is_refused(old: str, new: str, where: str, words: str) -> None:
    refused(where, words, EMPS, (old, new))


def test_the_number_of_further_problems_is_said() -> None:
    text = EMPS.replace("value = 80.0", "value = -80.0").replace("value = 300.0", "value = -3").replace('"1/s"', '"s"')
    with pytest.raises(ModelError) as caught:
        Model.from_toml(text)
    assert caught.value.where == "bodies.carriage.mass"
    assert caught.value.more == 2
    assert str(caught.value).endswith("(and 2 more problems)")


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [("name = 1\ngravity = = 3\n", 2, 11), ("name = 'a'\nname = 'b'\n", 2, 11), ("name = 'a'\n[bodies", 2, 8)],
)
def test_broken_syntax_is_located(tmp_path: Path, text: str, line: int, column: int) -> None:
    path = tmp_path / "model.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        Model.load(path)
    assert (caught.value.line, caught.value.column, caught.value.path) == (line, column, str(path))
    assert f"line {line}, column {column}" in str(caught.value)


def test_files_that_cannot_be_read_or_are_wrong_are_named(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="does not exist"):
        Model.load(tmp_path / "none.toml")
    with pytest.raises(ModelError, match="cannot be read"):
        Model.load(tmp_path)
    (tmp_path / "latin.toml").write_bytes('name = "ä"'.encode("latin-1"))
    with pytest.raises(ModelError, match="not UTF-8"):
        Model.load(tmp_path / "latin.toml")
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(EMPS.replace("value = 80.0", "value = -80.0"), encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        Model.load(wrong)
    assert str(caught.value).startswith(f"{wrong}: bodies.carriage.mass is -80 kg")


def test_a_file_of_a_windows_editor_is_read(emps: Model, tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_bytes(b"\xef\xbb\xbf" + EMPS.replace("\n", "\r\n").encode())
    assert Model.load(path) == emps


def test_save_and_load(emps: Model, tmp_path: Path) -> None:
    path = emps.save(tmp_path / "saved.toml")
    loaded = Model.load(path)
    assert loaded == emps
    assert loaded.path == str(path)
    assert loaded.with_parameters({"carriage.mass": 90.0}).path is None


# ---- channel tables --------------------------------------------------------------------------------------------------


def test_a_channel_table_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "channels.toml"
    rows = 'time = { column = "t", unit = "ms" }\n"axis.position" = { column = "q", unit = "mm", delay = 0.002 }\n'
    path.write_text(rows, encoding="utf-8")
    bare = load_channel_table(path)
    path.write_text(f"[channels]\n{rows}", encoding="utf-8")
    assert load_channel_table(path) == bare
    entry = bare["axis.position"]
    assert (entry.column, entry.unit, entry.scale, entry.offset, entry.delay, entry.optional) == (
        *("q", "mm", 1.0, 0.0, 0.002),
        False,
    )


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"column": "q"}, 'channels."axis.position".unit is missing'),
        ({"column": "q", "unit": "mtr"}, 'unknown symbol "mtr"'),
        ({"column": "q", "unit": "m", "colum": "x"}, 'did you mean "column" or "columns"?'),
        ({"column": "q", "unit": "m", "delay": math.inf}, "finite number"),
        ("q", "has to be a table"),
    ],
)
def test_channel_tables_that_cannot_be_right(entry: object, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        parse_channel_table({"axis.position": entry})
    assert words in str(caught.value)


def test_unit_errors_of_a_model_are_model_errors() -> None:
    with pytest.raises(ModelError) as caught:
        Model.from_toml(EMPS.replace('"kg"', '"N"'))
    assert not isinstance(caught.value, UnitError)
