"""Parameters that share a value, samples that do not count, effects that no diagnosis tries."""

import numpy as np
import pytest

from quotients import of_residual
from vpm.errors import IdentificationError
from vpm.experiment import Experiment
from vpm.identify import identify, problem
from vpm.identify.problem import TiedProblem
from vpm.model import Model
from vpm.simulate import Setup, simulate


def two_axes() -> Model:
    """Two carriages side by side, each against its own friction."""
    axes = ("left", "right")
    return Model.from_dict(
        {
            "name": "twins",
            "gravity": [0, 0, 0],
            "bodies": {f"{a}_body": {"mass": 2.0} for a in axes},
            "joints": {
                a: {"type": "prismatic", "parent": "world", "child": f"{a}_body", "axis": [1, 0, 0]} for a in axes
            },
            "actuators": {f"{a}_drive": {"joint": a, "gain": 1.0, "command_unit": "V"} for a in axes},
            "effects": [{"type": "viscous_friction", "at": a, "viscous": 1.0} for a in axes],
        }
    )


def recorded(left: float, right: float) -> Experiment:
    """Positions of the two carriages with given frictions under the same commands."""
    time = np.arange(300) * 0.01
    commands = {f"{a}_drive.command": np.sin(3.0 * time) for a in ("left", "right")}
    model = two_axes().with_parameters({"left.friction.viscous": left, "right.friction.viscous": right})
    run = simulate(model, Experiment.from_arrays(time, commands, model=model, name="log"), "free_run")
    positions = {f"{a}.position": run[f"{a}.position"] for a in ("left", "right")}
    return Experiment.from_arrays(time, commands | positions, model=model, name="log")


TIE = {"right.friction.viscous": "left.friction.viscous"}


def test_tied_parameters_share_their_value() -> None:
    fit = identify(two_axes(), recorded(3.0, 3.0), ["left.friction.viscous"], mode="free_run", ties=TIE)
    both = identify(two_axes(), recorded(3.0, 3.0), [*TIE, *TIE.values()], mode="free_run")
    assert fit["left.friction.viscous"] == pytest.approx(3.0, rel=0.05)
    assert fit["left.friction.viscous"] == pytest.approx(both["left.friction.viscous"], rel=1e-5)
    assert fit.model.parameters["right.friction.viscous"].value == fit["left.friction.viscous"]
    # Between two frictions the common one lies in the middle, as neither alone would.
    between = identify(two_axes(), recorded(2.0, 4.0), ["left.friction.viscous"], mode="free_run", ties=TIE)
    assert 2.3 < between["left.friction.viscous"] < 3.7


def test_the_derivative_by_a_tied_parameter_is_that_of_both() -> None:
    model, record = two_axes(), recorded(2.0, 4.0)
    data = TiedProblem(problem(model, [record], "free_run"), TIE)
    column = model.index("left.friction.viscous")
    _, jacobian = data.evaluate(model, model.theta, [column])
    slope = of_residual(data, model, column, 1e-5)
    np.testing.assert_allclose(jacobian[:, 0], slope, atol=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize(
    ("ties", "free", "words"),
    [
        ({"right.friction.viscus": "left.friction.viscous"}, ["left_body.mass"], "right.friction.viscous"),
        (TIE, ["right.friction.viscous"], "is free"),
        ({**TIE, "left.friction.viscous": "right.friction.viscous"}, ["left_body.mass"], "itself"),
        ({"right_body.mass": "left.friction.viscous"}, ["left_body.mass"], "equal units"),
    ],
)
def test_ties_without_a_meaning_are_refused(ties: dict[str, str], free: list[str], words: str) -> None:
    with pytest.raises(IdentificationError, match=words):
        identify(two_axes(), recorded(2.0, 2.0), free, mode="free_run", ties=ties)


def test_samples_of_the_settling_do_not_count() -> None:
    model, record = two_axes(), recorded(3.0, 3.0)
    spoilt = record.data.copy()
    spoilt[:50, list(record.channels).index("left.position")] += 1.0
    broken = Experiment.from_arrays(
        record.time, dict(zip(record.channels, spoilt.T, strict=True)), model=model, name="spoilt"
    )
    start = np.zeros(model.core.n_states)
    assert start.size == 4
    data = problem(model, [broken], "free_run", setup=Setup(settling=0.5))
    for block in data.blocks:
        residual, jacobian = data.evaluate(model, model.theta, [model.index("left.friction.viscous")])
        assert not residual[block.samples][:50].any()
        assert not jacobian[block.samples][:50].any()
        assert residual[block.samples][50:].any()
    with pytest.raises(IdentificationError, match="settling"):
        problem(model, [record], "free_run", setup=Setup(settling=2.99))
