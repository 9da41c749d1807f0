"""The proving ground at work: chooses cases, makes them, diagnoses them on all cores, and keeps what is done."""

import json
import os
import time
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np

from blind.answer import Answer, Named, answered
from blind.case import Case, hideable, sites_of, strengths_beside, try_cases
from blind.effects import EFFECTS
from blind.machines import MACHINES
from blind.score import site_right
from blind.table import failed
from vpm.errors import ExecutorError
from vpm.files import write_text
from vpm.tasks import Tasks, processes

KINDS = ("single", "pairs", "none", "parameters", "outside")
#: Cases that are made together.
BATCH = 30
#: Cases without a missing effect for each case of an effect: a rate of a few per cent takes many of them.
NOTHING, PAIRS = 4, 5
#: Effects that a calibratable parameter is, exactly: a payload of a slide is its mass, one at the tip of a link the tip
#: mass, one behind a single turning axis its centre and inertia. The oracle, which recalibrates by a straight line,
#: leaves something of a large one, but nobody can name it.
#: Nor can they name where the angle of an arm in a level plane is counted from: all directions of it are alike.
ABSORBED = frozenset({("axis_linear", "payload", ""), ("axis_rotary", "payload", ""), ("flexible_arm", "payload", "")})
ABSORBED |= {("flexible_arm", "sensor_offset", "encoder_1")}


@dataclass(frozen=True)
class Job:
    """One case to be made and diagnosed."""

    machine: str
    kind: str
    request: tuple[str, ...]
    seed: int
    noise_level: float


def jobs(
    machines: Sequence[str] = (),
    effects: Sequence[str] = (),
    seeds: Sequence[int] = (0,),
    noise_levels: Sequence[float] = (1.0,),
    kinds: Sequence[str] = KINDS,
    each: int = 1,
) -> list[Job]:
    """Cases of a run: each effect of each machine ``each`` times, with seeds that are dealt out in turn.

    - ``machines``, ``effects``: all if empty
    - ``each``: cases of each effect and machine; of no effect four times as many, and five times as many pairs

    Raises
    ------
    ValueError
        A name is unknown, or nothing is left.
    """
    _check("machine", machines, tuple(MACHINES))
    _check("effect", effects, tuple(EFFECTS))
    _check("kind", kinds, KINDS)
    if not seeds or not 1 <= each <= len(seeds):
        raise ValueError(f"each effect is to be hidden {each} times with {len(seeds)} seeds; give a seed for each time")
    found = []
    for level in noise_levels:
        for machine in machines or MACHINES:
            for dealt, (kind, request, times) in enumerate(_requests(machine, effects, kinds)):
                count = min(times * each, len(seeds))
                turns = [seeds[(dealt + k) % len(seeds)] for k in range(count)]
                found += [Job(machine, kind, request, seed, level) for seed in turns]
            if "pairs" in kinds:
                pairs = _pairs(machine, effects, seeds, PAIRS * each)
                found += [Job(machine, "pairs", pair, seed, level) for pair, seed in pairs]
    if not found:
        raise ValueError("no case is left; the effects make no sense on the machines")
    return found


def _check(what: str, names: Sequence[str], known: Sequence[str]) -> None:
    for name in names:
        if name not in known:
            raise ValueError(f'the proving ground has no {what} "{name}"; it has {", ".join(known)}')


def _requests(machine: str, effects: Sequence[str], kinds: Sequence[str]) -> Iterator[tuple[str, tuple[str, ...], int]]:
    """Kind, what to hide, and how often relative to one effect."""
    for kind, known in (("single", True), ("outside", False)):
        if kind in kinds:
            for name in hideable(machine, known=known):
                if not effects or name in effects:
                    yield kind, (name,), 1
    for kind in ("none", "parameters"):
        if kind in kinds and not effects:
            yield kind, (kind,), NOTHING


