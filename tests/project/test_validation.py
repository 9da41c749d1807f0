"""Every row of the validation table is within its tolerance, and the documents have every row."""

import pytest

from validation import table

#: Fits that `test_identify_examples` makes anyway, so that their rows are tested there.
FITTED = "Parameters of the examples from noisy logs"


@pytest.mark.parametrize("part", [part for part in table.PARTS if part != FITTED])
def test_every_row_is_within_its_tolerance(part: str) -> None:
    assert table.wrong(part) == []


def test_the_page_sums_up_every_part_of_the_table() -> None:
    text = table.PAGE.read_text(encoding="utf-8")
    assert list(dict.fromkeys(line["part"] for line in table.written())) == list(table.ALL)
    for part, against in ((title, each.against) for title, each in table.ALL.items()):
        count = sum(int(line["values"]) for line in table.written() if line["part"] == part)
        assert f"- **{part}**, {count}: {against}; " in text, "run make validation"
