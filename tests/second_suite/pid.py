"""The textbook's PID, for machines whose controller the model file knows."""

from dataclasses import dataclass

import numpy as np

from second_suite.machine import Array, Law, Machine


@dataclass(frozen=True)
class Pid:
    """Of the first coordinate: the derivative is a backward difference of the error, the integral rests at a limit."""

    actuator: str
    joint: str
    proportional: float
    integral: float
    derivative: float
    limit: float

    def entry(self) -> dict[str, object]:
        """What the model file says of it."""
        return {
            "type": "pid",
            "actuator": self.actuator,
            "measures": f"{self.joint}.position",
            "proportional": self.proportional,
            "integral": self.integral,
            "derivative": self.derivative,
            "limit": self.limit,
        }

    def law(self, machine: Machine, columns: int) -> Law:
        """The law in sampled time."""
        before, total = np.zeros(columns), np.zeros(columns)
        dt, others = 1.0 / machine.rate, len(machine.joints) - 1

        def command(k: int, y: Array, dy: Array, asked: Array) -> Array:
            del dy
            nonlocal before, total
            error = asked[0, 0] - y[0]
            slope = (error - before) / dt if k else np.zeros_like(error)
            tried = total + dt * error
            wanted = self.proportional * error + self.integral * tried + self.derivative * slope
            before = error
            total = np.where((np.abs(wanted) > self.limit) & (wanted * error > 0.0), total, tried)
            return np.stack([np.clip(wanted, -self.limit, self.limit), *[np.zeros(columns)] * others])

        return command
