"""The shortest way that costs least: an axis is moved by CasADi, with its equations and exact Jacobians in C.

``python examples/c/casadi_motion.py FOLDER`` writes the equations of the EMPS axis into a folder, compiles them, and
lets Ipopt find the commands that move the axis by 50 mm in 0.3 s with the least square of the command: direct
collocation by the implicit midpoint rule, whose Newton steps take the Jacobians that the source has.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import vpm
from vpm.realtime import c_source

if TYPE_CHECKING:
    from casadi import Function

MODEL = Path(__file__).resolve().parent.parent / "emps" / "model.toml"
STEPS, DURATION, WAY = 60, 0.3, 0.05


def rates(folder: Path) -> Function:
    """The rates of the axis, a function of (x, u), as CasADi calls it in a shared library."""
    import casadi

    c_source(vpm.Model.load(MODEL), name="axis").save(folder)
    command = ["cc", "-std=c99", "-O2", "-fPIC", "-shared", "axis.c", "-lm", "-o", "axis.so"]
    subprocess.run(command, cwd=folder, check=True)  # noqa: S603  (the words above, and no shell)
    return casadi.external("axis_rates", str((folder / "axis.so").resolve()))


def motion(f: Function) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """States (STEPS + 1, nx) and commands (STEPS, nu) of the cheapest motion."""
    import casadi

    h, nx, nu = DURATION / STEPS, f.size1_in(0), f.size1_in(1)
    x, u = casadi.MX.sym("x", nx, STEPS + 1), casadi.MX.sym("u", nu, STEPS)
    begin, end = np.zeros(nx), np.zeros(nx)
    end[0] = WAY
    middle = 0.5 * (x[:, 1:] + x[:, :-1])
    gaps = x[:, 1:] - x[:, :-1] - h * f.map(STEPS)(middle, u)
    limits = casadi.veccat(x[:, 0] - begin, x[:, -1] - end, gaps)
    problem: dict[str, Any] = {"x": casadi.veccat(x, u), "f": h * casadi.sumsqr(u), "g": limits}
    # Second derivatives are not in the source: Ipopt gathers them along its way.
    ipopt = {"hessian_approximation": "limited-memory", "print_level": 0, "sb": "yes", "tol": 1e-8, "max_iter": 1000}
    solver = casadi.nlpsol("solver", "ipopt", problem, {"print_time": False, "ipopt": ipopt})
    straight = np.linspace(begin, end, STEPS + 1)
    found = solver(x0=np.concatenate([straight.ravel(), np.zeros(STEPS * nu)]), lbg=0.0, ubg=0.0)
    if not solver.stats()["success"]:
        raise RuntimeError(f"Ipopt stopped with {solver.stats()['return_status']}")
    numbers = np.asarray(found["x"], dtype=np.float64).ravel()
    states, commands = np.split(numbers, [nx * (STEPS + 1)])
    return states.reshape(STEPS + 1, nx), commands.reshape(STEPS, nu)


def main(folder: Path) -> None:
    """Find the motion, and let a simulation follow its commands."""
    _, commands = motion(rates(folder))
    sim = vpm.Simulation(vpm.Model.load(MODEL), DURATION / STEPS)
    sim.run(commands)
    print(f"{commands.min():.3f} to {commands.max():.3f} V move the axis to {1e3 * sim['axis.position']:.3f} mm")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
