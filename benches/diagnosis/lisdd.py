"""LISDD, a baseline for the diagnosis: which terms of a library a balance of effort lacks, by holdout and F-test.

Yifan Wang, "Where Is My Physics Wrong? Localized and Identifiable Discovery of Model Discrepancy", arXiv:2606.23215
(2026). Written from the abstract; the paper itself and its code were not at hand.

As published: known physics is fitted on a clean regime, which is detected. Regimes are flagged by a calibrated energy
of their residual. Terms are selected by exhaustive holdout over a library. A sample-split F-test confirms them.

Filled in here:

- the regimes of an axis, which overlap and are cut at quantiles;
- the noise, from successive differences of the residual (J. von Neumann, Ann. Math. Statist. 12, 1941);
- the clean regime, as what is left once the worst regime was taken out time and again;
- all levels, with Bonferroni's correction in the place of a false-discovery rate;
- an effective number of samples for noise with memory (G. Bayley and J. Hammersley, J. Roy. Statist. Soc. Suppl. 8,
  1946);
- the library, with the signs that physics allows.

Most of what an axis lacks acts in every regime, and then none is clean. So there are two ways to look:

- ``everywhere``: known parameters are fitted together with the terms, on all regimes but one, and judged on the one
  held out, over all regimes in turn;
- ``flagged``: as published; terms are fitted to what the clean regimes leave of the flagged ones, on one record, and
  judged on the other. Where no regime is clean, it looks everywhere.

Either way terms are chosen on the training records and tested on the unseen ones. The largest choice counts of which
every term passes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
from lisdd_terms import Span, Term, along, library
from numpy.typing import NDArray
from scipy.stats import f as fisher

from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Regimes = Mapping[str, Mask]
Choice = tuple[int, ...]
#: Samples to fit on, and samples to judge on.
Fold = tuple[Mask, Mask]

WAYS = ("everywhere", "flagged")
#: Level of all tests together: of the regimes, and of the library.
LEVEL = 0.01
#: Terms that are chosen at most; the number of subsets grows with this power of the library.
LARGEST = 2
#: Samples that a regime has at least.
FEWEST = 10
#: A column of which the known physics leaves less than this share is known physics.
COLLINEAR = 0.02
#: Regimes that are clean keep so much of all samples, and determine the known parameters so much worse at most.
CLEAN_SHARE, CLEAN_CONDITION = 0.25, 10.0
#: Share of the trace that keeps normal equations regular where a fold holds nothing of a term.
RIDGE = 1e-8


@dataclass(frozen=True)
class Finding:
    """What LISDD says.

    Attributes
    ----------
    named : tuple of (effect, site)
        Confirmed terms, the most significant first.
    flagged : tuple of str
        Regimes whose residual stands above the noise with the known physics and the confirmed terms.
    """

    named: tuple[tuple[str, str], ...]
    flagged: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """In the words of `vpm.Diagnosis`; a regime that is flagged without a term is unexplained."""
        if self.named:
            return "effect_found"
        return "unexplained" if self.flagged else "no_disagreement"


@dataclass(frozen=True)
class Samples:
    """Balances of some records side by side, for n samples.

    Attributes
    ----------
    residual : ndarray, shape (n,)
    known : ndarray, shape (n, p)
        Its derivative by the calibratable parameters.
    added : ndarray, shape (n, m)
        What the columns of the terms add to it.
    state : ndarray, shape (n, 4)
        Position, velocity, acceleration and command.
    record : ndarray, shape (n,)
        Which record a sample is of.
    counts : ndarray, shape (n,)
        Whether it counts, which those at standstill do not.
    columns : tuple of slice
        Of each term in ``added``.
    """

    residual: Array
    known: Array
    added: Array
    state: Array
    record: NDArray[np.int64]
    counts: Mask
    columns: tuple[slice, ...]

    @property
    def neighbours(self) -> Mask:
        """Samples that count whose predecessor, in the same record, counts too; the first sample is left out."""
        return np.asarray(self.counts[1:] & self.counts[:-1] & (self.record[1:] == self.record[:-1]))


def named(model: Model, training: Sequence[Experiment], unseen: Sequence[Experiment]) -> list[tuple[str, str]]:
    """Effects that LISDD misses in a model of one axis, with their sites; see `lisdd`."""
    return list(lisdd(model, training, unseen).named)


def lisdd(model: Model, training: Sequence[Experiment], unseen: Sequence[Experiment], way: str = WAYS[0]) -> Finding:
    """Terms that a model of one axis lacks.

    Parameters
    ----------
    model : Model
        One joint, one actuator. Parameters with an uncertainty are refitted.
    training, unseen : sequence of Experiment
        Records on which terms are chosen, and on which they are tested.
    way : {"everywhere", "flagged"}
        Where it looks.

    Raises
    ------
    ValueError
        The model has more than one axis, or the way is unknown.
    """
    if len(model.joints) != 1 or len(model.actuators) != 1:
        raise ValueError(f'"{model.name}" is not a single axis: {len(model.joints)} joints')
    if way not in WAYS:
        raise ValueError(f'LISDD cannot look "{way}"; choose from {", ".join(WAYS)}')
    learn = InverseDynamicsProblem(model, training)
    test = InverseDynamicsProblem(model, unseen, cutoff=min(m.cutoff for m in learn.motions))
    span = Span.of(along(learn, model))
    terms = library(model, span)
    fitted, judged = samples(model, learn, terms), samples(model, test, terms)
    return Search(terms, span, fitted, judged).find(way)


def samples(model: Model, problem: InverseDynamicsProblem, terms: Sequence[Term]) -> Samples:
    """Residual of the nominal model along some records, with the columns of known parameters and terms."""
    free = [model.index(p.name) for p in model.parameters.values() if p.adjustable]
    residual, known = problem.evaluate(model, model.theta, free)
    shapes = [[term.shape(record) for term in terms] for record in along(problem, model)]
    ends = np.cumsum([0, *(shape.shape[1] for shape in shapes[0])]).tolist()
    commands = [m.parallel(m.inputs)[:, :1] for m in problem.motions]
    states = [np.column_stack([*problem.state(k), command]) for k, command in enumerate(commands)]
    return Samples(
        residual=residual,
        known=known,
        added=problem.added([np.column_stack(each)[:, None, :] for each in shapes]),
        state=np.concatenate(states),
        record=np.repeat(np.arange(len(states)), [len(x) for x in states]),
        counts=np.concatenate([block.moving for block in problem.blocks]) > 0.0,
        columns=tuple(slice(a, b) for a, b in pairwise(ends)),
    )


@dataclass(frozen=True)
class Borders:
    """Where regimes begin, from the training records."""

    span: Span
    slowest: float
    slow: float
    small: float
    large: float

    @classmethod
    def of(cls, fitted: Samples, span: Span) -> Borders:
        """Tenth and median of the speed, quartiles of the command."""
        _, velocity, _, command = np.abs(fitted.state[fitted.counts]).T
        slowest, slow = np.quantile(velocity, (0.1, 0.5))
        small, large = np.quantile(command, (0.25, 0.75))
        return cls(span, float(slowest), float(slow), float(small), float(large))

    def regimes(self, data: Samples) -> Regimes:
        """Samples of each regime that count; regimes overlap."""
        position, velocity, acceleration, command = data.state.T
        fast, forward, speeding = np.abs(velocity) > self.slow, velocity > 0.0, velocity * acceleration > 0.0
        end = 0.2 * self.span.way
        every: dict[str, Mask] = {
            "slow forward": ~fast & forward,
            "slow backward": ~fast & ~forward,
            "fast forward": fast & forward,
            "fast backward": fast & ~forward,
            "reversal": np.abs(velocity) < self.slowest,
            "speeding up": speeding,
            "slowing down": ~speeding,
            "low end": position < self.span.low + end,
            "high end": position > self.span.high - end,
            "small command": np.abs(command) < self.small,
            "large command": np.abs(command) > self.large,
        }
        return {name: mask & data.counts for name, mask in every.items()}


@dataclass(frozen=True)
class Search:
    """The method on given samples: ``fitted`` to choose terms, ``judged`` to test them."""

    terms: Sequence[Term]
    span: Span
    fitted: Samples
    judged: Samples

    def find(self, way: str) -> Finding:
        """Confirmed terms, and what is flagged."""
        borders = Borders.of(self.fitted, self.span)
        regimes = {name: mask for name, mask in borders.regimes(self.fitted).items() if mask.sum() >= FEWEST}
        suspects, values = clean(self.fitted, regimes)
        if way == "flagged" and values is not None:
            return self._in_flagged(suspects, values, regimes, borders.regimes(self.judged))
        counts = self.fitted.counts
        confirmed = self.confirmed([(counts & ~mask, mask) for mask in regimes.values()])
        return Finding(tuple(self.terms[k].named for k in confirmed), self._left(confirmed, regimes))

    def _in_flagged(self, suspects: Sequence[str], values: Array, fitted: Regimes, judged: Regimes) -> Finding:
        """As published: terms of what the clean regimes leave of the others."""
        if not suspects:
            return Finding((), ())
        inside = replace(
            self,
            fitted=_left_by(self.fitted, values, _any_of(fitted, suspects)),
            judged=_left_by(self.judged, values, _any_of(judged, suspects)),
        )
        if inside.judged.counts.sum() < FEWEST:
            return Finding((), tuple(suspects))
        confirmed = inside.confirmed(list(_halves(inside.fitted)))
        return Finding(tuple(self.terms[k].named for k in confirmed), tuple(suspects))

    def confirmed(self, folds: Sequence[Fold]) -> Choice:
        """The largest of the best choices of each size of which every term passes the test, most significant first."""
        level = np.log(LEVEL / len(self.terms))
        for choice in reversed(self._best(folds)):
            levels = self.log_levels(choice)
            if max(levels) < level:
                return tuple(choice[k] for k in np.argsort(levels))
        return ()

    def _best(self, folds: Sequence[Fold]) -> list[Choice]:
        """For each size the choice with the least error on what was held out, as long as larger ones have less."""
        choices = list(self._choices())
        if not choices:
            return []
        errors, without = self._held_out(choices, folds)
        best: list[Choice] = []
        for size in range(1, LARGEST + 1):
            mine = [k for k, choice in enumerate(choices) if len(choice) == size]
            if not mine:
                break
            least = min(mine, key=lambda k: float(errors[k]))
            if not errors[least] < without:
                break
            best.append(choices[least])
            without = float(errors[least])
        return best

    def _choices(self) -> Iterator[Choice]:
        """Every subset of the library up to the largest size; one effect is in it once, at one value of its grid."""
        usable = [k for k, columns in enumerate(self.fitted.columns) if is_new(self.fitted, columns)]
        for size in range(1, LARGEST + 1):
            for choice in combinations(usable, size):
                if len({self.terms[k].named for k in choice}) == size:
                    yield choice

    def _held_out(self, choices: Sequence[Choice], folds: Sequence[Fold]) -> tuple[Array, float]:
        """Sum of squares on all that was held out, for each choice and without terms; infinite for impossible signs."""
        data = self.fitted
        normal = _normalised(np.column_stack([data.known, data.added, data.residual]), data.counts)
        whole, _ = _beyond_known(normal, data.known.shape[1], (data.counts, data.counts))
        pairs = [_beyond_known(normal, data.known.shape[1], fold) for fold in folds]
        errors, resisting = np.empty(len(choices)), self._resisting
        for members, columns in self._of_one_width(choices):
            values = _solved(whole, columns)
            possible = np.all((values >= 0.0) | ~resisting[columns], axis=1)
            total = sum((_error(held, columns, _solved(taught, columns)) for taught, held in pairs), np.zeros(1))
            errors[members] = np.where(possible, total, np.inf)
        return errors, float(sum(held[-1, -1] for _, held in pairs))

    def _of_one_width(self, choices: Sequence[Choice]) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Choices with as many columns as each other: their places, and the columns, one row for each."""
        rows = [np.concatenate([_numbers(self.fitted.columns[k]) for k in choice]) for choice in choices]
        widths = np.array([len(row) for row in rows])
        for width in np.unique(widths):
            members = np.flatnonzero(widths == width)
            yield members, np.stack([rows[k] for k in members])

    @property
    def _resisting(self) -> Mask:
        """Columns whose coefficients physics does not allow to be negative."""
        first = np.zeros(self.fitted.added.shape[1], dtype=np.bool_)
        for term, columns in zip(self.terms, self.fitted.columns, strict=True):
            first[columns.start] = term.resists
        return first

    def log_levels(self, choice: Choice) -> list[float]:
        """Logarithm of the level at which the other samples confirm each term of a choice, given the others."""
        data = self.judged
        counts = data.counts
        parts = [data.added[counts, data.columns[k]] for k in choice]
        known, target = data.known[counts], data.residual[counts]
        full = np.column_stack([known, *parts])
        count = effective_count(data, target - full @ _fit(full, target))
        return [
            log_level(np.column_stack([known, *parts[:k], *parts[k + 1 :]]), full, target, count)
            for k in range(len(parts))
        ]

    def _left(self, choice: Choice, regimes: Regimes) -> tuple[str, ...]:
        """Regimes that are flagged with the known physics and the terms of a choice."""
        data = self.fitted
        fit = np.column_stack([data.known, *(data.added[:, data.columns[k]] for k in choice)])
        residual = data.residual - fit @ _fit(fit[data.counts], data.residual[data.counts])
        levels = energies(data, residual, regimes)
        return tuple(name for name, level in levels.items() if level < LEVEL / len(regimes))


