"""Every row of the validation table is within its tolerance, and the page in the documents has every row."""

from __future__ import annotations

import pytest

from validation.table import PAGE, PARTS


@pytest.mark.parametrize("part", PARTS)
def test_every_row_is_within_its_tolerance(part: str) -> None:
    rows = PARTS[part]()
    assert rows
    off = [f"{row.name}: {row.error:.3g} times what is allowed" for row in rows if not row.error <= 1.0]
    assert off == []
    text = PAGE.read_text(encoding="utf-8")
    assert [row.name for row in rows if f"| {row.name}" not in text] == [], "run make validation"
