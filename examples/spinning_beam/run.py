"""Spin-up of a flexible arm: what the levels of detail see, and what a linear beam would see.

python examples/spinning_beam/run.py [FOLDER]
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vpm

HERE = Path(__file__).resolve().parent
FULL, SPEED = 15.0, 6.0  # s until the full speed, rad/s
STEP = 2.5e-3

time = np.arange(0.0, 22.0, STEP)
wave = 2.0 * np.pi / FULL


def turning(time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angle, speed and acceleration of the hub: smoothly to the full speed, then on with it."""
    early = time < FULL
    start = SPEED / FULL * (0.5 * time**2 + (np.cos(wave * time) - 1.0) / wave**2)
    angle = np.where(early, start, SPEED * (time - 0.5 * FULL))
    speed = np.where(early, SPEED / FULL * (time - np.sin(wave * time) / wave), SPEED)
    return angle, speed, np.where(early, SPEED / FULL * (1.0 - np.cos(wave * time)), 0.0)


def deflection(model: vpm.Model) -> tuple[np.ndarray, np.ndarray]:
    """Time (s) and the tip's place across the turning axis (m), with the hub on its prescribed way."""
    motion = {"spin.position": turning(time)[0]}
    log = vpm.Experiment.from_arrays(time, motion, units={"spin.position": "rad"}, name="spin-up")
    run = vpm.simulate(model, log, "prescribed_motion", cutoff=20.0)
    angle = turning(run.time)[0]
    return run.time, run["tip.y"] * np.cos(angle) - run["tip.x"] * np.sin(angle)


def without_stiffening(model: vpm.Model) -> np.ndarray:
    """First mode of a linear beam: its ends do not come closer as it bends, so the tension cannot hold it.

    ``q'' + (omega^2 - speed^2) q = -c acceleration``: beyond the speed omega the deflection grows without end.
    """
    mode = model.at("modal(1)")
    mass, omega = mode.mass_matrix([0.0, 0.0, 0.0, 0.0])[:2, :2], 2.0 * np.pi * mode.natural_frequencies([0.0])[0]
    _, speed, acceleration = turning(time)
    q, rate = np.zeros(time.size), 0.0
    for k in range(time.size - 1):  # semi-implicit Euler
        rate -= STEP * ((omega**2 - speed[k] ** 2) * q[k] + mass[0, 1] / mass[1, 1] * acceleration[k])
        q[k + 1] = q[k] + STEP * rate
    return q * np.sign(mass[0, 1])


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    model = vpm.Model.load(HERE / "spinning_beam.toml")
    figure = Figure(figsize=(8.0, 4.0), layout="constrained")
    axis = figure.subplots()
    print(f"{'level':22s} {'largest':>9s} {'at the end':>11s}   deflection of the tip, m")
    for level, line in (("bezier(7)", "-"), ("deflection(6)", "--")):
        when, seen = deflection(model.at(level))
        axis.plot(when, seen, line, label=level)
        print(f"{level:22s} {np.abs(seen).max():9.4f} {seen[-1]:11.4f}")
    linear = without_stiffening(model)
    axis.plot(time, linear, ":", label="linear, without stiffening")
    lost = time[np.argmax(np.abs(linear) > 10.0)]
    print(f"{'without stiffening':22s} beyond the arm's own length at {lost:.1f} s, and it grows on")
    axis.set(xlabel="time [s]", ylabel="deflection of the tip [m]", ylim=(-1.5, 0.3))
    axis.legend()
    figure.savefig(folder / "spin_up.png")
    print(f"wrote {folder / 'spin_up.png'}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "folder", type=Path, nargs="?", default=Path("spinning-beam-plots"), help="where the pictures go"
    )
    main(parser.parse_args().folder)