def log_level(reduced: Array, full: Array, target: Array, count: float | None = None) -> float:
    """Logarithm of the level of an F-test of a linear model against one that has further columns.

    Exact in finite samples for independent normal errors (G. Seber and A. Lee, *Linear Regression Analysis*, 2003,
    section 4.3).

    Parameters
    ----------
    reduced, full : ndarray, shape (n, p) and (n, p + k)
    target : ndarray, shape (n,)
    count : float, optional
        Effective number of samples; n if not given.
    """
    errors, ranks = zip(*(_squares(columns, target) for columns in (reduced, full)), strict=True)
    more, left = ranks[1] - ranks[0], (len(target) if count is None else count) - ranks[1]
    if more < 1 or left <= 0.0:
        return 0.0
    if not errors[1] > 0.0:
        return -np.inf
    return float(fisher.logsf((errors[0] - errors[1]) / more / (errors[1] / left), more, left))


def effective_count(data: Samples, residual: Array) -> float:
    """Samples that would say as much without memory: ``n (1 - r) / (1 + r)`` for a correlation r > 0 of neighbours."""
    every = np.zeros(data.counts.size)
    every[data.counts] = residual
    pairs = data.neighbours
    power = float(np.sum(every[1:][pairs] ** 2))
    memory = max(float(np.sum((every[1:] * every[:-1])[pairs])) / power, 0.0) if power > 0.0 else 0.0
    return residual.size * (1.0 - memory) / (1.0 + memory)


