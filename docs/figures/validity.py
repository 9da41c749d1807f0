"""Pictures of the levels of detail: up to which slope deflections may be interpolated, and what a coordinate buys.

python docs/figures/validity.py [FOLDER]
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vpm import Model
from vpm.plot.style import label, panels, styled

HERE = Path(__file__).resolve().parent

Array = NDArray[np.float64]

#: Levels that interpolate the deflection, and the one that is exact to 1e-6 of the length (docs/validation.md).
INTERPOLATED, EXACT = ("deflection(4)", "hermite(2)", "modal(3)"), "strain(9)"

#: Counts per level, for the picture of frequencies.
COUNTS = {
    "lumped": (2, 4, 8, 12),
    "bezier": (3, 4, 5, 6, 7, 8),
    "hermite": (1, 2, 4, 6),
    "strain": (2, 3, 4, 5, 6, 7),
    "elements": (1, 2, 4, 8, 11),
}

#: (beta L)^2 of a clamped beam: cos x cosh x = -1.
ROOTS = np.square([1.875104068711961, 4.694091132974175])


def cantilever(level: str, *, line: float = 1.0, tip: float = 0.0, gravity: float = 0.0) -> Model:
    """A horizontal beam, 1 m long, with bending stiffness 1 N m^2 and a mass per length, on a lockable joint."""
    sizes = {"area": 1e-4, "moment_x": 1e-16, "moment_y": 1e-16, "torsion": 1e-16, "shear_x": 1.0, "shear_y": 1.0}
    load = {"mass": max(tip, 1e-8), "inertia": [1e-14, 1e-14, 1e-14, 0.0, 0.0, 0.0]}
    return Model.from_dict(
        {
            "name": "cantilever",
            "gravity": [0.0, 0.0, -gravity],
            "bodies": {"hub": {"mass": 1.0, "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]}, "load": load},
            "joints": {
                "spin": {"type": "revolute", "parent": "world", "child": "hub", "axis": [0.0, -1.0, 0.0]},
                "flange": {"type": "fixed", "parent": "beam", "child": "load"},
            },
            "beams": {
                "beam": {
                    "parent": "hub",
                    "rotation": [0.0, np.pi / 2.0, 0.0],
                    "length": 1.0,
                    "level": level,
                    "deforms": ["bending_y"],
                    "material": {"young": 1e16, "poisson": 0.3, "density": line / 1e-4},
                    "section": {"shape": "given", **sizes},
                }
            },
            "markers": {"tip": {"parent": "beam"}},
        }
    )


def resting(level: str, **load: float) -> tuple[Array, float]:
    """Place of the tip (m) at rest, and the largest slope of the axis (rad)."""
    model = cantilever(level, **load)
    coordinates, _ = model.equilibrium([0.0])
    states = np.concatenate([coordinates, np.zeros_like(coordinates)])[None, :]
    return tips(model, states[:1])[0], float(model.core.slopes(model.theta, states)[0, 0])


def spun(level: str, seconds: float) -> tuple[Array, float]:
    """Places of the tip (m) in the frame of the hub while it is turned by 90 degrees, and the largest slope (rad)."""
    model, step = cantilever(level), 0.01
    s = np.arange(0.0, seconds, step)[:, None] / seconds
    angle = 0.5 * np.pi * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
    rate = 0.5 * np.pi * (30.0 * s**2 - 60.0 * s**3 + 30.0 * s**4) / seconds
    change = 0.5 * np.pi * (60.0 * s - 180.0 * s**2 + 120.0 * s**3) / seconds**2
    outputs, states, _ = model.core.simulate_prescribed(model.theta, angle, rate, change, step, 1, "rosenbrock", [])
    seen = dict(zip(model.output_channels, outputs.T, strict=True))
    c, s = np.cos(angle[:, 0]), np.sin(angle[:, 0])
    place = np.column_stack([c * seen["tip.x"] + s * seen["tip.z"], c * seen["tip.z"] - s * seen["tip.x"]])
    return place, float(np.nanmax(model.core.slopes(model.theta, states), initial=0.0))


def tips(model: Model, states: Array) -> Array:
    """Places of the tip in states at rest."""
    seen = model.core.simulate(model.theta, states[0], np.zeros((1, 0)), 1e-3, 1, "rosenbrock", [])[0][0]
    found = dict(zip(model.output_channels, seen, strict=True))
    return np.array([[found["tip.x"], found["tip.z"]]])


def validity(level: str, solve: Callable[[str, float], tuple[Array, float]], loads: Array) -> Array:
    """Rows of slope (rad) and largest error of the tip over its largest deflection, one for each load."""
    rows = []
    for load in loads:
        (found, slope), (exact, _) = solve(level, float(load)), solve(EXACT, float(load))
        wrong, moved = (np.linalg.norm(part, axis=-1).max() for part in (found - exact, exact - [1.0, 0.0]))
        rows.append((slope, wrong / moved))
    return np.array(rows)


CASES: dict[str, tuple[Callable[[str, float], tuple[Array, float]], Array]] = {
    "force at the tip": (lambda level, f: resting(level, line=1e-9, tip=1.0, gravity=f), np.geomspace(0.06, 1.2, 10)),
    "own weight": (lambda level, g: resting(level, gravity=g), np.geomspace(0.18, 3.6, 10)),
    "a turn by 90 degrees": (spun, np.geomspace(10.0, 2.2, 10)),
}


def frequencies(kind: str) -> Array:
    """Rows of coordinates, and relative errors of the first and the second natural frequency."""
    rows = []
    for count in COUNTS[kind]:
        model = cantilever(f"{kind}({count})")
        found = 2.0 * np.pi * model.natural_frequencies([0.0])[:2]
        if found.size == 2:
            rows.append((model.core.n_elastic, *np.abs(found / ROOTS - 1.0)))
    return np.array(rows)


@styled
def draw_validity(limit: float) -> Figure:
    """Error over slope, a panel for each load."""
    figure, axes = panels(1, 3, height=2.6, width=9.0)
    for axis, (name, (solve, loads)) in zip(axes[0], CASES.items(), strict=True):
        for level, line in zip(INTERPOLATED, ("-", "--", ":"), strict=True):
            slope, error = validity(level, solve, loads).T
            axis.loglog(slope, 100.0 * error, line, label=level)
        axis.axvline(limit, color="k", linewidth=0.8)
        axis.axhline(1.0, color="k", linewidth=0.8)
        axis.set_title(name)
        axis.set_xlabel(label("largest slope", "rad"))
        axis.set_xticks([0.03, 0.1, 0.3], ["0.03", "0.1", "0.3"])
        axis.set_xticks([], minor=True)
        axis.set_xlim(0.013, 0.8)
        axis.set_yticks([0.01, 0.1, 1.0, 10.0], ["0.01", "0.1", "1", "10"])
        axis.set_yticks([], minor=True)
        axis.set_ylim(0.01, 40.0)
    axes[0][0].set_ylabel(label("error over deflection", "%"))
    axes[0][0].legend()
    return figure


@styled
def draw_frequencies() -> Figure:
    """Error of two frequencies over the number of coordinates."""
    figure, axes = panels(1, 2, height=2.8, width=9.0, share_x=True)
    for kind, marker in zip(COUNTS, "osdv^", strict=True):
        coordinates, *both = frequencies(kind).T
        for axis, error in zip(axes[0], both, strict=True):
            axis.semilogy(coordinates, 100.0 * np.maximum(error, 1e-9), marker=marker, markersize=4, label=kind)
            axis.set_yticks([], minor=True)
    for axis, name in zip(axes[0], ("first", "second"), strict=True):
        axis.set_title(f"{name} frequency of a clamped beam")
        axis.set_xlabel("coordinates")
    axes[0][0].set_ylabel(label("error", "%"))
    axes[0][1].legend()
    return figure


def main(folder: Path) -> None:
    """Write both pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    limit = cantilever(EXACT).core.slope_limit
    for name, figure in {"validity.svg": draw_validity(limit), "levels.svg": draw_frequencies()}.items():
        # Letters as letters and no date: small files that are the same each time.
        with rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
            figure.savefig(folder / name, metadata={"Date": None, "Creator": None})
        print(f"wrote {folder / name}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
