"""The element from records: stages after each other, then all coefficients together where that is better."""

from collections.abc import Mapping

import numpy as np

from vpm.errors import IdentificationError
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.maxwell_problem import OutputErrors
from vpm.narx.maxwell_records import MaxwellSignals, Samples, element_samples
from vpm.narx.maxwell_recursion import Scheme
from vpm.narx.maxwell_refinement import LEAST, NEAR, Records, refined
from vpm.narx.maxwell_result import MaxwellFit, unrefined
from vpm.studies.maxwell.maps import MaxwellMap, fit_maxwell_map
from vpm.studies.maxwell.motion import descend_motion, element_values, motion_covariance
from vpm.studies.maxwell.smoothing import smoothed
from vpm.studies.maxwell.windows import static_windows


def identify_maxwell(
    static: Records,
    dynamic: Records,
    signals: MaxwellSignals | None = None,
    *,
    degree: int | Mapping[str, int] | None = None,
    refined_degree: int | None = None,
    width: int = 3,
    settle: float = 0.0,
    scheme: Scheme = "trapezoidal",
    cutoff: float | None = None,
    step: float | None = None,
    refine: bool = True,
) -> MaxwellFit:
    """Element with maps of k0 and s0 from tests at rest and in motion.

    First k0 and s0 in windows of poses (`static_windows`), maps through them (`fit_maxwell_map`), k1 and c1 by output
    error over the tests in motion; then all of them together (`refine_maxwell`), kept if better on the same records.

    Parameters
    ----------
    static, dynamic : Experiment, or mapping of str to array-like, shape (N,), or a sequence of them
        One record for each pose at rest; tests in motion. Keep other tests to judge the result by.
    degree : int or mapping of "k0" and "s0" to int, optional
        Of the maps; by default as many as windows left out ask for.
    refined_degree : int, optional
        Of both maps in the refinement; by default the terms of the staged ones.
    width : int
        Poses in a window.
    settle : float
        Start of each test at rest that is left out, s.
    scheme : {"trapezoidal", "printed", "central_mean"}
    cutoff : float, optional
        Of a low-pass filter for the length of the tests in motion, Hz, well above the motion; by default none. Noise of
        the length makes k1 too small.
    step : float, optional
        Time between samples of records without a clock, s.

    Raises
    ------
    IdentificationError
        The records do not tell the element: by name and number.
    """
    signals = signals or MaxwellSignals()
    at_rest, moving = (element_samples(each, signals, step) for each in (static, dynamic))
    if abs(at_rest[0].step - moving[0].step) > 1e-6 * moving[0].step:
        raise IdentificationError(
            f"the tests at rest are sampled every {at_rest[0].step:g} s, those in motion every {moving[0].step:g} s; a "
            "difference equation has one step: resample one of them"
        )
    moving = [smoothed(one, cutoff) for one in moving]
    windows = static_windows(static, signals, width=width, settle=settle, step=step)
    degrees = degree if isinstance(degree, Mapping) else {"k0": degree, "s0": degree}
    k0, s0 = (fit_maxwell_map(windows, of, degrees.get(of)) for of in ("k0", "s0"))
    staged, k1_std, c1_std = _staged(moving, k0, s0, scheme)
    notes = (*windows.notes, *k0.notes, *s0.notes)
    skip = round(settle / at_rest[0].step)
    kept = [_after(one, skip) for one in at_rest]
    begun = unrefined(staged, kept + moving, (k0.std, s0.std, k1_std, c1_std), notes)
    if not refine:
        return begun
    return refined(begun, kept + moving, (k0.basis, s0.basis), signals, refined_degree)


def _after(one: Samples, skip: int) -> Samples:
    # At rest the length is one number: its noise would count as motion, and make k1 too small.
    rest = np.full(one.length.size - skip, one.length[skip:].mean())
    arrays = (one.force[skip:], rest, one.drive[skip:])
    return Samples(one.name, one.unit, one.time[skip:], one.step, *arrays)


def _staged(moving: list[Samples], k0: MaxwellMap, s0: MaxwellMap, scheme: Scheme) -> tuple[MaxwellNarx, float, float]:
    still = [one.name for one in moving if np.ptp(one.length) == 0.0]
    if len(still) == len(moving):
        raise IdentificationError(
            f"the length does not move in test {still[0]}, nor in any other of the tests in motion, so that k1 and c1 "
            "cannot be told; give a test with motion"
        )
    short = next((one for one in moving if one.force.size < LEAST), None)
    if short is not None:
        raise IdentificationError(
            f"test {short.name} has {short.force.size} samples, but k1 and c1 need {LEAST} at least; give a longer test"
        )
    problem = OutputErrors(moving, scheme, k0.basis, s0.basis)
    maps = [one.basis.from_plain(one.coefficients) for one in (k0, s0)]
    x = descend_motion(problem, np.concatenate([*maps, [0.0, 0.0]]))
    k1, c1 = element_values(x)
    if not (np.isfinite(k1) and k1 != 0.0 and np.isfinite(c1) and x[-1] < problem.limits[1] - NEAR):
        raise IdentificationError(
            f"the tests in motion ask for k1 = {k1:.3g} N/m and c1 = {c1:.3g} N s/m, whose relaxation time no record "
            f"in steps of {moving[0].step:g} s can show; give tests with more and faster motion, or check the force"
        )
    covariance = motion_covariance(problem, x, problem.jacobian(x), (k0, s0))
    std = np.sqrt(np.diag(covariance))
    element = MaxwellNarx(k0.coefficients, s0.coefficients, float(k1), float(c1), moving[0].step, scheme)
    return element, float(std[0]), float(std[1])
