"""A parameter that one record needs at another value than the others: somebody changed the machine between them.

A fit to all records then takes a mean, and no effect explains what that leaves. The test is Chow's for one parameter
and one record, which gets a value of its own (G. Chow, "Tests of equality between sets of coefficients in two linear
regressions", *Econometrica* 28, 1960). It allows for correlated and unequal residuals as `vpm.identify.whiteness` does.
"""

from collections.abc import Collection, Sequence

import numpy as np

from vpm.identify.identifiability import column_lengths
from vpm.identify.problem import Block
from vpm.identify.settings import MOSTLY_OPEN, Checks
from vpm.identify.whiteness import DEPENDENT, basis, explained_by
from vpm.numbers import Array


def changed_between(
    names: Sequence[str],
    values: Array,
    residual: Array,
    jacobian: Array,
    blocks: Sequence[Block],
    units: Sequence[str],
    blind: Collection[str],
    checks: Checks,
) -> list[str]:
    """Sentence on the parameter that, at a value of its own in one record, explains what a fit leaves; else none.

    - ``values``, ``units``: of the parameters ``names``
    - ``residual``, ``jacobian``: shapes (n,) and (n, p), at ``values``
    - ``blind``: parameters that the data do not determine
    """
    records = list(dict.fromkeys(block.experiment for block in blocks))
    count = max(block.samples.stop for block in blocks)
    residual, slopes = residual[:count], jacobian[:count]
    seen = [k for k, name in enumerate(names) if name not in blind]
    if len(records) < 2 or not seen or not (np.all(np.isfinite(residual)) and np.all(np.isfinite(slopes))):
        return []
    inside = np.zeros((len(records), count), dtype=bool)
    moving = np.zeros(count, dtype=bool)
    for block in blocks:
        inside[records.index(block.experiment), block.samples] = True
        moving[block.samples] = block.moving > 0.0
    lengths = column_lengths(slopes)
    tried = [(k, number) for k in seen for number in range(len(records) - (len(records) == 2))]
    common_basis, power = basis(slopes), float(residual @ residual)
    beside = residual - common_basis @ (common_basis.T @ residual)

    def gain(k: int, number: int) -> float:
        own = slopes[:, k] * inside[number] / lengths[k]
        own = own - common_basis @ (common_basis.T @ own)
        return float(own @ beside) ** 2 / max(float(own @ own), DEPENDENT**2)

    k, number = max(tried, key=lambda one: gain(*one))
    split = np.column_stack([slopes / lengths, slopes[:, k] * inside[number] / lengths[k]])
    weights = np.linalg.lstsq(split, residual, rcond=None)[0]
    least = float(np.sum((residual - split @ weights) ** 2))
    if not power > 0.0 or least > MOSTLY_OPEN**2 * power:
        return []
    size = np.sqrt((power - least) / max(int(moving.sum()), 1))
    largest = max(block.weight * block.scale for block in blocks)
    _, chance = explained_by(residual, slopes, (slopes[:, k] * inside[number])[:, None], moving)
    if len(tried) * chance > checks.level or size < checks.visible * largest:
        return []
    common = float(values[k] - weights[k] / lengths[k])
    own = float(common - weights[-1] / lengths[k])
    unit, others = units[k], ", ".join(name for name in records if name != records[number])
    rest = 100.0 * np.sqrt(least / power)
    return [
        f"{names[k]} differs between records: {own:.6g} {unit} in {records[number]} and {common:.6g} {unit} in "
        f"{others} leave {rest:.2g} % of the residual; fit records apart between which a load or a setting was changed"
    ]