def energies(data: Samples, residual: Array, regimes: Regimes) -> dict[str, float]:
    """Level at which the mean square of the residual in each regime stands above the noise.

    Noise is half the mean square of successive differences, which has two thirds of the degrees of freedom of a mean
    square.
    """
    noise = 0.5 * float(np.mean(np.diff(residual)[data.neighbours] ** 2))
    freedom = 2.0 / 3.0 * float(data.neighbours.sum())
    return {
        name: float(fisher.sf(np.mean(residual[mask] ** 2) / noise, mask.sum(), freedom))
        for name, mask in regimes.items()
    }


def clean(data: Samples, regimes: Regimes) -> tuple[tuple[str, ...], Array | None]:
    """Regimes that are flagged, and the known parameters on what is clean.

    Regimes are taken out, the worst one first, until none is flagged.

    Returns
    -------
    flagged : tuple of str
    values : ndarray, shape (p,), or None
        None where too little is left to know the parameters by.
    """
    inside, flagged = data.counts, tuple[str, ...]()
    lengths = np.linalg.norm(data.known[inside], axis=0)
    condition = _condition(data.known[inside] / lengths)
    while True:
        values = _fit(data.known[inside], data.residual[inside])
        open_ones = {name: mask & inside for name, mask in regimes.items() if name not in flagged}
        large = {name: mask for name, mask in open_ones.items() if mask.sum() >= FEWEST}
        levels = energies(data, data.residual - data.known @ values, large)
        worst = min(levels, key=lambda name: levels[name], default="")
        if not worst or levels[worst] > LEVEL / len(regimes):
            return flagged, values
        inside, flagged = inside & ~regimes[worst], (*flagged, worst)
        few = inside.sum() < CLEAN_SHARE * data.counts.sum()
        if few or _condition(data.known[inside] / lengths) > CLEAN_CONDITION * condition:
            return flagged, None


