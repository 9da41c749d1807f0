"""A soft strip falls under its own weight: its shapes as a strobe shows them, and its energies.

python examples/flexible_pendulum/run.py [FOLDER]
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vpm

HERE = Path(__file__).resolve().parent
STEP, SECONDS, FLASH = 1e-3, 1.0, 0.1  # s


def watched(model: vpm.Model, points: int) -> vpm.Model:
    """The same strip with markers all along it, so that its shape can be seen."""
    content = model.to_dict()
    places = np.linspace(0.0, content["beams"]["strip"]["length"], points)
    content["markers"] |= {f"p{k}": {"parent": "strip", "at": float(at)} for k, at in enumerate(places)}
    return vpm.Model.from_dict(content)


def fall(model: vpm.Model, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (N, 2, points), m, and kinetic, potential and elastic energy (N, 3), J."""
    # The fourth-order integrator: nothing damps this strip, so its energy tells how good the steps are.
    sim = vpm.Simulation(model, STEP, integrator="rosenbrock", substeps=2)
    n = len(model.coordinates)
    # What the strip stores in bending is the potential energy less that of the same strip without gravity.
    free = vpm.Model.from_dict(model.to_dict() | {"gravity": [0.0, 0.0, 0.0]})
    shapes, energies = [], []
    for _ in range(round(SECONDS / STEP) + 1):
        q, v = sim.state[:n], sim.state[n : 2 * n]
        kinetic, potential = model.energy(q, v)
        elastic = free.energy(q, v)[1]
        energies.append((kinetic, potential - elastic, elastic))
        shapes.append([[sim[f"p{k}.{axis}"] for k in range(points)] for axis in "xz"])
        sim.step()
    return np.array(shapes), np.array(energies)


def main(folder: Path, points: int = 21) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    model = watched(vpm.Model.load(HERE / "flexible_pendulum.toml"), points)
    shapes, energies = fall(model, points)
    every = round(FLASH / STEP)

    print("time, s    tip x, m    tip z, m    bending energy, J")
    for k in range(0, len(shapes), every):
        print(f"{k * STEP:7.1f} {shapes[k, 0, -1]:11.4f} {shapes[k, 1, -1]:11.4f} {energies[k, 2]:14.4f}")
    drift = np.ptp(energies.sum(axis=1)) / energies[:, 0].max()
    print(f"the sum of the energies stays within {drift:.1e} of the largest kinetic energy")

    strobe, over_time = (
        Figure(figsize=(7.0, 3.9), layout="constrained"),
        Figure(figsize=(8.0, 3.5), layout="constrained"),
    )
    axis = strobe.subplots()
    for k in range(0, len(shapes), every // 2):
        axis.plot(*shapes[k], color="tab:blue", alpha=0.25 + 0.75 * k / len(shapes))
    axis.set(xlabel="x [m]", ylabel="z [m]", aspect="equal", title=f"every {1000 * FLASH / 2:.0f} ms, later is darker")

    axis = over_time.subplots()
    for name, energy in zip(("kinetic", "of the weight", "of bending"), energies.T, strict=True):
        axis.plot(STEP * np.arange(len(energy)), energy, label=name)
    axis.plot(STEP * np.arange(len(energies)), energies.sum(axis=1), "k--", label="sum")
    axis.set(xlabel="time [s]", ylabel="energy [J]")
    axis.legend()
    for name, figure in {"strobe.png": strobe, "energies.png": over_time}.items():
        figure.savefig(folder / name)
        print(f"wrote {folder / name}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("pendulum-plots"), help="where the pictures go")
    main(parser.parse_args().folder)
