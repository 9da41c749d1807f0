"""Flexible links in a model file: what the file says reaches the core, levels change, and what cannot be is refused."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model_texts import changed, described, refused
from random_trees import trees
from vpm.errors import ModelError
from vpm.model import Model
from vpm.model.beams.level import FORMS, Level, parse_level

ARM = """
name = "arm"
gravity = [0.0, 0.0, -9.81]

[bodies.hub]
mass = 1.0
inertia = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]

[bodies.knee]
mass = 0.4
inertia = [1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0]

[bodies.load]
mass = 0.5

[joints.shoulder]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, 1.0, 0.0]

[joints.elbow]
type = "revolute"
parent = "upper"
child = "knee"
axis = [0.0, 1.0, 0.0]

[joints.grip]
type = "fixed"
parent = "fore"
child = "load"
translation = [0.0, 0.0, 0.01]

[beams.upper]
parent = "hub"
length = 0.44
level = "strain(3)"
deforms = ["bending_x", "torsion"]
material = { young = { value = 206.0, unit = "GPa", uncertainty = 5.0 }, poisson = 0.3, density = 7850.0 }
section = { shape = "rectangle", width = { value = 15.0, unit = "mm" }, height = 0.004 }
damping = { stiffness = 1e-3, mass = 0.1, ratios = [0.01, 0.02] }

[beams.fore]
parent = "knee"
length = 0.41
level = "bezier(3)"
material = { young = 70e9, density = 2700.0 }
sections = [
    { at = 0.0, shape = "tube", outer = 0.012, inner = 0.01 },
    { at = 0.41, shape = "tube", outer = 0.01, inner = 0.008 },
]

[lines.spring]
from = { parent = "world", point = [0.1, 0.0, 0.2] }
to = { parent = "upper", at = 0.2, point = [0.0, 0.0, 0.001] }

[gauges.root]
beam = "upper"
at = 0.056
y = 0.002

