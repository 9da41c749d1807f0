"""What a solver answered to a case, how many points that makes, and the table of many answers."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import permutations

from second_suite.cases import CLEAN, MACHINES, Case
from vpm import Experiment, Model

#: Names that speak of one kind of physics: a wrong name of the right class sends an engineer to the right place.
FRICTIONS = ("coulomb", "stribeck", "asymmetric", "viscous", "warming", "position_dependent", "load_dependent", "lugre")
CLASSES = (
    {*(f"{kind}_friction" for kind in FRICTIONS), "hysteresis", "quadratic_drag", "seal_friction"},
    {"bias_force", "gravity_tilt", "sensor_offset", "spring", "cubic_spring", "end_stop", "torque_ripple"},
    {"payload", "rotor_inertia", "sensor_gain"},
    {"input_delay", "actuator_lag", "sensor_delay", "valve_dynamics"},
    {"joint_compliance", "backlash", "link_flexibility"},
    {"dead_zone", "saturation", "uneven_edges"},
    {"internal_leakage", "supply_drop"},
)
Named = tuple[str, str]
#: From the model file and the records to learn from and to judge by, to what is missing: (effect, site) of each.
Solver = Callable[[Model, list[Experiment], list[Experiment]], Sequence[Named]]


@dataclass(frozen=True)
class Answer:
    """One case and the answer to it; ``hidden`` and ``named`` are (effect, site)."""

    machine: str
    request: str
    seed: int
    kind: str
    hidden: tuple[Named, ...]
    strengths: tuple[float, ...]
    solvable: bool
    named: tuple[Named, ...] = ()
    seconds: float = 0.0
    error: str = ""

    @property
    def points(self) -> float:
        """One for the hidden effects and nothing else, half if all are of the right class at the right joint.

        Two names that are one physics on this machine (`Machine.same`) are one name. A solver that fails has none.
        """
        if self.error:
            return 0.0
        if self._matched(self._same):
            return 1.0
        return 0.5 if self._matched(self._alike) else 0.0

    @property
    def line(self) -> str:
        """The case and its answer on one line."""
        mark = {1.0: "+", 0.5: "/", 0.0: "-"}[self.points] if self.solvable else "~"
        truth, answer = _words(self.hidden) or self.request, _words(self.named) or "-"
        clear = "".join(f", {s:.0f} times the noise" for s in self.strengths)
        return f"{mark} {self.machine} {self.seed} {truth} -> {self.error or answer} ({self.seconds:.1f} s{clear})"

    def _matched(self, fits: Callable[[Named, Named], bool]) -> bool:
        """Whether each name fits one hidden effect, and each hidden effect one name."""
        return len(self.named) == len(self.hidden) and any(
            all(map(fits, order, self.hidden)) for order in permutations(self.named)
        )

    def _same(self, name: Named, true: Named) -> bool:
        return name == true or any({name, true} == set(pair) for pair in MACHINES[self.machine].same)

    def _alike(self, name: Named, true: Named) -> bool:
        """Whether two names are of one class, at one joint as far as their sites are of joints."""
        at = {MACHINES[self.machine].joint_of(site) for _, site in (name, true)} - {None}
        one_class = any({name[0], true[0]} <= group for group in (*CLASSES, {name[0]}))
        return self._same(name, true) or (one_class and len(at) <= 1)


def _words(names: Sequence[Named]) -> str:
    return " + ".join(f"{effect}@{site}" for effect, site in names)


def answered(case: Case, solver: Solver) -> Answer:
    """Ask a solver; an error is an answer, too. Time is that of the processor, of all threads of this process."""
    model, began = case.model(), time.process_time()
    named: Sequence[Named] = ()
    error = ""
    try:
        named = solver(model, case.train, case.holdout)
    except Exception as failure:  # noqa: BLE001  whatever a solver raises is a failure of it, and counts as one
        error = f"{type(failure).__name__}: {failure}"
    return Answer(
        case.machine,
        case.request,
        case.seed,
        case.kind,
        tuple((h.effect, h.site) for h in case.hidden),
        case.strengths,
        case.solvable,
        tuple((effect, site) for effect, site in named),
        time.process_time() - began,
        error,
    )


HEAD = ("machine", "cases", "single", "exact", "pair", "outside", "false alarms", "weak", "failed", "median s", "max s")


def table(answers: Sequence[Answer]) -> str:
    """Points by machine and kind; a weak case, whose effect drowns in the noise, is not counted."""
    machines = list(dict.fromkeys(a.machine for a in answers))
    rows = [
        HEAD,
        *((m, *_counts([a for a in answers if a.machine == m])) for m in machines),
        ("all", *_counts(answers)),
    ]
    widths = [max(len(row[i]) for row in rows) for i in range(len(HEAD))]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)


def _counts(answers: Sequence[Answer]) -> tuple[str, ...]:
    def of(*kinds: str) -> list[Answer]:
        return [a for a in answers if a.kind in kinds and a.solvable]

    def points(group: Sequence[Answer]) -> str:
        return f"{sum(a.points for a in group):g}/{len(group)}" if group else "."

    clean, single = of(*CLEAN), of("single")
    times = sorted(a.seconds for a in answers)
    return (
        str(len(answers)),
        points(single),
        str(sum(a.points == 1.0 for a in single)),
        points(of("pair")),
        points(of("outside")),
        f"{sum(bool(a.named) for a in clean)}/{len(clean)}" if clean else ".",
        str(sum(not a.solvable for a in answers)),
        str(sum(bool(a.error) for a in answers)),
        f"{times[len(times) // 2]:.1f}",
        f"{times[-1]:.1f}",
    )
