"""Records of a known Maxwell NARX element, with noise on the force: poses at rest and sines."""

from typing import Any

import numpy as np

from vpm.narx import MaxwellNarx, MaxwellSignals
from vpm.numbers import Array

Record = dict[str, Array]

STEP = 1e-3
SIGNALS = MaxwellSignals("F", "s", "u")
K0, S0, K1, C1 = np.array([1e5, 2e4]), np.array([0.30, 0.01]), 5e5, 2e3


def element(scheme: Any = "trapezoidal", k0: Array = K0, s0: Array = S0) -> MaxwellNarx:
    return MaxwellNarx(k0, s0, K1, C1, STEP, scheme)


def made(e: MaxwellNarx, drive: float, length: Array, noise: float, random: np.random.Generator) -> Record:
    """Record of an element after its start has faded."""
    wait = 200
    s = np.concatenate([np.full(wait, length[0]), length])
    u = np.full(s.size, drive)
    force = e.simulate_free_run(s, (0.0, 0.0), u)[wait:]
    return {"F": force + noise * random.standard_normal(length.size), "s": length, "u": u[wait:]}


def poses(e: MaxwellNarx, noise: float = 0.0, seed: int = 0, samples: int = 400) -> list[Record]:
    random = np.random.default_rng(seed)
    grid = [(u, s) for u in (-1.0, -0.5, 0.0, 0.5, 1.0) for s in np.linspace(0.31, 0.35, 5)]
    return [made(e, u, np.full(samples, s), noise, random) for u, s in grid]


def motions(e: MaxwellNarx, noise: float = 0.0, seed: int = 1, samples: int = 2000) -> list[Record]:
    random = np.random.default_rng(seed)
    time = STEP * np.arange(samples)
    cases = [(u, f) for u in (-1.0, 0.0, 1.0) for f in (0.5, 2.0)]
    return [made(e, u, 0.33 + 0.01 * np.sin(2.0 * np.pi * f * time), noise, random) for u, f in cases]
