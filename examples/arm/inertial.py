"""Base parameters of an arm of three links from one designed motion: model file, excitation, simulation, fit.

python examples/arm/inertial.py [FOLDER]

The machine is not the model: its masses, centres and inertias are off by up to 20 %. It is simulated in eight steps to
a sample under a controller that sees quantised positions; the currents of the record carry noise.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import vpm
from vpm.excitation import FourierTrajectory, JointLimits, fourier_trajectory
from vpm.identify.inertial_model import InertialModel

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
STEP = 1e-3  # s
LIMITS = {
    "waist": JointLimits((-2.0, 2.0), 3.0, 12.0, 120.0),
    "shoulder": JointLimits((-1.8, 0.6), 2.5, 12.0, 120.0),
    "elbow": JointLimits((-1.2, 2.2), 3.5, 20.0, 60.0),
}
#: Counts of a turn, and noise of the measured current (A).
COUNTS, CURRENT = 2**19, 0.05


def nominal() -> vpm.Model:
    """The arm as drawn."""
    return vpm.Model.load(HERE / "arm.toml")


def machine(seed: int = 4) -> vpm.Model:
    """The arm as built: every number of its bodies and frictions up to 20 % off."""
    model, random = nominal(), np.random.default_rng(seed)
    values = {
        name: parameter.value * (1.0 + random.uniform(-0.2, 0.2))
        for name, parameter in model.parameters.items()
        if not name.endswith((".gain", "transition_velocity"))
    }
    return model.with_parameters(values)


def motion(evaluations: int = 300, period: float = 8.0) -> FourierTrajectory:
    """Motion that tells the drawn arm's base parameters best, within limits."""
    model = nominal()
    free = [name for name in model.parameters if not name.endswith((".gain", "transition_velocity"))]
    return fourier_trajectory(
        model,
        LIMITS,
        period=period,
        time_step=STEP,
        free=free,
        criterion="determinant",
        evaluations=evaluations,
        seed=1,
    )


def measured(target: FourierTrajectory, seed: int = 0, *, noise: bool = True) -> vpm.Experiment:
    """One period of the machine under PD control with the drawn arm's efforts fed forward."""
    real, drawn, random = machine(), nominal(), np.random.default_rng(seed)
    gains = np.array([drawn.parameters[f"{name}.gain"].value for name in drawn.actuators])
    stiffness, damping = np.array([2000.0, 2000.0, 800.0]), np.array([100.0, 100.0, 40.0])
    q, v, a = target.at(target.time)
    forward = np.array([drawn.inverse_dynamics(*row) for row in zip(q, v, a, strict=True)])
    start = {f"{joint}.position": float(q[0, k]) for k, joint in enumerate(real.joints)}
    sim = vpm.Simulation(real, STEP, integrator="rk4", substeps=8, state=start)
    quantum = 2.0 * np.pi / COUNTS if noise else 1e-12
    positions, currents, before = np.empty_like(q), np.empty_like(q), None
    for k in range(len(q)):
        seen = quantum * np.round(np.array([sim[f"{joint}.position"] for joint in real.joints]) / quantum)
        rate = v[k] if before is None else (seen - before) / STEP
        currents[k] = (forward[k] + stiffness * (q[k] - seen) + damping * (v[k] - rate)) / gains
        positions[k], before = seen, seen
        sim.step(currents[k])
    logged = currents + (CURRENT * random.standard_normal(currents.shape) if noise else 0.0)
    channels = {f"{joint}.position": positions[:, k] for k, joint in enumerate(real.joints)}
    channels |= {f"{drive}.command": logged[:, k] for k, drive in enumerate(real.actuators)}
    return vpm.Experiment.from_arrays(target.time, channels, model=drawn, name=f"arm {seed}")


def truth(fit: vpm.InertialFit) -> Array:
    """The machine's base parameters: its own values in the sums that were found."""
    model = machine()
    others = [name for name in fit.names if name in model.parameters and not name.endswith(".mass")]
    linear = InertialModel(model, others)
    values = dict(zip(linear.names, linear.nominal, strict=True))
    return fit.combine([values[name] for name in fit.names])


def main(folder: Path) -> None:
    target = motion()
    print(target.notes[0])
    record = measured(target)
    fit = vpm.identify_inertial(nominal(), record)
    print(*fit.summary, "", sep="\n")
    print(f"{'CAD':>10s}{'identified':>12s}{'std':>10s}{'truth':>10s}{'off/std':>9s}  base parameter")
    true = truth(fit)
    for k, words in enumerate(fit.base_words):
        off = (fit.base_values[k] - true[k]) / fit.base_std[k]
        numbers = f"{fit.base_nominal[k]:10.4f}{fit.base_values[k]:12.4f}{fit.base_std[k]:10.4f}{true[k]:10.4f}"
        print(f"{numbers}{off:+9.1f}  {words}")
    physical = vpm.identify_inertial(nominal(), record, physical=True)
    print("\namong feasible bodies:", *physical.summary, "", physical.table(), sep="\n")
    folder.mkdir(parents=True, exist_ok=True)
    fit.plot().savefig(folder / "arm_inertial.png")
    print(f"wrote {folder / 'arm_inertial.png'}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("arm-plots"), help="where the picture goes")
    main(parser.parse_args().folder)
