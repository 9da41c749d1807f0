"""References of four motions of the hydraulic leg as logs, for `vpm simplify`: squat, sway, bounce, pace.

python examples/hyl/references.py [FOLDER]

The leg stands, its foot on the ground, and both joints go up and down by some degrees; what the logs hold beside the
references is where the joints are in the full model, and the pressures, which stands still before.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import vpm

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
STEP, DURATION = 1e-3, 1.2
#: Time to sink into the pose, s.
SETTLE = 2.0
#: The pose that is asked for, deg; the middle of all motions.
HIP, KNEE = 40.0, -80.0
#: Amplitudes of hip and knee in degrees, frequencies in Hz: those of the last are between the others'.
MOTIONS = {
    "squat": ((6.0, 1.0), (12.0, 1.0)),
    "sway": ((6.0, 2.4), (4.0, 1.3)),
    "bounce": ((3.0, 3.0), (6.0, 3.0)),
    "pace": ((5.0, 1.7), (9.0, 1.7)),
}
PRESSURES = tuple(f"{drive}.pressure_{side}" for drive in ("hip_drive", "knee_drive") for side in "ab")
#: Digits after the point: of positions in rad and m, of pressures in Pa.
DIGITS, WHOLE = 8, 0


def references(name: str) -> dict[str, Array]:
    """References of hip and knee, rad; what is added to the pose begins and ends smoothly."""
    time = STEP * np.arange(round(DURATION / STEP) + 1)
    swell = np.minimum(1.0, time / 0.2) ** 2
    found = {}
    for drive, middle, sign, (size, frequency) in zip(
        ("hip_drive", "knee_drive"), (HIP, KNEE), (1.0, -1.0), MOTIONS[name], strict=True
    ):
        wave = swell * (1.0 - np.cos(2.0 * np.pi * frequency * time)) / 2.0
        found[f"{drive}.reference"] = np.deg2rad(middle + sign * size * wave)
    return found


def standing(model: vpm.Model) -> dict[str, float]:
    """Positions of the joints and pressures once the leg has sunk into its pose."""
    time = STEP * np.arange(round(SETTLE / STEP))
    positions = {
        "slider.position": 0.5293,
        "hip_rotation.position": np.deg2rad(HIP),
        "knee_rotation.position": np.deg2rad(KNEE),
    }
    held = {"hip_drive.reference": np.deg2rad(HIP), "knee_drive.reference": np.deg2rad(KNEE), "hand.command": 0.0}
    columns = {channel: np.full(time.size, value) for channel, value in {**positions, **held}.items()}
    run = vpm.simulate(model, vpm.Experiment.from_arrays(time, columns, model=model), "closed_loop")
    return {channel: float(run[channel][-1]) for channel in (*positions, *PRESSURES)}


def record(model: vpm.Model, name: str) -> vpm.Experiment:
    """One motion, with the joints where the full model has them."""
    given = references(name)
    time = STEP * np.arange(len(given["hip_drive.reference"]))
    still = {channel: np.full(time.size, value) for channel, value in standing(model).items()}
    columns = {**given, "hand.command": np.zeros(time.size)}
    first = vpm.Experiment.from_arrays(time, {**columns, **still}, model=model, name=name)
    run = vpm.simulate(model, first, "closed_loop")
    return vpm.Experiment.from_arrays(time, {**columns, **{each: run[each] for each in still}}, model=model, name=name)


def main(folder: Path) -> None:
    """Write the logs."""
    folder.mkdir(parents=True, exist_ok=True)
    model = vpm.Model.load(HERE / "hydraulic.toml")
    for name in MOTIONS:
        exact = record(model, name)
        values = {each: np.round(exact[each], WHOLE if each in PRESSURES else DIGITS) for each in exact.channels}
        rounded = vpm.Experiment.from_arrays(np.round(exact.time, DIGITS), values, model=model, name=name)
        print(f"wrote {rounded.to_csv(folder / f'{name}.csv')}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=HERE, help="where the logs go")
    main(parser.parse_args().folder)
