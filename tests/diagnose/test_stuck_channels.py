"""Channels that stand still although the machine moves are refused; those of what may stand are not."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from command_line import vpm
from model_texts import effect_text, on_rail
from shared_cases import shared_case
from vpm import diagnose, identify, rank
from vpm.discrepancy.stuck_channels import check_moving
from vpm.errors import DiagnosisError
from vpm.experiment import Experiment
from vpm.model import Model

AXIS = "axis_linear", "spring", 1
ARM = "arm2r", "saturation", 6001
CYLINDER = "servo_cylinder", "none", 1


def stuck(record: Experiment, channel: str) -> Experiment:
    """The same with its first value all the time."""
    data, column = np.array(record.data), record.channels.index(channel)
    data[:, column] = data[0, column]
    return replace(record, data=data)


@pytest.mark.parametrize(
    ("case", "channel"),
    [
        (AXIS, "axis.position"),
        (AXIS, "drive.command"),
        pytest.param(ARM, "shoulder.position", marks=pytest.mark.nightly),
        pytest.param(ARM, "elbow.position", marks=pytest.mark.nightly),
        pytest.param(ARM, "second.command", marks=pytest.mark.nightly),
        pytest.param(CYLINDER, "axis.position", marks=pytest.mark.nightly),
        pytest.param(CYLINDER, "servo.pressure_a", marks=pytest.mark.nightly),
        pytest.param(CYLINDER, "servo.command", marks=pytest.mark.nightly),
    ],
)
def test_a_stuck_channel_is_told_first(case: tuple[str, str, int], channel: str, tmp_path: Path) -> None:
    """A stuck encoder of one of two joints was a rotor inertia; with pressures beside it, the fit ended in an error."""
    made = shared_case(*case)
    model, record = made.model(), stuck(made.train[0], channel)
    words = f"{record.name}: {channel} is .* all the time, and the model moves it by .*; check that its column"
    both = [made.train[1], record]
    for ask in (partial(diagnose, model, both), partial(diagnose, model, both[0], record), partial(rank, model, both)):
        with pytest.raises(DiagnosisError, match=words):
            ask()
    model.save(tmp_path / "model.toml")
    record.to_csv(tmp_path / "log.csv")
    done = vpm("identify", "model.toml", "log.csv", cwd=tmp_path)
    assert done.returncode == 1
    assert f"log: {channel} is" in " ".join(done.stderr.split())


@pytest.mark.nightly
def test_what_the_model_holds_may_stand() -> None:
    """Dry friction holds a joint whatever its motor does, and a sensor with coarse steps shows no small way."""
    made = shared_case(*ARM)
    model, record = made.model(), stuck(made.train[0], "elbow.position")
    check_moving(model.with_parameters({"elbow.friction.coulomb": 1e3}), [record])
    check_moving(model, made.train)
    table = np.column_stack([record.data, 1e4 * made.train[0]["elbow.position"]])
    check_moving(
        model, [replace(record, channels=(*record.channels, "other"), units=(*record.units, "rad"), data=table)]
    )


@pytest.mark.nightly
def test_a_joint_that_rests_is_fitted_beside_those_that_move() -> None:
    """No sample of it counts, which divided by zero."""
    made = shared_case(*CYLINDER)
    fit = identify(made.model(), [stuck(made.train[0], "axis.position")])
    assert np.all(np.isfinite(list(fit.values)))


def coasting(model: Model, speed: float, seed: int) -> Experiment:
    """2 kg behind a motor that is off, brought to rest by 1 N s/m and 0.6 N of dry friction: closed form."""
    time = 0.001 * np.arange(3000)
    # 2 dv/dt = -v - 0.6, until it rests.
    rest = 2.0 * np.log1p(speed / 0.6)
    running = np.minimum(time, rest)
    place = 2.0 * (speed + 0.6) * (1.0 - np.exp(-running / 2.0)) - 0.6 * running
    place += 1e-5 * np.random.default_rng(seed).normal(size=time.size)
    values = {"slide.position": place, "motor.command": np.zeros(time.size)}
    return Experiment.from_arrays(time, values, name=f"coast_{seed}", model=model)


def test_friction_is_found_while_a_machine_coasts() -> None:
    """Nothing is large beside a drive that is off: the model was said to agree with the data."""
    oil = effect_text("viscous_friction", "slide", viscous='{ value = 1.0, unit = "N s/m", uncertainty = 0.5 }')
    model = Model.from_toml(on_rail("block", joint="slide", drive="motor") + 'command_unit = "N"\n' + oil)
    make = partial(coasting, model)
    found = diagnose(model, [make(1.0, 0), make(2.0, 1)], make(1.5, 2), workers=1)
    assert (found.verdict, [effect.name for effect in found.effects]) == ("effect_found", ["coulomb_friction"])
    size = found.effects[0].parameters[0]
    assert size.value == pytest.approx(0.6, abs=4.0 * size.std + 0.006)  # one percent for the filter of the motion
