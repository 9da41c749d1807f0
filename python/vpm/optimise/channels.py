"""Channels of a model as expressions of a point: state, commands and their slopes, duration of the phase."""

from functools import cached_property

import numpy as np

from vpm.numbers import Array
from vpm.optimise.equations import Equations, Expression, casadi
from vpm.optimise.task import RATE, Limit


class Channels:
    """Names to expressions: states, outputs, commands, and the rate of each of them with ``.rate`` behind.

    Attributes
    ----------
    variables : Expression
        State, commands, slopes of the commands by the share of the phase, duration of the phase.
    """

    def __init__(self, own: Equations) -> None:
        ca = casadi()
        self.own = own
        self.slope, self.T = ca.SX.sym("slope", len(own.commands)), ca.SX.sym("T")
        self.variables = ca.vertcat(own.x, own.u, self.slope, self.T)
        self._known: dict[str, Expression] = dict(zip(own.channels, own.outputs.elements(), strict=True))
        self._known |= dict(zip(own.states, own.x.elements(), strict=True))
        self._known |= dict(zip(own.commands, own.u.elements(), strict=True))

    def __contains__(self, name: str) -> bool:
        return name in self._known or (name.endswith(RATE) and name.removesuffix(RATE) in self)

    def __getitem__(self, name: str) -> Expression:
        if name not in self._known:
            ca, base = casadi(), self[name.removesuffix(RATE)]
            self._known[name] = ca.jtimes(base, self.own.x, self.own.rates) + ca.jtimes(
                base, self.own.u, self.slope / self.T
            )
        return self._known[name]

    @cached_property
    def evaluated(self) -> tuple[Expression, Expression]:
        """Functions of state and commands for optimised channels: rates, outputs."""
        ca, own = casadi(), self.own
        inputs = [own.x, own.u]
        return ca.Function("rates", inputs, [own.rates]), ca.Function("outputs", inputs, [own.outputs])

    def rates(self, states: Array, commands: Array) -> Array:
        """Rates of many states by the channels' functions, shape (N, nx)."""
        return np.array(self.evaluated[0].map(len(states))(states.T, commands.T).full()).T

    def outputs(self, states: Array, commands: Array) -> Array:
        """Output channels of many states, shape (N, ny)."""
        return np.array(self.evaluated[1].map(len(states))(states.T, commands.T).full()).T

    def size(self, limit: Limit, states: Array) -> float:
        """Size of a channel that counts as large: its limit, or how far states of their sizes take it from zero."""
        if limit.channel in self.own.states:
            return float(states[self.own.states.index(limit.channel)])
        return limit.size or 1.0
