"""References of three short motions of TUDOR as logs, for `vpm simplify`: slow_fast.csv, fast_slow.csv, opposite.csv.

python examples/tudor/references.py [FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from run import HERE, fast, record, slow
from vpm.experiment import Experiment
from vpm.model import Model

DURATION = 2.0
#: Digits after the point, in rad and N m: what is lost moves the arm by less than its sensors tell.
DIGITS = 6
MOTIONS = {
    "slow_fast": (slow, fast),
    "fast_slow": (fast, slow),
    "opposite": (fast, lambda time: -fast(time)),
}


def main(folder: Path) -> None:
    """Write the logs."""
    folder.mkdir(parents=True, exist_ok=True)
    model = Model.load(HERE / "tudor.toml")
    for name, (second, third) in MOTIONS.items():
        exact = record(model, second, third, DURATION)
        values = {channel: np.round(exact[channel], DIGITS) for channel in exact.channels}
        rounded = Experiment.from_arrays(np.round(exact.time, DIGITS), values, model=model, name=name)
        print(f"wrote {rounded.to_csv(folder / f'{name}.csv')}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=HERE, help="where the logs go")
    main(parser.parse_args().folder)
