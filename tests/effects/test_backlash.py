"""Backlash between motor and load, found along the motion of the motor alone; the machine is written out here."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vpm import Experiment, Model, diagnose, simulate
from vpm.catalogue import EFFECTS
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.screening.candidates import Candidate
from vpm.ranking.judgement import Judgement
from vpm.ranking.ranking_search import Search
from vpm.ranking.settings import Settings

GAP, MASS, ROTOR, VISCOUS = 4e-4, 12.0, 3.0, 30.0
STIFFNESS, DAMPING = 1.5e6, 900.0
#: Contacts in which the link sways at 14 Hz, a fifth of critically damped, and the gap between these.
TEXT = f"""name = "axis"
gravity = [0.0, 0.0, -9.81]

[bodies.body]
mass = {{ value = {MASS * 1.05}, uncertainty = {MASS * 0.1}, unit = "kg" }}

[joints.axis]
type = "prismatic"
parent = "world"
child = "body"
axis = [1.0, 0.0, 0.0]
rotor_inertia = {ROTOR}

[actuators.drive]
joint = "axis"
gain = {{ value = 1.0, unit = "N/N" }}
command_unit = "N"

[[effects]]
type = "viscous_friction"
at = "axis"
viscous = {{ value = {VISCOUS * 0.95}, uncertainty = {VISCOUS * 0.1}, unit = "N s/m" }}
"""


def record(
    gap: float, seed: int, seconds: float = 6.0, stiffness: float = STIFFNESS, damping: float = DAMPING
) -> Experiment:
    """A motor of which the link behind hangs in two contacts, pushed about by a position loop, at 1 kHz."""
    random = np.random.default_rng(seed)
    fine, step = 20, 5e-5
    time = 1e-3 * np.arange(round(seconds / 1e-3))
    phases = random.uniform(0.0, 6.28, 3)
    rates = 2.0 * np.pi * np.array([0.5, 1.1, 2.3])
    path = (np.array([[0.08], [0.03], [0.01]]) * np.sin(rates[:, None] * time + phases[:, None])).sum(0)
    path = (path - path[0]) * np.clip(time, 0.0, 1.0) ** 2
    q = v = link = rate = 0.0
    readings, commands, last = np.zeros(time.size), np.zeros(time.size), 0.0
    for k in range(time.size):
        readings[k] = 1e-6 * round((q + 3e-7 * random.standard_normal()) / 1e-6)
        speed, last = (readings[k] - last) / 1e-3, readings[k]
        effort = commands[k] = 800.0 * (10.0 * (path[k] - readings[k]) - speed)
        for _ in range(fine):
            twist = q - link
            beyond = twist - min(max(twist, -0.5 * gap), 0.5 * gap)
            push = stiffness * beyond + damping * (v - rate) if beyond else 0.0
            push = push if push * beyond > 0.0 else 0.0
            v += step * (effort - VISCOUS * v - push) / ROTOR
            rate += step * push / MASS
            q, link = q + step * v, link + step * rate
    data = {"axis.position": readings, "drive.command": commands}
    return Experiment.from_arrays(time, data, units={"axis.position": "m", "drive.command": "N"}, name=f"log {seed}")


@pytest.fixture(scope="module")
def loose() -> tuple[Experiment, ...]:
    """Two records of a machine with play."""
    return record(GAP, 1), record(GAP, 2)


@pytest.mark.nightly
def test_play_is_named_and_none_is_seen_where_there_is_none(loose: tuple[Experiment, ...]) -> None:
    model = Model.from_toml(TEXT)
    effects = ["backlash", "joint_compliance", "input_delay", "coulomb_friction"]
    why = diagnose(model, loose[:1], loose[1:], effects=effects)
    assert [(effect.name, effect.site) for effect in why.effects][:1] == [("backlash", "axis")]
    gap = next(p for p in why.effects[0].parameters if p.name == "gap")
    assert gap.value == pytest.approx(GAP, rel=0.15)
    tight = record(1e-9, 1), record(1e-9, 2)
    assert "backlash" not in {effect.name for effect in diagnose(model, tight[:1], tight[1:], effects=effects).effects}


def test_a_backlash_without_a_gap_is_the_compliance_that_it_contains() -> None:
    """Contacts that meet in one point make a straight line, over whatever way they close."""
    bare, damping = Model.from_toml(TEXT), (300.0, 600.0)
    spring = bare.with_effect("joint_compliance", "axis", stiffness=2e5, damping=sum(damping), inertia=1.0)
    contacts = dict(zip(("damping", "contact_damping"), damping, strict=True))
    play = bare.with_effect("backlash", "axis", stiffness=2e5, gap=0.0, width=1e-4, inertia=1.0, **contacts)
    time = 1e-3 * np.arange(500)
    force = {"drive.command": 500.0 * np.sin(60.0 * time)}
    pushed = Experiment.from_arrays(time, force, units={"drive.command": "N"}, name="push")
    ways = [simulate(one, pushed, integrator="rk4")["axis_deflection.position"] for one in (spring, play)]
    assert np.max(np.abs(ways[0])) > 1e-4
    assert ways[1] == pytest.approx(ways[0], abs=1e-12)
    assert "joint_compliance" in EFFECTS["backlash"].contains


@pytest.mark.parametrize(("gap", "apart"), [(GAP, False), (0.02, True)])
def test_a_gap_whose_contacts_never_meet_is_no_backlash(loose: tuple[Experiment, ...], gap: float, apart: bool) -> None:
    """In the middle of the gap roundings pass on ``stiffness width^2 / (1/2 gap^2)``: as much as the contacts here."""
    width = 0.05 * gap
    stiffness = STIFFNESS * (0.5 * gap**2 / width**2 if apart else 1.0)
    start = {"gap": gap, "width": width, "stiffness": stiffness, "damping": 1.0, "contact_damping": DAMPING}
    model = Model.from_toml(TEXT)
    search = Search(model, loose[:1], ["backlash"], Settings(), None, ParallelCandidates(1, None), lambda _: None)
    candidate = Candidate(EFFECTS["backlash"], "axis", (start,))
    structure = search.extensions.extended(search.start, candidate, start, "motor")
    trial: Any = SimpleNamespace(key=("backlash", "axis"), fitted=SimpleNamespace(structure=structure))
    assert search._stays_apart(trial) == apart
    judged = Judgement(1.0, 1.0, np.inf, 1.0, 1.0, 1.0, apart=apart)
    assert judged.counts(Settings()) != apart
