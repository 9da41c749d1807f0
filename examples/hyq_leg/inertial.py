"""Masses and inertias of the leg of HyQ by least squares: what two experiments can know, beside the truth.

python examples/hyq_leg/inertial.py [FOLDER]

D'Imperio (2016), section 5.1.1 and Table 5.1, finds seven masses and four inertias from ten seconds of slow motion
about one pose. Here a leg whose parameters are known is moved so, and then fast through its whole workspace. Torques
come from the balances of its seven bodies, with 0.5 N m of noise; angles from encoders with counts; rates and
accelerations from those angles alone. The regressor comes from virtual work.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import vpm
from vpm.experiment import Experiment
from vpm.experiment.motion import motion
from vpm.experiment.signal import parallel_filter
from vpm.linkages import INERTIAL_NAMES, Leg, LegParameters, inertial_values, with_inertial_values

Array = NDArray[np.float64]

STEP = 1e-3  # s
TORQUE_NOISE, COUNTS = 0.5, 2**17  # N m, and counts of a turn of the joint
UNITS = ("kg",) * 7 + ("kg m^2",) * 4


@dataclass(frozen=True)
class Encoders:
    """What the preparation of a log has to know of the leg: its two joints; torques are no inputs of it."""

    name: str = "HyQ leg"
    joints: tuple[str, ...] = ("hip", "knee")
    input_channels: tuple[str, ...] = ()
    optional_inputs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Motion:
    """Sines about a pose: angles in rad at the times of a record."""

    seconds: float
    pose: tuple[float, float]
    reach: tuple[float, float]
    frequencies: tuple[float, ...]  # Hz
    seed: int = 1

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        """Angles, rates and accelerations, (N, 2) each, within the reach about the pose."""
        random = np.random.default_rng(self.seed)
        states = np.zeros((3, time.size, 2))
        states[0] += self.pose
        for joint in (0, 1):
            omega = 2.0 * np.pi * np.array(self.frequencies) * (1.0 + 0.13 * joint)
            phase = random.uniform(0.0, 2.0 * np.pi, omega.size)
            size = self.reach[joint] / omega.size
            angle = time[:, None] * omega + phase
            states[0, :, joint] += size * np.sin(angle).sum(axis=1)
            states[1, :, joint] = size * (omega * np.cos(angle)).sum(axis=1)
            states[2, :, joint] = -size * (omega**2 * np.sin(angle)).sum(axis=1)
        return states[0], states[1], states[2]


#: As published: one pose, 2 degrees about it, below 0.1 rad/s, 10 s. And what a workbench allows.
NARROW = Motion(10.0, (np.radians(20.0), np.radians(-80.0)), (np.radians(2.0),) * 2, (0.15, 0.35, 0.6))
WIDE = Motion(
    60.0, (np.radians(10.0), np.radians(-80.0)), (np.radians(50.0), np.radians(60.0)), (0.3, 0.7, 1.3, 2.1, 3.1)
)


def drawn() -> Leg:
    """The leg of the CAD model: masses of Table 5.1, inertias of slender bodies."""
    return Leg.hyq("plausible")


def built() -> Leg:
    """The leg that is measured: the identified masses of Table 5.1, inertias 15 % above those of the CAD model."""
    values = inertial_values(LegParameters.hyq("plausible"))
    values[:7] = inertial_values(LegParameters.hyq("identified"))[:7]
    values[7:] *= 1.15
    return Leg(with_inertial_values(drawn().parameters, values), "HyQ leg, as built")


def clean(course: Motion, count: int = 400) -> vpm.InertialRegression:
    """What a motion could tell if nothing were measured but only known: exact states and torques."""
    states = course.at(np.linspace(0.0, course.seconds, count))
    return regression(drawn().regressor(*states), built().torques(*states, derivation="newton_euler"))


def measured(course: Motion, seed: int = 0) -> vpm.InertialRegression:
    """Regression from quantised angles and noisy torques; both sides pass the same filter."""
    random = np.random.default_rng(seed)
    time = np.arange(round(course.seconds / STEP)) * STEP
    states = course.at(time)
    torques = built().torques(*states, derivation="newton_euler") + TORQUE_NOISE * random.standard_normal(
        (time.size, 2)
    )
    quantum = 2.0 * np.pi / COUNTS
    angles = quantum * np.round(states[0] / quantum)
    channels = {"hip.position": angles[:, 0], "knee.position": angles[:, 1]}
    log = Experiment.from_arrays(time, channels, units=dict.fromkeys(channels, "rad"), name="leg")
    seen = motion(log, Encoders())
    table = drawn().regressor(seen.position, seen.velocity, seen.acceleration)[seen.kept]
    columns = parallel_filter(table.reshape(len(table), -1), seen.decimation).reshape(-1, 2, len(INERTIAL_NAMES))
    return regression(columns, parallel_filter(torques[seen.kept], seen.decimation))


def regression(table: Array, torques: Array) -> vpm.InertialRegression:
    """The 11 parameters of Table 5.1, each of them positive."""
    return vpm.InertialRegression.from_arrays(
        table,
        torques,
        INERTIAL_NAMES,
        nominal=inertial_values(drawn().parameters),
        units=UNITS,
        channels=("hip torque", "knee torque"),
        positive=INERTIAL_NAMES,
    )


def beside_truth(fit: vpm.InertialFit) -> str:
    """Table of the fit with one more column: the parameters of the leg that was simulated."""
    head, *rows = fit.table(all_parameters=True).splitlines()
    true = inertial_values(built().parameters)
    lines = [f"{row}  (truth {value:.4g})" for row, value in zip(rows, true, strict=True)]
    return "\n".join([head, *lines])


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    true = inertial_values(built().parameters)
    for label, course in (("wide and fast", WIDE), ("narrow and slow, as published", NARROW)):
        exact = vpm.identify_inertial(clean(course))
        worst = np.abs(exact.values / true - 1.0).max()
        print(f"== {label} ==\nwithout noise: rank {exact.rank} of 11, condition number {exact.condition:.3g}", end="")
        print(f", largest relative error {worst:.1e}" if exact.rank == len(true) else "")
        data = measured(course)
        for options in ({}, {"physical": True}, {"prior": 0.2}):
            fit = vpm.identify_inertial(data, **options)
            print("", *fit.summary, beside_truth(fit), sep="\n")
            if not options:
                print("", fit.base_table(), sep="\n")
                path = folder / f"leg_{label.split()[0]}.png"
                fit.plot().savefig(path)
                print(f"wrote {path}")
        print()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("hyq-leg-plots"), help="where the pictures go")
    main(parser.parse_args().folder)
