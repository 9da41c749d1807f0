"""The leg of HyQ: strokes and lever arms, torques by three derivations, shares of dynamics in the effort.

python examples/hyq_leg/run.py [FOLDER]
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from vpm import linkages

HERE = Path(__file__).resolve().parent


def main(folder: Path) -> None:
    leg = linkages.load(HERE / "leg.toml")
    folder.mkdir(parents=True, exist_ok=True)

    table = leg.stroke_table()
    print(table)
    save(table, folder / "strokes.png")

    q, v, a = np.radians([20.0, -80.0]), [2.0, -3.0], [4.0, -5.0]
    for derivation in ("virtual_work", "lagrange", "newton_euler"):
        print(f"torques by {derivation}: {leg.torques(q, v, a, derivation)} N m")
    reactions = leg.reactions(q, v, a)
    print(f"cylinder forces {reactions.cylinder_forces[0].round(2)} N, ground {reactions.ground[0]:.2f} N")

    # With the shank that meets the published averages.
    p = leg.parameters
    published = linkages.Leg(replace(p, lower=replace(p.lower, length=0.375)), "HyQ leg, shank 0.375 m")
    for duty in ("low", "medium", "high"):
        shares = published.shares(duty)
        print(f"{duty} dynamics: mu_M, mu_V, mu_G = {(100.0 * shares.mean).round(2)} %")
        fine = published.shares(
            duty, first=np.radians(np.arange(-40.0, 60.5, 2.5)), second=np.radians(np.arange(-140.0, -19.5, 2.5))
        )
        save(fine, folder / f"shares_{duty}.png")


def save(result: linkages.LegStrokes | linkages.ShareMap, path: Path) -> None:
    result.plot().savefig(path)
    print(f"wrote {path}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("hyq-leg-plots"), help="where the pictures go")
    main(parser.parse_args().folder)