def _pairs(
    machine: str, effects: Sequence[str], seeds: Sequence[int], count: int
) -> Iterator[tuple[tuple[str, str], int]]:
    """So many pairs of effects, with seeds that are dealt out in turn: every seed has pairs of its own."""
    names = [name for name in hideable(machine, known=True) if not effects or name in effects]
    both = [pair for pair in combinations(sorted(names), 2) if not any(absorbed(machine, name, "") for name in pair)]
    drawn = {seed: np.random.default_rng([seed, zlib.crc32(f"pairs of {machine}".encode())]) for seed in seeds}
    orders = {seed: generator.permutation(len(both)) for seed, generator in drawn.items()}
    for k in range(min(count, len(both) * len(seeds))):
        seed = seeds[k % len(seeds)]
        yield both[orders[seed][k // len(seeds)]], seed


def answers(
    todo: Sequence[Job],
    workers: int = 0,
    limit: float = 120.0,
    tell: Callable[[str], None] | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
) -> Iterator[Answer]:
    """Answers in the order in which they come; Ctrl-C ends what runs and the iteration.

    - ``workers``: processes; 0 takes one for each core, 1 works here
    - ``limit``: longest time of one diagnosis on the processor [s]
    - ``tell``: called with a line for each case, and for each task that died
    - ``executor``: works in the place of processes of this machine, see `vpm.tasks.Tasks`
    """
    count = workers or os.cpu_count() or 1
    say = tell or (lambda _: None)
    here = executor is None and count == 1
    given = _here(todo, limit) if here else _beside(todo, executor or partial(processes, count), limit, say)
    for done, answer in enumerate(given, 1):
        say(f"{done}/{len(todo)}  {line(answer)}")
        yield answer


def line(answer: Answer) -> str:
    """An answer in a line."""
    hidden = ", ".join(f"{h.name}@{h.site}" for h in answer.hidden) or answer.request[0]
    told = ", ".join(f"{n.name}@{n.site}" for n in answer.named) or answer.verdict or answer.error[:80]
    strength = f" strength {min(answer.strengths):.2g}" if answer.strengths else ""
    took = f"{answer.seconds:.1f} s" + (", ended by the limit" if answer.late else "")
    mark = "wrong" if failed(answer) else "right" if answer.solvable or not answer.hidden else "too weak"
    return f"{mark:8s} {answer.machine}, seed {answer.seed}: {hidden}{strength} -> {told}  ({took})"


def _batches(todo: Sequence[Job]) -> Iterator[list[Job]]:
    """Jobs of one machine and noise level together, those of a seed next to each other."""
    for key in dict.fromkeys((job.machine, job.noise_level) for job in todo):
        mine = sorted((job for job in todo if (job.machine, job.noise_level) == key), key=lambda job: job.seed)
        pieces = -(-len(mine) // BATCH)
        for k in range(pieces):
            yield mine[k * len(mine) // pieces : (k + 1) * len(mine) // pieces]


Strengths = tuple[float, ...]
Made = tuple[Job, Case | None, Strengths, Strengths, float, str]


def make(batch: Sequence[Job]) -> list[Made]:
    """Cases of a batch with strengths of the hidden effects, those of each one alone, times that they took, errors."""
    began = time.process_time()
    made = try_cases(batch[0].machine, [(job.request, job.seed) for job in batch], batch[0].noise_level)
    strengths = list(_strengths(batch, made))
    each = (time.process_time() - began) / len(batch)
    result: list[Made] = []
    for job, case, (own, alone) in zip(batch, made, strengths, strict=True):
        if isinstance(case, FloatingPointError):
            result.append((job, None, (), (), each, str(case)))
        else:
            slim = replace(case.oracle, with_effect=(), without_effect=())
            result.append((job, replace(case, oracle=slim), own, alone, each, ""))
    return result


def _strengths(
    batch: Sequence[Job], made: Sequence[Case | FloatingPointError]
) -> Iterator[tuple[Strengths, Strengths]]:
    """Strengths of the hidden effects of each case: beside the other one, where there are two, and alone."""
    machine, level = batch[0].machine, batch[0].noise_level
    one = [(job, name) for job in batch if len(job.request) > 1 for name in job.request]
    beside = dict(
        zip(one, strengths_beside(machine, [(job.request, name, job.seed) for job, name in one], level), strict=True)
    )
    tried = zip(one, try_cases(machine, [((name,), job.seed) for job, name in one], level), strict=True)
    alone = {key: case.oracle.strength if isinstance(case, Case) else np.nan for key, case in tried}
    for job, case in zip(batch, made, strict=True):
        if not isinstance(case, Case) or not case.truth.hidden:
            yield (), ()
            continue
        own: Strengths = (case.oracle.strength,)
        named = [Named(h.name, h.site) for h in case.truth.hidden]
        nobody = [absorbed(machine, n.name, n.site) for n in named]
        if len(named) == 1:
            yield _but(own, nobody), _but(own, nobody)
        else:
            same = [site_right(machine, *named)] * 2
            keys = [(job, name) for name in job.request]
            yield _but([beside[key] for key in keys], nobody, same), _but([alone[key] for key in keys], nobody)


def _but(strengths: Sequence[float], *never: Sequence[bool]) -> Strengths:
    """Strengths, but nothing of effects that nobody can name."""
    return tuple(0.0 if any(reasons) else s for s, *reasons in zip(strengths, *never, strict=True))


def absorbed(machine: str, name: str, site: str) -> bool:
    """Whether an effect at a site is one that nobody can tell from what the model has."""
    return not ABSORBED.isdisjoint({(machine, name, ""), (machine, name, site)})


def ask(made: Made, limit: float) -> Answer:
    """The answer to a case."""
    job, case, strengths, alone, making, error = made
    if case is None:
        known = all(EFFECTS[name.partition("@")[0]].known for name in job.request if name not in {"none", "parameters"})
        return Answer(job.machine, job.kind, job.request, job.seed, job.noise_level, known, making=making, error=error)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return replace(answered(case, job.kind, job.request, strengths, limit), alone=alone, making=making)


def _here(todo: Sequence[Job], limit: float) -> Iterator[Answer]:
    try:
        for batch in _batches(todo):
            for made in make(batch):
                yield ask(made, limit)
    except KeyboardInterrupt:
        return


def _beside(
    todo: Sequence[Job], where: Executor | Callable[[], Executor], limit: float, say: Callable[[str], None]
) -> Iterator[Answer]:
    """The same by an executor; a case whose worker died again and again is answered by that."""
    batches, folder = _batches(todo), str(Path(__file__).resolve().parent.parent)
    with Tasks[list[Job] | Job](where, say, [folder]) as tasks:
        making = 0
        try:
            while True:
                # Cases are made a little ahead of the diagnoses, not all of them first.
                most = max(2, tasks.width // BATCH)
                while making < most and tasks.count < tasks.width and (batch := next(batches, None)):
                    making += 1
                    tasks.add(batch, partial(make, batch), f"making {len(batch)} cases of {batch[0].machine}")
                if not tasks.count:
                    return
                for done in tasks.answered():
                    if isinstance(done.error, KeyboardInterrupt):
                        return
                    making -= isinstance(done.key, list)
                    if isinstance(done.key, Job):
                        yield done.value if done.error is None else _lost(done.key, done.error)
                    elif done.error is not None:
                        yield from (_lost(job, done.error) for job in done.key)
                    else:
                        for made in done.value:
                            name = f"{made[0].machine}, seed {made[0].seed}: {', '.join(made[0].request)}"
                            tasks.add(made[0], partial(ask, made, limit), name)
        except KeyboardInterrupt:
            return


def _lost(job: Job, error: BaseException) -> Answer:
    """The answer to a case that nobody could answer; a defect of the proving ground itself is raised."""
    if not isinstance(error, ExecutorError):
        raise error
    return ask((job, None, (), (), 0.0, str(error)), 0.0)


def save_json(found: Sequence[Answer], path: Path) -> None:
    """Every answer, one to a line."""
    lines = ",\n".join(json.dumps(answer.to_dict()) for answer in found)
    write_text(path, f"[\n{lines}\n]\n")


def load_json(path: Path) -> list[Answer]:
    """The answers of a file."""
    return [Answer.from_dict(entry) for entry in json.loads(path.read_text(encoding="utf-8"))]


__all__ = ["KINDS", "Job", "answers", "ask", "jobs", "line", "load_json", "make", "save_json", "sites_of"]
