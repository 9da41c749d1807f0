"""Stiffness and damping of the HyL leg's cylinders from repeated loops and drops, beside what the leg really has.

python examples/hyl/impedance.py                    tables of the ideal and of the hydraulic leg
python examples/hyl/impedance.py --repeats 10 plots more tests, and pictures into the folder plots

The records are simulated, joints on bushings. A load cell in each piston and an encoder at each joint measure, with
noise, quantisation, and an offset and a gain that change from test to test; the hand never pushes twice alike, and no
two drops are from one height.
"""

from __future__ import annotations

import argparse
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vpm
from vpm import impedance
from vpm.studies.impedance.pictures import plot_loops

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
#: Models on bushings: ideal cylinders under joint control, and servo-cylinders whose force loops follow that control.
LEGS = {"ideal": "fcm.toml", "hydraulic": "hydraulic_fcm.toml"}
#: Low and high impedance of D'Imperio (2016), section 3.4.1: P in N m/rad, and the hand's force for it; 2.2 times, as
#: in the scenario, would push the knee of the hydraulic leg onto its end stop.
IMPEDANCES = {"low": (150.0, 1.0), "high": (300.0, 1.6)}
DERIVATIVE = 6.0  # D, N m s/rad
MASS = 11.981  # of the whole leg, kg
STANDING = (0.350 + 0.341) * np.cos(np.radians(40.0))  # height of the hip with the foot on the ground, m

#: Load cell of 5 kN, 0.5 %: noise, quantum, offset and gain (standard deviations), N and 1.
NOISE, QUANTUM, OFFSET, GAIN = 5.0, 2.5, 10.0, 0.0025
#: Quantum of the encoder at hip and knee (rad); its noise is a third of it.
ENCODER = np.radians(0.045)

#: Hand: first cycles that are left out, then those that count.
SETTLING, CYCLES, FREQUENCY = 2, 4, 0.2
#: Frequencies of the hand for the law of the loss, each at full and at half of its force.
SWEEP = (0.1, 0.2, 0.4)
#: Length of a landing, s.
LANDING = 0.35

#: Pins of each cylinder in the plane of the joint's parent: fixed one, joint, moving one at joint angle zero (m).
PINS = {
    "hip": (0.3199928467749999 + 0.03498839826044419j, 0.0 + 0.0j, -0.045j),
    "knee": (0.03136307959319706 - 0.04500836537432492j, 0.350 + 0.0j, 0.0447534852915723 - 0.004703780847044406j),
}


def length(joint: str, angle: Array) -> Array:
    """Length of a cylinder over the angle of its joint, m."""
    fixed, pivot, moving = PINS[joint]
    return np.abs(pivot + moving * np.exp(1j * angle) - fixed)


def lever(joint: str, angle: float, step: float = 1e-5) -> tuple[float, float]:
    """``l = ds/dq`` (m) and ``dl/dq`` (m/rad) at an angle."""
    low, middle, high = length(joint, angle + step * np.array([-1.0, 0.0, 1.0]))
    return float(high - low) / (2.0 * step), float(high - 2.0 * middle + low) / step**2


@dataclass(frozen=True)
class Truth:
    """What the controller is at the cylinder in a test.

    Attributes
    ----------
    gain : float
        ``P / l^2`` in the mean pose, N/m.
    stiffness : float
        ``P / l^2 + F (dl/dq) / l^2``: the lever changes under the load F, N/m.
    damping : float
        ``D int (dq/dt)^2 dt / int (ds/dt)^2 dt``: ``D / l^2`` as the motion weighs it, N s/m.
    """

    gain: float
    stiffness: float
    damping: float


def truth(joint: str, proportional: float, run: vpm.Run, window: slice) -> Truth:
    """Gains seen at a cylinder over a part of a run."""
    arm, change = lever(joint, float(run[f"{joint}_rotation.position"][window].mean()))
    gain, force = proportional / arm**2, float(run[f"{joint}_drive.force"][window].mean())
    turned, moved = run[f"{joint}_rotation.velocity"][window], run[f"{joint}_cylinder.rate"][window]
    return Truth(gain, gain + force * change / arm**2, DERIVATIVE * float(turned @ turned / (moved @ moved)))


def simulated(
    file: str, leg: str, proportional: float, changes: dict[str, Any], parameters: dict[str, float] | None = None
) -> vpm.Run:
    """One test of a scenario of this folder, with some of its keys and of the model's parameters changed."""
    content = tomllib.loads((HERE / file).read_text(encoding="utf-8"))
    content.pop("plot")
    gains = {f"{joint}_impedance.proportional": proportional for joint in PINS} | (parameters or {})
    content |= {"runs": [{"name": "test", "model": LEGS[leg], "set": gains}]} | changes
    result = vpm.Scenario.from_dict(content, folder=HERE).run()
    if result.failures:
        raise RuntimeError(str(result.failures))
    return result["test"]


