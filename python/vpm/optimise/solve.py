"""The search: a coarse mesh first, finer where the equations ask for it, and what to say when there is no motion."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from types import FrameType
from typing import Any

import numpy as np

from vpm.errors import OptimisationError, VpmError
from vpm.model import Model
from vpm.numbers import Array
from vpm.optimise.channels import Channels
from vpm.optimise.equations import casadi, equations
from vpm.optimise.kept import binding
from vpm.optimise.mesh import bends, errors, finer
from vpm.optimise.motion import MeshMotion
from vpm.optimise.start import complete, ends, scales, simulated, way
from vpm.optimise.task import Fitted, Limit
from vpm.optimise.transcription import Scales, Transcription

#: Called with a sentence about what is being done.
Progress = Callable[[str], object]
#: Iterations of IPOPT on one mesh.
ITERATIONS = 2000
_GOOD = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


@dataclass
class Search:
    """State of a search for an optimal motion: its best motion, cost, error, and how it came there."""

    channels: Channels
    task: Fitted
    scales: Scales
    motion: MeshMotion
    objective: float = float("nan")
    error: float = float("inf")
    status: str = "interrupted"
    rounds: int = 0
    iterations: int = 0
    seconds: float = 0.0
    known: bool = False
    notes: list[str] = field(default_factory=list)


class SearchInterruptedError(KeyboardInterrupt):
    """Ctrl-C during a search, with what it knew."""

    def __init__(self, search: Search) -> None:
        super().__init__("interrupted")
        self.search = search


def search(model: Model, given: Fitted, progress: Progress, start: MeshMotion | None = None) -> Search:
    """Solve for the best motion on a mesh that is fine enough, from another motion if there is one.

    Raises `OptimisationError`: no motion fulfils the task; the sentence says by how much the nearest one fails.
    Raises `SearchInterruptedError`: Ctrl-C.
    """
    task = complete(model, given)
    channels = Channels(equations(model))
    points = ends(model, task, channels)
    sizes = scales(task, channels, points)
    meshes = tuple(np.linspace(0.0, 1.0, phase.intervals + 1) for phase in task.phases)
    motion = start or way(task, channels, points, sizes.durations, meshes)
    if start is None and any(phase.guess for phase in task.phases):
        motion = simulated(model, task, channels, motion)
    elif start is None and (stiff := _stiff(model, given, progress)) is not None:
        motion = _bent(channels, motion, stiff)
    found = Search(channels, task, sizes, motion, known=start is not None)
    try:
        _refine(found, progress)
    except KeyboardInterrupt:
        raise SearchInterruptedError(found) from None
    return found


def _refine(found: Search, progress: Progress) -> None:
    task, start = found.task, found.motion
    for number in range(task.refinements + 1):
        count = sum(mesh.size - 1 for mesh in start.meshes)
        run = _Run(found, start, _prefixed(progress, f"{count} intervals"), warm=found.known or number > 0)
        run.solve()
        if run.status not in _GOOD and number == 0:
            run = _calm(found, progress) or run
        if run.status not in _GOOD:
            if number == 0:
                raise OptimisationError(_why(found, run))
            found.notes.append(f"The search on {count} intervals ended with {run.status}; the mesh before it stands.")
            return
        found.motion, found.objective, found.status = run.motion, run.objective, "optimal"
        found.rounds = number + 1
        wrong = errors(found.channels, found.motion, found.scales)
        bent = bends(task, found.channels.own.commands, found.motion, found.scales)
        found.error = max(float(one.max()) for one in wrong)
        meshes = tuple(
            finer(mesh, error, bend, task.tolerance)
            for mesh, error, bend in zip(found.motion.meshes, wrong, bent, strict=True)
        )
        if all(new.size == old.size for new, old in zip(meshes, found.motion.meshes, strict=True)):
            if found.error > task.tolerance:
                found.notes.append("The mesh has as many intervals as it may have.")
            return
        start = found.motion.on(meshes)
    refinements = f"{task.refinements} refinement{'' if task.refinements == 1 else 's'}"
    found.notes.append(f"After {refinements} the mesh is still coarser than the tolerance asks for.")


def _prefixed(progress: Progress, what: str) -> Progress:
    return lambda text: progress(f"{what}, {text}")


def _calm(found: Search, progress: Progress) -> _Run | None:
    """Solve first for the motion of least energy in a fixed time, which is found more easily; or None."""
    task, start = found.task, found.motion
    for share in (1.0, 0.5):
        times = tuple(part.longest**share * part.shortest ** (1.0 - share) for part in task.phases)
        phases = tuple(
            replace(part, shortest=time, longest=time) for part, time in zip(task.phases, times, strict=True)
        )
        found.task = replace(task, phases=phases, weights={"energy": 1.0})
        slow = replace(start, durations=np.array(times))
        easier = _Run(found, slow, _prefixed(progress, "least energy in a fixed time first"), warm=False)
        found.task = task
        easier.solve()
        if easier.status in _GOOD:
            run = _Run(found, easier.motion, _prefixed(progress, "from least energy"), warm=False)
            run.solve()
            if run.status in _GOOD:
                return run
    return None


class _Run:
    """IPOPT on one mesh, which keeps the best iterate."""

    def __init__(self, found: Search, start: MeshMotion, progress: Progress, *, warm: bool) -> None:
        self.found, self.warm = found, warm
        self.form = Transcription(found.channels.own, found.task, found.scales, start.meshes)
        self.program = self.form.program()
        self.status, self.objective, self.motion = "", float("nan"), start
        self._progress = progress
        self.z = self.form.pack(start)

    def solve(self, *, soft: bool = False) -> None:
        options: dict[str, Any] = {
            "print_level": 0,
            "sb": "yes",
            "max_iter": ITERATIONS,
            "tol": min(1e-5, max(1e-8, 1e-2 * self.found.task.tolerance)),  # a hundredth of what the mesh may miss
            "mu_strategy": "adaptive",
        }
        if not soft and (self.warm or any(phase.guess for phase in self.found.task.phases)):
            # A start that keeps to the equations is not pushed far into the limits.
            options |= {"mu_strategy": "monotone", "bound_mult_init_method": "mu-based", "mu_init": 1e-3}
            if self.warm:
                options |= {"mu_init": 1e-4, "bound_push": 1e-6, "bound_frac": 1e-6}
        watch = _watch(self)
        solver = self.program.solver(options, watch)
        bounds = self.form.bounds(soft=soft)
        start = np.clip(self.z, bounds["lbx"], bounds["ubx"])
        try:
            with _listening(watch):
                result = solver(x0=start, p=float(soft), **bounds)
        except KeyboardInterrupt:
            self._keep()
            raise
        except RuntimeError as error:  # the library's own
            raise OptimisationError(f"IPOPT cannot take the task: {str(error).splitlines()[-1]}") from error
        self.status = str(solver.stats()["return_status"])
        if watch.interrupted:
            self._keep()
            raise KeyboardInterrupt
        self.z = np.array(result["x"].full()).ravel()
        self.objective = float(result["f"])
        self.motion = self.form.unpack(self.z)

    def _keep(self) -> None:
        """Keep the solver's last iterate, unless the optimum on a coarser mesh is there."""
        if self.found.rounds:
            self.found.notes.append("Ctrl-C ended the search before the mesh was fine enough.")
        else:
            self.found.motion, self.found.objective = self.form.unpack(self.z), self.objective

    def seen(self, z: Array, cost: float, violation: float) -> None:
        """Iterate of the solver IPOPT."""
        self.found.iterations += 1
        self.z, self.objective = z, cost
        self._progress(f"iteration {self.found.iterations}: {cost:.6g}, misses {violation:.1e}")


