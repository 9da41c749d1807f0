"""A value that is changed gives the model, the file and the refusal that building from the changed file gives."""

import math
from collections.abc import Callable
from functools import cached_property, partial
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nightly import at_night
from vpm.demo import MODEL
from vpm.errors import ModelError
from vpm.model import Model
from vpm.model import model as door
from vpm.numbers import LARGEST

ROOT = Path(__file__).resolve().parents[2] / "examples"
#: Every model file of the examples, and two whose values have conditions between them that no example has.
FILES = sorted(
    str(path.relative_to(ROOT))
    for path in ROOT.rglob("*.toml")
    if "\n[bodies." in path.read_text(encoding="utf-8") or "\n[beams." in path.read_text(encoding="utf-8")
)
BLOCK = """
name = "block on a sprung shaft"
gravity = [0.0, 0.0, -9.81]

[bodies.block]
mass = 2.0
inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0]

[bodies.wheel]
mass = 1.0
inertia = [0.01, 0.01, 0.01, 0.001, 0.0, 0.0]

[joints.height]
type = "prismatic"
parent = "world"
child = "block"
axis = [0.0, 0.0, 1.0]

[joints.turn]
type = "revolute"
parent = "block"
child = "wheel"
axis = [0.0, 1.0, 0.0]

[transmissions.belt]
ratios = { turn = 3.0 }
inertia = 1e-4

[actuators.motor]
transmission = "belt"
gain = 1.0
command_unit = "N m"

[contacts.foot]
parent = "block"
plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
stiffness = { value = 100.0, unit = "N/mm^1.5" }
exponent = 1.5
damping = 50.0
friction = { static = 0.8, dynamic = 0.6, static_velocity = 0.01, dynamic_velocity = 0.1 }

[bushings.mount]
a = { parent = "world" }
b = { parent = "block" }
stiffness = [
    [10.0, 1.0, 0, 0, 0, 0],
    [1.0, 10.0, 0, 0, 0, 0],
    [0, 0, 10.0, 0, 0, 0],
    [0, 0, 0, 1e3, 0, 0],
    [0, 0, 0, 0, 1e3, 0],
    [0, 0, 0, 0, 0, 1e3],
]
damping = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]

[[effects]]
type = "joint_compliance"
at = "turn"
stiffness = { value = 5.0, unit = "kN m/rad", uncertainty = 1.0, min = 1.0, max = 10.0 }
inertia = 0.001

[[effects]]
type = "end_stop"
at = "height"
low = -0.1
stiffness = 1e5
high = 0.1
"""
MACHINES = {**{name: Model.load(ROOT / name) for name in FILES}, "demo": Model.load(MODEL)}
MACHINES["block"] = Model.from_toml(BLOCK)
#: Of which every value is changed outside of `make test-nightly`: conditions between values, joints, a drive, a beam.
DAILY = {"block", "demo", "servo_cylinder/rig.toml", "flexible_pendulum/flexible_pendulum.toml"}

shares = st.sampled_from([0.0, -1.0, 0.5, 0.999, 1.001, 2.0, 30.0])
anything = st.sampled_from([0.0, -0.0, 1e-13, -1.0, 1.5, 2.0, math.nan, math.inf, -math.inf, 2.0 * LARGEST])
#: Name of a machine, then changes one after the other: where in the table, and a factor on the value or a number.
changes = st.lists(
    st.dictionaries(
        st.floats(0.0, 1.0, exclude_max=True),
        st.one_of(shares.map(lambda share: ("times", share)), anything.map(lambda value: ("to", value))),
        min_size=1,
        max_size=3,
    ),
    min_size=1,
    max_size=3,
)


def rebuilt(model: Model, values: dict[str, float]) -> Model:
    """Built from the file of a model in which values were changed: every check, on everything."""
    return Model.from_dict(model._checked.with_values(values).content())


def told(model: Model) -> dict[str, object]:
    """All that a model keeps, and all that it writes."""
    kinds = [
        name for kind in type(model).__mro__ for name, entry in vars(kind).items() if isinstance(entry, cached_property)
    ]
    kept = {name: getattr(model, name) for name in kinds if name not in {"core", "dynamics", "loops", "theta"}}
    return kept | {
        "theta": model.theta.tolist(),
        "file": model.to_toml(),
        "dictionary": model.to_dict(),
        "description": model.description(),
        "words": repr(model),
        "path": model.path,
    }  # fmt: skip


def answer(make: Callable[[dict[str, float]], Model], values: dict[str, float]) -> Model | tuple[object, ...]:
    """The model, or all that its refusal says."""
    try:
        return make(values)
    except ModelError as error:
        return str(error), error.where, error.path, error.more


def compared(model: Model, values: dict[str, float]) -> Model | None:
    """The changed model if there is one, after a comparison with what its file gives."""
    changed, expected = answer(model.with_parameters, values), answer(partial(rebuilt, model), values)
    if not isinstance(changed, Model) or not isinstance(expected, Model):
        assert changed == expected
        return None
    assert told(changed) == told(expected)
    assert changed == expected
    assert hash(changed) == hash(expected)
    return changed


@pytest.mark.parametrize("name", at_night(MACHINES, but=DAILY))
def test_every_single_value_can_be_changed_as_by_its_file(name: str) -> None:
    """Each parameter moved a little, most of them inside of their bounds."""
    model = MACHINES[name]
    told(model)  # so that what it keeps is handed on
    for parameter in model.parameters.values():
        compared(model, {parameter.name: 1.001 * parameter.value + (1e-6 if parameter.value == 0.0 else 0.0)})


@given(st.sampled_from(sorted(MACHINES)), changes)
def test_any_change_gives_what_the_changed_file_gives(name: str, steps: list[dict[float, tuple[str, float]]]) -> None:
    model = MACHINES[name]
    for step in steps:
        values = {}
        for share, (how, number) in step.items():
            parameter = list(model.parameters.values())[int(share * len(model.parameters))]
            values[parameter.name] = number if how == "to" else number * parameter.value
        changed = compared(model, values)
        if changed is None:
            return
        assert Model.from_toml(changed.to_toml()) == changed
        model = changed


def test_conditions_between_values_hold_after_a_change_of_either() -> None:
    """Refused with the same sentence whichever of the values breaks one."""
    block = MACHINES["block"]
    pairs = [
        ({"foot.friction.dynamic_velocity": 0.005}, {"foot.friction.static_velocity": 0.2}, "above static_velocity"),
        ({"height.end_stop.low": 0.2}, {"height.end_stop.high": -0.2}, "the lower one has to be below"),
        ({"mount.stiffness.rx.ry": 50.0}, {"mount.stiffness.rx": 1e-3}, "positive semidefinite"),
        ({"wheel.inertia.zz": 0.1}, {"wheel.inertia.xy": 0.1}, "principal moments"),
    ]
    for one, other, words in pairs:
        for values in (one, other):
            with pytest.raises(ModelError, match=words):
                block.with_parameters(values)


def test_a_change_looks_at_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    """No file is checked for it, as long as it is one that can be made."""
    model = MACHINES["demo"]
    monkeypatch.setattr(door, "check_document", lambda *_: pytest.fail("the whole document was checked"))
    for before, after in pairwise([model, *(model.with_parameters({"arm.mass": share}) for share in (1.01, 1.02))]):
        assert before.structure is after.structure
    assert after.parameters["arm.mass"].value == 1.02
