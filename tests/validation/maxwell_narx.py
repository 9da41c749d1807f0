"""The Maxwell element as a difference equation and from records: closed forms, ranks, published constants."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from validation.row import Row, accepted, against, row
from vpm import narx
from vpm.narx import MaxwellNarx
from vpm.numbers import Array

VALUES = accepted("maxwell_narx")
K0, S0, K1, C1 = 1e5, 0.30, 5e5, 2e3
OMEGA = 2.0 * np.pi * 1.5
#: Name in the references, and scheme.
SCHEMES: dict[str, Any] = {"eq552": "printed", "trapezoidal": "trapezoidal", "central_mean": "central_mean"}
STEPS = (2e-3, 1e-3, 5e-4, 2.5e-4)


def rows() -> list[Row]:
    """Every row of the element."""
    found: dict[str, ArrayLike] = {
        "narx.exact_force": _settled(),
        "narx.eq552.parasitic_multiplier": _multiplier(),
        "narx.static_rank": _rank(),
        "narx.minimum_norm_s0": [_minimum_norm(length) for length in (0.29, 0.32)],
        "narx.reported.tau": [_element(1e-3, k1=k1, c1=c1).relaxation_time for k1, c1 in _REPORTED],
    }
    for name, scheme in SCHEMES.items():
        errors = [_largest_error(step, scheme) for step in STEPS]
        found[f"narx.{name}.max_error"] = errors
        found[f"narx.{name}.order"] = np.log2(errors[-2] / errors[-1])
    errors = [_backward_error(step) for step in STEPS]
    found |= {"narx.backward_euler.max_error": errors, "narx.backward_euler.order": np.log2(errors[-2] / errors[-1])}
    return [*(against(VALUES[name], value) for name, value in found.items()), _recovery()]


#: k1 and c1 of hip and knee, D'Imperio (2016), section 5.2.5.
_REPORTED = ((-17.64575, -0.016015), (-6.09655, -0.00618))


def _element(step: float, scheme: Any = "trapezoidal", k1: float = K1, c1: float = C1) -> MaxwellNarx:
    return MaxwellNarx(np.array([K0]), np.array([S0]), k1, c1, step, scheme)


def _length(time: NDArray[np.floating[Any]]) -> Array:
    return np.asarray(0.32 + 0.01 * np.sin(OMEGA * time))


def _exact(time: NDArray[np.floating[Any]]) -> Array:
    tau = C1 / K1
    gain = (K0 + tau * (K0 + K1) * 1j * OMEGA) / (1.0 + tau * 1j * OMEGA)
    return np.asarray(K0 * 0.02 + 0.01 * np.imag(gain * np.exp(1j * OMEGA * time)))


def _settled() -> Array:
    """Forces at 0.5, 1 and 2 s of a run in steps of 10 us from rest, 0.2 s before."""
    step = 1e-5
    time = step * np.arange(-20_000, 200_001)
    force = _element(step).simulate_free_run(_length(time), (0.0, 0.0))
    return force[[20_000 + 50_000, 20_000 + 100_000, 20_000 + 200_000]]


def _largest_error(step: float, scheme: Any) -> float:
    time = step * np.arange(round(1.0 / step) + 1)
    exact = _exact(time)
    run = _element(step, scheme).simulate_free_run(_length(time), (float(exact[0]), float(exact[1])))
    return float(np.abs(run - exact).max())


def _backward_error(step: float) -> float:
    """Largest error of a run by backward Euler, `(1 + tau/h) F = tau/h F' + k0 (s - s0) + tau/h (k0 + k1) (s - s')`."""
    time = step * np.arange(round(1.0 / step) + 1)
    exact, length, share = _exact(time), _length(time), C1 / K1 / step
    now, before = K0 + share * (K0 + K1), -share * (K0 + K1)
    terms = [[(0, 1)], [(1, 0)], [(1, 1)], []]
    coefficients = np.array([share, now, before, -K0 * S0]) / (1.0 + share)
    element = narx.Narx.from_terms("force", ["length"], terms, coefficients)
    run = element.simulate_free_run({"time": time, "force": exact, "length": length})
    return float(np.abs(run.values - exact).max())


def _multiplier() -> float:
    """What a start error of 1 N keeps per sample in the printed form: every other sample keeps its square."""
    length = np.full(42, 0.32)
    off = _element(1e-3, "printed").simulate_free_run(length, (2001.0, 2000.0))
    return float((off[40] - 2000.0) ** (1.0 / 40.0))


def _rank() -> float:
    length = np.full(100, 0.32)
    return float(narx.static_rank(_element(1e-3).simulate_free_run(length, (0.0, 0.0)), length, 1e-3))


def _minimum_norm(length: float) -> float:
    return narx.minimum_norm_static(np.full(3, 50.0), np.full(3, length), 1e-3)[1]


def _recovery() -> Row:
    """k0, s0, k1, c1 of an element from poses at rest and one sine, without noise."""
    element, time = _element(1e-3), 1e-3 * np.arange(2000)
    poses = [np.full(300, s) for s in (0.31, 0.32, 0.33)]
    rest = [{"force": element.simulate_free_run(s, (K0 * (s[0] - S0),) * 2), "length": s} for s in poses]
    moving = {"force": element.simulate_free_run(_length(time), (2e3, 2e3))[300:], "length": _length(time)[300:]}
    fit = narx.identify_maxwell(rest, moving, step=1e-3)
    e = fit.element
    error = np.abs(np.array([e.k0[0] / K0, e.s0[0] / S0, e.k1 / K1, e.c1 / C1]) - 1.0).max()
    source = "recomputed: k0, s0, k1, c1 from simulated tests at rest and in motion"
    return row("narx.recovery", error, 0.0, "1", source, absolute=1e-6)
