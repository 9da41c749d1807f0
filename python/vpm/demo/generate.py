"""Make the demo's log: a simulation of its own, which shares no code with the models that have to explain it.

The machine of `vpm.demo.machine`, under a sampled cascade controller, measured by a noisy encoder.

Run it with ``python -m vpm.demo.generate --hidden torque_ripple --out some-folder``.
"""

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from vpm.demo.hidden import DEFAULT, HIDDEN
from vpm.demo.machine import SAMPLE_TIME, Machine, State, advance

SEED = 20
"""Seed of the shipped log's encoder noise."""

COLUMNS = ("time_s", "q_rad", "u_A", "qref_rad")
"""Columns of the log: time, encoder reading, motor current command as applied, reference of the controller."""


def train_reference(time: float) -> float:
    """Generate the reference of the training record: five sines that never repeat, faded in.

    ``time``: time since the start of the record [s].
    Result: reference angle [rad].
    """
    sines = ((0.62, 1.3, 0.0), (0.38, 2.9, 1.9), (0.22, 5.3, 0.6), (0.10, 9.1, 2.4), (0.05, 15.7, 4.0))
    fade = _smooth_step(time)
    return fade * sum(amplitude * math.sin(rate * time + phase) for amplitude, rate, phase in sines)


def validation_reference(time: float) -> float:
    """Generate the reference of the validation record: moves from angle to angle, with short rests.

    ``time``: time since the start of the record [s].
    Result: reference angle [rad].
    """
    angles = (0.0, 0.9, 0.3, -1.1, -0.5, 0.6, 1.2, -0.2, -0.9, 0.4, 1.0, -0.6, 0.0)
    move, rest = 0.7, 0.1
    number, within = divmod(time, move + rest)
    here = angles[min(int(number), len(angles) - 1)]
    there = angles[min(int(number) + 1, len(angles) - 1)]
    return here + (there - here) * _smooth_step(within / move)


def _smooth_step(progress: float) -> float:
    """Generate a rise from 0 to 1 without jumps of velocity and acceleration (minimum jerk)."""
    x = min(max(progress, 0.0), 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def record(
    machine: Machine, reference: Callable[[float], float], duration: float, noise: np.random.Generator
) -> npt.NDArray[np.float64]:
    """Generate a record: run the machine under its controller and log it.

    The controller reads the encoder at a sample, computes ``u = kv (kp (r - y) - dy)`` within its limit, and holds it
    until the next; ``dy`` is the backward difference of the mean of the last two readings.

    ``reference``: reference angle [rad] over time [s]; ``duration``: length of the record [s].
    Result: one row per sample, shape (samples, 4), in the order of `COLUMNS`.
    """
    samples = round(duration / SAMPLE_TIME) + 1
    rows = np.empty((samples, len(COLUMNS)))
    commands: list[float] = []
    readings: list[float] = []
    state = State()
    for k, disturbance in enumerate(noise.normal(0.0, machine.encoder_noise, samples).tolist()):
        wanted = round(reference(k * SAMPLE_TIME), 6)
        state.positions.append(state.position)
        readings.append(_reading(machine, state, disturbance))
        rate = (readings[k] - readings[max(k - 2, 0)]) / (2.0 * SAMPLE_TIME)
        command = machine.velocity_gain * (machine.position_gain * (wanted - readings[k]) - rate)
        # The drive takes its command in steps of 0.1 mA, so the log holds exactly what was applied.
        commands.append(round(min(max(command, -machine.current_limit), machine.current_limit), 4))
        rows[k] = k * SAMPLE_TIME, readings[k], commands[k], wanted
        advance(machine, state, commands)
    return rows


def _reading(machine: Machine, state: State, disturbance: float) -> float:
    """Generate the encoder's reading of the angle at a sample, or of an earlier one [rad]."""
    late = round(machine.sensor_delay / SAMPLE_TIME)
    angle = state.positions[max(len(state.positions) - 1 - late, 0)]
    count = math.tau / machine.encoder_counts
    return count * round((machine.sensor_gain * angle + machine.sensor_offset + disturbance) / count)


def write_log(path: Path, rows: npt.NDArray[np.float64]) -> None:
    """Write a generated log, rows (samples, 4) in the order of `COLUMNS`, as comma-separated values."""
    lines = [",".join(COLUMNS)]
    lines += [f"{time:.3f},{q:.6f},{u:.4f},{wanted:.6f}" for time, q, u, wanted in rows.tolist()]
    _write(path, "\n".join(lines) + "\n")


def _write(path: Path, text: str) -> None:
    """Write a generated file beside the place and move it into it."""
    beside = path.with_name(f".{path.name}.part")
    try:
        beside.write_text(text, encoding="utf-8", newline="\n")
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def truth(hidden: str) -> str:
    """Generate the text of ``truth.toml``: the hidden effect and the true values.

    ``hidden``: a name in `HIDDEN`.
    """
    entry = HIDDEN[hidden]
    machine = entry.machine
    known = {
        "arm.center_of_mass.x": machine.center_of_mass,
        "arm.inertia.yy": machine.inertia,
        "shoulder.friction.viscous": machine.viscous,
    }
    lines = [
        "# What the log's machine really is. The diagnosis never reads this file; the demo shows it at the end.",
        "",
        "[hidden]",
        f'effect = "{hidden}"',
        f'at = "{entry.site}"',
        *(f"beside = {[list(pair) for pair in entry.beside]!r}" for _ in entry.beside[:1]),
        "",
        "[hidden.parameters]",
        *(f'"{name}" = {value:.12g}' for name, value in entry.parameters.items()),
        "",
        "[parameters]",
        *(f'"{name}" = {value:.12g}' for name, value in known.items()),
    ]
    return "\n".join(lines) + "\n"


def generate(folder: Path, hidden: str = DEFAULT, seed: int = SEED) -> None:
    """Generate the demo's files: ``train.csv``, ``validation.csv``, ``truth.toml`` and ``model.toml``.

    - ``folder``: where to write; made if it is not there
    - ``hidden``: the effect that the machine has and the model does not: a name in `HIDDEN`
    """
    if hidden not in HIDDEN:
        raise ValueError(f"'{hidden}' is no effect that the demo can hide; take one of: {', '.join(HIDDEN)}.")
    machine = HIDDEN[hidden].machine
    noise = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    write_log(folder / "train.csv", record(machine, train_reference, 15.0, noise))
    write_log(folder / "validation.csv", record(machine, validation_reference, 10.0, noise))
    _write(folder / "truth.toml", truth(hidden))
    model = Path(__file__).with_name("model.toml")
    if folder.resolve() != model.parent.resolve():
        _write(folder / "model.toml", model.read_text(encoding="utf-8"))


def main() -> None:
    """Read the command line and generate the files."""
    parser = argparse.ArgumentParser(description="Make a log of a machine with a hidden effect.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write to")
    parser.add_argument("--hidden", choices=sorted(HIDDEN), default=DEFAULT, help="the hidden effect")
    parser.add_argument("--seed", type=int, default=SEED, help="seed of the encoder noise")
    arguments = parser.parse_args()
    generate(arguments.out, arguments.hidden, arguments.seed)


if __name__ == "__main__":
    main()
