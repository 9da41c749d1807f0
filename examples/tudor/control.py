"""TUDOR's tip along a line and back to rest: the rigid model in the controller against the flexible one.

python examples/tudor/control.py [FOLDER] [--seeds 5]

The simulated arm has curves of degree 6 where the controller's model has 3; its encoders and gauges are noisy.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from time import thread_time

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

import vpm

mpl.use("Agg")
from matplotlib import pyplot as plt

Array = NDArray[np.float64]
Machine = Callable[[vpm.Model], vpm.Model]

FILE = Path(__file__).resolve().parent / "tudor.toml"
JOINTS, MOTORS, AXES = ("joint_1", "joint_2", "joint_3"), ("motor_1", "motor_2", "motor_3"), "xyz"
#: Poses between which the tip moves (rad), the time that it takes, and the rest before and after (s).
START, END, MOVE, REST = (0.0, 0.3, -0.5), (0.5, 0.7, -0.8), 0.8, 1.2
STEP = 1e-3
#: Noise of encoders (rad) and of gauges, and forces that nobody knows of, N per root of a kilogram.
ENCODER, GAUGE, FORCE = 2e-5, 1e-6, 0.3
#: Largest torques of the motors, N m.
LIMITS = {"motor_1": 40.0, "motor_2": 30.0, "motor_3": 10.0}
#: Values of which nobody knows more than 10 %.
UNCERTAIN = (
    "column.inertia.zz",
    "shoulder.inertia.yy",
    "elbow_drive.mass",
    "joint_3.rotor_inertia",
    "strip_1.young",
    "strip_2.young",
    "strip_1.density",
    "strip_2.density",
    "strip_1.damping.stiffness",
    "strip_2.damping.stiffness",
)
BRIDGES = ("bridge_gauge_1", "bridge_gauge_2")


def _with(arm: vpm.Model, effect: str, places: tuple[str, ...], **values: float) -> vpm.Model:
    for place in places:
        arm = arm.with_effect(effect, place, **values)
    return arm


def _rubbing(arm: vpm.Model) -> vpm.Model:
    for joint, torque in zip(JOINTS, (0.3, 0.3, 0.1), strict=True):
        arm = arm.with_effect("coulomb_friction", joint, coulomb=torque, transition_velocity=1e-3)
        arm = arm.with_effect("viscous_friction", joint, viscous=0.2)
    return arm


#: Effects that the simulated arm has and no model of a controller.
HIDDEN: dict[str, Machine] = {
    "dry and viscous friction": _rubbing,
    "play of joint 2": lambda arm: arm.with_effect(
        "backlash", "joint_2", gap=5e-4, stiffness=2e4, contact_damping=20.0, width=2e-5, damping=0.05
    ),
    "soft gears": lambda arm: _with(arm, "joint_compliance", JOINTS[1:], stiffness=3e3, damping=1.0),
    "delay of 2 ms": lambda arm: _with(arm, "input_delay", MOTORS, time=2e-3),
    "slow motors, 2 ms": lambda arm: _with(arm, "actuator_lag", MOTORS, time_constant=2e-3),
    "payload of 50 g": lambda arm: arm.with_effect("payload", "elbow", mass=0.05, z=0.41),
    "torque ripple": lambda arm: _with(arm, "torque_ripple", JOINTS[1:], period=0.1, cosine=0.1),
    "gauges 5 % wrong": lambda arm: _with(arm, "sensor_gain", BRIDGES, value=1.05),
}


def arm(level: int) -> vpm.Model:
    """The arm with curves of this degree, and with a sensor at each gauge."""
    bridges = "".join(f'\n[sensors.{name}]\nmeasures = "{name[7:]}.strain"\n' for name in BRIDGES)
    return vpm.Model.from_toml(FILE.read_text(encoding="utf-8").replace("bezier(5)", f"bezier({level})") + bridges)


class Servos:
    """A feed-forward with the PD servos of the model file, which differentiate their encoders."""

    def __init__(self, model: vpm.Model, plan: vpm.FlexibleFeedforward) -> None:
        values = [
            model.parameters[f"servo_{n}.{gain}"].value for gain in ("proportional", "derivative") for n in (1, 2, 3)
        ]
        self.proportional, self.derivative = np.array(values[:3]), np.array(values[3:])
        self.plan, self.channels = plan, tuple(f"{joint}.position" for joint in JOINTS)
        self.sample, self.before = 0, plan.position[0, :3]

    def step(self, seen: Array) -> Array:
        """Torques of a sample."""
        at = min(self.sample, len(self.plan.time) - 1)
        rate, self.before, self.sample = (seen - self.before) / STEP, seen, self.sample + 1
        off = self.plan.position[at, :3] - seen, self.plan.velocity[at, :3] - rate
        largest = np.array(list(LIMITS.values()))
        return np.clip(
            self.plan.commands[at] + self.proportional * off[0] + self.derivative * off[1], -largest, largest
        )


class Laboratory:
    """Plans of the controller's model, and the simulated arm that plays them."""

    def __init__(self, level: int = 3, finer: int = 6) -> None:
        self.model, self.finer = arm(level), arm(finer)
        ends = [self.model.forward_kinematics("tip", self.model.equilibrium(q)[0])[:3, 3] for q in (START, END)]
        self.motion = vpm.TargetMotion.rest_to_rest(*ends, MOVE)
        self.plans = {
            method: vpm.flexible_feedforward(
                self.model,
                self.motion,
                "tip",
                start=START,
                method=method,
                pre_actuation=REST,
                post_actuation=REST,
                limits=LIMITS,
            )
            for method in ("rigid", "quasi_static", "inversion")
        }
        tip = [f"tip.{axis}" for axis in AXES]
        self.feedback = vpm.state_feedback(
            self.model,
            self.plans["inversion"],
            deviations={**dict.fromkeys(tip, 1e-3), **{f"{joint}.velocity": 0.1 for joint in JOINTS}},
            efforts={"motor_1": 2.0, "motor_2": 2.0, "motor_3": 1.0},
            integrate=dict.fromkeys(tip, 2e-4),
        )
        self.noise = vpm.Noise(
            {**{f"{joint}.position": ENCODER for joint in JOINTS}, "gauge_1.strain": GAUGE, "gauge_2.strain": GAUGE},
            dict(zip(self.model.coordinates, FORCE * np.sqrt(self.model.masses_at_zero), strict=True)),
        )

    def controllers(self) -> dict[str, Servos | vpm.FlexibleController]:
        """Fresh ones, from the plainest on."""
        flexible = self.plans["inversion"]
        return {
            "rigid, PD": Servos(self.model, self.plans["rigid"]),
            "sag, PD": Servos(self.model, self.plans["quasi_static"]),
            "flexible, PD": Servos(self.model, flexible),
            "flexible, LQR": vpm.FlexibleController(
                self.model,
                flexible,
                self.feedback,
                self.noise,
                limits=LIMITS,
                # The cheapest steps are as good for an observer that is corrected in each of them.
                integrator="linearly_implicit",
            ),
        }

    def alone(self) -> float:
        """Largest error of the tip where the controller's model plays the plan by itself, m."""
        plan = self.plans["inversion"]
        sim = vpm.Simulation(self.model, STEP, state=plan.state[0], substeps=4)
        shown = sim.run(vpm.FlexibleController(self.model, plan), plan.time[-1] - plan.time[0])
        tip = np.column_stack([shown[f"tip.{axis}"] for axis in AXES])
        moving = (plan.time[1:] >= 0.0) & (plan.time[1:] <= MOVE)
        return float(np.linalg.norm(tip - plan.target[1:], axis=1)[moving].max())

    def play(self, machine: vpm.Model, controller: Servos | vpm.FlexibleController, seed: int = 0) -> Array:
        """Error of the tip (N, 3), m, from the first sample of the target on."""
        plan = self.plans["inversion"]
        generator, state = np.random.default_rng(seed), np.zeros(machine.core.n_states)
        place = dict(zip(JOINTS, START, strict=True))
        joints = np.array([place.get(name, 0.0) for name in machine.joints])
        state[: len(machine.coordinates)] = machine.equilibrium(joints)[0]
        sim = vpm.Simulation(machine, STEP, state=state, substeps=2)
        deviations = np.array([GAUGE if name.endswith("strain") else ENCODER for name in controller.channels])
        tip = np.empty((len(plan.time), 3))
        for row in tip:
            row[:] = [sim[f"tip.{axis}"] for axis in AXES]
            seen = np.array([sim[name] for name in controller.channels])
            sim.step(controller.step(seen + deviations * generator.normal(size=len(seen))))
        return (tip - plan.target)[plan.time >= 0.0]


