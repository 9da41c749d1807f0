"""Stiffness and damping from any motion between rest and rest, such as a landing: modulating functions.

``F = F0 + k x + c dx/dt`` is multiplied by ``phi_j = sin(j pi s)``, s from 0 to 1 over the record, and integrated. The
functions vanish at both ends, so that ``int (dx/dt) phi_j dt = -int x (dphi_j/dt) dt``: nothing is differentiated
(M. Shinbrot, "On the analysis of linear and nonlinear systems", Trans. ASME 79, 1957). The J equations are solved by
least squares, less the known share of the displacement's white noise in their normal matrix, which would make both
estimates too small.
"""

from dataclasses import dataclass

import numpy as np

from vpm.errors import ExperimentError, IdentificationError
from vpm.experiment import noise_std
from vpm.narx.records import RecordLike
from vpm.numbers import Array
from vpm.results import Result
from vpm.studies.impedance.channels import Sense, check_moves, check_sense, columns


@dataclass(frozen=True, repr=False, eq=False)
class Landing(Result):
    """Stiffness and damping that a motion from rest to rest shows, such as a landing.

    Attributes
    ----------
    stiffness, damping, force_at_zero : float
        N/m, N s/m, N of ``F = F0 + k x + c dx/dt``, with the applied force.
    stiffness_std, damping_std : float
        Of white noise.
    misfit : float
        What the law leaves of the J integrals, as a share of their spread: above some percent the law is another one.
    """

    name: str
    stiffness: float
    damping: float
    force_at_zero: float
    stiffness_std: float
    damping_std: float
    misfit: float
    notes: tuple[str, ...] = ()


def identify_landing(
    record: RecordLike,
    displacement: str,
    force: str,
    *,
    sense: Sense = "applied",
    delay: float = 0.0,
    terms: int = 30,
) -> Landing:
    """Stiffness and damping of a spring with a damper from one transient.

    Parameters
    ----------
    record : Experiment or mapping of str to array-like, shape (N,)
        With steps of equal length; a mapping has its clock under ``"time"``, s.
    displacement, force : str
        Channels, m and N.
    sense : {"applied", "reaction"}
        As in `identify_loop`.
    delay : float
        By how much the force is recorded later than the displacement, s.
    terms : int
        J; the highest frequency that is looked at is ``J / (2 T)`` in a record of T seconds.

    Raises
    ------
    IdentificationError
        A channel is missing or does not move, or the record cannot tell k from c.
    ExperimentError
        A channel holds values that are no numbers, time does not increase evenly, or there are too few samples.
    """
    sign = check_sense(sense)
    if terms < 4:
        raise IdentificationError(f"terms is {terms}, and three unknowns need four equations at least; give 4 or more")
    found = columns(record, (displacement, force), 4 * terms)
    check_moves(found, displacement)
    steps = np.diff(found.time)
    if np.ptp(steps) > 0.01 * steps.mean():
        raise ExperimentError(
            f"{found.name}: its steps lie between {steps.min():g} and {steps.max():g} s; bring it to an even grid first"
        )
    time, x, f = found.time, found.values[0], sign * found.values[1]
    if delay:
        inside = (time + delay >= time[0]) & (time + delay <= time[-1])
        time, x, f = time[inside], x[inside], np.interp(time[inside] + delay, time, f)
    matrix, right, noise = _equations(time, x, f, terms)
    normal = matrix.T @ matrix - noise
    if np.linalg.cond(normal / np.sqrt(np.outer(np.diag(normal), np.diag(normal)))) > 1e10 or np.any(
        np.linalg.eigvalsh(normal) <= 0.0
    ):
        raise IdentificationError(
            f"{found.name} cannot tell stiffness from damping: the displacement does not stand out of its noise in "
            f"{terms} integrals; record a larger motion"
        )
    solved = np.linalg.solve(normal, matrix.T @ right)
    left = right - matrix @ solved
    variance = float(left @ left) / (terms - 3)
    inverse = np.linalg.inv(normal)
    std = np.sqrt(variance * np.diag(inverse @ (matrix.T @ matrix) @ inverse))
    misfit = float(np.linalg.norm(left) / np.linalg.norm(right - matrix[:, :1] * solved[0]))
    middle = float(x.mean())
    k, c = float(solved[1]), float(solved[2])
    notes = []
    if misfit > 0.1:
        notes.append(
            f"a spring with a damper leaves {100.0 * misfit:.0f} % of the force unexplained: the law is another "
            "one, or the record begins before the landing"
        )
    dt = float(steps.mean())
    if k * dt > 0.05 * abs(c) and not delay:
        notes.append(
            f"one sample ({1e3 * dt:.3g} ms) of unknown delay of the force would change the damping by {k * dt:.3g} "
            "N s/m; measure the delay and give delay="
        )
    return Landing(found.name, k, c, float(solved[0]) - k * middle, float(std[1]), float(std[2]), misfit, tuple(notes))


def _equations(time: Array, x: Array, f: Array, terms: int) -> tuple[Array, Array, Array]:
    """Equations of a landing: matrix (J, 3) for F0, k, c, right side (J,), and noise shares (3, 3)."""
    span, dt = float(time[-1] - time[0]), float(time[1] - time[0])
    orders = np.pi * np.arange(1, terms + 1)[:, None]
    s = (time - time[0]) / span
    phi, slope = np.sin(orders * s), orders / span * np.cos(orders * s)
    # Gregory's rule of fourth order: a landing is fastest at the very first sample, where the trapezoid is poor.
    ends = np.array([3.0 / 8.0, 7.0 / 6.0, 23.0 / 24.0])
    weights = np.full(time.size, dt)
    weights[:3] *= ends
    weights[-3:] *= ends[::-1]
    flat = x - x.mean()
    matrix = np.column_stack([phi @ weights, phi @ (weights * flat), -slope @ (weights * flat)])
    variance = noise_std(x) ** 2 if x.size >= 20 else 0.0
    noise = np.diag([0.0, variance * np.sum((phi * weights) ** 2), variance * np.sum((slope * weights) ** 2)])
    return matrix, phi @ (weights * f), noise
