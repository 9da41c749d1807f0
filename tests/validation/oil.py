"""Bulk modulus and gain of the valve by least squares, on records of the cylinder that were solved without vpm."""

import numpy as np

from hydraulic_reference import NO_LOAD_IN, NO_LOAD_OUT, SUPPLY, TANK
from oil_witness import BETA, FREQUENCIES, GAIN, GEOMETRY, LEAKAGE, found, seen, sum_rule_bias
from validation.row import Row, row
from vpm.studies.oil import pressures_from_force

PRESSURES = ("pressure_a", "pressure_b")
#: Stiffness of the oil in mid-stroke (N/m), closed form, and friction of the rig (N s/m).
STIFFNESS, FRICTION = 6742506.861, 700.0


def least_squares() -> list[Row]:
    """Every row of the regression."""
    bias = [sum_rule_bias(frequency)[0] for frequency in FREQUENCIES]
    source = "recomputed: pressures by 5.41 as printed, sine of 0.8 mA at 0.6, 1.2, 1.8 Hz, without noise"
    rows = [row("hyd.sum_rule_bias_Kv", bias, [-0.21, -0.149, -0.132], "1", source, absolute=0.02), _rule()]
    source = "simulated with; solved without vpm (LSODA, 1e-10), 1 kHz, without noise"
    fits = [found(seen(frequency), *PRESSURES, extra=("leakage",)) for frequency in FREQUENCIES]
    for name, truth, unit in (
        ("compliance", 1.0 / BETA, "1/Pa"),
        ("flow_gain", GAIN, "m^3/(s A sqrt(Pa))"),
        ("leakage", LEAKAGE, "m^3/(s Pa)"),
    ):
        rows.append(row(f"oil.{name}", [fit[name] for fit in fits], np.full(3, truth), unit, source, relative=1e-4))
    return [*rows, _late()]


def _rule() -> Row:
    """Pressures without load by the corrected rule, out and in."""
    ports = np.full(2, SUPPLY), np.full(2, TANK)
    pressures = pressures_from_force(np.zeros(2), np.array([1.0, -1.0]), *ports, GEOMETRY)
    expected = np.transpose([NO_LOAD_OUT[:2], NO_LOAD_IN[:2]])
    return row("oil.rule_without_load", pressures, expected, "Pa", "closed form: steady motion", relative=1e-9)


def _late() -> Row:
    """What a clock that is off by 25 us adds to true by found beta: tau K/B where the force is B v."""
    log = seen(1.2)
    late = log | {"spool": np.interp(log["time"] + 25e-6, log["time"], log["spool"])}
    fits = [found(each, *PRESSURES, balance="force", extra=("leakage",)) for each in (log, late)]
    change = (fits[1]["compliance"] - fits[0]["compliance"]) * BETA
    source = "closed form: oil stiffness of mid-stroke by friction, times 25 us; mass, spring and stroke left out"
    return row("oil.late_clock", change, 25e-6 * STIFFNESS / FRICTION, "1", source, relative=0.1)
