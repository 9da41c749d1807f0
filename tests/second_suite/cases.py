"""Cases: a model file that lacks something, four records of the machine that has it, and whether that can be seen.

**Frozen cases.** `frozen` lists them by seed. Each seed has, of every machine, both kinds of clean case and every fifth
of the other requests, so that five consecutive seeds have each request once. Seeds of `DEV` are to develop on. Seeds of
`FRESH` are never run, or looked at, while anything is developed: they are for one count of what is finished.

**Rule for "solvable".** Each case is simulated without noise with the effect and without it. The change of all logged
signals is divided by the noise of each channel, which is what noise and counts change in the machine without the effect
(through its controller, too). What other values of the adjustable parameters would do alike is taken out by least
squares on the training records, and the same values are then tried on the record that judges. What is left has to be
`CLEAR` times the noise (root mean square of the best channel) on training and on judging records. Else the case is
"not solvable" and does not count as missed. Of several effects each one is taken out beside the others.
"""

import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from second_suite import arm, belt, boom, cart, hoist, rotary, scara, slewer, sweeper
from second_suite.logs import flat, least, logged
from second_suite.loop import Inputs, Signals, simulated
from second_suite.machine import Machine, columns_of, drawn
from second_suite.plant import Hidden
from vpm import Experiment, Model
from vpm.numbers import Array

MACHINES: dict[str, Machine] = {
    m.MACHINE.name: m.MACHINE for m in (belt, rotary, cart, scara, hoist, arm, boom, slewer, sweeper)
}
NONE, PARAMETERS = "none", "parameters"
CLEAN = frozenset({NONE, PARAMETERS})
DEV, FRESH, SLICES = range(5), range(100, 105), 5
#: How far clear of the noise an effect has to stand.
CLEAR = 3.0
#: Errors of the file's parameters, as share of their uncertainty; range of the wrong one in the cases "parameters".
OFF, WRONG = 0.4, (1.8, 2.6)
#: By how much of its uncertainty each parameter is moved to see what it does, and the true machine's spread.
NUDGE, SPREAD = 0.1, 0.06


@dataclass(frozen=True)
class Case:
    """One case."""

    #: ``kind`` is single, pair, outside, none or parameters.
    machine: str
    request: str
    seed: int
    kind: str
    document: dict[str, Any]  #: The model file.
    train: list[Experiment]
    holdout: list[Experiment]
    hidden: tuple[Hidden, ...]
    strengths: tuple[float, ...]  #: Of each hidden effect, see the rule above.

    @property
    def solvable(self) -> bool:
        """Whether each hidden effect stands clear of the noise."""
        return all(strength >= CLEAR for strength in self.strengths)

    def model(self) -> Model:
        """The model file, read."""
        return Model.from_dict(self.document)


def requests(machine: str) -> dict[str, str]:
    """All that can be asked for, with its kind: ``effect@site``, joined by ``+`` if several are hidden."""
    m = MACHINES[machine]
    found = {NONE: NONE, PARAMETERS: PARAMETERS}
    found |= {f"{c.effect}@{c.site}": "single" for c in m.choices}
    found |= {"+".join(f"{e}@{s}" for e, s in pair): "pair" for pair in m.pairs}
    return found | {f"{c.effect}@{c.site}": "outside" for c in m.outside}


def frozen(seeds: Iterable[int]) -> Iterator[tuple[str, str, int]]:
    """The cases of some seeds: machine, request, seed."""
    for seed in seeds:
        for machine in MACHINES:
            for number, (request, kind) in enumerate(requests(machine).items()):
                if kind in CLEAN or number % SLICES == seed % SLICES:
                    yield machine, request, seed


def make_case(machine: str, request: str, seed: int) -> Case:
    """One case, the same for the same words and number."""
    m, kind = MACHINES[machine], requests(machine)[request]
    hidden = () if kind in CLEAN else hidden_of(m, request, seed)
    values = true_values(m, seed)
    rng = _rng(machine, request, seed)
    names = [name for name in m.adjustable if name not in {h.base for h in hidden}]
    document = m.document(_numbers(m, values, names, kind, rng), frozenset(h.base for h in hidden))
    signals = _records(m, seed, values, hidden, noisy=True, rng=rng)
    strengths = tuple(
        strength(m, seed, hidden, tuple(other for other in hidden if other is not h), names) for h in hidden
    )
    logs = [_log(m, seed, signals, record) for record in range(len(m.lengths))]
    return Case(machine, request, seed, kind, document, logs[:-1], logs[-1:], hidden, strengths)


def hidden_of(m: Machine, request: str, seed: int) -> tuple[Hidden, ...]:
    """What a request hides, with numbers drawn by the seed."""
    choices = {f"{c.effect}@{c.site}": c for c in (*m.choices, *m.outside)}
    return tuple(
        Hidden(c.effect, c.site, drawn(_rng(m.name, word, seed), c.ranges), c.base)
        for word, c in ((word, choices[word]) for word in request.split("+"))
    )


def true_values(m: Machine, seed: int) -> dict[str, float]:
    """The machine of a seed: the textbook's numbers, of which the adjustable ones are its own."""
    rng = _rng(m.name, "machine", seed)
    return {k: v * (1.0 + SPREAD * rng.uniform(-1.0, 1.0) if k in m.adjustable else 1.0) for k, v in m.values.items()}


