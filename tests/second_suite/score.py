"""What a diagnosis answered to a case, what counts as right, and the table of many answers."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from second_suite.cases import MACHINES, NONE, PARAMETERS, Case

#: Names that speak of one kind of physics: a wrong name of the right class sends an engineer to the right place.
CLASSES = (
    {"coulomb_friction", "stribeck_friction", "asymmetric_friction", "hysteresis", "viscous_friction"},
    {"bias_force", "gravity_tilt", "sensor_offset", "spring", "end_stop", "torque_ripple"},
    {"payload", "rotor_inertia", "sensor_gain"},
    {"input_delay", "actuator_lag", "sensor_delay"},
    {"joint_compliance", "backlash", "link_flexibility"},
    {"dead_zone", "saturation"},
)
Named = tuple[str, str]


@dataclass(frozen=True)
class Answer:
    """One case and the answer to it; ``hidden`` and ``named`` are (effect, site)."""

    machine: str
    request: str
    seed: int
    kind: str
    hidden: list[Named]
    strengths: list[float]
    solvable: bool
    verdict: str = ""
    named: list[Named] = field(default_factory=list)
    candidates: list[Named] = field(default_factory=list)
    seconds: float = 0.0
    making: float = 0.0
    error: str = ""
    numbers: dict[str, float] = field(default_factory=dict)
    truth: dict[str, float] = field(default_factory=dict)
    summary: str = ""

    @property
    def right(self) -> bool:
        """Whether the first name is one that was hidden."""
        return bool(self.named) and any(self._same(self.named[0], true)[0] for true in self.hidden)

    @property
    def site_right(self) -> bool:
        """The same, at the right site."""
        return bool(self.named) and any(self._same(self.named[0], true)[1] for true in self.hidden)

    @property
    def class_right(self) -> bool:
        """Whether the first name is of the class of one that was hidden."""
        first = self.named[0][0] if self.named else ""
        return self.right or any({first, true} <= group for group in CLASSES for true, _ in self.hidden)

    @property
    def found(self) -> int:
        """How many of the hidden effects are named at their sites."""
        return sum(any(self._same(name, true)[1] for name in self.named) for true in self.hidden)

    @property
    def more(self) -> list[Named]:
        """Names that nothing hidden explains."""
        return [name for name in self.named if not any(self._same(name, true)[1] for true in self.hidden)]

    @property
    def good(self) -> bool:
        """Whether the answer is what it should be."""
        if self.kind in {NONE, PARAMETERS}:
            return not self.named and self.verdict in {"no_disagreement", "parameters_only"}
        if self.kind == "outside":
            return self.verdict == "unexplained"
        if self.kind == "pair":
            return self.found == len(self.hidden)
        return self.right and self.site_right

    def _same(self, name: Named, true: Named) -> tuple[bool, bool]:
        """Whether two names are one, and the sites too; what is one physics on this machine is one."""
        if any({name, true} == set(pair) for pair in MACHINES[self.machine].same):
            return True, True
        return name[0] == true[0], tuple(name) == tuple(true)


def answered(case: Case, diagnose: Callable[..., Any], making: float) -> Answer:
    """Ask ``diagnose(model, train, validate)``; an error is an answer, too."""
    began = time.process_time()
    known: dict[str, Any] = {
        "machine": case.machine,
        "request": case.request,
        "seed": case.seed,
        "kind": case.kind,
        "hidden": [(h.effect, h.site) for h in case.hidden],
        "strengths": [round(s, 2) for s in case.strengths],
        "solvable": case.solvable,
        "making": making,
        "truth": {f"{h.effect}@{h.site}.{k}": v for h in case.hidden for k, v in h.values.items()},
    }
    try:
        why = diagnose(case.model(), case.train, case.validate)
    except Exception as error:  # noqa: BLE001  whatever a diagnosis raises is a failure of it, and counts as one
        return Answer(**known, seconds=time.process_time() - began, error=f"{type(error).__name__}: {error}")
    seconds = time.process_time() - began
    named = [_named(effect) for effect in why.effects]
    numbers = {
        f"{effect.name}@{effect.site}.{p.name}": float(p.value)
        for effect in why.effects
        for p in getattr(effect, "parameters", ())
    }
    candidates = list(dict.fromkeys(_named(candidate) for candidate in why.candidates))
    summary = str(getattr(why, "summary", ""))
    return Answer(
        **known,
        verdict=why.verdict,
        named=named,
        candidates=candidates[:6],
        seconds=seconds,
        numbers=numbers,
        summary=summary,
    )


def _named(entry: Any) -> Named:
    return str(getattr(entry, "name", getattr(entry, "effect", ""))), str(entry.site)


def to_dict(answer: Answer) -> dict[str, Any]:
    """Plain data, with what the score makes of it."""
    return {**asdict(answer), "good": answer.good}


def table(answers: Sequence[Answer]) -> str:
    """Counts by machine."""
    rows: list[tuple[str, ...]] = [
        ("machine", "cases", "top-1", "class", "site", "pairs", "false", "unexpl.", "weak", "failed", "s", "max s")
    ]
    machines = list(dict.fromkeys(a.machine for a in answers))
    shown = [*machines, "all"] if len(machines) > 1 else machines
    rows += [(machine, *_counts([a for a in answers if machine in {a.machine, "all"}])) for machine in shown]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)


def _counts(answers: Sequence[Answer]) -> tuple[str, ...]:
    single = [a for a in answers if a.kind == "single" and a.solvable]
    pairs = [a for a in answers if a.kind == "pair" and a.solvable]
    nothing = [a for a in answers if a.kind in {NONE, PARAMETERS}]
    outside = [a for a in answers if a.kind == "outside" and a.solvable]
    times = sorted(a.seconds for a in answers)

    def share(count: int, group: Sequence[Answer]) -> str:
        return f"{count}/{len(group)}" if group else "."

    first = [a for a in single if a.right]
    return (
        str(len(answers)),
        share(len(first), single),
        share(sum(a.class_right for a in single), single),
        share(sum(a.site_right for a in first), first),
        share(sum(a.good for a in pairs), pairs),
        share(sum(bool(a.named) for a in nothing), nothing),
        share(sum(a.good for a in outside), outside),
        str(sum(not a.solvable for a in answers)),
        str(sum(bool(a.error) for a in answers)),
        f"{times[len(times) // 2]:.1f}",
        f"{times[-1]:.1f}",
    )
