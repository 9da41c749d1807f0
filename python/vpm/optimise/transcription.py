"""From a task to a nonlinear program: direct collocation on Radau's points.

Source: J. T. Betts, "Practical Methods for Optimal Control and Estimation Using Nonlinear Programming", 2nd edition
2010, chapter 4. States are polynomials of degree three in each interval that fulfil the equations of motion at
Radau's points; commands run straight between the nodes, so that their limits and those of their rates hold everywhere.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array

from vpm.numbers import Array
from vpm.optimise.channels import Channels
from vpm.optimise.collocation import DERIVATIVE, POINTS, STAGES, WEIGHTS
from vpm.optimise.equations import Equations, Expression, casadi
from vpm.optimise.motion import MeshMotion
from vpm.optimise.program import Group, Program
from vpm.optimise.task import RATE, End, Fitted, Limit

LARGE = 1e19  # IPOPT takes it for infinite


@dataclass(frozen=True)
class Scales:
    """Sizes of states, commands and durations, by which variables are divided."""

    states: Array
    commands: Array
    durations: Array


@dataclass(frozen=True)
class Row:
    """A constraint: what a message calls it, between which numbers, and the size that makes 1 of its unit."""

    name: str
    unit: str
    least: float
    most: float
    scale: float


class Transcription:
    """Variables, constraints and their numbers for one task on one mesh."""

    def __init__(self, own: Equations, task: Fitted, scales: Scales, meshes: tuple[Array, ...]) -> None:
        self.own, self.task, self.scales, self.meshes = own, task, scales, meshes
        self.channels = Channels(own)
        self.nx, self.nu = len(own.states), len(own.commands)
        self.nv = self.nx + 2 * self.nu + 1
        self.rests = (task.begin.rest, *(phase.end.rest for phase in task.phases))
        points = STAGES * sum(mesh.size - 1 for mesh in meshes) + 1
        nodes = np.cumsum([0, *(mesh.size for mesh in meshes)])
        self._u = points * self.nx + self.nu * nodes
        # Each interval has a duration of its own, equal to its neighbour's: a column of all would fill the matrix.
        self._t = int(self._u[-1]) + np.cumsum([0, *(mesh.size - 1 for mesh in meshes)])
        self._r = int(self._t[-1])
        self._s = self._r + self.nu * sum(self.rests)
        self.points = points
        self.rows: list[Row] = []
        self._linear: list[tuple[int, int, float]] = []
        self._slacks = 0
        self._groups: list[tuple[Any, list[list[tuple[int, int, float]]], list[tuple[int, int, float]]]] = []
        self._cost: list[tuple[int, float]] = []
        self._build()

    # ---- places of variables -----------------------------------------------------------------------------------------

    def x(self, point: int) -> int:
        """Index in the transcription at which the state of a point begins."""
        return point * self.nx

    def u(self, phase: int, node: int) -> int:
        """Index in the transcription at which the commands of a node begin."""
        return int(self._u[phase]) + node * self.nu

    def t(self, phase: int, interval: int) -> int:
        """Index in the transcription of a phase's duration, as an interval sees it."""
        return int(self._t[phase]) + interval

    def r(self, end: int) -> int:
        """Index in the transcription at which the commands of the rest at an end begin."""
        return self._r + self.nu * sum(self.rests[:end])

    # ---- building ----------------------------------------------------------------------------------------------------

    def _build(self) -> None:
        first = 0
        for phase, mesh in enumerate(self.meshes):
            self._dynamics(phase, mesh, first)
            self._command_rates(phase, mesh)
            first += STAGES * (mesh.size - 1)
            self._end(self.task.phases[phase].end, phase + 1, first, phase, mesh.size - 1)
            self._cost.append((self.t(phase, 0), self.task.weights.get("time", 0.0) * self.scales.durations[phase]))
        self._path(0, [(0, 0, 0.0)])
        self._end(self.task.begin, 0, 0, 0, 0)
        self._joined()

    def _dynamics(self, phase: int, mesh: Array, first: int) -> None:
        ca, own, widths = casadi(), self.own, np.diff(mesh)
        T = self.channels.T
        results = [T * own.rates / self.scales.states]
        energy = self.task.weights.get("energy", 0.0)
        if energy:
            results.append(T * ca.sumsqr(own.u) * energy)
        group = ca.vertcat(*results)
        size, puts = self.nx + bool(energy), []
        places: list[list[tuple[int, int, float]]] = []
        for k, width in enumerate(widths):
            for i in range(STAGES):
                at = len(places)
                places.append(self._place(phase, k, POINTS[i], first + STAGES * k + i + 1))
                for state in range(self.nx):
                    row = self._row(Row("the equations of motion", "1", 0.0, 0.0, 1.0))
                    for j in range(STAGES + 1):
                        self._linear.append((row, self.x(first + STAGES * k + j) + state, DERIVATIVE[i, j]))
                    puts.append((row, at * size + state, -width))
                if energy:
                    puts.append((-1, at * size + self.nx, width * WEIGHTS[i]))
        self._groups.append((group, places, puts))
        where = [(k, first + STAGES * k + i + 1, POINTS[i]) for k in range(widths.size) for i in range(STAGES)]
        self._path(phase, where)

    def _path(self, phase: int, where: list[tuple[int, int, float]]) -> None:
        """Transcribed limits of what is neither a state nor a command, at points (interval, point, share)."""
        ca = casadi()
        limits = [one for one in self.task.phases[phase].limits if not self._is_bound(one.channel)]
        rows = [(self._scaled(one), self.channels[one.channel]) for one in limits]
        for marker, center, radius in self.task.obstacles:
            away = [(self.channels[f"{marker}.{axis}"] - c) for axis, c in zip("xyz", center, strict=True)]
            row = Row(f"the distance of {marker} from an obstacle", "1", 1.0, math.inf, 1.0)
            rows.append((row, ca.sumsqr(ca.vertcat(*away)) / radius**2))
        if not rows:
            return
        places = [self._place(phase, k, share, point) for k, point, share in where]
        puts = [
            (self._row(row), at * len(rows) + number, 1.0)
            for at in range(len(places))
            for number, (row, _) in enumerate(rows)
        ]
        self._groups.append((ca.vertcat(*(value / row.scale for row, value in rows)), places, puts))

    def _command_rates(self, phase: int, mesh: Array) -> None:
        for limit in self.task.phases[phase].limits:
            if limit.channel.removesuffix(RATE) not in self.own.commands or not limit.channel.endswith(RATE):
                continue
            column = self.own.commands.index(limit.channel.removesuffix(RATE))
            size, T = self.scales.commands[column], self.scales.durations[phase]
            for k, width in enumerate(np.diff(mesh)):
                for end, lower in ((limit.least, 0.0), (limit.most, -math.inf)):
                    if math.isfinite(end):
                        least, most = (lower, math.inf if lower == 0.0 else 0.0)
                        row = self._row(Row(limit.channel, limit.unit, least, most, size / (T * width)))
                        self._linear += [
                            (row, self.u(phase, k + 1) + column, 1.0),
                            (row, self.u(phase, k) + column, -1.0),
                            (row, self.t(phase, k), -end * T * width / size),
                        ]

    def _end(self, end: End, number: int, point: int, phase: int, node: int) -> None:
        """Transcribed conditions of an instant, each with slacks that are zero for a possible task."""
        ca = casadi()
        last = number == len(self.meshes)
        goals = {name: weight for name, weight in self.task.weights.items() if name in self.channels} if last else {}
        values: list[Expression] = []
        puts = []
        for one in end.conditions:
            row = self._scaled(one)
            puts.append((self._soft(row), len(values), 1.0))
            values.append(self.channels[one.channel] / row.scale)
        for name, weight in goals.items():
            puts.append((-1, len(values), weight))
            values.append(self.channels[name])
        interval, share = (node - 1, 1.0) if node else (0, 0.0)
        if values:
            self._groups.append((ca.vertcat(*values), [self._place(phase, interval, share, point)], puts))
        if end.rest:
            place = self._place(phase, interval, share, point)
            rest = self.r(number)
            place = [one for one in place if not self.nx <= one[0] < self.nx + self.nu]
            place += [(self.nx + c, rest + c, self.scales.commands[c]) for c in range(self.nu)]
            sizes = self.scales.states / self.scales.durations[phase]
            when = "the beginning" if number == 0 else f"the end of {self.task.phases[phase].name}"
            rows = [
                (self._soft(Row(f"the rate of {name} at {when}", f"{unit} per s", 0.0, 0.0, size)), at, 1.0)
                for at, (name, unit, size) in enumerate(zip(self.own.states, self.own.state_units, sizes, strict=True))
            ]
            self._groups.append((self.own.rates / sizes, [place], rows))

    def _joined(self) -> None:
        """Transcribed joints of intervals: common durations, continuous commands, closed periods."""
        for phase, mesh in enumerate(self.meshes):
            for k in range(mesh.size - 2):
                row = self._row(Row("the duration", "1", 0.0, 0.0, 1.0))
                self._linear += [(row, self.t(phase, k), 1.0), (row, self.t(phase, k + 1), -1.0)]
        last = len(self.meshes) - 1
        for column, name in enumerate(self.own.commands):
            limited = [any(one.channel == f"{name}{RATE}" for one in phase.limits) for phase in self.task.phases]
            pairs = []
            if self.rests[0] and limited[0]:
                pairs.append((self.r(0), self.u(0, 0)))
            for phase, mesh in enumerate(self.meshes):
                end = self.u(phase, mesh.size - 1)
                if self.rests[phase + 1] and limited[phase]:
                    pairs.append((end, self.r(phase + 1)))
                if phase < last and limited[phase] and limited[phase + 1]:
                    pairs.append((end, self.u(phase + 1, 0)))
            if self.task.periodic:
                pairs.append((self.u(last, self.meshes[last].size - 1), self.u(0, 0)))
            for a, b in pairs:
                row = self._row(Row(f"{name} without jumps", "1", 0.0, 0.0, 1.0))
                self._linear += [(row, a + column, 1.0), (row, b + column, -1.0)]
        if self.task.periodic:
            for state, (name, unit) in enumerate(zip(self.own.states, self.own.state_units, strict=True)):
                row = self._soft(Row(f"{name} as at the beginning", unit, 0.0, 0.0, self.scales.states[state]))
                self._linear += [(row, self.x(self.points - 1) + state, 1.0), (row, self.x(0) + state, -1.0)]

    # ---- parts -------------------------------------------------------------------------------------------------------

    def _place(self, phase: int, interval: int, share: float, point: int) -> list[tuple[int, int, float]]:
        """Variables of the transcription that make those of a point: row, variable, factor."""
        width = self.meshes[phase][interval + 1] - self.meshes[phase][interval]
        found = [(s, self.x(point) + s, self.scales.states[s]) for s in range(self.nx)]
        for c in range(self.nu):
            size, left, right = self.scales.commands[c], self.u(phase, interval) + c, self.u(phase, interval + 1) + c
            found += [(self.nx + c, left, (1.0 - share) * size), (self.nx + c, right, share * size)]
            slope = self.nx + self.nu + c
            found += [(slope, left, -size / width), (slope, right, size / width)]
        return [*found, (self.nv - 1, self.t(phase, interval), self.scales.durations[phase])]

    def _is_bound(self, channel: str) -> bool:
        base = channel.removesuffix(RATE)
        return channel in self.own.states or channel in self.own.commands or base in self.own.commands

    def _scaled(self, limit: Limit) -> Row:
        return Row(limit.channel, limit.unit, limit.least, limit.most, self.channels.size(limit, self.scales.states))

    def _row(self, row: Row) -> int:
        self.rows.append(row)
        return len(self.rows) - 1

    def _soft(self, row: Row) -> int:
        number = self._row(row)
        self._linear += [(number, self._s + self._slacks, -1.0), (number, self._s + self._slacks + 1, 1.0)]
        self._slacks += 2
        return number

    # ---- results -----------------------------------------------------------------------------------------------------

    @property
    def size(self) -> int:
        """Number of variables of the transcription."""
        return self._s + self._slacks

    def program(self) -> Program:
        """Transcribed nonlinear program of a task on a mesh."""
        ng, nz = len(self.rows), self.size
        groups = []
        for results, places, puts in self._groups:
            V = [(at * self.nv + row, column, value) for at, place in enumerate(places) for row, column, value in place]
            B = [(ng if row < 0 else row, column, value) for row, column, value in puts]
            groups.append(
                Group(
                    self.channels.variables,
                    results,
                    len(places),
                    csr_array(_sparse(V, (len(places) * self.nv, nz))),
                    csc_array(_sparse(B, (ng + 1, len(places) * results.numel()))),
                )
            )
        c, slack = np.zeros(nz), np.zeros(nz)
        for at, value in self._cost:
            c[at] += value
        slack[self._s :] = 1.0
        return Program(csr_array(_sparse(self._linear, (ng, nz))), groups, slack, c)

    def bounds(self, *, soft: bool) -> dict[str, Array]:
        """Bounds of the transcription's variables and constraints; ``soft`` lets conditions be missed."""
        low, high = np.full(self.size, -LARGE), np.full(self.size, LARGE)
        sizes = {name: ("x", at, self.scales.states[at]) for at, name in enumerate(self.own.states)}
        sizes |= {name: ("u", at, self.scales.commands[at]) for at, name in enumerate(self.own.commands)}
        first = 0
        for phase, (part, mesh) in enumerate(zip(self.task.phases, self.meshes, strict=True)):
            own = slice(self.t(phase, 0), self.t(phase, mesh.size - 1))
            low[own], high[own] = (end / self.scales.durations[phase] for end in (part.shortest, part.longest))
            last = first + STAGES * (mesh.size - 1)
            for one in part.limits:
                if one.channel not in sizes:
                    continue
                kind, at, size = sizes[one.channel]
                if kind == "x":
                    columns = [self.x(point) + at for point in range(first, last + 1)]
                else:
                    columns = [self.u(phase, node) + at for node in range(mesh.size)]
                    ends = [end for end in ((0,) if phase == 0 else ()) if self.rests[end]]
                    ends += [phase + 1] if self.rests[phase + 1] else []
                    columns += [self.r(end) + at for end in ends]
                low[columns] = np.maximum(low[columns], one.least / size)
                high[columns] = np.minimum(high[columns], one.most / size)
            first = last
        low[self._s :], high[self._s :] = 0.0, LARGE if soft else 0.0
        least = np.array([row.least / row.scale for row in self.rows])
        most = np.array([row.most / row.scale for row in self.rows])
        return {"lbx": low, "ubx": high, "lbg": np.maximum(least, -LARGE), "ubg": np.minimum(most, LARGE)}

    def pack(self, motion: MeshMotion) -> Array:
        """Variables of the transcription from a motion on a mesh."""
        z = np.zeros(self.size)
        z[: self.points * self.nx] = (motion.states / self.scales.states).ravel()
        z[self.points * self.nx : self._t[0]] = np.concatenate(
            [(u / self.scales.commands).ravel() for u in motion.commands]
        )
        counts = [mesh.size - 1 for mesh in self.meshes]
        z[self._t[0] : self._r] = np.repeat(motion.durations / self.scales.durations, counts)
        held = [one / self.scales.commands for one in motion.rests if one is not None]
        if held:
            z[self._r : self._s] = np.concatenate(held)
        return z

    def unpack(self, z: Array) -> MeshMotion:
        """Motion on a mesh from variables of the transcription."""
        states = z[: self.points * self.nx].reshape(-1, self.nx) * self.scales.states
        commands = tuple(
            z[self._u[at] : self._u[at + 1]].reshape(-1, self.nu) * self.scales.commands
            for at in range(len(self.meshes))
        )
        rests = tuple(
            z[self.r(end) : self.r(end) + self.nu] * self.scales.commands if there else None
            for end, there in enumerate(self.rests)
        )
        return MeshMotion(self.meshes, z[self._t[:-1]] * self.scales.durations, states, commands, rests)

    def missed(self, z: Array) -> list[tuple[str, str, float, float]]:
        """Conditions that a soft solution of the transcription misses: name, unit, value, demand; worst first."""
        slack = z[self._s :].reshape(-1, 2)
        soft = sorted({row for row, column, _ in self._linear if column >= self._s})
        found = []
        for number, (over, under) in zip(soft, slack, strict=True):
            row, size = self.rows[number], float(over - under)
            wanted = row.most if size > 0.0 else row.least
            found.append((abs(size), (row.name, row.unit, wanted + size * row.scale, wanted)))
        return [one for size, one in sorted(found, reverse=True) if size > 1e-6]


def _sparse(entries: list[tuple[int, int, float]], shape: tuple[int, int]) -> coo_array:
    rows = np.array([one[0] for one in entries], dtype=np.int64)
    columns = np.array([one[1] for one in entries], dtype=np.int64)
    return coo_array((np.array([one[2] for one in entries], dtype=np.float64), (rows, columns)), shape=shape)
