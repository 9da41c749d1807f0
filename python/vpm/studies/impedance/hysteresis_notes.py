"""Sentences on what may be wrong with the numbers of a loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vpm.experiment import quantisation_step
from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm.studies.impedance.hysteresis_loop import Loop

#: Share of the damping beyond which a possible error is worth a sentence.
WORTH = 0.05


def loop_notes(loop: Loop, displacement: Array, step: float, delay_std: float, explained: float) -> tuple[str, ...]:
    """Notes on a hysteresis loop, to know before its numbers are trusted.

    - ``displacement``: shape (N,), as recorded, m
    - ``step``: time between samples, s
    - ``delay_std``: s; zero if nothing was said about it
    - ``explained``: share of the displacement's variance that the Fourier series has
    """
    notes = []
    if loop.stiffness < 0.0 and loop.energy < 0.0:
        notes.append('stiffness and energy are both negative, as for a force that answers: give sense="reaction"')
    elif loop.energy < 0.0:
        notes.append(
            f"the loop gains {-loop.energy:.3g} J a cycle: the part is active, the force is recorded early, or the "
            "loss is smaller than what the delay between the channels hides"
        )
    if delay_std == 0.0 and loop.stiffness * step > WORTH * abs(loop.damping):
        notes.append(
            f"one sample ({1e3 * step:.3g} ms) of unknown delay of the force would change the damping by "
            f"{loop.stiffness * step:.3g} N s/m, {100.0 * loop.stiffness * step / abs(loop.damping):.0f} % of it; "
            "measure the delay and give delay= and delay_std="
        )
    quantum = quantisation_step(displacement)
    if quantum is not None and loop.amplitude < 5.0 * quantum:
        notes.append(
            f"the amplitude of {loop.amplitude:.3g} m is {loop.amplitude / quantum:.2g} steps of the encoder "
            f"({quantum:.3g} m), whose rounding is then no noise; move further"
        )
    if explained < 0.98:
        notes.append(
            f"the displacement repeats itself in {100.0 * explained:.0f} % of its variance only; give frequency=, or "
            "test with a steadier motion"
        )
    bend = _bend(loop)
    if bend > WORTH:
        notes.append(
            f"{100.0 * bend:.0f} % of the force's amplitude is in harmonics that no linear spring with a damper makes: "
            "the stiffness is that of a chord and changes with amplitude and mean"
        )
    spread = float(np.std(loop.cycle_energy, ddof=1)) if loop.cycle_energy.size > 2 else 0.0
    expected = loop.energy_std * np.sqrt(loop.cycle_energy.size)
    if spread > max(3.0 * expected, 0.02 * abs(loop.energy)):
        notes.append(
            f"the energy differs from cycle to cycle by {spread:.3g} J, noise would make {expected:.3g} J: the "
            "motion or the part changes, and the standard deviations are too small; repeat the test"
        )
    if loop.cycle_energy.size == 1:
        notes.append("a single cycle cannot tell drift from loss; record more of them")
    return tuple(notes)


def _bend(loop: Loop) -> float:
    """Bent part of the hysteresis force that spring and damper leave, as a share, for the notes."""
    whole, moved = loop.force_harmonics, loop.displacement_harmonics
    orders = np.arange(1, moved.size + 1)
    left = whole.copy()
    left[: moved.size] -= (loop.stiffness + 2j * np.pi * loop.frequency * loop.damping * orders) * moved
    noise = 4.0 * loop.force_noise**2 / loop.force.size * whole.size
    return float(np.sqrt(max(np.sum(np.abs(left) ** 2) - noise, 0.0) / np.sum(np.abs(whole) ** 2)))
