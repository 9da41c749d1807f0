"""About 2 000 damaged files in every test run; `make fuzz CASES=100000` takes more."""

import sys

import pytest


@pytest.mark.skipif(sys.platform != "linux", reason="needs processes with limits as Linux has them")
def test_damaged_input_is_refused_or_gives_finite_numbers() -> None:
    from fuzz.watch import watched

    found = watched(1, 2000)
    assert not found.wrong, "\n".join(f"seed {seed}: {words}" for seed, words in found.wrong.items())
    assert found.counts["refused"] > 500
    assert found.counts["accepted"] > 100
