"""The two-link flexible arm with geometrically exact beam elements of three nodes, in Exudyn.

Settings are those that make it fastest here: the build without range checks, symbolic functions instead of Python ones
for the references (nothing calls Python while it runs), a modified Newton method, one thread, no files, sensors at
10 Hz, the linear solver that a trial run finds fastest, and a Newton tolerance of 1e-4: 1e-8, the default, takes a
fifth to a half longer at almost the same errors, 1e-3 loses accuracy, 1e-2 fails. A Jacobian that is renewed in each
step pays at small steps and loses accuracy at large ones, so both ways are offered.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_arm import DURATION, P, swing

sys.exudynFast = True  # type: ignore[attr-defined]  # read by exudyn when it is imported

import exudyn as exu  # noqa: E402
from exudyn import itemInterface as items  # noqa: E402, N813
from exudyn.advancedUtilities import CreateSymbolicUserFunction  # noqa: E402

Array = NDArray[np.float64]

VERSION = exu.__version__
SOLVERS = ("EXUdense", "EigenDense", "EigenSparse")


class ExudynArm:
    """The arm with so many elements per link, ready to run once."""

    def __init__(
        self, motion: str, elements: int, step: float, solver: str, *, renew: bool, duration: float = DURATION
    ) -> None:
        self.system = exu.SystemContainer()
        self.mbs = self.system.AddSystem()
        self.kept: list[object] = []  # symbolic functions have to outlive the run
        self.elements = elements
        self.settings = self._settings(step, solver, renew, duration)
        self._build(motion)

    def run(self) -> tuple[Array, Array]:
        """Tips (m) and strains at 10 Hz from 0.1 s on."""
        self.mbs.SolveDynamic(self.settings)
        tip, *curvatures = (self.mbs.GetSensorStoredData(sensor)[1:] for sensor in self.sensors)
        return tip[:, 1:3], P["h"] / 2 * np.stack([table[:, -1] for table in curvatures], axis=1)

    @staticmethod
    def _settings(step: float, solver: str, renew: bool, duration: float) -> Any:  # noqa: ANN401
        settings = exu.SimulationSettings()
        integration = settings.timeIntegration
        integration.numberOfSteps, integration.endTime = round(duration / step), duration
        integration.verboseMode = 0
        integration.newton.useModifiedNewton = True
        integration.newton.modifiedNewtonJacUpdatePerStep = renew
        integration.newton.relativeTolerance, integration.newton.absoluteTolerance = 1e-4, 1e-6
        integration.generalizedAlpha.spectralRadius = 0.9
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = 0.1
        settings.parallel.numberOfThreads = 1
        settings.linearSolverType = getattr(exu.LinearSolverType, solver)
        return settings

    def _build(self, motion: str) -> None:
        first, beams1 = self._link(0.0, P["l1"])
        second, beams2 = self._link(P["l1"], P["l2"])
        for node, mass, inertia in (
            (first[0], 0.0, P["Jh1"]),
            (first[-1], P["me"], P["Je"]),
            (second[0], 0.0, P["Jh2"]),
            (second[-1], P["mt"], 0.0),
        ):
            body = self.mbs.AddObject(items.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
            if mass > 0.0:
                self._weigh(body)
        ground = self._marker(self.mbs.AddNode(items.NodePointGround()), 0)
        for axis in (0, 1):
            hinge = [self._marker(first[-1], axis), self._marker(second[0], axis)]
            self.mbs.AddObject(items.CoordinateConstraint(markerNumbers=[ground, self._marker(first[0], axis)]))
            self.mbs.AddObject(items.CoordinateConstraint(markerNumbers=hinge))
        shoulder, elbow = self._marker(first[0], 2), [self._marker(first[-1], 2), self._marker(second[0], 2)]
        self._servo(motion, [ground, shoulder], P["kp1"], P["kd1"])
        self._servo(motion, elbow, P["kp2"], P["kd2"])
        kinds = exu.OutputVariableType
        record = {"storeInternal": True, "writeToFile": False}
        tip = items.SensorNode(nodeNumber=second[-1], outputVariableType=kinds.Position, **record)
        self.sensors = [self.mbs.AddSensor(tip)]
        for beams, length in ((beams1, P["l1"]), (beams2, P["l2"])):
            at = P["gauge"] - length / self.elements / 2  # counted from the middle of the element
            gauge = items.SensorBody(
                bodyNumber=beams[0], localPosition=[at, 0, 0], outputVariableType=kinds.CurvatureLocal, **record
            )
            self.sensors.append(self.mbs.AddSensor(gauge))
        self.mbs.Assemble()

    def _link(self, x: float, length: float) -> tuple[list[Any], list[Any]]:
        count, area = 2 * self.elements, P["b"] * P["h"]
        bending = P["E"] * area * P["h"] ** 2 / 12
        nodes = [
            self.mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[x + length * k / count, 0, 0]))
            for k in range(count + 1)
        ]
        beams = []
        for element in range(self.elements):
            beam = items.ObjectBeamGeometricallyExact2D(
                nodeNumbers=nodes[2 * element : 2 * element + 3],
                length=length / self.elements,
                massPerLength=P["rho"] * area,
                crossSectionInertia=P["rhoI"],
                bendingStiffness=bending,
                axialStiffness=P["E"] * area,
                shearStiffness=P["G"] * area * P["ks"],
                bendingDamping=P["beta"] * bending,
            )
            beams.append(self.mbs.AddObject(beam))
            self._weigh(beams[-1])
        return nodes, beams

    def _servo(self, motion: str, markers: list[Any], gain: float, damping: float) -> None:
        spring = items.CoordinateSpringDamper(markerNumbers=markers, stiffness=gain, damping=damping)
        self.mbs.AddObject(spring)
        course, sides = swing(motion), zip(markers, (-1.0, 1.0), strict=True)
        speed = 2 * np.pi / course.period
        for marker, sign in sides:
            if marker != markers[0] or len(self.kept) > 0:  # the ground needs no reaction
                pull = _pull(sign * gain * course.amplitude / 2, sign * damping * course.amplitude / 2 * speed, speed)
                torque = CreateSymbolicUserFunction(self.mbs, pull, "loadUserFunction", itemTypeName="LoadCoordinate")
                self.kept.append(torque)
                load = items.LoadCoordinate(markerNumber=marker, load=1.0, loadUserFunction=torque)
                self.mbs.AddLoad(load)

    def _marker(self, node: object, coordinate: int) -> Any:  # noqa: ANN401
        return self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))

    def _weigh(self, body: object) -> None:
        marker = self.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=body))
        self.mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=[0, -P["g"], 0]))


def _pull(angle: float, rate: float, speed: float) -> Callable[..., Any]:
    """Torque of a servo toward its reference, for the part that does not depend on the motion."""

    def pull(mbs: Any, t: Any, load: Any) -> Any:  # noqa: ANN401, ARG001  # names that exudyn reads
        return float(angle) * (1 - exu.symbolic.cos(float(speed) * t)) + float(rate) * exu.symbolic.sin(
            float(speed) * t
        )

    return pull


def fastest_solver(elements: int, step: float, renew: bool) -> str:
    """The linear solver that runs the first second fastest."""

    def trial(solver: str) -> float:
        durations = []
        for _ in range(3):
            arm = ExudynArm("fast", elements, step, solver, renew=renew, duration=1.0)
            begin = time.perf_counter()
            arm.run()
            durations.append(time.perf_counter() - begin)
        return min(durations)

    return min(SOLVERS, key=trial)
