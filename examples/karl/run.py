"""KARL: what its strokes can do, and where they lose control.

python examples/karl/run.py [FOLDER]
"""

import argparse
from pathlib import Path

import numpy as np

from vpm import linkages

HERE = Path(__file__).resolve().parent


def main(folder: Path) -> None:
    karl = linkages.load(HERE / "karl.toml")
    folder.mkdir(parents=True, exist_ok=True)

    print(*karl.summary, sep="\n")

    poses = karl.direct((0.20, 0.18))
    print(f"the strokes 0.200 m and 0.180 m leave {len(poses)} configurations (deg):")
    print(np.degrees(poses.angles).round(3))
    target = karl.end_point(np.radians([20.0, 90.0]))
    print(f"the end point {target.round(4)} m can be reached in {len(karl.inverse(target))} ways")
    full = np.array([300.0, 600.0])
    print(f"full force gives the torques {karl.torques(poses.angles[0], poses.strokes[0], full).round(2)} N m")

    # The strokes between the singular ones, in the mode that the prototype is built in.
    workspace = karl.workspace(mode=0)
    print(workspace)
    for name, figure in {"workspace.png": workspace.plot(), "modes.png": poses.plot()}.items():
        figure.savefig(folder / name)
        print(f"wrote {folder / name}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("karl-plots"), help="where the pictures go")
    main(parser.parse_args().folder)
