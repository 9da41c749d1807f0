"""Numbers of a scenario file in SI units."""

from __future__ import annotations

from vpm.errors import UnitError
from vpm.scenario.messages import Keys, refuse
from vpm.scenario.schema import Given
from vpm.units import convert


def si_value(given: Given, unit: str, keys: Keys) -> float:
    """SI value of a number that should be in a unit of this kind.

    Raises
    ------
    ScenarioError
        It has a unit of another kind.
    """
    if given.unit is None:
        return given.value
    try:
        return convert(given.value, given.unit, unit)
    except UnitError as error:
        refuse(keys, f"is wrong: {error}")