def pushed(leg: str, impedance_name: str, frequency: float, share: float = 1.0, **parameters: float) -> vpm.Run:
    """A hand pushes the standing leg at a frequency (Hz), with a share of the force of the scenario."""
    proportional, hand = IMPEDANCES[impedance_name]
    sine = {"type": "sine", "mean": -65.0, "amplitude": 87.0 * share, "frequency": frequency, "start": 1.0}
    duration = 1.0 + round((SETTLING + CYCLES) / frequency, 2)
    changes = {"duration": duration, "commands": {"hand": sine}}
    return simulated("quasi_static.toml", leg, proportional, changes, {"hand.gain": hand, **parameters})


def dropped(leg: str, impedance_name: str, random: np.random.Generator) -> vpm.Run:
    """The leg drops from 50 mm, more or less."""
    changes = {
        "duration": 0.101 + LANDING + 0.02,
        "time_step": 1e-3,
        "initial": {
            "slider.position": STANDING + float(random.normal(0.050, 0.002)),
            "hip_rotation.position": np.radians(40.0),
            "knee_rotation.position": np.radians(-80.0),
        },
    }
    return simulated("drop.toml", leg, IMPEDANCES[impedance_name][0], changes)


def measured(run: vpm.Run, joint: str, window: slice, random: np.random.Generator | None) -> dict[str, Array]:
    """Stroke by encoder and linkage, force by load cell; as they are where no random numbers are given."""
    angle, force = run[f"{joint}_rotation.position"][window], run[f"{joint}_drive.force"][window]
    if random is not None:
        angle = ENCODER * np.round(angle / ENCODER + random.standard_normal(angle.size) / 3.0)
        force = (1.0 + GAIN * random.standard_normal()) * force + OFFSET * random.standard_normal()
        force = QUANTUM * np.round((force + NOISE * random.standard_normal(force.size)) / QUANTUM)
    return {"time": run.time[window], "stroke": length(joint, angle), "force": force}


def loop_window(run: vpm.Run, frequency: float) -> slice:
    """Samples after the cycles that settle."""
    return slice(int(np.searchsorted(run.time, 1.0 + SETTLING / frequency)), None)


def landing_window(run: vpm.Run) -> slice:
    """Samples of a landing, from touch-down."""
    first = int(np.argmax(run["foot.normal_force"] > 0.0))
    return slice(first, first + round(LANDING / float(run.time[1] - run.time[0])))


def first_stop(run: vpm.Run, joint: str, window: slice) -> impedance.Stop:
    """D'Imperio (2016), eq 5.27 with its factors put right: the whole leg's energy, as if one cylinder took it all."""
    stroke = length(joint, run[f"{joint}_rotation.position"][window])
    lowest = int(np.argmax(np.abs(stroke - stroke[0])))
    speed = -float(run["slider.velocity"][window.start - 1])
    span = float(run.time[window][lowest] - run.time[window][0])
    return impedance.stop_damping(MASS, speed, abs(float(stroke[lowest] - stroke[0])), span)


@dataclass
class Tests:
    """Repeated tests of one leg at one impedance, by joint."""

    loops: dict[str, list[impedance.Loop]]
    landings: dict[str, list[impedance.Landing]]
    stops: dict[str, list[impedance.Stop]]
    truths: dict[str, Truth]
    landing_truths: dict[str, Truth]


def repeated(leg: str, impedance_name: str, repeats: int, seed: int = 0) -> Tests:
    """Repeat both tests; the truths are those of the first ones."""
    random = np.random.default_rng(seed)
    proportional = IMPEDANCES[impedance_name][0]
    found = Tests({j: [] for j in PINS}, {j: [] for j in PINS}, {j: [] for j in PINS}, {}, {})
    for repeat in range(repeats):
        frequency = FREQUENCY * float(random.uniform(0.9, 1.1))
        slow = pushed(leg, impedance_name, frequency, float(random.uniform(0.85, 1.0)))
        fall = dropped(leg, impedance_name, random)
        windows = loop_window(slow, frequency), landing_window(fall)
        for joint in PINS:
            record = measured(slow, joint, windows[0], random)
            found.loops[joint].append(loop(record, frequency))
            found.landings[joint].append(landing(measured(fall, joint, windows[1], random)))
            found.stops[joint].append(first_stop(fall, joint, windows[1]))
            if repeat == 0:
                found.truths[joint] = truth(joint, proportional, slow, windows[0])
                found.landing_truths[joint] = truth(joint, proportional, fall, windows[1])
    return found


