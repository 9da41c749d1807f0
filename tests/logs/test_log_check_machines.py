"""Mistakes planted into logs of the machines of the proving ground, as `benches/log_check.py` counts them."""

import sys
from importlib import import_module
from typing import Any

import pytest

from places import ROOT

pytestmark = pytest.mark.nightly

BENCHES = ROOT / "benches"
MACHINES = ("axis_linear", "axis_rotary", "arm2r", "servo_cylinder", "hydraulic_leg", "flexible_arm")


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(sys, "path", [str(BENCHES), *sys.path])
    return import_module("log_check")


@pytest.mark.parametrize("machine", MACHINES)
def test_names_planted_mistakes_in_the_first_sentence(study: Any, machine: str) -> None:
    named, tried, _ = study.planted(machine, 9330)
    assert tried > 60
    assert named >= 0.9 * tried  # of all machines together 0.95, see docs/log_check.md


@pytest.mark.parametrize("machine", MACHINES[:4])
def test_finds_no_mistake_where_there_is_none(study: Any, machine: str) -> None:
    right, tried, _ = study.clean(machine, 9340)
    assert tried > 20
    assert right >= tried - 1
