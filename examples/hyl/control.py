"""HyL squats and stops: rigid joints in the controller against joints on bushings.

python examples/hyl/control.py [FOLDER] [--seeds 5]

Bearings of 3e6 N/m, pins and housings included, carry the simulated leg. Its cylinders lag by 2 ms and rub, which no
model of a controller knows; rows of the table name what else is hidden.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

import vpm

mpl.use("Agg")
from matplotlib import pyplot as plt

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
STEP, MOVE, REST = 1e-3, 0.35, 0.4
#: Heights of the hip (m) between which it squats, radial stiffness of the bearings (N/m), lengths of the legs (m).
HIGH, LOW, BEARING, UPPER, LOWER = 0.56, 0.47, 3e6, 0.350, 0.341
DRIVES, JOINTS = ("hip_drive", "knee_drive"), ("hip_rotation", "knee_rotation")
MEASURED = ("slider.position", *(f"{joint}.position" for joint in JOINTS))
#: Noise of the encoders (m, rad), and gains of the leg's joint controllers (N m/rad, N m s/rad).
NOISE, PROPORTIONAL, DERIVATIVE = 2e-5, 300.0, 6.0
#: Values of which nobody knows more than 10 %.
UNCERTAIN = (
    *("carriage.mass", "upper_leg.mass", "lower_leg.mass"),
    *("upper_leg.center_of_mass.x", "lower_leg.center_of_mass.x", "foot.stiffness"),
)


def leg(file: str) -> vpm.Model:
    """A leg without its controllers, with bearings of the above stiffness and their share of critical damping."""
    text = (HERE / file).read_text(encoding="utf-8")
    text = text[: text.index("[controllers.")].replace("1e8, 1e8, 1e7", f"{BEARING:g}, {BEARING:g}, 1e7")
    for damping in (188.0, 187.0):
        text = text.replace(f"{damping}, {damping}, 59.0", f"{damping / 10.0}, {damping / 10.0}, 59.0")
    return vpm.Model.from_toml(text + f'\n[markers.toe]\nparent = "lower_leg"\ntranslation = [{LOWER}, 0.0, 0.0]\n')


def start() -> dict[str, float]:
    """The pose with the toe below the hip."""
    hip = np.arccos((HIGH**2 + UPPER**2 - LOWER**2) / (2.0 * HIGH * UPPER))
    knee = -hip - np.arccos((HIGH**2 + LOWER**2 - UPPER**2) / (2.0 * HIGH * LOWER))
    return {"slider": HIGH - 5e-5, "hip_rotation": float(hip), "knee_rotation": float(knee)}


class Impedance:
    """A feed-forward with the leg's PD controllers of the joints, as forces of the cylinders."""

    channels = MEASURED

    def __init__(self, model: vpm.Model, plan: vpm.FlexibleFeedforward) -> None:
        columns = [plan.coordinates.index(joint) for joint in JOINTS]
        self.plan, self.angles, self.rates = plan, plan.position[:, columns], plan.velocity[:, columns]
        rows = [model.output_channels.index(f"{drive.removesuffix('_drive')}_cylinder.length") for drive in DRIVES]
        grid = np.arange(0, len(plan.time), 20)
        # Lever arms of the cylinders along the way.
        arms = [np.diag(model.linearize(plan.state[at]).C[np.ix_(rows, columns)]) for at in grid]
        self.levers = np.column_stack([np.interp(np.arange(len(plan.time)), grid, arm) for arm in np.transpose(arms)])
        self.sample, self.before = 0, self.angles[0]

    def step(self, seen: Array) -> Array:
        """Forces of a sample."""
        at = min(self.sample, len(self.plan.time) - 1)
        rate, self.before, self.sample = (seen[1:] - self.before) / STEP, seen[1:], self.sample + 1
        torque = PROPORTIONAL * (self.angles[at] - seen[1:]) + DERIVATIVE * (self.rates[at] - rate)
        command = self.plan.commands[at].copy()
        command[1:] += torque / self.levers[at]
        return command


def judged(error: Array) -> tuple[float, float]:
    """Largest error of the hip's height while it moves, and half its swing afterwards, m."""
    moving, after = np.split(error, [round(MOVE / STEP)])
    return float(np.abs(moving).max()), 0.5 * float(np.ptp(after))


def play(machine: vpm.Model, controller: Impedance | vpm.FlexibleController, plan: vpm.FlexibleFeedforward) -> Array:
    """Error of the hip's height (N,), m, from the first sample of the target on."""
    generator, state = np.random.default_rng(0), np.zeros(machine.core.n_states)
    own = plan.position[0]
    state[: len(own)] = own
    sim, height = vpm.Simulation(machine, STEP, state=state), np.empty(len(plan.time))
    for place in range(len(height)):
        seen = np.array([sim[name] for name in MEASURED])
        height[place] = seen[0]
        sim.step(controller.step(seen + NOISE * generator.normal(size=len(seen))))
    return (height - plan.target[:, 0])[plan.time >= 0.0]


