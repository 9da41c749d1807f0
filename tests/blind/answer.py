"""What a diagnosis answers to a case, beside what the best possible one could have reached, as plain data."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields, replace
from types import FrameType
from typing import Any

import numpy as np

import vpm
from blind.case import Case
from blind.oracle import CLEAR
from vpm.discrepancy import Diagnosis
from vpm.identify import InverseDynamicsProblem, estimate
from vpm.model import Model

#: Numbers of the truth beyond this stand for "not there": the far end of a stop that has one end.
NOWHERE = 1e8
#: Share of the limit of time that an interrupted diagnosis has to say what it knows.
GRACE = 0.25


@dataclass(frozen=True)
class Named:
    """An effect at a site, with the values of its parameters and their stated standard deviations (SI).

    The probability is that of its class: of it and of all that the diagnosis says it cannot tell from it, which are
    alike.
    """

    name: str
    site: str
    values: dict[str, float] = field(default_factory=dict)
    stds: dict[str, float] = field(default_factory=dict)
    probability: float | None = None
    alike: tuple[str, ...] = ()


@dataclass(frozen=True)
class Weighed:
    """An effect at a site whose evidence was told in a round of a ranking, nats; the one that came in is accepted."""

    round: int
    name: str
    site: str
    evidence: float
    accepted: bool


@dataclass(frozen=True)
class Answer:
    """One case with the answer to it."""

    #: The case; ``request`` is what `blind.make_case` takes.
    machine: str
    kind: str
    request: tuple[str, ...]
    seed: int
    noise_level: float
    known: bool  #: Whether the catalogue is said to have all that is hidden.
    hidden: tuple[Named, ...] = ()
    #: How far each hidden effect stands clear of the noise, see `blind.Oracle`, where the other one of a pair is
    #: there with parameters that nobody knows either; nothing has none.
    strengths: tuple[float, ...] = ()
    verdict: str = ""  #: Of the diagnosis; "" if it failed.
    named: tuple[Named, ...] = ()  #: Accepted effects in their order.
    #: Accepted effects, then the other candidates in the order of what they explain of the validation data.
    ranking: tuple[Named, ...] = ()
    rivals: tuple[str, ...] = ()  #: Names that the diagnosis says it cannot tell from an accepted one.
    #: Root mean square of the unseen residual of `vpm.identify.InverseDynamicsProblem` in units of the signal:
    #: nominal model, nominal effects with refitted parameters, repaired model, and model with the hidden effect
    #: that was fitted from the truth. NaN where it is not known.
    nominal_gap: float = np.nan
    recalibrated_gap: float = np.nan
    gap: float = np.nan
    oracle_gap: float = np.nan
    oracle_note: str = ""  #: Why there is no oracle gap.
    #: Time of the processor for the diagnosis, and for making the case.
    seconds: float = 0.0
    making: float = 0.0
    error: str = ""  #: Why it failed, or "".
    late: bool = False  #: Whether the diagnosis was ended by the limit of time and this is what it knew until then.
    alone: tuple[float, ...] = ()  #: Strengths of effects where the other one of a pair is not there.
    weighed: tuple[Weighed, ...] = ()  #: Evidence of all effects of which a ranking told it.

    @property
    def solvable(self) -> bool:
        """Whether each hidden effect stands clear of the noise."""
        return bool(self.strengths) and all(strength > CLEAR for strength in self.strengths)

    def to_dict(self) -> dict[str, object]:
        """Plain data for JSON; what is not known is null."""
        stored: dict[str, Any] = {
            k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in asdict(self).items()
        }
        for named in stored["named"]:
            named["stds"] = {k: v for k, v in named["stds"].items() if np.isfinite(v)}
        return stored

    @classmethod
    def from_dict(cls, stored: dict[str, object]) -> Answer:
        """The same, read back."""
        values: dict[str, object] = {}
        for entry in fields(cls):
            if entry.name in {"late", "alone", "weighed"} and entry.name not in stored:
                continue
            value = stored[entry.name]
            if entry.name in {"hidden", "named", "ranking"}:
                value = tuple(_named(item) for item in value)  # type: ignore[attr-defined]
            elif entry.name == "weighed":
                value = tuple(Weighed(**item) for item in value)  # type: ignore[attr-defined]
            elif isinstance(value, list):
                value = tuple(value)
            values[entry.name] = np.nan if value is None else value
        return cls(**values)  # type: ignore[arg-type]


def _named(stored: dict[str, Any]) -> Named:
    return Named(**{**stored, "alike": tuple(stored.get("alike", ()))})


def hidden_in(case: Case) -> tuple[Named, ...]:
    """The hidden effects of a case."""
    return tuple(Named(h.name, h.site, dict(h.parameters)) for h in case.truth.hidden)


def answered(case: Case, kind: str, request: Sequence[str], strengths: Sequence[float], limit: float) -> Answer:
    """Diagnose a case; whatever goes wrong is part of the answer.

    A diagnosis that takes too long is interrupted as by Ctrl-C, and counts with what it knows until then.

    ``strengths``: of each hidden effect; ``limit``: longest time of the processor for it [s].
    """
    known = all(h.known for h in case.truth.hidden)
    hidden = hidden_in(case)
    about = (case.machine, kind, tuple(request), case.seed, case.noise_level, known, hidden, tuple(strengths))
    began, alarm = time.process_time(), _Alarm(limit)
    try:
        with alarm.set():
            why = vpm.diagnose(case.model(), case.train, case.validate)
    except KeyboardInterrupt:
        if not alarm.rung:
            raise
        return Answer(*about, seconds=time.process_time() - began, error=alarm.text)
    except Exception as error:  # noqa: BLE001  whatever a diagnosis raises is a failure of it, and counts as one
        return Answer(*about, seconds=time.process_time() - began, error=f"{type(error).__name__}: {error}")
    seconds = time.process_time() - began
    named = tuple(
        Named(
            e.name,
            e.site,
            {p.name: p.value for p in e.parameters},
            {p.name: p.std for p in e.parameters},
            e.class_probability if np.isfinite(e.class_probability) else None,
            tuple(other for first, *others in why.classes if first == f"{e.name} at {e.site}" for other in others),
        )
        for e in why.effects
    )
    weighed = tuple(
        Weighed(c.round, c.name, c.site, c.evidence_nats, c.accepted)
        for c in why.candidates
        if np.isfinite(c.evidence_nats)
    )
    rivals = tuple(dict.fromkeys(other for a in why.ambiguous_with for other in a.others))
    gaps, note = _gaps(case, why, limit)
    answer = Answer(*about, why.verdict, named, ranking(why), rivals, *gaps, note, seconds=seconds, late=alarm.rung)
    return replace(answer, weighed=weighed)


def ranking(why: Diagnosis) -> tuple[Named, ...]:
    """Accepted effects in their order, then other candidates: refitted ones by validation gain, others as screened."""
    order = [(e.name, e.site) for e in why.effects]
    others = [c for c in why.candidates if not c.accepted]
    tried = sorted((c for c in others if np.isfinite(c.unseen)), key=lambda c: (c.round, -c.unseen))
    screened = sorted(
        (c for c in others if not np.isfinite(c.unseen)), key=lambda c: (c.round, -np.nan_to_num(c.screened))
    )
    order += [(c.name, c.site) for c in (*tried, *screened)]
    return tuple(Named(*pair) for pair in dict.fromkeys(order))


def _gaps(case: Case, why: Diagnosis, limit: float) -> tuple[tuple[float, float, float, float], str]:
    """Unseen gaps of the nominal, the recalibrated, the repaired model and that of the oracle, all by one measure."""
    nominal = case.model()
    try:
        training = InverseDynamicsProblem(nominal, case.train)
        unseen = InverseDynamicsProblem(nominal, case.validate, cutoff=min(m.cutoff for m in training.motions))

        def size(model: Model) -> float:
            return float(np.sqrt(np.mean(unseen.evaluate(model, model.theta)[0] ** 2)))

        first = next((step.values for step in why.steps if step.change == "recalibrated"), {})
        kept = {name: value for name, value in first.items() if name in nominal.parameters}
        told = (size(nominal), size(nominal.with_parameters(kept)), size(why.model))
    except Exception as error:  # noqa: BLE001  an answer without a figure is still an answer
        return (np.nan, np.nan, np.nan, np.nan), f"{type(error).__name__}: {error}"
    try:
        with _Alarm(limit).set(gently=False):
            model, free = informed(case)
            fit = estimate(model, training, free)
            fitted = model.with_parameters(dict(zip(free, map(float, fit.values), strict=True)))
            return (*told, min(size(model), size(fitted))), ""
    except Exception as error:  # noqa: BLE001  the package may not have the effect
        return (*told, np.nan), f"{type(error).__name__}: {error}"


def informed(case: Case) -> tuple[Model, tuple[str, ...]]:
    """The model with the true parameters and the hidden effects, and what of it is to be fitted."""
    model = Model.from_toml(case.true_text)
    free = [p.name for p in model.parameters.values() if p.adjustable]
    for h in case.truth.hidden:
        values = {name: value for name, value in h.parameters.items() if abs(value) < NOWHERE}
        model = model.with_effect(h.name, at=h.site, **values)
        effect = model.effect(h.name, h.site)
        free += [effect.parameter_names[name] for name in values if name in effect.parameter_names]
    return model, tuple(free)


class _Alarm:
    """Ends what takes more than ``limit`` seconds of the processor, where the system can do that.

    First as Ctrl-C does, and with a TimeoutError if that is not heeded within ``GRACE`` of the limit.
    """

    def __init__(self, limit: float) -> None:
        self.limit, self.rung = limit, False

    @property
    def text(self) -> str:
        """What is said of a diagnosis that knew nothing yet."""
        return f"TimeoutError: not done within {self.limit:g} s of the processor"

    @contextmanager
    def set(self, *, gently: bool = True) -> Iterator[None]:
        """Watch what is done within; not ``gently``, the first ring ends it with TimeoutError."""
        if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
            yield
            return

        def late(_number: int, _frame: FrameType | None) -> None:
            first, self.rung = gently and not self.rung, True
            if first:
                raise KeyboardInterrupt
            raise TimeoutError(self.text.partition(": ")[2])

        before = signal.signal(signal.SIGPROF, late)
        signal.setitimer(signal.ITIMER_PROF, self.limit, GRACE * self.limit)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            signal.signal(signal.SIGPROF, before)