@contextmanager
def _listening(watch: Any) -> Iterator[None]:  # noqa: ANN401
    """End the solver by Ctrl-C after the iteration: inside of one it would be an error."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before in {signal.SIG_IGN, None}:
        yield
        return

    def press(_number: int, _frame: FrameType | None) -> None:
        watch.interrupted = True

    signal.signal(signal.SIGINT, press)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _watch(run: _Run) -> Any:  # noqa: ANN401
    """Callback that the solver IPOPT calls after every iteration."""
    ca = casadi()
    nx, ng = run.form.size, len(run.form.rows)
    limits = run.form.bounds(soft=False)
    sizes = {"x": nx, "f": 1, "g": ng, "lam_x": nx, "lam_g": ng, "lam_p": 1}

    class Watch(ca.Callback):  # type: ignore[misc, name-defined, unused-ignore]
        interrupted = False

        def __init__(self) -> None:
            ca.Callback.__init__(self)
            self.construct("watch", {})

        def get_n_in(self) -> int:
            return int(ca.nlpsol_n_out())

        def get_n_out(self) -> int:
            return 1

        def get_name_in(self, i: int) -> str:
            return str(ca.nlpsol_out(i))

        def get_sparsity_in(self, i: int) -> Any:  # noqa: ANN401
            return ca.Sparsity.dense(sizes[ca.nlpsol_out(i)], 1)

        def eval(self, arguments: Any) -> list[int]:  # noqa: ANN401
            try:
                g = np.array(arguments[2].full()).ravel()
                missed = np.maximum(limits["lbg"] - g, g - limits["ubg"]).max(initial=0.0)
                run.seen(np.array(arguments[0].full()).ravel(), float(arguments[1]), float(missed))
            except KeyboardInterrupt:
                self.interrupted = True
            return [int(self.interrupted)]

    return Watch()


def _why(found: Search, run: _Run) -> str:
    """Why there is no solution: the nearest motion, what it misses and which limits bind."""
    soft = _Run(found, found.motion, lambda _: None, warm=False)
    soft.solve(soft=True)
    missed = soft.form.missed(soft.z)
    if soft.status not in _GOOD:
        return f"no motion was found within the limits ({soft.status}): {_worst(soft)}; allow more, or more intervals"
    if not missed:
        return f"the search ended with {run.status}, though motions exist; give more intervals or other limits of time"
    what, unit, there, wanted = missed[0]
    held = tuple(binding(found.channels, found.task, soft.motion))
    limits = f", and {' and '.join(held)}" if held else ""
    unit = "" if unit == "1" else f" {unit}"
    return (
        f"the search found no motion that fulfils the task: the nearest one has {what} {there:.5g}{unit} in place of "
        f"{wanted:.5g}{unit}{limits}; allow more, or ask for less"
    )


def _worst(run: _Run) -> str:
    """Constraint that the solver's last iterate misses most."""
    bounds, (problem, _) = run.form.bounds(soft=True), run.program.functions()
    function = casadi().Function("g", [problem["x"], problem["p"]], [problem["g"]])
    g = np.array(function(run.z, 1.0).full()).ravel()
    missed = np.maximum(bounds["lbg"] - g, g - bounds["ubg"])
    row = run.form.rows[int(np.argmax(missed))]
    return f"it misses {row.name} by {missed.max() * row.scale:.4g} {row.unit}"


