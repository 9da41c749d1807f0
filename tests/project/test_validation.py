"""Every row of the validation table is within its tolerance, and the page in the documents has every row."""

from __future__ import annotations

import pytest

from validation import table

#: Fits that `test_identify_examples` makes anyway, so that their rows are tested there.
FITTED = "Parameters of the examples from noisy logs"


@pytest.mark.parametrize("part", [part for part in table.PARTS if part != FITTED])
def test_every_row_is_within_its_tolerance(part: str) -> None:
    assert table.wrong(part) == []
