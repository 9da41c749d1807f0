"""Every row of the validation table is within its tolerance, and the table in the documents has every row."""

from __future__ import annotations

import csv

import pytest

from validation.table import ALL, PAGE, PARTS, TABLE


@pytest.mark.parametrize("part", PARTS)
def test_every_row_is_within_its_tolerance(part: str) -> None:
    rows = PARTS[part].make()
    assert rows
    off = [f"{row.name}: {row.error:.3g} times what is allowed" for row in rows if not row.error <= 1.0]
    assert off == []
    assert sorted(row.name for row in rows) == sorted(line["what"] for line in written() if line["part"] == part), (
        "run make validation"
    )


def written() -> list[dict[str, str]]:
    with TABLE.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_page_sums_up_every_part_of_the_table() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert list(dict.fromkeys(line["part"] for line in written())) == list(ALL)
    for part, against in ((title, each.against) for title, each in ALL.items()):
        count = sum(int(line["values"]) for line in written() if line["part"] == part)
        assert f"| {part} | {count} | {against} |" in text, "run make validation"
