"""Make the demo's log: a simulation of its own, which shares no code with the models that have to explain it.

The machine is one link on a horizontal axis, hanging down at ``q = 0``, driven by a geared motor with a sampled
cascade controller and measured by a noisy encoder:

    ``(J + m l^2) dv/dt = k u_motor - m g l sin(q) - b v - tau_hidden``

Time runs in steps of 50 microseconds, forty for each sample of the controller, by Moreau's midpoint rule. The hidden
Coulomb friction is set-valued, so that the link really stands still while the drive pushes less than the friction
holds: each step takes the friction impulse as far as it goes toward stopping the link and no further. The catalogue's
Coulomb friction is a smooth approximation of that, so the diagnosis is not handed its own formula back.

References
----------
.. [1] J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988.
.. [2] V. Acary, B. Brogliato, "Numerical Methods for Nonsmooth Dynamical Systems", 2008, chapter 10.

Run it with ``python -m vpm.demo.generate --hidden torque_ripple --out some-folder``.
"""

import argparse
import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

SAMPLE_TIME = 0.002
"""Time between two samples of controller and log [s]."""

STEPS_PER_SAMPLE = 40
"""Steps of the simulation for each sample: 20 kHz."""

SEED = 20
"""Seed of the shipped log's encoder noise."""

COLUMNS = ("time_s", "q_rad", "u_A", "qref_rad")
"""Columns of the log: time, encoder reading, motor current command as applied, reference of the controller."""


@dataclass(frozen=True)
class Machine:
    """The true machine. The model file that ships beside it knows some of these values only roughly.

    It has room for every hidden effect; one that it does not have is zero.
    """

    mass: float = 1.8
    """Mass of the link [kg]."""
    center_of_mass: float = 0.221
    """Distance from the axis to the centre of mass [m]."""
    inertia: float = 0.0345
    """Moment of inertia about the centre of mass, around the axis [kg m^2]."""
    gravity: float = 9.81
    """[m/s^2]."""
    torque_per_current: float = 1.6
    """Torque on the joint for each ampere of command, gear included [N m/A]."""
    viscous: float = 0.135
    """Viscous friction [N m s/rad]."""

    coulomb: float = 0.0
    """Coulomb friction, set-valued at standstill [N m]."""
    ripple: float = 0.0
    """Amplitude of the torque ripple [N m]."""
    ripple_period: float = math.tau / 16.0
    """Period of the torque ripple along the joint [rad]."""
    ripple_phase: float = 0.7
    """The ripple is ``ripple cos(2 pi q / period - phase)`` [rad]."""
    bias: float = 0.0
    """Constant torque that the drive has to overcome [N m]."""
    dead_zone: float = 0.0
    """The motor answers only to the part of the command beyond this current [A]."""
    delay: float = 0.0
    """Time until a command reaches the motor [s]."""

    position_gain: float = 12.0
    """Outer gain of the controller [1/s]."""
    velocity_gain: float = 2.0
    """Inner gain of the controller [A s/rad]."""
    current_limit: float = 6.0
    """Largest command of the controller [A]."""

    encoder_counts: int = 65536
    """Counts for each turn of the joint."""
    encoder_noise: float = 5e-5
    """Standard deviation of the noise ahead of the encoder's rounding [rad]."""


HIDDEN = {
    "coulomb_friction": Machine(coulomb=0.55),
    "viscous_friction": Machine(viscous=0.45),
    "torque_ripple": Machine(ripple=0.40),
    "bias_force": Machine(bias=0.60),
    "dead_zone": Machine(dead_zone=0.25),
    "input_delay": Machine(delay=0.005),
    "none": Machine(),
}
"""What can be hidden: for each name the machine that has it."""


def train_reference(time: float) -> float:
    """Reference of the training record: five sines that never repeat, faded in over one second.

    Parameters
    ----------
    time
        Time since the start of the record [s].

    Returns
    -------
    float
        Reference angle [rad].
    """
    sines = ((0.62, 1.3, 0.0), (0.38, 2.9, 1.9), (0.22, 5.3, 0.6), (0.10, 9.1, 2.4), (0.05, 15.7, 4.0))
    fade = _smooth_step(time)
    return fade * sum(amplitude * math.sin(rate * time + phase) for amplitude, rate, phase in sines)


