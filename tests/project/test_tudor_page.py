"""The page of TUDOR quotes what its script prints."""

import re
import sys
from importlib import import_module

import numpy as np
import pytest

from places import EXAMPLES, ROOT
from vpm.model import Model

PAGE = ROOT / "docs" / "tudor.md"
NUMBER = re.compile(r"[+-]?\d+\.\d+")


@pytest.mark.nightly
def test_the_page_quotes_the_search_for_table_3_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES / "tudor"))
    table = import_module("table")
    try:
        table.main(Model.load(EXAMPLES / "tudor" / "tudor.toml"))
    finally:
        sys.modules.pop("table")
    printed = capsys.readouterr().out.splitlines()
    quoted = next(block for block in PAGE.read_text(encoding="utf-8").split("```") if printed[0] in block)
    lines = [line for line in quoted.splitlines() if line.strip() and line.strip() != "text"]
    assert len(lines) == len(printed)
    # The last search ends anywhere among swings that do equally well: its strains are told, its swing is one of many.
    for one, other in zip(printed[:-2], lines[:-2], strict=True):
        assert NUMBER.sub("", one).split() == NUMBER.sub("", other).split()
        found, shown = (np.array(NUMBER.findall(line), dtype=float) for line in (one, other))
        np.testing.assert_allclose(found, shown, rtol=2e-3, atol=0.15)
