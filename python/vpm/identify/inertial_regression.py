"""Efforts as a linear function of inertial parameters: the regression that structural parameters are found from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import IdentificationError, check_known
from vpm.numbers import Array
from vpm.results import Storable


@dataclass(frozen=True, repr=False, eq=False)
class InertialRegression(Storable):
    """``effort = regressor @ parameters`` at N samples of n channels.

    Attributes
    ----------
    regressor : ndarray, shape (N, n, p)
        Derivative of each channel's effort by each parameter.
    effort : ndarray, shape (N, n)
        Measured, less what known parts contribute.
    names, units : tuple of str
        Of the p parameters.
    channels : tuple of str
        Of the n efforts.
    nominal : ndarray, shape (p,)
        Values beforehand, as of a CAD model; NaN where there is none.
    bodies : dict of str to tuple of str
        The ten parameters of each full rigid body: mass, first moment x y z, moments of inertia xx yy zz xy xz yz about
        the origin of the body's frame, products being entries of the matrix.
    positive : tuple of str
        Parameters beside those that cannot be negative.
    prefer : tuple of str
        Parameters that stand for their combination, where there is a choice.
    records : tuple of int
        Samples of each record, N in all; noise is not carried over from one to the next.
    """

    regressor: Array
    effort: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    channels: tuple[str, ...]
    nominal: Array
    bodies: dict[str, tuple[str, ...]] = field(default_factory=dict)
    positive: tuple[str, ...] = ()
    prefer: tuple[str, ...] = ()
    records: tuple[int, ...] = ()

    @classmethod
    def from_arrays(
        cls,
        regressor: ArrayLike,
        effort: ArrayLike,
        names: tuple[str, ...] | list[str],
        *,
        nominal: ArrayLike | None = None,
        units: tuple[str, ...] | list[str] | None = None,
        channels: tuple[str, ...] | list[str] | None = None,
        bodies: Mapping[str, tuple[str, ...]] | None = None,
        positive: tuple[str, ...] | list[str] = (),
        prefer: tuple[str, ...] | list[str] = (),
        records: tuple[int, ...] | list[int] | None = None,
    ) -> InertialRegression:
        """A regression of one's own; see the attributes for shapes.

        Parameters
        ----------
        regressor : array_like, shape (N, n, p) or (N, p)
        effort : array_like, shape (N, n) or (N,)
        nominal : array_like, shape (p,), optional
        records : sequence of int, optional
            By default one record of N samples.

        Raises
        ------
        IdentificationError
            Shapes do not fit, a number is not finite, a name is unknown, or nothing varies.
        """
        table, load = np.asarray(regressor, dtype=np.float64), np.asarray(effort, dtype=np.float64)
        table = table[:, None, :] if table.ndim == 2 else table
        load = load[:, None] if load.ndim == 1 else load
        _check_shapes(table, load, len(names))
        count = len(names)
        made = cls(
            table,
            load,
            tuple(names),
            tuple(units) if units is not None else ("1",) * count,
            tuple(channels) if channels is not None else tuple(f"effort {k + 1}" for k in range(load.shape[1])),
            np.full(count, np.nan) if nominal is None else np.array(nominal, dtype=np.float64),
            {body: tuple(ten) for body, ten in (bodies or {}).items()},
            tuple(positive),
            tuple(prefer),
            (len(load),) if records is None else tuple(records),
        )
        made.check()
        return made

    @property
    def slices(self) -> tuple[slice, ...]:
        """Rows of the regression that are the samples of each record."""
        ends = np.cumsum(self.records)
        return tuple(slice(int(end) - count, int(end)) for end, count in zip(ends, self.records, strict=True))

    def check(self) -> None:
        """Complain about what no regression can be made of."""
        self._check_names()
        for what, table in (("effort", self.effort), ("regressor", self.regressor)):
            if not np.isfinite(table).all():
                row, channel, *parameter = (int(k) for k in np.argwhere(~np.isfinite(table))[0])
                of = f", parameter {self.names[parameter[0]]}" if parameter else ""
                value = table[row, channel, *parameter]
                raise IdentificationError(
                    f"the {what} is {value} at sample {row}, channel {self.channels[channel]}{of}; leave "
                    "the sample out, or start a new record after the gap"
                )
        equations, unknown = self.effort.size, len(self.names)
        if equations < 2 * unknown:
            raise IdentificationError(
                f"{len(self.effort)} samples of {self.effort.shape[1]} channels are {equations} equations for "
                f"{unknown} parameters; give at least {2 * unknown} equations, better a hundred for each parameter",
                parameters=self.names,
            )
        for column, label in enumerate(self.channels):
            if np.ptp(self.effort[:, column]) == 0.0:
                raise IdentificationError(
                    f"the effort of {label} is {self.effort[0, column]:.4g} in all {len(self.effort)} samples; a "
                    "sensor that answers never gives that: check its column, or leave the channel out"
                )
        if np.ptp(self.regressor, axis=0).max() == 0.0:
            raise IdentificationError(
                f"the machine stands still: all {len(self.effort)} samples have the same motion, so that they are one "
                "equation per channel; record a motion, or several poses",
                parameters=self.names,
            )

    def _check_names(self) -> None:
        for what, given, count in (
            ("names", len(set(self.names)), len(self.names)),
            ("units", len(self.units), len(self.names)),
            ("nominal values", self.nominal.size, len(self.names)),
            ("channels", len(self.channels), self.effort.shape[1]),
            ("samples in records", sum(self.records), len(self.effort)),
        ):
            if given != count:
                raise IdentificationError(
                    f"{given} {what} do not fit, {count} are needed; give one for each, all distinct"
                )
        tens = [name for ten in self.bodies.values() for name in ten]
        check_known([*tens, *self.positive, *self.prefer], self.names, IdentificationError, "there is no parameter")
        for body, ten in self.bodies.items():
            if len(ten) != 10:
                raise IdentificationError(
                    f"the body {body} has {len(ten)} parameters; a full body has 10: mass, first moment x y z, moments "
                    "of inertia xx yy zz xy xz yz. Name what else must be positive in positive="
                )


def _check_shapes(table: Array, load: Array, count: int) -> None:
    if table.ndim != 3 or load.ndim != 2 or table.shape != (*load.shape, count) or not load.size:
        raise IdentificationError(
            f"a regressor of shape {table.shape} does not fit an effort of shape {load.shape} and {count} names; give "
            "(samples, channels, parameters), (samples, channels) and one name for each parameter"
        )
