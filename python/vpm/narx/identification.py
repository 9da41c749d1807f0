"""Terms and coefficients of a NARX model from records."""

from collections.abc import Mapping, Sequence
from math import comb
from typing import Literal

import numpy as np

from vpm._core import narx_candidates, narx_fit, narx_select
from vpm.errors import IdentificationError, refused_as
from vpm.narx.model import Narx
from vpm.narx.records import RecordLike, as_list, series

#: What decides how many terms are kept; all of them look at the training records only.
Criterion = Literal["bic", "aic", "unexplained", "free_run_tail"]

#: Numbers of the criteria that have one: the unexplained share of energy, and the held-out share of each record.
DEFAULTS = {"bic": 0.0, "aic": 0.0, "unexplained": 1e-6, "free_run_tail": 0.3}

#: A free run beyond so many times the largest measured output counts as diverged.
FAR = 1e3

#: Most candidates that are formed.
MOST_CANDIDATES = 20_000

#: Most numbers in the columns of all candidates, of which two copies are held: 2 GB.
MOST_NUMBERS = 125_000_000

Lags = int | Sequence[int]


def identify(
    records: RecordLike | Sequence[RecordLike],
    *,
    output: str,
    inputs: Sequence[str],
    output_lags: Lags = 2,
    input_lags: Lags | Mapping[str, Lags] = 2,
    degree: int = 1,
    constant: bool = True,
    n_terms: int | Literal["all"] | None = None,
    criterion: Criterion = "bic",
    value: float | None = None,
    max_terms: int = 30,
) -> Narx:
    """Choose the terms of a NARX model by their error-reduction ratio and fit their coefficients.

    Candidates are all products of at most `degree` lagged signals. They are chosen one by one: always the one that
    explains most of the output's energy beyond those before it (orthogonal least squares: S. Chen, S. Billings and
    W. Luo, Int. J. Control 50, 1989; S. Billings, *Nonlinear System Identification*, 2013, section 3.2). Samples count
    that have a full past inside their own record.

    Parameters
    ----------
    records : Experiment, or mapping of str to array-like, or a sequence of them
        Training records; several count in one fit.
    output_lags : int or sequence of int
        A number n stands for 1 ... n.
    input_lags : int, sequence of int, or mapping of an input's name to one of these
        A number n stands for 1 ... n; give ``[0, 1, 2]`` for an input that acts at once.
    degree : int
        1 gives a linear model (ARX).
    constant : bool
        Whether the constant is a candidate.
    n_terms : int or "all", optional
        So many terms; ``"all"`` fits every candidate without selection. By default the criterion decides.
    criterion : {"bic", "aic", "unexplained", "free_run_tail"}
        Least information criterion; or the first model that leaves no more than `value` of the energy unexplained; or
        the best free run over the last share `value` of each record, which terms and coefficients have not seen then.
    value : float, optional
        1e-6 for ``"unexplained"``, 0.3 for ``"free_run_tail"``.
    max_terms : int
        Most terms that a criterion may choose.

    Raises
    ------
    IdentificationError
        The records do not tell the model: too few samples, lags longer than a record, a channel that never moves, terms
        that depend linearly on each other, a sample that is no number; by name.
    """
    signals = [output, *inputs]
    given = [series(record, output, inputs, f"record {at}") for at, record in enumerate(as_list(records))]
    if not given:
        raise IdentificationError("there is no record; give one at least")
    pool = _pool(signals, output_lags, input_lags, degree, constant=constant)
    samples = sum(one.time.size for one in given)
    if len(pool) * samples > MOST_NUMBERS:
        raise IdentificationError(
            f"{len(pool)} candidates over {samples} samples take {len(pool) * samples:.2g} numbers, and at most "
            f"{MOST_NUMBERS:.2g} are held; take fewer lags, a lower degree or fewer samples"
        )
    triples = [(one.name, one.output, one.inputs) for one in given]
    largest = max(float(np.abs(one.output).max(initial=0.0)) for one in given)
    limit = FAR * largest if largest > 0.0 else float("inf")
    number = DEFAULTS.get(criterion, 0.0) if value is None else value
    stop = "terms" if n_terms is not None else str(criterion)
    most = n_terms if isinstance(n_terms, int) else max_terms
    with refused_as(IdentificationError):
        if n_terms == "all":
            theta = narx_fit(signals, pool, triples)
            return Narx(output, tuple(inputs), _frozen(pool), theta, np.full(theta.size, np.nan), limit)
        terms, theta, ratios, values, dependent = narx_select(signals, pool, triples, most, stop, number)
    notes = [f"{name} cannot be told from the chosen terms once {by} is among them." for name, by in dependent]
    if n_terms is None and len(terms) == max_terms:
        notes.append(f"The criterion asked for all of the {max_terms} terms allowed; allow more.")
    return Narx(output, tuple(inputs), _frozen(terms), theta, ratios, limit, tuple(notes), values)


def _frozen(terms: Sequence[Sequence[tuple[int, int]]]) -> tuple[tuple[tuple[int, int], ...], ...]:
    return tuple(tuple((signal, lag) for signal, lag in term) for term in terms)


def _pool(
    signals: Sequence[str], output_lags: Lags, input_lags: Lags | Mapping[str, Lags], degree: int, *, constant: bool
) -> list[list[tuple[int, int]]]:
    """Candidate terms for the identification of a polynomial NARX, as products of lagged signals."""
    if isinstance(input_lags, Mapping):
        unknown = sorted(set(input_lags) - set(signals[1:]))
        if unknown:
            raise IdentificationError(f'input_lags names "{unknown[0]}", but the inputs are {", ".join(signals[1:])}')
        per_input = [input_lags.get(name, 2) for name in signals[1:]]
    else:
        per_input = [input_lags] * (len(signals) - 1)
    lags = [(at, _delays(one, signals[at], least=0 if at else 1)) for at, one in enumerate([output_lags, *per_input])]
    if degree < 1:
        raise IdentificationError(f"degree must be 1 or more, got {degree}; 1 gives a linear model")
    count = comb(sum(len(delays) for _, delays in lags) + degree, degree)
    if count > MOST_CANDIDATES:
        raise IdentificationError(
            f"these lags and degree {degree} give {count} candidates, and at most {MOST_CANDIDATES} are formed; take "
            "fewer lags or a lower degree"
        )
    return narx_candidates(lags, degree, constant)


def _delays(lags: Lags, name: str, *, least: int) -> list[int]:
    delays = list(range(1, lags + 1)) if isinstance(lags, int) else sorted({int(lag) for lag in lags})
    if delays and delays[0] < least:
        raise IdentificationError(
            f"lags of {name} must be {least} or more, got {delays[0]}; the output looks back only"
        )
    return delays
