"""Pictures of the three tests of the HyL leg, from the scenarios in `examples/hyl`, and the numbers of docs/hyl.md.

python docs/figures/hyl.py [FOLDER]
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

import vpm
from vpm.plot.style import label, panels, styled

HERE = Path(__file__).resolve().parent
HYL = HERE.parent.parent / "examples" / "hyl"

Array = NDArray[np.float64]

#: Radial stiffness of hip and knee bearing (N/m), for the study of what a soft joint changes.
STIFFNESSES = (1e6, 3e6, 1e7, 3e7, 1e8)
#: Damping of bearings, as a share of critical with the lighter of the two bodies (kg).
SHARE, LIGHTER = 0.01, {"hip": 0.885, "knee": 0.876}


def bushed(stiffness: float) -> dict[str, float]:
    """Parameters of both bearings with a radial stiffness (N/m) and 1 % of critical damping."""
    found = {}
    for joint, mass in LIGHTER.items():
        for axis in "xy":
            found[f"{joint}_bearing.stiffness.{axis}"] = stiffness
            found[f"{joint}_bearing.damping.{axis}"] = 2.0 * SHARE * np.sqrt(stiffness * mass)
    return found


def dropped(runs: list[dict[str, object]], **changes: object) -> vpm.ScenarioRun:
    """The drop of the example with other runs."""
    content = tomllib.loads((HYL / "drop.toml").read_text(encoding="utf-8"))
    content.pop("plot")
    return vpm.Scenario.from_dict({**content, "runs": runs, **changes}, folder=HYL).run()


def spectrum(run: vpm.Run, channel: str, start: float, seconds: float) -> tuple[Array, Array]:
    """Frequencies (Hz) and amplitudes of a channel from a time on, less its smooth course of 5 ms."""
    step = run.time[1] - run.time[0]
    here = (run.time >= start) & (run.time < start + seconds)
    values = run[channel][here]
    width = 2 * round(0.0025 / step) + 1
    smooth = np.convolve(np.pad(values, width // 2, mode="edge"), np.ones(width) / width, mode="valid")
    window = np.hanning(values.size)
    amplitude = np.abs(np.fft.rfft((values - smooth) * window, 8 * values.size)) * 2.0 / window.sum()
    return np.fft.rfftfreq(8 * values.size, step), amplitude


def dominant(run: vpm.Run, channel: str = "foot.normal_force") -> tuple[float, float]:
    """Frequency (Hz) above 100 Hz and amplitude of the strongest oscillation in the 40 ms after the impact."""
    start = run.time[int(run["foot.normal_force"].argmax())] + 0.002
    frequency, amplitude = spectrum(run, channel, float(start), 0.04)
    high = frequency > 100.0
    best = int(amplitude[high].argmax())
    return float(frequency[high][best]), float(amplitude[high][best])


def study() -> Iterator[tuple[str, vpm.Run]]:
    """Drops with the cylinders as springs (low gain): rigid joints, then bearings from soft to stiff."""
    runs: list[dict[str, object]] = [{"name": "rigid", "model": "rcm_springs.toml"}]
    runs += [{"name": f"{k:g} N/m", "model": "fcm_springs.toml", "set": bushed(k)} for k in STIFFNESSES]
    result = dropped(runs, duration=0.2, time_step=2e-5, references={})
    for entry in runs:
        yield str(entry["name"]), result[str(entry["name"])]


@styled
def draw_impact() -> Figure:
    """Forces of ground and knee cylinder after the impact, for rigid joints and softer and softer bearings."""
    figure, axes = panels(1, 2, height=2.8, width=9.0)
    for name, run in study():
        if name not in {"rigid", "1e+06 N/m", "1e+07 N/m", "1e+08 N/m"}:
            continue
        here = (run.time > 0.100) & (run.time < 0.125)
        for axis, channel in zip(axes[0], ("foot.normal_force", "knee_drive.force"), strict=True):
            axis.plot(1e3 * run.time[here], run[channel][here], linewidth=1.0, label=name)
    for axis, title in zip(axes[0], ("ground", "knee cylinder"), strict=True):
        axis.set_title(title)
        axis.set_xlabel(label("time", "ms"))
        axis.set_ylabel(label("force", "N"))
    axes[0][1].legend()
    return figure


def numbers() -> None:
    """Print what docs/hyl.md says."""
    for name, run in study():
        peak = int(run["foot.normal_force"].argmax())
        frequency, amplitude = dominant(run)
        print(
            f"{name}: peak {run['foot.normal_force'][peak]:.1f} N, dominant {frequency:.0f} Hz with {amplitude:.2f} N, "
            f"height at 0.15 s {np.interp(0.15, run.time, run['slider.position']):.6f} m, "
            f"knee force up to {run['knee_drive.force'].max():.1f} N"
        )


def main(folder: Path) -> None:
    """Write the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    figures = {f"hyl_{test}.svg": vpm.Scenario.load(HYL / f"{test}.toml").run().plot() for test in TESTS}
    figures["hyl_impact.svg"] = draw_impact()
    for name, figure in figures.items():
        with rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
            figure.savefig(folder / name, metadata={"Date": None, "Creator": None})
        print(f"wrote {folder / name}")
    numbers()


TESTS = ("static", "quasi_static", "drop", "hydraulic_drop")

if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
