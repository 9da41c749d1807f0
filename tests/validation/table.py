"""The whole table, and the page that sums it up."""

import csv
import io
import json
import subprocess
from collections.abc import Callable, Mapping
from typing import NamedTuple

from places import ROOT
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

PAGE = ROOT / "docs" / "validation.md"
TABLE = PAGE.with_suffix(".csv")


class Part(NamedTuple):
    """What makes the rows of a part, and what they stand beside."""

    make: Callable[[], list[Row]]
    against: str


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


#: The parts that Python can make, by their titles.
PARTS = {
    "KARL, a limb on two strokes": Part(linkages.karl, "published strokes and counts; other code"),
    "The leg of HyQ": Part(linkages.leg, "published shares; three derivations; other code"),
    "Masses and inertias by least squares": Part(inertial.reference, "published masses; regrouping by hand"),
    "A hydraulic servo-cylinder": Part(hydraulics.rig, "closed forms; Radau method at 1e-10"),
    "Oil and valve of a cylinder by least squares": Part(oil.least_squares, "closed forms; LSODA at 1e-10"),
    "A Maxwell element from records": Part(maxwell_narx.rows, "closed form of its equation"),
    "The HyL leg stands and falls": Part(hyl.reference, "closed forms; other code"),
    "The HyL leg beside a solution without vpm": Part(hyl.witnessed, "Kane's equations, DOP853 at 1e-10"),
    "Stiffness and damping from loops and landings": Part(impedance.rows, "closed forms; DOP853 at 1e-11"),
    "Vibrations of beams": Part(beams.frequencies, "frequency equations; converged series"),
    "Beams at rest": Part(beams.statics, "elliptic integrals; closed forms; converged series"),
    "A two-link arm about its rest": Part(beams.two_links, "converged series"),
    "Spinning up a flexible arm": Part(motions.spinning, "two codes, converged; closed form"),
    "A soft pendulum falls": Part(motions.falling, "two codes, converged; conservation of energy"),
    "A two-link arm in motion": Part(motions.two_links, "converged series, 240 samples"),
    "TUDOR at rest": Part(tudor.static, "closed forms; other code"),
    "TUDOR in motion": Part(tudor.dynamic, "other code"),
    "TUDOR, the published table": Part(tudor.published, "published strains; a factor and a swing sought for them"),
    "A carton and a fingertip": Part(studies.printed, "published constants and means"),
    "A panel that bends, a curved bar and a ball on a layer": Part(studies.solved, "elastica; Golovin; Dimitriadis"),
    "Parameters of the examples from noisy logs": Part(identification.recovered, "truth, within three deviations"),
}
#: All parts of the page.
ALL = PARTS | {
    "Derivations, conservation and convergence in the core": Part(
        core_rows, "Lagrange's equations; differences; conservation; orders of methods; closed forms"
    )
}


def wrong(part: str) -> list[str]:
    """Rows of a part that are off by more than is allowed, or do not stand in the table as it is written."""
    rows = PARTS[part].make()
    if not rows:
        return [f"{part}: no row"]
    off = [f"{each.name}: {each.error:.3g} times what is allowed" for each in rows if not each.error <= 1.0]
    lines = {line["what"] for line in written() if line["part"] == part}
    changed = lines.symmetric_difference(each.name for each in rows)
    return off + [f"{name} is in the table or among the rows alone: run make validation" for name in sorted(changed)]


def written() -> list[dict[str, str]]:
    """The table as it is written."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


_HEAD = """# Validation

With this page you can look up how far vpm is from numbers that it did not make: closed forms, published values and
converged solutions of other codes. `make validation` computes all of them and writes the page.
[validation.csv](validation.csv) has every quantity with its unit, tolerance and source. Each one is a test
(`tests/project/test_validation.py`; the last part in `crates/vpm-core/tests/all/validation`).

Each line has a part with the number of its values, what they stand beside, and the quantity that comes nearest to its
tolerance: its difference of the one allowed, absolute or relative (*rel.*) to the reference. Sections, equations and
tables are those of M. D'Imperio's PhD thesis (2016).
"""
#: Reference values that no row can stand for, each with the reason.
_UNCOMPUTED = {
    "`tudor.merit.static_fit`, `.first_mode`, `.scale`": "the public record is not part of the repository; "
    "`tests/beams/test_merit.py` compares them where it is at hand",
    "`narx.reported.sigma`": "the record is not public",
    "`ident.table5_2.stiffness`": "measured on the leg, 2.2 and 2.6 times as stiff at twice the gain; `P / l^2` of a "
    "controller is twice (`ident.stiffness_from_gain`)",
    "`ident.table5_3.Kv_hip`, `.beta_hip`": "the records are not public; where the truth is known see "
    "`oil.compliance`, `oil.flow_gain`",
}

_PUBLISHED = """
## Published values

"""
_WITHOUT = """
## Reference values that are not compared

"""


def page(rows: Mapping[str, list[Row]]) -> str:
    """Text of the page."""
    lines = [_HEAD, "\n"]
    for title, each in rows.items():
        worst, count = max(each, key=lambda one: one.error), sum(one.found.size for one in each)
        nearest = f"`{worst.name}`, {worst.difference} of {worst.allowed}"
        lines.append(f"- **{title}**, {count}: {ALL[title].against}; {nearest}\n")
    lines.append(_PUBLISHED)
    for found in (one for each in rows.values() for one in each if one.source.startswith("published")):
        where = found.source.removeprefix("published: ").partition(";")[0]
        reference = found.reference if found.unit == "1" else f"{found.reference} {found.unit}"
        lines.append(f"- `{found.name}`: {found.shown}, published {reference}, allowed {found.allowed} ({where})\n")
    return "".join([*lines, _WITHOUT, *(f"- {what}: {why}\n" for what, why in _UNCOMPUTED.items())])


def table(rows: Mapping[str, list[Row]]) -> str:
    """All quantities as comma-separated values; of a list the number that is nearest to its tolerance."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("part", "what", "values", "vpm", "reference", "unit", "difference", "allowed", "source"))
    for title, each in rows.items():
        writer.writerows(
            (title, r.name, r.found.size, r.shown, r.reference, r.unit, r.difference, r.allowed, r.source) for r in each
        )
    return text.getvalue()