def loop(record: dict[str, Array], frequency: float, delay: float = 0.0) -> impedance.Loop:
    """Loop of a cylinder, whose force works against its stroke; the hand's frequency is known."""
    return impedance.identify_loop(
        record, "stroke", "force", sense="reaction", frequency=frequency, delay=delay, drift=2
    )


def landing(record: dict[str, Array]) -> impedance.Landing:
    """Spring and damper of a cylinder from a landing."""
    return impedance.identify_landing(record, "stroke", "force", sense="reaction")


def laws(leg: str, seed: int = 1) -> dict[str, impedance.LossLaw]:
    """Law of the loss of each cylinder, from some frequencies at two forces."""
    random = np.random.default_rng(seed)
    loops: dict[str, list[impedance.Loop]] = {joint: [] for joint in PINS}
    for frequency in SWEEP:
        for share in (1.0, 0.5):
            run = pushed(leg, "low", frequency, share)
            for joint, found in loops.items():
                found.append(loop(measured(run, joint, loop_window(run, frequency), random), frequency))
    return {joint: impedance.identify_loss_law(found) for joint, found in loops.items()}


def delays(shifts: tuple[int, ...] = (0, 1, 5)) -> list[tuple[int, impedance.Loop, impedance.Loop]]:
    """Knee of the ideal leg, its force recorded late by some ms: delay unknown, and given."""
    run = pushed("ideal", "low", FREQUENCY)
    record = measured(run, "knee", loop_window(run, FREQUENCY), None)
    found = []
    for shift in shifts:
        late = {name: column[shift:] for name, column in record.items()}
        late["force"] = record["force"][: record["force"].size - shift]
        found.append((shift, loop(late, FREQUENCY), loop(late, FREQUENCY, 1e-3 * shift)))
    return found


def compensated(gains: tuple[float, ...] = (0.0, 8e-3, 10.67e-3)) -> list[tuple[float, impedance.Loop]]:
    """Knee of the hydraulic leg with none, three quarters (as in the file) and all of the piston's flow fed forward."""
    found = []
    for gain in gains:
        parameters = {f"{joint}_impedance.velocity_gain": gain for joint in PINS}
        run = pushed("hydraulic", "low", FREQUENCY, **parameters)
        found.append((gain, loop(measured(run, "knee", loop_window(run, FREQUENCY), None), FREQUENCY)))
    return found


def print_truths(all_tests: dict[str, Tests]) -> None:
    """Gains of the controller at the cylinders, and what eq 5.27 makes of the same drops."""
    print(f"\n{'truth':14s}{'joint':8s}{'impedance':11s}{'P/l^2':>9s}{'with load':>11s}{'D/l^2':>8s}{'eq 5.27 c':>11s}")
    for name, found in all_tests.items():
        for kind, truths in (("quasi-static", found.truths), ("drop", found.landing_truths)):
            for joint, known in truths.items():
                stop = np.mean([one.damping for one in found.stops[joint]])
                told = f"{stop:11.3g}" if kind == "drop" else ""
                numbers = f"{known.gain:9.4g}{known.stiffness:11.4g}{known.damping:8.4g}"
                print(f"{kind:14s}{joint:8s}{name:11s}{numbers}{told}")


def main(repeats: int, folder: Path | None, legs: tuple[str, ...] = tuple(LEGS)) -> None:
    """Print the tables, the laws of the loss, and what a delay does."""
    for leg in legs:
        all_tests = {name: repeated(leg, name, repeats) for name in IMPEDANCES}
        rows = []
        for name, found in all_tests.items():
            for kind, by_joint in (("quasi-static", found.loops), ("drop", found.landings)):
                rows += [impedance.repeat_tests(joint, name, kind, by_joint[joint]) for joint in PINS]
        table = impedance.ImpedanceTable(tuple(rows))
        print(f"\n{leg} leg, {repeats} tests each\n{table}")
        print_truths(all_tests)
        for joint, law in laws(leg).items():
            print(f"{joint}: {law}")
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            table.plot().savefig(folder / f"impedance_{leg}.png", dpi=110)
            loops = [all_tests["low"].loops[joint][0] for joint in PINS]
            plot_loops(loops).savefig(folder / f"loops_{leg}.png", dpi=110)
    for gain, knee in compensated():
        print(f"hydraulic, velocity gain {1e3 * gain:5.2f} mA s/m: knee {knee.damping:.0f} N s/m")
    for shift, blind, told in delays():
        print(f"force {shift} ms late: knee {blind.damping:.0f} N s/m; with the delay given {told.damping:.0f} N s/m")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="?", type=Path, help="folder for pictures")
    parser.add_argument("--repeats", type=int, default=5, help="tests of each kind")
    asked = parser.parse_args()
    main(asked.repeats, asked.plots)
