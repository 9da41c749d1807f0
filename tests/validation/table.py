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
codes. Every row is a test (`tests/project/test_validation.py`, those of the last part
`crates/vpm-core/tests/all/validation`); `make validation` computes all of them anew and writes this page. A row that
stands for several numbers shows the one that comes nearest to its tolerance.
"""

#: Reference values that no row can stand for, each with the reason.
_UNCOMPUTED = {
    "`tudor.merit.static_fit`, `.first_mode`, `.scale`": "of a public record that is not part of the repository; "
    "`tests/beams/test_merit.py` compares them where it is at hand",
    "`narx.reported.sigma`": "of a record that nobody else has",
    "`ident.table5_2.stiffness`": "measured on the leg, and 2.2 and 2.6 times as stiff at twice the gain; a "
    "controller's `P / l^2` is twice, see `ident.stiffness_from_gain`",
    "`ident.table5_3.Kv_hip`, `.beta_hip`": "of records that nobody else has; what such a regression finds where the "
    "truth is known: `oil.compliance`, `oil.flow_gain`",
}

_COLUMNS = (
    "| what | vpm | reference | unit | difference | allowed | source |\n| --- | --- | --- | --- | --- | --- | --- |\n"
)


def wrong(part: str) -> list[str]:
    """Rows of a part that are off by more than is allowed, or stand on no page."""
    rows, text = PARTS[part](), PAGE.read_text(encoding="utf-8")
    if not rows:
        return [f"{part}: no row"]
    off = [f"{each.name}: {each.error:.3g} times what is allowed" for each in rows if not each.error <= 1.0]
    missing = [each.name for each in rows if f"| {each.name}" not in text]
    return off + [f"{name} stands on no page: run make validation" for name in missing]


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
    reasons = "\n".join(f"| {what} | {why} |" for what, why in _UNCOMPUTED.items())
    parts.append(f"## Reference values without a row\n\n| what | why |\n| --- | --- |\n{reasons}\n")
    return "\n".join(parts)