def _stiff(model: Model, task: Fitted, progress: Progress) -> MeshMotion | None:
    """Solution for the machine with rigid links, on a coarse mesh, where it has flexible ones."""
    if not model.beams or all(not name.startswith(tuple(model.beams)) for name in model.coordinates):
        return None
    rigid = model.at("rigid")
    known = {*rigid.state_names, *rigid.output_channels}

    def kept(limits: tuple[Limit, ...]) -> tuple[Limit, ...]:
        return tuple(one for one in limits if one.channel.removesuffix(".rate") in known)

    try:
        phases = tuple(
            replace(one, limits=kept(one.limits), end=replace(one.end, conditions=kept(one.end.conditions)))
            for one in task.phases
        )
        begin = replace(task.begin, conditions=kept(task.begin.conditions))
        coarse = replace(task, phases=phases, begin=begin, refinements=0)
        return search(rigid, coarse, _prefixed(progress, "rigid links first")).motion
    except VpmError:
        return None


def _bent(channels: Channels, motion: MeshMotion, stiff: MeshMotion) -> MeshMotion:
    """Start of the solver: the motion of rigid links, with links that bend as at rest at both ends."""
    states, names = motion.states.copy(), channels.own.states
    elastic = states.shape[1] - stiff.states.shape[1]
    half = sum(name.endswith(".velocity") for name in names)
    joints = half - elastic // 2
    rigid_half = joints
    states[:, :joints] = stiff.states[:, :joints]
    states[:, half : half + joints] = stiff.states[:, rigid_half : 2 * rigid_half]
    states[:, 2 * half :] = stiff.states[:, 2 * rigid_half :]
    return replace(motion, durations=stiff.durations, states=states, commands=stiff.commands)
