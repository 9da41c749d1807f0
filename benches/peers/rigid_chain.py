"""Time of one call from Python on a rigid arm of seven joints, beside Pinocchio's bindings, with a check of values.

    python benches/peers/rigid_chain.py [--calls 30000] [--markdown FILE]

Inverse dynamics (rnea), mass matrix (crba) and forward dynamics (aba), each on prepared buffers and ready arrays, as a
controller written in Python calls them; and efforts along a whole record in one call, beside a loop in Pinocchio's C++.
Pinocchio takes part where it is installed: pip install "vpm-dynamics[peers]".
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "peers")]

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
#: Samples of a record, and passes over it of which the fastest counts.
RECORD, PASSES = 100_000, 7
LOOP = ROOT / "benches" / "peers" / "pinocchio_chain.cpp"
#: What Pinocchio's headers ask of the compiler and of Boost.
FLAGS = (
    *("-std=c++17", "-O3", "-march=native", "-DNDEBUG", "-w"),
    *(
        "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
        "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
        "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
    ),
)


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


def compiled(folder: Path) -> Path | None:
    """The loop in C++, where there are a compiler and the headers of Pinocchio and Eigen."""
    prefix = next((Path(path) / "cmeel.prefix" for path in sys.path if (Path(path) / "cmeel.prefix").is_dir()), None)
    compiler = shutil.which("c++")
    if prefix is None or compiler is None or not (prefix / "include" / "eigen3").is_dir():
        return None
    includes = [f"-I{prefix}/include", f"-I{prefix}/include/eigen3"]
    links = [f"-L{prefix}/lib", "-lpinocchio_default", f"-Wl,-rpath,{prefix}/lib"]
    target = folder / "pinocchio_chain"
    subprocess.run([compiler, *FLAGS, *includes, str(LOOP), *links, "-o", str(target)], check=True)  # noqa: S603
    return target


def record_sentence(random: np.random.Generator) -> str:
    """Time of a sample where efforts along a record are asked for in one call, on one core."""
    model, states = vpm_model(), random.uniform(-1.0, 1.0, (3, RECORD, len(MASSES)))
    times = []
    for _ in range(PASSES):
        begin = time.process_time()
        efforts, _ = model.core.required(model.theta, *states, 1e-3)
        times.append(time.process_time() - begin)
    own = 1e6 * min(times) / RECORD
    told = f"Efforts along a record of {RECORD:,} samples in one call: vpm {own:.3f} us of CPU time per sample"
    with TemporaryDirectory() as folder:
        loop = compiled(Path(folder))
        if loop is None:
            return f"{told}; a compiler, Pinocchio or the headers of Eigen (cmeel-eigen) are missing for a loop in C++."
        lines = [f"{len(MASSES)} {RECORD} {PASSES}"]
        for k, mass in enumerate(MASSES):
            numbers = (mass, *CENTER, *(moment * mass for moment in MOMENTS), *offset(k), 1 + axis(k)[2])
            lines.append(" ".join(repr(float(number)) for number in numbers))
        lines += [" ".join(map(repr, row.tolist())) for rows in states.transpose(1, 0, 2) for row in rows]
        done = subprocess.run([str(loop)], input="\n".join(lines), capture_output=True, text=True, check=True)  # noqa: S603
    seconds, total = map(float, done.stdout.split())
    off = abs(total - float(efforts.sum())) / float(np.abs(efforts).sum())
    if not off <= AGREEMENT:
        raise SystemExit(
            f"efforts along a record differ from Pinocchio by {off:.1e} in their sum, allowed {AGREEMENT:g}"
        )
    theirs = 1e6 * seconds / RECORD
    return f"{told}, Pinocchio's `rnea` in a loop of C++ {theirs:.3f} us: {theirs / own:.1f} times as long."


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
    lines = []
    for name in ("rnea", "crba", "aba"):
        found = {engine: microseconds(calls[name], options.calls) for engine, calls in engines.items()}
        told = [
            f"{engine} {min(wall):.2f} us (median {statistics.median(wall):.2f})" for engine, (wall, _) in found.items()
        ]
        ratios = [f"ratio {cpu / found['vpm'][1]:.2f}" for engine, (_, cpu) in found.items() if engine != "vpm"]
        lines.append(f"- {name}: {', '.join(told + ratios)}")
    text = "\n".join(lines) + f"\n\n{note}\n\n{record_sentence(random)}\n"
    print(text)
    if options.markdown:
        options.markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
