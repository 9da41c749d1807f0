"""A solid of finite elements as a flexible link, beside the beam that it is: frequencies, and a spin-up.

python examples/reduced_link/run.py [FOLDER]
"""

import argparse
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import vpm
from vpm.reduction import Interface, box_mesh, reduce_structure, solid

HERE = Path(__file__).resolve().parent
SPINNING = HERE.parent / "spinning_beam" / "spinning_beam.toml"
FULL, SPEED = 15.0, 6.0  # s until the full speed, rad/s
SIDE = (12.0 * 2.5e-7) ** 0.25  # m, of the square with the second moment of the spinning beam


def own_bar(folder: Path) -> None:
    """The steel bar with a tool at its tip: natural frequencies of the solid and of the beam."""
    reduction = vpm.reduce(HERE / "bar.toml", modes=6)
    reduction.link.save(folder / "bar.npz")
    print(reduction)
    shutil.copy(HERE / "arm.toml", folder / "arm.toml")
    arm = vpm.Model.load(folder / "arm.toml")
    content = arm.to_dict()
    content["beams"]["bar"] = {
        **{key: content["beams"]["bar"][key] for key in ("parent", "rotation")},
        "length": 0.44,
        "level": "deflection(10)",
        "deforms": ["bending_x", "bending_y", "torsion", "shear_x", "shear_y"],
        "material": {"young": 206e9, "poisson": 0.3, "density": 7850.0},
        "section": {"shape": "rectangle", "width": 0.004, "height": 0.015},
    }
    for name, model in (("solid", arm), ("beam", vpm.Model.from_dict(content))):
        shown = ", ".join(f"{value:.5g}" for value in model.natural_frequencies([0.0])[:4])
        print(f"{name}, the hub held: {shown} Hz")


def long_arm(elements: int) -> dict[str, Any]:
    """The spinning beam of Simo and Vu-Quoc as a square solid: same length, bending stiffness and mass."""

    def ends(nodes: np.ndarray) -> tuple[Interface, ...]:
        places = {"root": 0.0, "tip": 10.0}
        return tuple(Interface(name, np.flatnonzero(np.abs(nodes[:, 2] - at) < 1e-6)) for name, at in places.items())

    mesh = box_mesh((SIDE, SIDE, 10.0), (1, 1, elements))
    # Without Poisson's ratio the clamp holds no more than that of a beam does.
    bar = solid(mesh, ends, young=5.6e10, poisson=0.0, density=1.2 / SIDE**2)
    arm = {"parent": "hub", "rotation": [0.0, 0.5 * np.pi, 0.0], "level": "reduced(8)"}
    return {**arm, "reduced": reduce_structure(bar, modes=8).link.text}


def tip(model: vpm.Model) -> tuple[np.ndarray, np.ndarray]:
    """Time (s) and deflection of the tip (m) while the hub is spun up on a prescribed way."""
    time, wave = np.arange(0.0, 22.0, 2.5e-3), 2.0 * np.pi / FULL
    start = SPEED / FULL * (0.5 * time**2 + (np.cos(wave * time) - 1.0) / wave**2)
    angle = np.where(time < FULL, start, SPEED * (time - 0.5 * FULL))
    log = vpm.Experiment.from_arrays(time, {"spin.position": angle}, units={"spin.position": "rad"}, name="spin-up")
    run = vpm.simulate(model, log, "prescribed_motion", cutoff=20.0)
    angle = np.interp(run.time, time, angle)
    return run.time, run["tip.y"] * np.cos(angle) - run["tip.x"] * np.sin(angle)


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    own_bar(folder)
    beam = vpm.Model.load(SPINNING).at("deflection(6)")
    figure = Figure(figsize=(8.0, 4.0), layout="constrained")
    axis = figure.subplots()
    when, expected = tip(beam)
    axis.plot(when, expected, label="beam, deflection(6)")
    print(f"spin-up, largest deflection of the tip: {np.abs(expected).max():.4f} m as a beam")
    for elements in (8, 16, 32):
        content = beam.to_dict()
        content["beams"]["arm"] = long_arm(elements)
        when, found = tip(vpm.Model.from_dict(content))
        axis.plot(when, found, "--", label=f"solid of {elements} bricks")
        missed = np.abs(found - expected).max()
        print(f"{elements:3d} bricks: {np.abs(found).max():.4f} m, {missed:.4f} m from the beam at most")
    axis.set(xlabel="time [s]", ylabel="deflection of the tip [m]")
    axis.legend()
    figure.savefig(folder / "spin_up.png")
    print(f"wrote {folder / 'spin_up.png'}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("reduced-link-plots"), help="where pictures go")
    main(parser.parse_args().folder)
