"""Picture of docs/oil_and_valve.md: what sampling, a late clock, air and a rippling supply do to 1/beta.

python docs/figures/oil.py [FOLDER]
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vpm.plot.style import label, panels, styled

HERE = Path(__file__).resolve().parent
BENCH = SimpleNamespace(**runpy.run_path(str(HERE.parent.parent / "examples/servo_cylinder/oil.py"), run_name="bench"))

Array = NDArray[np.float64]

#: Estimators of the first two panels.
SHOWN = {
    "as printed": "as printed: force, pa + pb = ps + pt, differences",
    "balance of the force, differences": "pressures, balance of the force, differences",
    "balance of the force, integral": "pressures, balance of the force, instruments",
    "both chambers, differences": "pressures, differences",
    "both chambers, filtered": "pressures, filtered",
    "both chambers, integral": "pressures, integral, instruments",
}
LATE = 1e-3 * np.array([-1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0])
AIR = np.array([0.0, 0.002, 0.005, 0.01, 0.02])
RIPPLE = np.array([0.0, 0.01, 0.02, 0.05, 0.1])


def of_air(extra: tuple[str, ...]) -> Array:
    """True by found beta of the best estimator against the fraction of air, 1 kHz, with noise."""
    fits = [BENCH.estimate(BENCH.measured(BENCH.Bench(air=air), 1000.0), extra=extra) for air in AIR]
    return np.array([fit["compliance"] * BENCH.BETA for fit in fits])


def of_ripple(which: str, *, known: bool) -> Array:
    """True by found beta against the ripple of the supply, 2 kHz, without noise."""
    fits = [
        BENCH.estimate(BENCH.measured(BENCH.Bench(ripple=share), 2000.0, None), which, supply=known) for share in RIPPLE
    ]
    return np.array([fit["compliance"] * BENCH.BETA for fit in fits])


def of_clock(which: str) -> Array:
    """True by found beta against the lateness of the command in the log, 2 kHz, without noise."""
    fits = [BENCH.tried(BENCH.Suspect(late=float(late)), which) for late in LATE]
    return np.array([fit["compliance"] * BENCH.BETA for fit in fits])


@styled
def draw() -> Figure:
    """Four suspects."""
    figure, axes = panels(2, 3, height=2.7, width=11.0)
    for name, which in SHOWN.items():
        rate, compliance, gain = BENCH.against_rate(which).T
        axes[0][0].semilogx(rate, compliance, marker="o", markersize=3, label=name)
        axes[0][1].semilogx(rate, 100.0 * gain, marker="o", markersize=3)
    axes[0][0].set_ylim(-2.0, 1.5)
    axes[0][0].set_title("1/beta, with noise")
    axes[0][1].set_title("K_v, with noise")
    axes[0][1].set_ylabel(label("error", "%"))
    handles, names = axes[0][0].get_legend_handles_labels()
    axes[0][2].axis("off")
    axes[0][2].legend(handles, names, loc="center left", title="estimator")
    for which, name in ((BENCH.BARE, "balance of the force, differences"), (BENCH.BEST, "both chambers, integral")):
        axes[1][0].plot(1e3 * LATE, of_clock(which), marker="o", markersize=3, label=name)
        axes[1][2].plot(100.0 * RIPPLE, of_ripple(which, known=False), marker="o", markersize=3, label=name)
    axes[1][2].plot(100.0 * RIPPLE, of_ripple(BENCH.BARE, known=True), "--", label="supply measured")
    for extra, name in ((("leakage",), "both chambers, integral"), (("leakage", "air"), "with the column of air")):
        axes[1][1].plot(100.0 * AIR, of_air(extra), marker="o", markersize=3, label=name)
    _titled(axes[1][0], "command logged late", label("late", "ms"))
    _titled(axes[1][1], "air in the oil", label("fraction", "%"))
    _titled(axes[1][2], "ripple of the supply", label("amplitude", "%"))
    for axis in (axes[0][0], axes[1][0]):
        axis.set_ylabel("true beta / found beta")
    for axis in axes[0][:2]:
        axis.set_xlabel(label("sampling rate", "Hz"))
    return figure


def _titled(axis: Axes, title: str, below: str) -> None:
    axis.set_title(title)
    axis.set_xlabel(below)
    axis.legend()


def main(folder: Path) -> None:
    """Write the picture."""
    folder.mkdir(parents=True, exist_ok=True)
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "oil.svg"}):
        draw().savefig(folder / "oil.svg", metadata={"Date": None, "Creator": None})
    print(f"wrote {folder / 'oil.svg'}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
