"""Mistakes of channel tables that are tried: units, factors of ten, signs, names, clocks."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from vpm.errors import VpmError
from vpm.expression import Quantity, read_expression
from vpm.log_check.correction import TIME, Correction, LateShaft, Pair, factor_between
from vpm.log_check.settings import Settings
from vpm.model import ChannelEntry, Model
from vpm.numbers import Array
from vpm.units import parse_unit

#: Units in which logs are often written, by the SI unit of a channel.
CUSTOMARY: Mapping[str, tuple[str, ...]] = {
    "m": ("mm", "cm", "inch"),
    "rad": ("deg", "rev"),
    "m/s": ("mm/s", "cm/s", "m/min"),
    "rad/s": ("deg/s", "rpm", "rev/s"),
    "m/s^2": ("mm/s^2", "cm/s^2", "gn"),
    "rad/s^2": ("deg/s^2", "rpm/s", "rev/s^2"),
    "N": ("kN", "kgf", "lbf"),
    "N m": ("N mm", "kN m", "kgf m"),
    "A": ("mA",),
    "V": ("mV",),
    "Pa": ("kPa", "bar", "MPa", "psi"),
    "m^3/s": ("l/min", "l/s"),
    "1": ("%",),
    "s": ("ms", "us", "ns", "min"),
}
#: Powers of ten by which counts and amplifiers are off.
DECADES = (-6, -3, -2, -1, 1, 2, 3, 6)
#: Factors that differ by less are one.
SAME = 0.02


def scales(model: Model, used: Sequence[str], units: Mapping[str, str], settings: Settings) -> Iterator[Correction]:
    """Corrections to try: wrong units, factors and signs of channels, and exchanged channels.

    - ``used``: channels that the model reads
    - ``units``: units in which the channels, and the time, were read
    """
    si = {name: model.channel_unit(name) for name in used}
    for group in _groups(model, used, si):
        if len({(si[name], units[name]) for name in group}) > 1:
            yield Correction(group, -1.0)  # all that belongs to a joint that turns the other way
            continue
        yield Correction(group, -1.0)
        for factor, unit in _factors(model, group, units[group[0]], si[group[0]]):
            if max(factor, 1.0 / factor) >= settings.smallest:
                yield from (Correction(group, sign * factor, unit=unit) for sign in (1.0, -1.0))
    for pair in combinations(used, 2):
        if si[pair[0]] == si[pair[1]]:
            yield Correction(pair, swap=True)
    for factor, unit in _in_other_units(units[TIME], "s"):
        yield Correction((TIME,), factor, unit=unit)


def delays(model: Model, used: Sequence[str], settings: Settings) -> Iterator[Correction]:
    """Corrections to try: channels stamped too late or too early; see `scales`."""
    si = {name: model.channel_unit(name) for name in used}
    for group in _groups(model, used, si):
        if len({name.rpartition(".")[2] for name in group}) == 1:
            yield from (Correction(group, delay=delay) for delay in settings.delays)


def delays_of_columns(
    table: Mapping[str, ChannelEntry], used: Sequence[str], settings: Settings
) -> Iterator[Correction]:
    """Corrections to try: one column of a value over several that is stamped late; see `delays`.

    Its others have to be channels by themselves: then the record tells how the value would be.

    - ``table``: channel table by which the record was read
    """
    for channel in used:
        entry = table.get(channel)
        for late in () if entry is None else entry.columns:
            beside = _told_apart(table, channel, late, used)
            if beside:
                found = Correction((channel,), column=late, beside=beside)
                yield from (replace(found, delay=delay) for delay in settings.delays)


def delays_of_shafts(
    model: Model, table: Mapping[str, ChannelEntry], used: Sequence[str], settings: Settings
) -> Iterator[Correction]:
    """Corrections to try: a shaft that is stamped late, which tells the angle of one joint beside others; see `delays`.

    That joint is late then, and those that are measured themselves move it along as the shaft does.
    """
    shafts = {name: model.ratios(name) for name in model.transmissions if f"{name}.position" in table}
    for name, ratios in shafts.items():
        told = [joint for joint in ratios if f"{joint}.position" in used and f"{joint}.position" not in table]
        if len(told) == 1 and sum(told[0] in other for other in shafts.values()) == 1:
            share = {f"{joint}.position": float(model.theta[model.index(one)]) for joint, one in ratios.items()}
            own = share.pop(f"{told[0]}.position")
            beside = tuple((channel, -one / own) for channel, one in share.items())
            if beside and all(channel in used for channel, _ in beside):
                found = LateShaft((f"{told[0]}.position",), column=f"{name}.position", beside=beside)
                yield from (replace(found, delay=delay) for delay in settings.delays)


def _told_apart(
    table: Mapping[str, ChannelEntry], channel: str, late: str, used: Sequence[str]
) -> tuple[tuple[str, float], ...]:
    """Channels that the other columns of a value to correct are, with the weight of each; none where it is no sum."""
    entry = table[channel]
    own = {one.column: name for name, one in table.items() if name in used and one.column and not one.delay}
    others = {name: own.get(part.column, "") for name, part in entry.columns.items() if name != late}
    weights = _weights(entry)
    if not weights or not all(others.values()):
        return ()
    steps = {name: parse_unit(table[of].unit).factor * table[of].scale for name, of in others.items()}
    return tuple((of, weights[name] / steps[name]) for name, of in others.items())


def _weights(entry: ChannelEntry) -> dict[str, float]:
    """Weights of the numbers in the columns of a value to correct, in SI; none where it is no weighted sum of them."""
    value, names = read_expression(entry.value), tuple(entry.columns)
    units = {name: parse_unit(part.unit) for name, part in entry.columns.items()}

    def at(numbers: Array) -> Array:
        parts = {
            name: Quantity(units[name].to_si(each), units[name].dimension)
            for name, each in zip(names, numbers, strict=True)
        }
        return entry.scale * value(parts).values

    try:
        # All columns at zero, each at one, then all at different numbers: of a sum the first ones tell the last.
        tried = at(np.column_stack([np.zeros(len(names)), np.eye(len(names)), 1.0 + np.arange(len(names)) / 3.0]))
    except VpmError:
        return {}
    weights = tried[1:-1] - tried[0]
    is_sum = np.isclose(tried[-1], tried[0] + weights @ (1.0 + np.arange(len(names)) / 3.0), rtol=1e-9)
    return dict(zip(names, weights.tolist(), strict=True)) if is_sum else {}


def of_two(model: Model, used: Sequence[str], units: Mapping[str, str], settings: Settings) -> Iterator[Pair]:
    """Corrections to try: wrong units and signs of joints and of their drives at once; see `scales`."""
    for positions, commands in _driven(model, used):
        sides = (list(_of_units(model, group, units, settings)) for group in (positions, commands))
        yield from (Pair(first, second) for first, second in product(*sides))


def _of_units(
    model: Model, group: tuple[str, ...], units: Mapping[str, str], settings: Settings
) -> Iterator[Correction]:
    """Corrections to try: other units, and the opposite sign, of channels of one kind."""
    yield Correction(group, -1.0)
    for factor, unit in _in_other_units(units[group[0]], model.channel_unit(group[0])):
        if max(factor, 1.0 / factor) >= settings.smallest:
            yield from (Correction(group, sign * factor, unit=unit) for sign in (1.0, -1.0))


def _driven(model: Model, used: Sequence[str]) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Positions to correct with the commands that drive them: drive by drive, and all of one unit."""
    found: list[tuple[tuple[str, ...], tuple[str, ...]]] = []
    kinds: dict[tuple[str, str], tuple[list[str], list[str]]] = defaultdict(lambda: ([], []))
    for command in (name for name in used if name.endswith(".command")):
        joints = model.joints_of_actuator(command.rpartition(".")[0])
        if positions := tuple(name for name in used if name in {f"{joint}.position" for joint in joints}):
            found.append((positions, (command,)))
            several = kinds[model.channel_unit(positions[0]), model.channel_unit(command)]
            several[0].extend(name for name in positions if name not in several[0])
            several[1].append(command)
    together = [(tuple(positions), tuple(commands)) for positions, commands in kinds.values()]
    return list(dict.fromkeys([*found, *together]))