def machines(model: vpm.Model, seeds: int) -> dict[str, vpm.Model]:
    """The simulated legs."""
    real = model
    for drive in DRIVES:
        real = real.with_effect("actuator_lag", drive, time_constant=2e-3)
    for joint in JOINTS:
        real = real.with_effect("viscous_friction", joint, viscous=0.5)
    found = {"lag and friction of cylinders": real}
    for seed in range(seeds):
        signs = np.random.default_rng(seed).choice([-1.0, 1.0], len(UNCERTAIN))
        values = {name: real.parameters[name].value for name in UNCERTAIN}
        wrong = {name: value * (1.0 + 0.1 * sign) for (name, value), sign in zip(values.items(), signs, strict=True)}
        found[f"10 % wrong, seed {seed}"] = real.with_parameters(wrong)
    late, dry = real, real
    for drive, joint in zip(DRIVES, JOINTS, strict=True):
        late = late.with_effect("input_delay", drive, time=2e-3)
        dry = dry.with_effect("coulomb_friction", joint, coulomb=2.0, transition_velocity=1e-2)
    return {"the model itself": model, **found, "and a delay of 2 ms": late, "and dry friction of 2 N m": dry}


def main(folder: Path, seeds: int) -> None:
    """Print the table, and draw the error of the hip's height."""
    folder.mkdir(parents=True, exist_ok=True)
    rigid, flexible = leg("rcm.toml"), leg("fcm.toml")
    motion = vpm.TargetMotion.rest_to_rest([HIGH, 0.0], [LOW, 0.0], MOVE)
    plans = [
        vpm.flexible_feedforward(
            model,
            motion,
            ["slider.position", "toe.x"],
            start=start(),
            inputs=DRIVES,
            pre_actuation=REST,
            post_actuation=REST,
        )
        for model in (rigid, flexible)
    ]
    feedback = vpm.state_feedback(
        flexible,
        plans[1],
        deviations={"slider.position": 1e-3, "toe.x": 1e-2, **{f"{joint}.velocity": 0.5 for joint in JOINTS}},
        efforts=dict.fromkeys(DRIVES, 100.0),
        integrate={"slider.position": 1e-4},
    )
    forces = dict(zip(flexible.coordinates, 5.0 * np.sqrt(flexible.masses_at_zero), strict=True))
    noise = vpm.Noise(dict.fromkeys(MEASURED, NOISE), forces)
    print("largest error of the hip's height, and swing after the motion, mm")
    print(f"{'':32}{'rigid, PD':>18}{'flexible, PD':>18}{'flexible, LQR':>18}   better than rigid by")
    drawn = {}
    for case, machine in machines(flexible, seeds).items():
        controllers = {
            "rigid, PD": Impedance(rigid, plans[0]),
            "flexible, PD": Impedance(flexible, plans[1]),
            "flexible, LQR": vpm.FlexibleController(flexible, plans[1], feedback, noise, channels=MEASURED),
        }
        drawn[case] = {name: play(machine, own, plans[1]) for name, own in controllers.items()}
        rows = [judged(error) for error in drawn[case].values()]
        told = "".join(f"{1e3 * error:11.3f} {1e3 * swing:6.3f}" for error, swing in rows)
        better = " ".join(f"{first / last:6.1f}" for first, last in zip(rows[0], rows[-1], strict=True))
        print(f"{case:32}{told}   {better}", flush=True)
    draw(drawn, folder / "control.png")
    print(f"wrote {folder / 'control.png'}")


def draw(drawn: dict[str, dict[str, Array]], path: Path) -> None:
    """The error of the hip's height over time, for the first legs."""
    shown = list(drawn)[:3]
    figure, axes = plt.subplots(len(shown), 1, figsize=(9, 2.6 * len(shown)), sharex=True, layout="constrained")
    for axis, case in zip(axes, shown, strict=True):
        for name, error in drawn[case].items():
            axis.plot(STEP * np.arange(len(error)), 1e3 * error, label=name)
        axis.set_title(case)
        axis.set_ylabel("hip, mm")
    axes[0].legend(loc="upper right")
    axes[-1].set_xlabel("time, s")
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("hyl-plots"), help="where the picture goes")
    parser.add_argument("--seeds", type=int, default=5, help="legs with 10 % wrong values")
    arguments = parser.parse_args()
    main(arguments.folder, arguments.seeds)
