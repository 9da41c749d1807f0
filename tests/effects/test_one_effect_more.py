"""An effect more is checked alone: the model is that of the whole document, and so is every error."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vpm.model.model as module
from nightly import at_night
from places import EXAMPLES
from vpm import demo
from vpm.catalogue import EFFECTS
from vpm.errors import ModelError, VpmError
from vpm.model import Model

MACHINES = {
    "arm": Path(demo.MODEL),
    "rig": EXAMPLES / "servo_cylinder" / "rig.toml",
    "tudor": EXAMPLES / "tudor" / "tudor.toml",
    "wrist": EXAMPLES / "wrist" / "wrist.toml",
}
#: Values of all parameters: none that is given, some that a few take, some that none does.
VALUES: tuple[float | None, ...] = (None, 0.0, 1.0, -1.0, math.nan)


def places(model: Model) -> list[str]:
    """A component of each kind, one that is none, and the shafts."""
    kinds = {EFFECTS[name].site for name in EFFECTS}
    return sorted({*(site for kind in kinds for site in model.sites(kind)[:1]), *model.transmissions, "nowhere"})


def answer(model: Model, name: str, at: str, side: str, values: dict[str, float]) -> Any:
    """All that tells one model from another, or the error."""
    try:
        other = model.with_effect(name, at=at, side=side, **values)  # type: ignore[call-overload]
    except VpmError as error:
        return type(error), str(error), getattr(error, "where", None)
    text, theta = other.to_toml(), other.theta.tolist()
    return text, other.structure, theta, list(other.parameters.items()), other.effects, other.output_channels


@pytest.mark.parametrize("machine", at_night(MACHINES, but=("rig", "wrist")))
def test_models_and_errors_are_those_of_the_whole_check(machine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = Model.load(MACHINES[machine])
    cases = [
        (name, at, side, {} if value is None else {p.name: value for p in effect.parameters})
        for name, effect in EFFECTS.items()
        for at in places(model)
        for side in ("motor", "link")
        for value in VALUES
        if side == "motor" or value is None
    ]
    found = [answer(model, *case) for case in cases]
    monkeypatch.setattr(module, "check_effect", lambda *_: None)
    for case, own in zip(cases, found, strict=True):
        assert own == answer(model, *case), case
    assert sum(len(own) == 3 for own in found) > 50
    assert sum(len(own) == 6 for own in found) > 20


def test_only_what_divides_the_machine_takes_a_check_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    model = Model.load(demo.MODEL)

    def refused(*_: object) -> None:
        raise AssertionError("the whole document is checked")

    monkeypatch.setattr(module, "check_document", refused)
    axis = model.joints[0]
    # Values that were changed before stay.
    mass = next(name for name in model.parameters if name.endswith(".mass"))
    moved = model.with_parameters({mass: 2.0 * model.parameters[mass].value})
    other = moved.with_effect("end_stop", at=axis, low=-1.0, high=1.0, stiffness=1e4, damping=1.0)
    assert other.parameters[mass] == moved.parameters[mass]
    np.testing.assert_array_equal(other.theta[: len(model.theta)], moved.theta)
    assert other.path is None
    # Its rules hold from now on.
    low, high = f"{axis}.end_stop.low", f"{axis}.end_stop.high"
    assert other.with_parameters({low: 0.5}).parameters[high].value == 1.0
    with pytest.raises(AssertionError, match="whole document"):
        other.with_parameters({low: 2.0})
    with pytest.raises(AssertionError, match="whole document"):
        model.with_effect("joint_compliance", at=axis, stiffness=1e4, damping=1.0, inertia=0.1)


def test_a_second_effect_of_a_name_is_refused_as_ever() -> None:
    model = Model.load(demo.MODEL)
    axis = model.joints[0]
    once = model.with_effect("cubic_spring", at=axis, stiffness=1.0)
    with pytest.raises(ModelError, match=rf'is a second cubic_spring at "{axis}"'):
        once.with_effect("cubic_spring", at=axis, stiffness=1.0)
    assert once.without_effect("cubic_spring", axis) == model
