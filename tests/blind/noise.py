"""Noise and counts of sensors, drawn per case from what is on the market."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Array = NDArray[np.float64]


def encoder(generator: Generator, name: str, quanta: tuple[float, ...]) -> dict[str, float]:
    """Count of an encoder, and noise of 0.2 to 0.6 counts ahead of it."""
    quantum = float(generator.choice(quanta))
    return {f"{name}.quantum": quantum, f"{name}.noise": quantum * float(generator.uniform(0.2, 0.6))}


def converter(name: str, span: float, bits: int, noise: float) -> dict[str, float]:
    """An analogue sensor behind a converter of so many bits over its span, with noise of this size."""
    return {f"{name}.quantum": span / 2**bits, f"{name}.noise": noise}


def normal(generator: Generator, samples: int, sensors: int) -> Array:
    """Standard normal numbers of one record, shape (samples, sensors)."""
    return generator.standard_normal((samples, sensors))
