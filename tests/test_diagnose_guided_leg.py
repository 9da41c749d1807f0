"""A hydraulic leg on a guide that has no drive: what acts there, no balance of effort sees."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import vpm
from vpm.discrepancy.by_ranking import free_joints
from vpm.experiment import Experiment
from vpm.model import Model

Array = NDArray[np.float64]

HYL = Path(__file__).resolve().parent.parent / "examples" / "hyl"
RECORDS = ("squat", "bounce", "sway")
#: Noise of positions [m, rad], pressures [Pa] and of the force of the ground [N].
NOISE = {"position": 1e-5, "pressure_a": 5e3, "pressure_b": 5e3, "normal_force": 1.0}
LOGGED = (
    *("slider.position", "hip_rotation.position", "knee_rotation.position", "foot.normal_force"),
    *(f"{drive}.pressure_{side}" for drive in ("hip_drive", "knee_drive") for side in "ab"),
)
COMMANDS = tuple(f"{drive}.{what}" for drive in ("hip_drive", "knee_drive") for what in ("command", "reference"))


def leg() -> Model:
    """The leg of the examples without the hand that pulls at its slider."""
    content = Model.load(HYL / "hydraulic.toml").to_dict()
    del content["actuators"]["hand"]
    return Model(content)


def logged(model: Model) -> list[Experiment]:
    """Its three motions in closed loop with steps that are controlled, with noise of sensors."""
    random, logs = np.random.default_rng(11), []
    for name in RECORDS:
        asked = Experiment.load(HYL / f"{name}.csv", model=Model.load(HYL / "hydraulic.toml"))
        run = vpm.simulate(model, asked, "closed_loop")
        values: dict[str, Array] = {c: run[c] if c in run.channels else asked[c] for c in COMMANDS}
        for channel in LOGGED:
            level = NOISE[channel.rpartition(".")[2]]
            values[channel] = run[channel] + level * random.standard_normal(len(run.time))
        logs.append(Experiment.from_arrays(run.time, values, name=name, model=leg()))
    return logs


def test_what_no_balance_sees_is_told() -> None:
    """A payload on the trunk loads the guide's joint alone; that nothing is said of it has to be said."""
    assert free_joints(leg()) == ("slider",)
    assert free_joints(Model.load(HYL / "hydraulic.toml")) == ()
    *train, test = logged(leg().with_effect("payload", at="carriage", mass=0.8))
    why = vpm.diagnose(leg(), train, test, effects=["bias_force"])
    assert any(note.startswith("the joint slider has no drive") for note in why.notes)