def judged(error: Array) -> tuple[float, float]:
    """Largest error of the tip during the motion, and residual vibration: half its swing in the second after, m."""
    moving, after = np.split(error, [round(MOVE / STEP)])
    return float(np.linalg.norm(moving, axis=1).max()), float(
        0.5 * np.linalg.norm(np.ptp(after[: round(1.0 / STEP)], axis=0))
    )


def wrong(machine: vpm.Model, seed: int) -> vpm.Model:
    """The arm with each uncertain value wrong by 10 %, up or down."""
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], len(UNCERTAIN))
    values = {name: machine.parameters[name].value for name in UNCERTAIN}
    return machine.with_parameters(
        {name: value * (1.0 + 0.1 * sign) for (name, value), sign in zip(values.items(), signs, strict=True)}
    )


def main(folder: Path, seeds: int) -> None:
    """Print the table, and draw the tip's error."""
    folder.mkdir(parents=True, exist_ok=True)
    laboratory = Laboratory()
    cases: dict[str, vpm.Model] = {"nominal": laboratory.finer}
    cases |= {f"10 % wrong, seed {seed}": wrong(laboratory.finer, seed) for seed in range(seeds)}
    cases |= {name: hide(laboratory.finer) for name, hide in HIDDEN.items()}
    print(f"the plan played on its own model, without feedback: {1e3 * laboratory.alone():.6f} mm")
    names = list(laboratory.controllers())
    print("largest error of the tip, and residual vibration, mm")
    print(f"{'':26}" + "".join(f"{name:>20}" for name in names) + "      better than rigid by")
    found, drawn = {}, {}
    for case, machine in cases.items():
        errors = {name: laboratory.play(machine, own) for name, own in laboratory.controllers().items()}
        found[case], drawn[case] = {name: judged(error) for name, error in errors.items()}, errors
        print(_row(case, found[case], names), flush=True)
    wrongs = [found[case] for case in found if case.startswith("10 %")]
    if wrongs:
        factors = np.array([_factors(row, names) for row in wrongs]).min(axis=0)
        print(f"worst of {seeds} seeds: better than rigid by {factors[0]:.1f} (error), {factors[1]:.1f} (vibration)")
    own = laboratory.controllers()["flexible, LQR"]
    times = own.step_times(5000, thread_time) if isinstance(own, vpm.FlexibleController) else np.zeros(1)
    quantiles = {name: float(np.quantile(times, q)) for name, q in (("p50", 0.5), ("p90", 0.9), ("p99", 0.99))}
    told = ", ".join(f"{name} {1e6 * value:.0f} us" for name, value in quantiles.items())
    print(
        f"a step of observer, feedback and feed-forward: {told}; {100 * quantiles['p90'] / STEP:.1f} % of 1 ms at p90"
    )
    _draw(drawn, folder / "control.png")
    print(f"wrote {folder / 'control.png'}")


