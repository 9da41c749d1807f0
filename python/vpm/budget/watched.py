"""The program that valgrind watches: it makes steps, and imports no more than that takes."""

import sys

import numpy as np

from vpm._core import System


def make_steps(path: str, count: str) -> None:
    """Make so many steps of what a file describes."""
    with np.load(path) as file:
        System(str(file["description"])).time_steps(
            file["theta"],
            file["state"],
            file["inputs"],
            float(file["time_step"]),
            int(file["substeps"]),
            str(file["method"]),
            int(count),
            0,
            bool(file["compiled"]),
        )


if __name__ == "__main__":
    make_steps(*sys.argv[1:])
