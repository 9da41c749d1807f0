"""The whole table, and the page that shows it."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

from validation import (
    beams,
    hydraulics,
    hyl,
    identification,
    impedance,
    inertial,
    linkages,
    maxwell_narx,
    motions,
    oil,
    studies,
    tudor,
)
from validation.row import Row, row

ROOT = Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs" / "validation.md"

#: Title of each part, and what makes its rows.
PARTS: dict[str, Callable[[], list[Row]]] = {
    "KARL, a limb on two strokes": linkages.karl,
    "The leg of HyQ": linkages.leg,
    "Masses and inertias by least squares": inertial.reference,
    "A hydraulic servo-cylinder": hydraulics.rig,
    "Oil and valve of a cylinder by least squares": oil.least_squares,
    "A Maxwell element from records": maxwell_narx.rows,
    "The HyL leg stands and falls": hyl.reference,
    "The HyL leg beside a solution without vpm": hyl.witnessed,
    "Stiffness and damping from loops and landings": impedance.rows,
    "Vibrations of beams": beams.frequencies,
    "Beams at rest": beams.statics,
    "A two-link arm about its rest": beams.two_links,
    "Spinning up a flexible arm": motions.spinning,
    "A soft pendulum falls": motions.falling,
    "A two-link arm in motion": motions.two_links,
    "TUDOR at rest": tudor.static,
    "TUDOR in motion": tudor.dynamic,
    "TUDOR, the published table": tudor.published,
    "A carton and a fingertip": studies.printed,
    "A panel that bends, a curved bar and a ball on a layer": studies.solved,
    "Parameters of the examples from noisy logs": identification.recovered,
}

_HEAD = """# Validation

What vpm computes beside numbers that it did not make: closed forms, published values, converged solutions of other
codes. Every row is a test (`tests/test_validation.py`, those of the last part `crates/vpm-core/tests/all/validation`);
`make validation` computes all of them anew and writes this page. A row that stands for several numbers shows the one
that comes nearest to its tolerance.
"""

_COLUMNS = (
    "| what | vpm | reference | unit | difference | allowed | source |\n| --- | --- | --- | --- | --- | --- | --- |\n"
)


def core_rows() -> list[Row]:
    """What only the core can show, from its own program."""
    command = ["cargo", "run", "--quiet", "--release", "--package", "vpm-core", "--example", "validation"]
    lines = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
    entries = [json.loads(line) for line in lines]
    return [
        row(
            e["name"], e["found"], e["expected"], e["unit"], e["source"], absolute=e["absolute"], relative=e["relative"]
        )
        for e in entries
    ]


def page() -> str:
    """Text of the page."""
    parts = [_HEAD]
    for title, make in {**PARTS, "Derivations, conservation and convergence in the core": core_rows}.items():
        rows = make()
        parts.append(f"## {title}\n\n{_COLUMNS}" + "\n".join(each.markdown() for each in rows) + "\n")
    return "\n".join(parts)