def inputs_of(m: Machine, seed: int) -> tuple[Inputs, list[int]]:
    """References and torques of all records, and how many samples each has; short ones are held to the end."""
    counts = [round(length * m.rate) for length in m.lengths]
    longest, n = max(counts), len(m.joints)
    reference, torque = np.zeros((longest, n, len(counts))), np.zeros((longest, n, len(counts)))
    feedback = np.ones((1, len(counts)))
    for record, count in enumerate(counts):
        time = np.arange(count) / m.rate
        rng = _rng(m.name, f"motion {record}", seed)
        reference[:count, :, record] = m.motion(rng, time, record)
        reference[count:, :, record] = reference[count - 1, :, record]
        if m.torque is not None:
            torque[:count, :, record], alone = m.torque(rng, time, record)
            feedback[0, record] = 0.0 if alone else 1.0
    return Inputs(reference, torque, feedback), counts


def strength(m: Machine, seed: int, hidden: Sequence[Hidden], others: Sequence[Hidden], names: Sequence[str]) -> float:
    """How far the effects beyond ``others`` stand clear of the noise, on training or judging records, which is less."""
    values = true_values(m, seed)
    rng = np.random.default_rng(0)
    change = flat(m, _records(m, seed, values, hidden, noisy=False, rng=rng))
    gone = {h.base: 0.0 for h in hidden if h.base and h not in others}
    change = change - flat(m, _records(m, seed, values | gone, others, noisy=False, rng=rng))
    slopes, noise = _nudged(m.name, seed)
    picked = slopes[[i for i, name in enumerate(m.adjustable) if name in names]] / noise
    change = change / noise
    counts = [round(length * m.rate) for length in m.lengths]
    training = np.zeros(change.shape, dtype=bool)
    judging = training.copy()
    for record, count in enumerate(counts):
        (judging if record == len(counts) - 1 else training)[:count, :, record] = True
    columns = picked[:, training].T
    size = np.linalg.norm(columns, axis=0)
    fit = np.linalg.lstsq(columns / size, change[training], rcond=1e-8)[0] / size if len(columns.T) else np.zeros(0)
    left = change - np.tensordot(fit, picked, 1)

    def clear(where: NDArray[np.bool_]) -> float:
        return float(np.sqrt((left**2 * where).sum(axis=(0, 2)) / where.sum(axis=(0, 2))).max())

    return min(clear(training), clear(judging))


@lru_cache(maxsize=8)
def _nudged(machine: str, seed: int) -> tuple[Array, Array]:
    """What each adjustable parameter changes per share of its value, and the noise (1, channels, records)."""
    m = MACHINES[machine]
    values, names = true_values(m, seed), list(m.adjustable)
    inputs, _ = inputs_of(m, seed)
    records = len(m.lengths)
    times = len(names) + 2
    columns = columns_of(values, records * times)
    for i, name in enumerate(names):
        columns[name][records * i : records * (i + 1)] *= 1.0 + NUDGE * m.adjustable[name]
    noisy = np.arange(records * times) >= records * (times - 1)
    wide = Inputs(*(np.tile(a, times) for a in (inputs.reference, inputs.torque, inputs.feedback)))
    rng = _rng(machine, "oracle", seed)
    signals = simulated(m, columns, (), wide, noisy, rng)
    parts = np.split(flat(m, signals), times, axis=2)
    clean = parts[-2]
    slopes = np.stack([(part - clean) / (NUDGE * m.adjustable[name]) for part, name in zip(parts, names, strict=False)])
    noise = np.sqrt(np.mean((parts[-1] - clean) ** 2, axis=0, keepdims=True))
    return slopes, np.maximum(noise, least(m)[None, :, None])


def _records(
    m: Machine, seed: int, values: dict[str, float], hidden: Sequence[Hidden], *, noisy: bool, rng: np.random.Generator
) -> Signals:
    inputs, _ = inputs_of(m, seed)
    columns = len(m.lengths)
    return simulated(m, columns_of(values, columns), hidden, inputs, np.full(columns, noisy), rng)


def _log(m: Machine, seed: int, signals: Signals, record: int) -> Experiment:
    return logged(m, inputs_of(m, seed)[0], signals, record)


def _numbers(m: Machine, values: dict[str, float], names: Sequence[str], kind: str, rng: np.random.Generator) -> Any:
    """Writes numbers of the model file: the adjustable ones are somewhat off, with what is known of them."""
    errors = {name: 0.0 if kind == NONE else OFF * float(rng.standard_normal()) for name in names}
    if kind == PARAMETERS:
        wrong = names[int(rng.integers(len(names)))]
        errors[wrong] = float(rng.choice([-1.0, 1.0]) * rng.uniform(*WRONG))

    def number(name: str) -> object:
        if name not in errors:
            return values[name]
        share = m.adjustable[name]
        # A factor, so that no number of a wide uncertainty comes out negative.
        written = values[name] * float(np.exp(share * errors[name]))
        return {"value": written, "uncertainty": share * abs(written)}

    return number


def _rng(*words: object) -> np.random.Generator:
    return np.random.default_rng(zlib.crc32(repr(words).encode()))
