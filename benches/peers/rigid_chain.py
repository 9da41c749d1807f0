"""Time of one call from Python on a rigid arm of seven joints, beside Pinocchio's bindings, with a check of values.

    python benches/peers/rigid_chain.py [--calls 30000] [--markdown FILE]

Inverse dynamics (rnea), mass matrix (crba) and forward dynamics (aba), each on prepared buffers and ready arrays, as a
controller written in Python calls them. Pinocchio takes part where it is installed: pip install "vpm-dynamics[peers]".
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "peers")]

import markdown  # noqa: E402
from vpm.model import Dynamics, Model  # noqa: E402

Array = NDArray[np.float64]
Calls = dict[str, Callable[[], Array]]

MASSES = (4.0, 3.5, 3.0, 2.5, 1.5, 1.0, 0.5)
CENTER = (0.01, -0.02, 0.08)
#: xx yy zz xy xz yz about the centre of mass, per mass.
MOMENTS = (0.012, 0.011, 0.004, 0.0003, -0.0002, 0.0005)
#: Values have to agree to this, relative to the largest of them.
AGREEMENT = 1e-9
REPEATS = 15


def axis(k: int) -> tuple[float, float, float]:
    return (0.0, 0.0, 1.0) if k % 2 == 0 else (0.0, 1.0, 0.0)


def offset(k: int) -> tuple[float, float, float]:
    return (0.0, 0.0, 0.15 if k == 0 else 0.175)


def vpm_model() -> Model:
    """A light robot's proportions: roll and pitch axes in turn, 16 kg, 1.2 m."""
    lines = ['name = "arm of seven joints"', "gravity = [0.0, 0.0, -9.81]"]
    for k, mass in enumerate(MASSES):
        moments = [moment * mass for moment in MOMENTS]
        parent = f"link{k - 1}" if k else "world"
        lines += [f"[bodies.link{k}]", f"mass = {mass}", f"center_of_mass = {list(CENTER)}", f"inertia = {moments}"]
        lines += [f"[joints.joint{k}]", 'type = "revolute"', f'parent = "{parent}"', f'child = "link{k}"']
        lines += [f"axis = {list(axis(k))}", f"translation = {list(offset(k))}"]
    return Model.from_toml("\n".join(lines))


def vpm_calls(q: Array, v: Array, a: Array) -> Calls:
    dynamics = Dynamics(vpm_model())
    return {
        "rnea": lambda: dynamics.inverse_dynamics(q, v, a),
        "crba": lambda: dynamics.mass_matrix(q),
        "aba": lambda: dynamics.forward_dynamics(q, v, a),
    }


def pinocchio_calls(q: Array, v: Array, a: Array) -> Calls:
    import pinocchio as pin

    model = pin.Model()
    model.gravity = pin.Motion(np.array([0.0, 0.0, -9.81]), np.zeros(3))
    parent = 0
    for k, mass in enumerate(MASSES):
        joint = pin.JointModelRZ() if k % 2 == 0 else pin.JointModelRY()
        parent = model.addJoint(parent, joint, pin.SE3(np.eye(3), np.array(offset(k))), f"joint{k}")
        xx, yy, zz, xy, xz, yz = (moment * mass for moment in MOMENTS)
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        model.appendBodyToJoint(parent, pin.Inertia(mass, np.array(CENTER), inertia), pin.SE3.Identity())
    data = model.createData()
    return {
        "rnea": lambda: pin.rnea(model, data, q, v, a),
        "crba": lambda: pin.crba(model, data, q),
        "aba": lambda: pin.aba(model, data, q, v, a),
    }


def microseconds(call: Callable[[], Array], calls: int) -> tuple[list[float], float]:
    """Wall time of one call in each repeat, and the least CPU time."""
    wall, cpu = [], []
    for _ in range(REPEATS):
        begin, busy = time.perf_counter(), time.process_time()
        for _ in range(calls // REPEATS):
            call()
        cpu.append(time.process_time() - busy)
        wall.append(time.perf_counter() - begin)
    scale = 1e6 / (calls // REPEATS)
    return [scale * each for each in wall], scale * min(cpu)


def check(ours: Calls, theirs: Calls) -> float:
    """Largest difference relative to the largest value; an error where it is above what is allowed."""
    worst = 0.0
    for name, call in ours.items():
        expected, found = np.asarray(theirs[name]()), call()
        if name == "crba":  # Pinocchio fills one triangle or both, depending on its version
            expected, found = np.triu(expected), np.triu(found)
        off = float(np.abs(found - expected).max() / np.abs(expected).max())
        worst = max(worst, off)
        if not off <= AGREEMENT:
            raise SystemExit(f"{name} differs from Pinocchio by {off:.1e} of its largest value, allowed {AGREEMENT:g}")
    return worst


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--calls", type=int, default=30_000)
    parser.add_argument("--markdown", type=Path, help="write the section of the performance page here")
    options = parser.parse_args()
    random = np.random.default_rng(7)
    state = tuple(random.uniform(-1.0, 1.0, 7) for _ in range(3))
    engines, note = {"vpm": vpm_calls(*state)}, "Pinocchio is not installed, so nothing was compared."
    if find_spec("pinocchio"):
        engines["Pinocchio"] = pinocchio_calls(*state)
        note = f"Values agree to {check(engines['vpm'], engines['Pinocchio']):.0e} of the largest."
    lines, least = [], {}
    for name in ("rnea", "crba", "aba"):
        for engine, calls in engines.items():
            wall, cpu = microseconds(calls[name], options.calls)
            least[engine] = cpu
            ratio = f"{cpu / least['vpm']:.2f}" if engine != "vpm" else ""
            spread = f"{statistics.median(wall):.2f}, {max(wall) - min(wall):.2f}"
            lines.append((name, engine, f"{min(wall):.2f}", spread, f"{cpu:.2f}", ratio))
    text = f"{markdown.table(('call', 'engine', 'wall, us', 'median, spread', 'CPU, us', 'ratio'), lines)}\n\n{note}\n"
    print(text)
    if options.markdown:
        options.markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
