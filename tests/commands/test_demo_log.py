"""The demo's log is what its description says: reproducible, true to its physics, and not explained by its model."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import savgol_filter

from vpm import demo
from vpm.demo import generate
from vpm.demo.hidden import HIDDEN
from vpm.demo.machine import SAMPLE_TIME, Machine

RECORDS = ("train.csv", "validation.csv")


def read(path: Path) -> npt.NDArray[np.float64]:
    """Columns of a record, shape (4, samples)."""
    return np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)


@pytest.mark.parametrize("name", RECORDS)
def test_shipped_records_are_reproduced(name: str, tmp_path: Path) -> None:
    generate.generate(tmp_path)
    assert (demo.FOLDER / name).read_text(encoding="utf-8").startswith(",".join(generate.COLUMNS) + "\n")
    np.testing.assert_allclose(read(demo.FOLDER / name), read(tmp_path / name), rtol=0.0, atol=1e-9)


def test_shipped_truth_and_model_are_reproduced(tmp_path: Path) -> None:
    generate.generate(tmp_path)
    assert (tmp_path / "truth.toml").read_text(encoding="utf-8") == demo.TRUTH.read_text(encoding="utf-8")
    assert (tmp_path / "model.toml").read_bytes() == demo.MODEL.read_bytes()


@pytest.mark.parametrize("name", RECORDS)
def test_records_are_small_and_move_enough(name: str) -> None:
    path = demo.FOLDER / name
    assert path.stat().st_size <= 600_000
    time, position, command, _ = read(path)
    np.testing.assert_allclose(np.diff(time), SAMPLE_TIME, rtol=0.0, atol=1e-9)
    velocity = savgol_filter(position, 31, 3, deriv=1, delta=SAMPLE_TIME)
    assert velocity.max() > 3.0
    assert velocity.min() < -3.0
    moving = velocity[np.abs(velocity) > 0.1]
    assert np.count_nonzero(np.diff(np.sign(moving))) >= (20 if name == "train.csv" else 5)
    assert np.abs(command).max() < Machine().current_limit


def test_free_run_agrees_with_an_adaptive_integrator() -> None:
    machine = Machine(encoder_noise=0.0, encoder_counts=2**40)
    rows = generate.record(machine, generate.train_reference, 2.0, np.random.default_rng(0))
    inertia = machine.inertia + machine.mass * machine.center_of_mass**2
    weight = machine.mass * machine.gravity * machine.center_of_mass
    state = np.zeros(2)
    worst = 0.0
    for _, position, command, _ in rows:
        worst = max(worst, abs(state[0] - position))
        torque = machine.torque_per_current * command

        def rate(_time: float, x: npt.NDArray[np.float64], torque: float = torque) -> list[float]:
            return [x[1], (torque - weight * math.sin(x[0]) - machine.viscous * x[1]) / inertia]

        state = solve_ivp(rate, (0.0, SAMPLE_TIME), state, rtol=1e-10, atol=1e-12).y[:, -1]
    # One count of the machine's encoder is 9.6e-5 rad.
    assert worst < 2e-6


def test_hidden_friction_really_sticks() -> None:
    machine = replace(HIDDEN["coulomb_friction"].machine, encoder_noise=0.0)
    # The controller's push at a standing error e is kv kp e; this one stays at 0.9 of what the friction holds.
    held = 0.9 * machine.coulomb / (machine.torque_per_current * machine.velocity_gain * machine.position_gain)
    stuck = generate.record(machine, lambda _: held, 0.5, np.random.default_rng(0))
    assert np.all(stuck[:, 1] == 0.0)
    assert stuck[-1, 2] > 0.0
    loose = generate.record(machine, lambda _: held / 0.8, 0.5, np.random.default_rng(0))
    assert loose[-1, 1] > 0.0


def regression(hidden: str, folder: Path) -> dict[str, float]:
    """Fit the equation of motion to both records by least squares, knowing only which effect is hidden.

    Returns the values of the true parameters by the names of the model.
    """
    with (folder / "truth.toml").open("rb") as file:
        document = tomllib.load(file)
    parameters = document["hidden"]["parameters"]
    rows, torques = [], []
    for name in RECORDS:
        _, position, command, _ = read(folder / name)
        smooth, velocity, acceleration = (
            savgol_filter(position, 25, 4, deriv=order, delta=SAMPLE_TIME) for order in range(3)
        )
        if hidden == "input_delay":
            late = parameters["motor.delay.time"] / SAMPLE_TIME
            command = np.interp(np.arange(command.size) - late, np.arange(command.size), command)
        if hidden == "dead_zone":
            command = np.sign(command) * np.maximum(np.abs(command) - parameters["motor.dead_zone.width"], 0.0)
        # The mean of the held commands around a sample, filtered as the motion is.
        applied = savgol_filter(0.5 * (command + np.concatenate([command[:1], command[:-1]])), 25, 4)
        columns = [acceleration, np.sin(smooth), velocity]
        if hidden == "coulomb_friction":
            columns.append(np.sign(velocity))
        if hidden == "bias_force":
            columns.append(np.ones_like(velocity))
        if hidden == "torque_ripple":
            angle = math.tau * smooth / parameters["shoulder.ripple.period"]
            columns += [np.cos(angle), np.sin(angle)]
        keep = np.abs(velocity) > 0.2
        rows.append(np.stack(columns, axis=1)[keep])
        torques.append(1.6 * applied[keep])
    found = np.linalg.lstsq(np.concatenate(rows), np.concatenate(torques))[0]
    values = {"weight": found[1], "inertia about the axis": found[0], "shoulder.friction.viscous": found[2]}
    names = [name for name in parameters if name.startswith("shoulder.") and not name.endswith((".period", ".viscous"))]
    return values | dict(zip(names, found[3:], strict=True))


#: What the regression below knows to fit; the others have tests of their own in test_demo_hide.py.
REGRESSED = ("coulomb_friction", "viscous_friction", "torque_ripple", "bias_force", "dead_zone", "input_delay", "none")


@pytest.mark.parametrize("hidden", REGRESSED)
def test_log_carries_what_truth_says(hidden: str, tmp_path: Path) -> None:
    generate.generate(tmp_path, hidden)
    with (tmp_path / "truth.toml").open("rb") as file:
        document = tomllib.load(file)
    assert document["hidden"]["effect"] == hidden
    true = document["parameters"] | document["hidden"]["parameters"]
    found = regression(hidden, tmp_path)
    arm = 1.8 * true["arm.center_of_mass.x"]
    assert found["weight"] == pytest.approx(arm * 9.81, rel=0.01)
    assert found["inertia about the axis"] == pytest.approx(
        true["arm.inertia.yy"] + arm * true["arm.center_of_mass.x"], rel=0.02
    )
    assert found["shoulder.friction.viscous"] == pytest.approx(true["shoulder.friction.viscous"], abs=0.01)
    for name in set(found) & set(document["hidden"]["parameters"]):
        assert found[name] == pytest.approx(true[name], rel=0.03), name


def test_model_file_knows_what_is_known_and_misses_what_is_hidden() -> None:
    with demo.MODEL.open("rb") as file:
        model = tomllib.load(file)
    with demo.TRUTH.open("rb") as file:
        truth = tomllib.load(file)
    machine = Machine()
    assert model["bodies"]["arm"]["mass"] == machine.mass
    assert model["gravity"] == [0.0, 0.0, -machine.gravity]
    assert model["actuators"]["motor"]["gain"]["value"] == machine.torque_per_current
    servo = model["controllers"]["servo"]
    assert servo["position_gain"]["value"] == machine.position_gain
    assert servo["velocity_gain"]["value"] == machine.velocity_gain
    assert servo["limit"]["value"] == machine.current_limit
    assert [effect["type"] for effect in model["effects"]] == ["viscous_friction"]
    assert truth["hidden"]["effect"] == "coulomb_friction"
    rough = {
        "arm.center_of_mass.x": model["bodies"]["arm"]["center_of_mass"][0],
        "arm.inertia.yy": model["bodies"]["arm"]["inertia"][1],
        "shoulder.friction.viscous": model["effects"][0]["viscous"],
    }
    for name, value in rough.items():
        off = truth["parameters"][name] - value["value"]
        assert 0.03 * value["value"] < abs(off) < 1.5 * value["uncertainty"], name


def test_an_effect_that_cannot_be_hidden_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="'rust' is no effect that the demo can hide; take one of: coulomb_"):
        generate.generate(tmp_path, "rust")


def test_a_full_disk_leaves_the_log_that_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = tmp_path / "train.csv"
    log.write_text("old", encoding="utf-8")

    def half(self: Path, text: str, **_: object) -> int:
        self.write_bytes(text[: len(text) // 2].encode())
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", half)
    with pytest.raises(OSError, match="No space left"):
        generate.write_log(log, np.zeros((3, 4)))
    assert log.read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["train.csv"]