def is_new(data: Samples, columns: slice) -> bool:
    """Whether some column of a term is none of the known physics."""
    added, known = data.added[data.counts, columns], data.known[data.counts]
    rest = added - known @ _fit(known, added)
    return bool(np.any(np.linalg.norm(rest, axis=0) > COLLINEAR * np.linalg.norm(added, axis=0)))


def _left_by(data: Samples, values: Array, counts: Mask) -> Samples:
    """The same without known parameters, which have these values, and of some samples alone."""
    left = data.residual - data.known @ values
    return replace(data, residual=left, known=data.known[:, :0], counts=counts)


def _halves(data: Samples) -> Iterator[Fold]:
    """Each record held out in turn; the two halves of a single one."""
    one = data.record.max() == 0
    part = (np.arange(data.record.size) >= data.record.size // 2).astype(np.int64) if one else data.record
    for number in np.unique(part[data.counts]):
        yield data.counts & (part != number), data.counts & (part == number)


def _any_of(regimes: Regimes, names: Sequence[str]) -> Mask:
    return np.asarray(np.logical_or.reduce([regimes[name] for name in names]))


def _numbers(columns: slice) -> NDArray[np.int64]:
    return np.arange(columns.start, columns.stop)


def _normalised(matrix: Array, counts: Mask) -> Array:
    """Columns of length one over the samples that count."""
    lengths = np.linalg.norm(matrix[counts], axis=0)
    return np.asarray(matrix / np.where(lengths > 0.0, lengths, 1.0))


def _beyond_known(matrix: Array, known: int, fold: Fold) -> tuple[Array, Array]:
    """Products of what the known columns, fitted on the first samples of a fold, leave of the others: on both parts."""
    taught, held = matrix[fold[0]], matrix[fold[1]]
    share = _fit(taught[:, :known], taught[:, known:])
    rests = [part[:, known:] - part[:, :known] @ share for part in (taught, held)]
    return rests[0].T @ rests[0], rests[1].T @ rests[1]


def _solved(products: Array, columns: NDArray[np.int64]) -> Array:
    """Coefficients of each choice by normal equations, whose last column is the target."""
    matrices = products[columns[:, :, None], columns[:, None, :]]
    width = columns.shape[1]
    ridge = RIDGE * np.trace(matrices, axis1=1, axis2=2) / width + np.finfo(np.float64).tiny
    solved = np.linalg.solve(matrices + ridge[:, None, None] * np.eye(width), products[columns, -1][..., None])
    return np.asarray(solved[..., 0])


def _error(products: Array, columns: NDArray[np.int64], values: Array) -> Array:
    """Sum of squares that coefficients leave."""
    matrices = products[columns[:, :, None], columns[:, None, :]]
    squares = np.einsum("nk,nkl,nl->n", values, matrices, values)
    return np.asarray(products[-1, -1] - 2.0 * np.sum(values * products[columns, -1], axis=1) + squares)


def _fit(columns: Array, target: Array) -> Array:
    return np.asarray(np.linalg.lstsq(columns, target, rcond=1e-10)[0])


def _squares(columns: Array, target: Array) -> tuple[float, int]:
    """Sum of squares that a fit leaves, and the rank of its columns."""
    scaled = _normalised(columns, np.ones(len(columns), dtype=np.bool_))
    values, _, rank, _ = np.linalg.lstsq(scaled, target, rcond=1e-8)
    return float(np.sum((target - scaled @ values) ** 2)), int(rank)


def _condition(columns: Array) -> float:
    return float(np.linalg.cond(columns)) if columns.size else 1.0