def _groups(model: Model, used: Sequence[str], si: Mapping[str, str]) -> list[tuple[str, ...]]:
    """Channels to correct by one mistake: each alone, all of a kind, all of a joint with its drives."""
    kinds: dict[tuple[str, str], list[str]] = defaultdict(list)
    joints: dict[str, list[str]] = defaultdict(list)
    for name in used:
        owner, _, quantity = name.rpartition(".")
        kinds[quantity, si[name]].append(name)
        if owner in model.joints:
            joints[owner].append(name)
        elif owner in model.actuators and len(own := model.joints_of_actuator(owner)) == 1:
            joints[own[0]].append(name)
    several = [tuple(group) for group in (*kinds.values(), *joints.values()) if len(group) > 1]
    return list(dict.fromkeys([*((name,) for name in used), *several]))


def _factors(model: Model, group: Sequence[str], stated: str, si: str) -> Iterator[tuple[float, str]]:
    """Factors to try as corrections of a stated unit, each with the unit that they are in, or ""."""
    found: list[float] = []
    ratios = [factor for ratio in _gear_ratios(model, group) for factor in (ratio, 1.0 / ratio)]
    tried = [*_in_other_units(stated, si), *((factor, "") for factor in (*ratios, *(10.0**n for n in DECADES)))]
    for factor, unit in tried:
        if all(abs(math.log(factor / other)) > SAME for other in found):
            found.append(factor)
            yield factor, unit


def _in_other_units(stated: str, si: str) -> Iterator[tuple[float, str]]:
    """Correction factors for values in another unit than stated, or converted wrongly."""
    others = [unit for unit in (si, *CUSTOMARY.get(si, ())) if unit != stated]
    yield from ((factor_between(unit, stated), unit) for unit in others)
    yield from ((factor_between(stated, unit), "") for unit in others)


def _gear_ratios(model: Model, group: Sequence[str]) -> Iterator[float]:
    """Gear ratios to try as corrections: a log may show the motor in the place of the joint."""
    owners = {name.rpartition(".")[0] for name in group}
    for actuator in model.actuators:
        name = f"{actuator}.gear_ratio"
        if name in model.parameters and (actuator in owners or owners & set(model.joints_of_actuator(actuator))):
            yield abs(model.parameters[name].value) or 1.0
