"""Play in series with a spring of its joint: one split, contacts as stiff as the spring, and a gap beside it."""

import numpy as np
import pytest

from test_backlash import DAMPING, GAP, MASS, ROTOR, STIFFNESS, TEXT, record
from vpm import Model, diagnose
from vpm.errors import ModelError
from vpm.simplify.reductions import reduced, reductions

#: The machine whose maker states how stiff its gear is, and nothing of a play; values are off by up to a tenth.
STATED = f"""{TEXT.replace(f"rotor_inertia = {ROTOR}", "")}
[[effects]]
type = "joint_compliance"
at = "axis"
stiffness = {{ value = {0.93 * STIFFNESS}, uncertainty = {0.14 * STIFFNESS}, unit = "N/m" }}
damping = {{ value = {0.9 * DAMPING}, uncertainty = {0.3 * DAMPING}, unit = "N s/m" }}
inertia = {{ value = {1.03 * ROTOR}, uncertainty = {0.1 * ROTOR}, unit = "kg" }}
"""


def in_series(gap: float = GAP) -> Model:
    return Model.from_toml(STATED).with_effect("backlash", "axis", gap=gap, width=0.05 * GAP)


def alone() -> Model:
    """The same play with contacts of its own, which are as stiff as the spring."""
    model = Model.from_toml(STATED)
    spring = {short: model.parameters[name].value for short, name in model.effects[-1].parameter_names.items()}
    rest = model.without_effect("joint_compliance", "axis")
    closed = {"contact_damping": spring["damping"], "damping": 0.0, "width": 0.05 * GAP}
    own = {"stiffness": spring["stiffness"], "inertia": spring["inertia"]}
    return rest.with_effect("backlash", "axis", gap=GAP, **closed, **own)


def test_a_play_in_series_with_a_spring_is_one_with_contacts_as_stiff() -> None:
    one, other = in_series(), alone()
    assert one.joints == other.joints == ("axis", "axis_deflection")
    generator = np.random.default_rng(3)
    for _ in range(20):
        coordinates = generator.normal(0.0, [0.1, GAP])
        rates, efforts = generator.normal(0.0, [0.2, 0.01]), np.append(generator.normal(0.0, 40.0), 0.0)
        expected = other.forward_dynamics(coordinates, rates, efforts)
        assert one.forward_dynamics(coordinates, rates, efforts) == pytest.approx(expected, rel=1e-12)


def test_without_a_gap_it_is_the_spring_alone() -> None:
    state = np.array([0.02, 3e-5]), np.array([0.1, -0.02]), np.array([25.0, 0.0])
    spring = Model.from_toml(STATED).forward_dynamics(*state)
    assert in_series(gap=0.0).forward_dynamics(*state) == pytest.approx(spring, rel=1e-12)


def test_it_comes_and_goes_without_the_spring_which_takes_it_along() -> None:
    model = in_series()
    assert Model.from_toml(model.to_toml()) == model
    assert model.without_effect("backlash", "axis") == Model.from_toml(STATED)
    assert model.without_effect("joint_compliance", "axis").added_joints == ()
    both = [reductions(model)["effect backlash", "axis"][0], reductions(model)["effect joint_compliance", "axis"][0]]
    assert reduced(model, both[::-1]).added_joints == ()


def test_what_is_of_the_spring_is_not_taken_twice() -> None:
    with pytest.raises(ModelError, match="is that of joint_compliance at axis, which backlash is in series with"):
        Model.from_toml(STATED).with_effect("backlash", "axis", gap=GAP, inertia=1.0)
    with pytest.raises(ModelError, match="gap is missing"):
        Model.from_toml(STATED).with_effect("backlash", "axis")


def test_a_play_beside_a_stated_stiffness_is_named_with_its_gap() -> None:
    found = diagnose(Model.from_toml(STATED), [record(GAP, 1)], [record(GAP, 2)])
    assert [(one.name, one.site) for one in found.effects] == [("backlash", "axis")]
    (gap,) = (one.value for one in found.effects[0].parameters if one.name == "gap")
    assert gap == pytest.approx(GAP, rel=0.05)
    assert "N/m, damped with" in found.effects[0].sentence


def test_where_nothing_has_a_play_none_is_named() -> None:
    found = diagnose(Model.from_toml(STATED), [record(1e-9, 1)], [record(1e-9, 2)])
    assert found.verdict == "parameters_only"
    moved = sum(found.model.parameters[name].value for name in ("body.mass", "axis.compliance.inertia"))
    assert moved == pytest.approx(MASS + ROTOR, rel=0.01)
