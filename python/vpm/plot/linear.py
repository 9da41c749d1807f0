"""Pictures of linear models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array, Complex
from vpm.plot.style import BLUE, LINE, ORANGE, SOFT, STAGES, label, panels, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@styled
def plot_poles(poles: Complex) -> Figure:
    """Draw poles of a linear model in the complex plane; those that grow stand out.

    ``poles``: shape (nx,), 1/s.
    """
    figure, ((axes,),) = panels(1, height=3.5)
    grows = poles.real > 0.0
    for chosen, color, meaning in ((~grows, BLUE, "dies out or stays"), (grows, ORANGE, "grows")):
        if np.any(chosen):
            axes.plot(poles[chosen].real, poles[chosen].imag / (2.0 * np.pi), "x", color=color, label=meaning)
    axes.axvline(0.0, color=LINE)
    axes.axhline(0.0, color=LINE)
    axes.set(xlabel=label("real part", "1/s"), ylabel=label("imaginary part / 2π", "Hz"), title="Poles")
    axes.legend()
    return figure


@styled
def plot_bode(frequencies: Array, response: Complex, inputs: Sequence[str], outputs: Sequence[str]) -> Figure:
    """Draw gain and phase of a linear model over frequency, a line per pair of input and output.

    - ``frequencies``: shape (F,), Hz
    - ``response``: shape (F, ny, nu)
    - ``inputs``, ``outputs``: names of the last two axes of `response`
    """
    figure, ((upper,), (lower,)) = panels(2, height=2.6, share_x=True)
    pairs = [(row, column) for row in range(len(outputs)) for column in range(len(inputs))]
    for number, (row, column) in enumerate(pairs):
        line, color = response[:, row, column], STAGES[1:][number % (len(STAGES) - 1)]
        upper.loglog(frequencies, np.abs(line), color=color, label=f"{inputs[column]} → {outputs[row]}")
        lower.semilogx(frequencies, np.degrees(np.unwrap(np.angle(line))), color=color)
    upper.set(ylabel=label("gain", "SI"), title="Frequency response, without delays")
    upper.legend()
    lower.set(ylabel=label("phase", "degrees"), xlabel=label("frequency", "Hz"))
    lower.axhline(-180.0, color=SOFT, linewidth=0.6)
    return figure