def _factors(row: dict[str, tuple[float, float]], names: list[str]) -> Array:
    return np.array(row[names[0]]) / np.array(row[names[-1]])


def _row(case: str, row: dict[str, tuple[float, float]], names: list[str]) -> str:
    told = "".join(f"{1e3 * row[name][0]:12.3f} {1e3 * row[name][1]:7.3f}" for name in names)
    return f"{case:26}{told}   " + " ".join(f"{factor:9.1f}" for factor in _factors(row, names))


def _draw(drawn: dict[str, dict[str, Array]], path: Path) -> None:
    shown = [
        name for name in ("nominal", "10 % wrong, seed 0", "dry and viscous friction", "delay of 2 ms") if name in drawn
    ]
    figure, axes = plt.subplots(len(shown), 1, figsize=(9, 2.6 * len(shown)), sharex=True, layout="constrained")
    for axis, case in zip(np.atleast_1d(axes), shown, strict=True):
        for name, error in drawn[case].items():
            axis.semilogy(STEP * np.arange(len(error)), 1e3 * np.linalg.norm(error, axis=1), label=name)
        axis.set_title(case)
        axis.set_ylabel("tip's error, mm")
    np.atleast_1d(axes)[0].legend(loc="upper right")
    np.atleast_1d(axes)[-1].set_xlabel("time, s")
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("tudor-plots"), help="where the picture goes")
    parser.add_argument("--seeds", type=int, default=5, help="machines with 10 % wrong values")
    arguments = parser.parse_args()
    main(arguments.folder, arguments.seeds)
