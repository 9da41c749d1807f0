"""What derivatives of a ranking cost beside a pass without, for three machines as they are and with a gear that gives.

    python benches/diagnosis/tangents.py --samples 800

Times are of the processor, of passes that come again. Passes are those that screen effects; exact derivatives are those
of the steps of a fit. The gap is the largest between both, as a share of the largest derivative of its channel, all by
numbers of the size that parameters have.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "peers"), str(ROOT / "tests")]

from blind import make_case  # noqa: E402
from markdown import table  # noqa: E402
from second_suite.cases import NONE  # noqa: E402
from second_suite.cases import make_case as make_other  # noqa: E402
from vpm import Experiment, Model  # noqa: E402
from vpm.ranking.settings import Settings  # noqa: E402
from vpm.ranking.tracked_records import TrackedRecords, Tracker  # noqa: E402

Array = NDArray[np.float64]
BAND, SEED, COUNTS = 10.0, 9571, (3, 6, 16)


def machines(samples: int) -> Iterator[tuple[str, Model, Experiment]]:
    arm = make_other("arm", NONE, SEED)
    arm = replace(arm, document={**arm.document, "effects": []})
    for name, case in (
        ("six-axis arm", arm),
        *((name, make_case(name, "coulomb_friction", SEED)) for name in ("hydraulic_leg", "flexible_arm")),
    ):
        model, log = case.model(), case.train[0]
        first = Experiment.from_arrays(
            log.time[:samples], {channel: log[channel][:samples] for channel in log.channels}, model=model
        )
        yield name, model, first
        gives = model.with_effect("joint_compliance", model.joints[0], stiffness=1e4, damping=10.0)
        yield f"{name}, a gear gives", gives, first


def timed(
    tracked: TrackedRecords, model: Model, tracker: Tracker, columns: list[int], moves: Array | None = None
) -> tuple[float, Array]:
    """Milliseconds of a pass that comes again, and its derivatives."""
    tracked.follow(model, model.theta, tracker, columns, moves)
    begin = process_time()
    _, slopes = tracked.follow(model, model.theta, tracker, columns, moves)
    return 1e3 * (process_time() - begin), slopes


def main() -> None:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=800)
    rows = []
    for name, model, log in machines(parser.parse_args().samples):
        tracked, tracker = TrackedRecords(model, [log], Settings()), Tracker(BAND)
        plain, _ = timed(tracked, model, tracker.coarse, [])
        nonzero = [int(place) for place in np.flatnonzero(model.theta)]
        for columns in (nonzero[:count] for count in COUNTS):
            moves = 1e-6 * np.abs(model.theta[columns])
            screened, slopes = timed(tracked, model, tracker.coarse, columns, moves)
            exact, true = timed(tracked, model, tracker.coarse, columns)
            off, true = (slopes - true) * moves, true * moves
            sizes = np.maximum(np.abs(true).max(axis=(0, 2)), 1e-300)
            gap = float((np.abs(off).max(axis=(0, 2)) / sizes).max())
            times = [f"{time:.1f}" for time in (plain, exact, screened)]
            rows.append([name, str(len(columns)), *times, f"{exact / screened:.1f}", f"{gap:.0e}"])
    print(table(["machine", "derivatives", "without, ms", "exact, ms", "screening, ms", "ratio", "gap"], rows))


if __name__ == "__main__":
    main()