[markers.tip]
parent = "fore"
"""


def arm(*changes: tuple[str, str]) -> Model:
    return changed(ARM, *changes)


# ---- what a file says ------------------------------------------------------------------------------------------------


def test_a_beam_reaches_the_core_as_it_is_written() -> None:
    model = arm()
    upper, fore = described(model)["beams"]
    assert (upper["name"], upper["on"], upper["length"]) == ("upper", {"body": 0}, 0.44)
    assert (upper["level"], upper["deforms"]) == ({"strain": 3}, ["bending_x", "torsion"])
    assert upper["material"] == {key: model.index(f"upper.{key}") for key in ("young", "poisson", "density")}
    width, height = model.index("upper.section.width"), model.index("upper.section.height")
    assert upper["sections"] == [{"at": 0.0, "shape": {"shape": "rectangle", "width": width, "height": height}}]
    assert upper["damping"] == {
        "stiffness": model.index("upper.damping.stiffness"),
        "mass": model.index("upper.damping.mass"),
        "ratios": [model.index("upper.damping.ratios.0"), model.index("upper.damping.ratios.1")],
    }
    assert fore["on"] == {"body": 1}
    assert fore["deforms"] == ["bending_x", "bending_y", "torsion"]
    assert [entry["at"] for entry in fore["sections"]] == [0.0, 0.41]
    assert fore["sections"][1]["shape"]["outer"] == model.index("fore.section.1.outer")
    assert fore["damping"] == {"stiffness": None, "mass": None, "ratios": []}


def test_things_sit_on_the_sections_they_name() -> None:
    content = described(arm())
    assert content["bodies"][1]["on"] == {"section": {"beam": 0, "at": 0.44}}  # the tip, unless told otherwise
    assert content["welds"][0]["on"] == {"section": {"beam": 1, "at": 0.41}}
    assert content["welds"][0]["translation"] == [0.0, 0.0, 0.01]
    assert content["lines"][0]["to"] == {"on": {"section": {"beam": 0, "at": 0.2}}, "point": [0.0, 0.0, 0.001]}
    assert content["gauges"] == [{"name": "root", "beam": 0, "at": 0.056, "x": 0.0, "y": 0.002}]
    assert content["markers"][0]["on"] == {"section": {"beam": 1, "at": 0.41}}


def test_parameters_of_beams_are_shapes_in_si() -> None:
    model = arm()
    young = model.parameters["upper.young"]
    assert (young.value, young.unit, young.uncertainty, young.kind) == (206e9, "Pa", 5e9, "shape")
    width = model.parameters["upper.section.width"]
    assert width.value == pytest.approx(0.015)
    assert width.unit == "m"
    own = [p for name, p in model.parameters.items() if name.partition(".")[0] in model.beams]
    assert len(own) == 3 + 2 + 4 + 3 + 4
    assert {p.kind for p in own} == {"shape"}
    assert (model.parameters["fore.poisson"].minimum, model.parameters["fore.poisson"].maximum) == (-0.999, 0.5)
    assert model.parameters["upper.damping.ratios.1"].minimum == 0.0
    assert [name for name, p in model.parameters.items() if p.adjustable] == ["upper.young"]


def test_second_moments_may_be_small() -> None:
    given_section = "{ shape = 'given', area = 6e-5, moment_x = 8e-11, moment_y = 1.1e-9, torsion = 3e-10 }"
    model = arm(('{ shape = "rectangle", width = { value = 15.0, unit = "mm" }, height = 0.004 }', given_section))
    assert model.parameters["upper.section.moment_x"].value == 8e-11
    assert model.parameters["upper.section.moment_x"].unit == "m^4"
    with pytest.raises(ModelError, match=r"moment_x is 0 m\^4, but only more than 0 m\^4 is physically possible"):
        model.with_parameters({"upper.section.moment_x": 0.0})


def test_components_and_channels_by_name() -> None:
    model = arm()
    assert model.beams == ("upper", "fore")
    assert model.bodies == ("hub", "knee", "load")
    assert (model.joints, model.gauges, model.markers) == (("shoulder", "elbow"), ("root",), ("tip",))
    assert model.levels == {"upper": "strain(3)", "fore": "bezier(3)"}
    assert model.output_channels[8:] == (
        *("spring.length", "spring.rate", "spring.tension", "root.strain"),
        *("tip.x", "tip.y", "tip.z", "tip.rx", "tip.ry", "tip.rz"),
    )
    units = [model.channel_unit(channel) for channel in model.output_channels[8:]]
    assert units == ["m", "m/s", "N", "1", "m", "m", "m", "rad", "rad", "rad"]
    assert model.coordinates[:8] == (
        *("shoulder", "elbow"),
        *(f"upper.{component}.{i}" for component in ("bending_x", "torsion") for i in range(3)),
    )
    assert model.coordinates[8:10] == ("fore.bending_x.0", "fore.bending_x.1")
    assert len(model.state_names) == 2 * len(model.coordinates)
    assert "2 beams" in repr(model)
    assert model.sites("body") == ("hub", "knee", "load", "upper", "fore")


def test_a_payload_sits_at_the_tip_of_a_beam() -> None:
    loaded = arm().with_effect("payload", at="upper", mass=0.2, z=0.01)
    entry = described(loaded)["effects"][0]
    assert entry["beam"] == 0
    assert loaded.parameters["upper.payload.mass"].value == 0.2


def test_a_beam_may_be_the_whole_machine() -> None:
    model = Model.from_toml(
        """
        name = "cantilever"
        gravity = [0.0, 0.0, -9.81]
        [beams.strip]
        parent = "world"
        rotation = [0.0, 1.5707963267948966, 0.0]
        length = 1.0
        level = "elements(4)"
        deforms = ["bending_y"]
        material = { young = 206e9, density = 7850 }
        section = { shape = "circle", diameter = 0.01 }
        """
    )
    assert (model.bodies, model.joints) == ((), ())
    assert model.coordinates == tuple(f"strip.bending_y.{i}" for i in range(5))


# ---- levels of detail ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "bending", "torsion"),
    [
        ("rigid", 0, 0),
        ("lumped(4)", 4, 4),
        ("modal(3)", 3, 3),
        ("bezier(4)", 3, 4),
        ("deflection(4)", 3, 4),
        ("hermite(2)", 4, 2),
        ("strain(3)", 3, 3),
        ("elements(3)", 4, 4),
    ],
)
def test_coordinates_of_a_level(text: str, bending: int, torsion: int) -> None:
    level = parse_level(text)
    assert str(level) == text
    assert (level.count("bending_x"), level.count("torsion")) == (bending, torsion)
    names = level.coordinates(("bending_x", "torsion"))
    assert len(set(names)) == len(names) == bending + torsion


@given(st.sampled_from(sorted(FORMS)), st.data())
def test_levels_read_back_and_have_a_range(name: str, data: st.DataObject) -> None:
    number = data.draw(st.integers(-5, 300))
    inside = FORMS[name].least <= number <= FORMS[name].most
    if inside:
        assert parse_level(f" {name}( {number} ) ") == parse_level(f"{name}({number})") == Level(name, number)
    else:
        with pytest.raises(ValueError, match=f"can be {FORMS[name].least} to {FORMS[name].most}"):
            parse_level(f"{name}({number})")


@pytest.mark.parametrize(
    ("text", "repair"),
    [
        ("rigid(2)", 'write "rigid"'),
        ("bezier", 'write for example "bezier\\(3\\)"'),
        ("strian(3)", 'did you mean "strain"'),
        ("strain(2.5)", 'write for example "strain\\(3\\)"'),
        ("strain(3", 'write for example "strain\\(3\\)"'),
        ("fine", "write one of rigid, lumped\\(n\\)"),
    ],
)
def test_levels_that_are_none(text: str, repair: str) -> None:
    with pytest.raises(ValueError, match=repair):
        parse_level(text)


def test_at_changes_the_level_and_nothing_else() -> None:
    model = arm()
    rigid = model.at("rigid")
    assert rigid.levels == {"upper": "rigid", "fore": "rigid"}
    assert rigid.coordinates == rigid.joints
    assert rigid.parameters == model.parameters
    assert described(rigid)["beams"][0]["damping"]["ratios"] == []  # a rigid beam has no modes
    one = model.at({"fore": "modal(2)"})
    assert one.levels == {"upper": "strain(3)", "fore": "modal(2)"}
    assert one.at({"fore": "bezier(3)"}) == model
    assert model.levels["fore"] == "bezier(3)"


def test_at_refuses_what_is_not_there() -> None:
    model = arm()
    with pytest.raises(ModelError, match='has no beam "uper"; did you mean "upper"'):
        model.at({"uper": "rigid"})
    with pytest.raises(ModelError, match=r'beams.upper.level is "bezir.3.", which is no level of detail; did you mean'):
        model.at("bezir(3)")
    with pytest.raises(ModelError, match="can be 1 to 8"):
        model.at("modal(9)")
    stiff = Model.from_toml(
        'name = "stiff"\ngravity = [0, 0, 0]\n[bodies.b]\nmass = 1\n'
        '[joints.j]\ntype = "prismatic"\nparent = "world"\nchild = "b"\naxis = [1, 0, 0]\n'
    )
    with pytest.raises(ModelError, match="has no beams"):
        stiff.at("rigid")


# ---- what cannot be right --------------------------------------------------------------------------------------------

RECTANGLE = '{ shape = "rectangle", width = { value = 15.0, unit = "mm" }, height = 0.004 }'

WRONG = [
    # form
    ("length = 0.44\n", "", "beams.upper.length", "length = 0.5"),
    ('level = "strain(3)"\n', "", "beams.upper.level", 'level = "bezier(4)"'),
    ('"strain(3)"', '"strain"', "beams.upper.level", "needs a number"),
    ('"bending_x", "torsion"', '"bending_x", "bending_z"', "beams.upper.deforms[1]", 'or "bending_x"'),
    ('"bending_x", "torsion"', '"torsion", "torsion"', "beams.upper.deforms", "has torsion twice"),
    ('["bending_x", "torsion"]', "[]", "beams.upper.deforms", "has 0 entries"),
    ("poisson = 0.3,", "poison = 0.3,", "beams.upper.material.poison", 'did you mean "poisson"'),
    (", density = 7850.0 }", "}", "beams.upper.material.density", "density = 7850"),
    ('"rectangle"', '"rectangel"', "beams.upper.section", 'has the shape "rectangel"; did you mean "rectangle"'),
    ('shape = "rectangle", ', "", "beams.upper.section", "has no shape"),
    ("height = 0.004", "heigth = 0.004", "beams.upper.section.heigth", 'did you mean "height"'),
    ("outer = 0.01,", "outr = 0.01,", "beams.fore.sections[1].outr", 'did you mean "outer"'),
    ('"mm" }', '"mm", mini = 1.0 }', "beams.upper.section.width.mini", 'did you mean "min"'),
    ("stiffness = 1e-3", "stifness = 1e-3", "beams.upper.damping.stifness", 'did you mean "stiffness"'),
    ("[beams.upper]", "[beams.elbow]", "beams.elbow", "has the same name as joints.elbow"),
    ("gravity = [0.0, 0.0, -9.81]\n", "", "gravity", "add it, for example gravity = [0.0, 0.0, -9.81]"),
    # values
    ("length = 0.44", "length = 0.0", "beams.upper.length", "is 0 m, but has to be above 0"),
    ("value = 15.0", "value = -15.0", "beams.upper.section.width", "only more than 0 m is physically possible"),
    ("height = 0.004", "height = 0.0", "beams.upper.section.height", "only more than 0 m is physically possible"),
    ('"mm"', '"kg"', "beams.upper.section.width", "wrong unit"),
    ("poisson = 0.3", "poisson = 0.6", "beams.upper.material.poisson", "only -0.999 to 0.5 is physically possible"),
    ("ratios = [0.01, 0.02]", "ratios = [0.01, -0.02]", "beams.upper.damping.ratios[1]", "feed energy"),
    ("inner = 0.01 }", "inner = 0.012 }", "beams.fore.sections[0]", "inner 0.012 m and outer 0.012 m"),
    # sections
    (f"section = {RECTANGLE}\n", "", "beams.upper.section", 'section = { shape = "rectangle"'),
    ("section = {", "section = { at = 0.0,", "beams.upper.section.at", "holds for the whole beam"),
    ("at = 0.0, shape", "at = 0.1, shape", "beams.fore.sections", "rise from 0 to the length 0.41 m"),
    ("at = 0.41, shape", "at = 0.40, shape", "beams.fore.sections", "rise from 0 to the length 0.41 m"),
    ("at = 0.41, shape", "shape", "beams.fore.sections[1].at", "add the arc length"),
    # the tree
    ('parent = "hub"', 'parent = "hubb"', "beams.upper.parent", 'no body or beam of the model; did you mean "hub"'),
    ('parent = "hub"', 'parent = "knee"', "bodies.knee", "knee -> upper -> knee"),
    ('parent = "hub"', 'parent = "upper"', "beams.upper", "reaches the world: upper -> upper; give"),
    ('parent = "hub"', 'parent = "fore"', "bodies.knee", "knee -> upper -> fore -> knee"),
    ('child = "load"', 'child = "upper"', "joints.grip.child", "a beam, but a joint carries a body"),
    ('parent = "hub"', 'parent = "hub"\nat = 0.1', "beams.upper.at", '"hub" is no beam to go along'),
    ('parent = "upper"\n', 'parent = "upper"\nat = 0.5\n', "joints.elbow.at", "goes from 0 to 0.44 m"),
    ("at = 0.2,", "at = -0.2,", "lines.spring.to.at", "goes from 0 to 0.44 m"),
    # gauges and markers
    ("at = 0.056", "at = 0.56", "gauges.root.at", 'is 0.56 m, but beam "upper" goes from 0 to 0.44 m'),
    ("at = 0.056\n", "", "gauges.root.at", "at = 0.05"),
    ('beam = "upper"', 'beam = "uper"', "gauges.root.beam", 'did you mean "upper"'),
    ("y = 0.002", "x = 0.002", "gauges.root", "can only read zero"),
    ("y = 0.002", "y = 2.0", "gauges.root.y", "the section ends 0.002 m from the axis"),
    ('[markers.tip]\nparent = "fore"', '[markers.tip]\nparent = "four"', "markers.tip.parent", 'did you mean "fore"'),
]


@pytest.mark.parametrize(("old", "new", "where", "says"), WRONG, ids=[f"{w}: {s}" for _, _, w, s in WRONG])
def test_what_cannot_be_right_is_refused(old: str, new: str, where: str, says: str) -> None:
    refused(where, says, ARM, (old, new))


def test_two_ways_to_say_the_section() -> None:
    with pytest.raises(ModelError, match=r"beams.fore has section and sections; remove one"):
        arm(("sections = [", 'section = { shape = "circle", diameter = 0.01 }\nsections = ['))


def test_webs_and_flanges_fit() -> None:
    shape = "{{ shape = 'i', width = 0.02, height = 0.03, flange = {}, web = {} }}"
    assert arm((RECTANGLE, shape.format(0.002, 0.001))).parameters["upper.section.web"].value == 0.001
    with pytest.raises(ModelError, match=r"two flanges of 0.015 m, which fill the height 0.03 m"):
        arm((RECTANGLE, shape.format(0.015, 0.001)))
    with pytest.raises(ModelError, match=r"has web 0.03 m, which is not below the width 0.02 m"):
        arm((RECTANGLE, shape.format(0.002, 0.03)))


def test_shapes_do_not_change_along_a_beam() -> None:
    circle = "{ at = 0.41, shape = 'circle', diameter = 0.01 }"
    with pytest.raises(ModelError, match="has the shapes circle and tube"):
        arm(('{ at = 0.41, shape = "tube", outer = 0.01, inner = 0.008 }', circle))


# ---- random machines -------------------------------------------------------------------------------------------------


@given(trees())
def test_random_trees_survive_being_written(content: dict[str, Any]) -> None:
    model = Model.from_dict(content)
    again = Model.from_toml(model.to_toml())
    assert again == model
    assert again.to_toml() == model.to_toml()
    assert again.parameters == model.parameters


@given(trees())
def test_random_trees_stand_in_the_description_as_a_whole(content: dict[str, Any]) -> None:
    model = Model.from_dict(content)
    told = described(model)
    names = [body["joint"]["name"] for body in told["bodies"]]
    assert names == list(model.joints)
    assert [beam["name"] for beam in told["beams"]] == list(model.beams)
    # Every body of the file stands once: on its joint, or fixed to something.
    carried = [body["name"] for body in told["bodies"] if body["inertia"]]
    assert sorted([*carried, *(weld["name"] for weld in told["welds"])]) == sorted(model.bodies)
    # Parents first, within the bodies and within the beams, and everything leads to the world.
    ready: set[tuple[str, int]] = set()
    waiting = [("body", k, body["on"]) for k, body in enumerate(told["bodies"])]
    waiting += [("section", k, beam["on"]) for k, beam in enumerate(told["beams"])]
    for k, body in enumerate(told["bodies"]):
        assert body["on"] == "world" or body["on"].get("body", -1) < k
    for _ in range(len(waiting)):
        ready |= {(kind, k) for kind, k, on in waiting if on == "world" or key_of(on) in ready}
    assert len(ready) == len(waiting)
    for part in (*told["bodies"], *told["welds"], *told["beams"]):
        rotation = np.reshape(part.get("joint", part)["rotation"], (3, 3))
        assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)


def key_of(on: dict[str, Any]) -> tuple[str, int]:
    ((kind, value),) = on.items()
    return kind, value if kind == "body" else value["beam"]


@given(trees(), st.data())
def test_a_changed_level_keeps_the_parameters(content: dict[str, Any], data: st.DataObject) -> None:
    model = Model.from_dict(content)
    if not model.beams:
        return
    chosen = data.draw(st.sampled_from(model.beams))
    other = model.at({chosen: "strain(2)"})
    assert other.parameters == model.parameters
    assert other.levels == {**model.levels, chosen: "strain(2)"}
    assert other.at({chosen: model.levels[chosen]}) == model
