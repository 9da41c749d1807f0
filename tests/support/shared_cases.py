"""Cases of the proving ground that many tests ask for: all of a machine are made together, once for all test processes.

Side by side they take little longer than one alone, and each is what it would be alone, to the last digit: see
`test_blind_generators.test_a_case_follows_from_its_seed_alone`.
"""

import os
import pickle
from functools import cache
from pathlib import Path

from blind import Case, make_cases

#: Folder that all processes of a run of the tests share; set in `conftest`.
FOLDER = "VPM_TESTS_SHARE"

Request = tuple[str | tuple[str, ...], int]

#: What tests outside of `make test-nightly` ask for; one batch of a machine that is quick to simulate.
DAILY: dict[str, tuple[Request, ...]] = {"axis_linear": (("actuator_lag", 5), ("spring", 1))}
#: What the others ask for. Cases of one seed share most of what is simulated, and those of one sampling rate a batch.
NIGHTLY: dict[str, tuple[Request, ...]] = {
    "arm2r": (("saturation", 6001), ("sensor_offset@encoder_2", 5003)),
    "axis_linear": (
        ("bias_force", 2),
        ("friction_drift", 9),
        ("input_delay", 2),
        ("input_delay", 22),
        ("input_delay", 2003),
        ("none", 3),
        ("sensor_delay", 2003),
        ("spring", 2),
        ("stribeck_friction", 18),
        (("viscous_friction",), 159),
        ("viscous_friction", 5004),
        (("actuator_lag", "viscous_friction"), 5004),
        (("joint_compliance", "viscous_friction"), 159),
        (("spring", "viscous_friction"), 3),
    ),
    "axis_rotary": (
        ("asymmetric_friction", 5),
        ("bias_force", 2),
        ("cubic_spring", 43),
        ("end_stop", 4),
        ("input_delay", 0),
        ("joint_compliance", 1004),
        ("none", 42),
        ("parameters", 100),
        ("spring", 2),
        ("spring", 7),
        ("spring", 9),
        ("spring", 100),
        ("spring", 106),
        ("stribeck_friction", 3001),
        (("asymmetric_friction", "input_delay"), 0),
        (("asymmetric_friction", "input_delay"), 7009),
        (("dead_zone", "torque_ripple"), 102),
        (("gravity_tilt", "stribeck_friction"), 102),
        (("hysteresis", "joint_compliance"), 5002),
    ),
    "hydraulic_leg": (("none", 21), ("seal_friction@knee_drive", 21)),
    "servo_cylinder": (
        ("bias_force", 43),
        ("bias_force@axis", 42),
        ("dead_zone", 42),
        ("none", 1),
        ("seal_friction", 43),
        ("sensor_offset@encoder", 42),
        ("sensor_offset@gauge_b", 42),
    ),
}
#: Machines whose oracle would take a column for each of their many parameters, for which no test asks.
MANY_PARAMETERS = frozenset({"arm2r", "hydraulic_leg", "servo_cylinder"})


def shared_case(machine: str, hidden: str | tuple[str, ...], seed: int) -> Case:
    """A case of the lists above."""
    name = "daily" if (hidden, seed) in DAILY.get(machine, ()) else "nightly"
    return _all(machine, name)[hidden, seed]


@cache
def _all(machine: str, name: str) -> dict[Request, Case]:
    kept = Path(os.environ[FOLDER]) / f"{machine}_{name}.pickle"
    if kept.is_file():
        found: dict[Request, Case] = pickle.loads(kept.read_bytes())
        return found
    requests = (DAILY if name == "daily" else NIGHTLY)[machine]
    made = make_cases(machine, requests, recalibrate=machine not in MANY_PARAMETERS)
    cases = dict(zip(requests, made, strict=True))
    # Another process sees all of it or none.
    part = kept.with_suffix(f".{os.getpid()}")
    part.write_bytes(pickle.dumps(cases))
    part.replace(kept)
    return cases
