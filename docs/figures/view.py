"""The picture of docs/view.md: the hydraulic leg lands."""

from pathlib import Path

import numpy as np

import vpm
from vpm.files import replacing
from vpm.view import course_of, scene_of
from vpm.view.film import draw

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    """Draw the leg when its foot pushes most."""
    run = vpm.Scenario.load(ROOT / "examples" / "hyl" / "hydraulic_drop.toml").run()["low gain"]
    model = vpm.Model.load(ROOT / "examples" / "hyl" / "hydraulic.toml")
    scene = scene_of(model, course_of(model, run))
    picture = draw(scene, int(np.argmax(run["foot.normal_force"])), size=(960, 600))
    with replacing(ROOT / "docs" / "figures" / "view.png") as beside:
        picture.savefig(beside, dpi=100)


if __name__ == "__main__":
    main()