def validation_reference(time: float) -> float:
    """Reference of the validation record: moves from angle to angle, each followed by a short rest.

    Parameters
    ----------
    time
        Time since the start of the record [s].

    Returns
    -------
    float
        Reference angle [rad].
    """
    angles = (0.0, 0.9, 0.3, -1.1, -0.5, 0.6, 1.2, -0.2, -0.9, 0.4, 1.0, -0.6, 0.0)
    move, rest = 0.7, 0.1
    number, within = divmod(time, move + rest)
    here = angles[min(int(number), len(angles) - 1)]
    there = angles[min(int(number) + 1, len(angles) - 1)]
    return here + (there - here) * _smooth_step(within / move)


def _smooth_step(progress: float) -> float:
    """Rise from 0 to 1 with no jump in velocity and acceleration (the minimum-jerk polynomial)."""
    x = min(max(progress, 0.0), 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def record(
    machine: Machine, reference: Callable[[float], float], duration: float, noise: np.random.Generator
) -> npt.NDArray[np.float64]:
    """Run the machine under its controller and log it.

    The controller reads the encoder at a sample, computes ``u = kv (kp (r - y) - dy)`` within its limit, and holds it
    until the next; ``dy`` is the backward difference of the mean of the last two readings.

    Parameters
    ----------
    machine
        The true machine.
    reference
        Reference angle [rad] over time [s].
    duration
        Length of the record [s].
    noise
        Source of the encoder noise.

    Returns
    -------
    numpy.ndarray
        One row per sample, shape (samples, 4), in the order of `COLUMNS`.
    """
    samples = round(duration / SAMPLE_TIME) + 1
    count = math.tau / machine.encoder_counts
    rows = np.empty((samples, len(COLUMNS)))
    commands: list[float] = []
    readings: list[float] = []
    position, velocity = 0.0, 0.0
    for k, disturbance in enumerate(noise.normal(0.0, machine.encoder_noise, samples).tolist()):
        wanted = round(reference(k * SAMPLE_TIME), 6)
        readings.append(count * round((position + disturbance) / count))
        rate = (readings[k] - readings[max(k - 2, 0)]) / (2.0 * SAMPLE_TIME)
        command = machine.velocity_gain * (machine.position_gain * (wanted - readings[k]) - rate)
        # The drive takes its command in steps of 0.1 mA, so the log holds exactly what was applied.
        commands.append(round(min(max(command, -machine.current_limit), machine.current_limit), 4))
        rows[k] = k * SAMPLE_TIME, readings[k], commands[k], wanted
        position, velocity = _one_sample(machine, position, velocity, commands)
    return rows


def _one_sample(machine: Machine, position: float, velocity: float, commands: list[float]) -> tuple[float, float]:
    """Move the machine from the sample of the last command to the next one."""
    step = SAMPLE_TIME / STEPS_PER_SAMPLE
    inertia = machine.inertia + machine.mass * machine.center_of_mass**2
    weight = machine.mass * machine.gravity * machine.center_of_mass
    damping = 0.5 * step * machine.viscous / inertia
    stopping = step * machine.coulomb / inertia
    late = round(machine.delay / step)
    for i in range(STEPS_PER_SAMPLE):
        # The command that was given `late` steps ago; before the record starts, its first one.
        command = commands[max(len(commands) - 1 + (i - late) // STEPS_PER_SAMPLE, 0)]
        middle = position + 0.5 * step * velocity
        torque = (
            machine.torque_per_current * math.copysign(max(abs(command) - machine.dead_zone, 0.0), command)
            - weight * math.sin(middle)
            - machine.bias
            - machine.ripple * math.cos(math.tau * middle / machine.ripple_period - machine.ripple_phase)
        )
        free = (1.0 - damping) * velocity + step * torque / inertia
        # Set-valued friction: it takes off as much speed as it can and never turns the motion round.
        velocity = math.copysign(max(abs(free) - stopping, 0.0), free) / (1.0 + damping)
        position = middle + 0.5 * step * velocity
    return position, velocity


def write_log(path: Path, rows: npt.NDArray[np.float64]) -> None:
    """Write a log as comma-separated values.

    Parameters
    ----------
    path
        File to write.
    rows
        Shape (samples, 4), in the order of `COLUMNS`.
    """
    lines = [",".join(COLUMNS)]
    lines += [f"{time:.3f},{q:.6f},{u:.4f},{wanted:.6f}" for time, q, u, wanted in rows.tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def truth(hidden: str) -> str:
    """Text of ``truth.toml``: the hidden effect and the true values of what the model file knows only roughly.

    Parameters
    ----------
    hidden
        A name in `HIDDEN`.

    Returns
    -------
    str
        A TOML document. Its parameter names are those of the model.
    """
    machine = HIDDEN[hidden]
    effects: dict[str, tuple[str, dict[str, float]]] = {
        "coulomb_friction": ("shoulder", {"shoulder.friction.coulomb": machine.coulomb}),
        "viscous_friction": ("shoulder", {"shoulder.friction.viscous": machine.viscous}),
        "torque_ripple": (
            "shoulder",
            {
                "shoulder.ripple.period": machine.ripple_period,
                "shoulder.ripple.cosine": machine.ripple * math.cos(machine.ripple_phase),
                "shoulder.ripple.sine": machine.ripple * math.sin(machine.ripple_phase),
            },
        ),
        "bias_force": ("shoulder", {"shoulder.bias.force": machine.bias}),
        "dead_zone": ("motor", {"motor.dead_zone.width": machine.dead_zone}),
        "input_delay": ("motor", {"motor.delay.time": machine.delay}),
        "none": ("", {}),
    }
    site, parameters = effects[hidden]
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
        f'at = "{site}"',
        "",
        "[hidden.parameters]",
        *(f'"{name}" = {value:.12g}' for name, value in parameters.items()),
        "",
        "[parameters]",
        *(f'"{name}" = {value:.12g}' for name, value in known.items()),
    ]
    return "\n".join(lines) + "\n"


def generate(folder: Path, hidden: str = "coulomb_friction", seed: int = SEED) -> None:
    """Write the demo's files: ``train.csv``, ``validation.csv``, ``truth.toml`` and a copy of ``model.toml``.

    Parameters
    ----------
    folder
        Where to write; made if it is not there.
    hidden
        The effect that the machine has and the model does not: a name in `HIDDEN`.
    seed
        Seed of the encoder noise. The same seed gives the same files.

    Raises
    ------
    ValueError
        If `hidden` is not a name in `HIDDEN`.
    """
    if hidden not in HIDDEN:
        raise ValueError(f"'{hidden}' is no effect that the demo can hide; take one of: {', '.join(HIDDEN)}.")
    machine = HIDDEN[hidden]
    noise = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    write_log(folder / "train.csv", record(machine, train_reference, 15.0, noise))
    write_log(folder / "validation.csv", record(machine, validation_reference, 10.0, noise))
    (folder / "truth.toml").write_text(truth(hidden), encoding="utf-8", newline="\n")
    model = Path(__file__).with_name("model.toml")
    if folder.resolve() != model.parent.resolve():
        shutil.copyfile(model, folder / "model.toml")


def main() -> None:
    """Read the command line and write the files."""
    parser = argparse.ArgumentParser(description="Make a log of a machine with a hidden effect.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write to")
    parser.add_argument("--hidden", choices=sorted(HIDDEN), default="coulomb_friction", help="the hidden effect")
    parser.add_argument("--seed", type=int, default=SEED, help="seed of the encoder noise")
    arguments = parser.parse_args()
    generate(arguments.out, arguments.hidden, arguments.seed)


if __name__ == "__main__":
    main()
