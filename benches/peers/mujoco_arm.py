"""The two-link flexible arm as a chain of rigid segments with elastic hinges, in MuJoCo."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from reference_arm import DURATION, P, swing

Array = NDArray[np.float64]

VERSION = mujoco.__version__
#: Hinges of each link.
SEGMENTS = 16
#: MuJoCo takes no bodies without mass.
NOTHING = 1e-9


def weight(mass: float, inertia: float, x: float, length: float = 0.0) -> str:
    """Body welded to the one around it."""
    moment = max(inertia, mass * length**2 / 12, NOTHING)
    return (
        f'<body pos="{x} 0 0"><inertial pos="{length / 2} 0 0" mass="{max(mass, NOTHING)}" '
        f'diaginertia="{moment} {moment} {moment}"/></body>'
    )


def link(k: int, inside: str) -> str:
    """One link: hinges in the middle of equal cells, so that half a cell is rigid at both ends."""
    length, stiffness = P[f"l{k}"], P["E"] * P["b"] * P["h"] ** 3 / 12
    cell, density = length / SEGMENTS, P["rho"] * P["b"] * P["h"]
    hinge = f'stiffness="{stiffness / cell}" damping="{P["beta"] * stiffness / cell}"'
    text = weight(density * cell / 2, 0.0, 0.0, cell / 2) + inside.replace("AT", str(cell / 2))
    for segment in reversed(range(SEGMENTS)):
        x = cell / 2 if segment == 0 else cell
        own = weight(density * cell, 0.0, 0.0, cell) if segment < SEGMENTS - 1 else ""
        text = f'<body pos="{x} 0 0"><joint name="e{k}_{segment}" type="hinge" axis="0 0 1" {hinge}/>{own}{text}</body>'
    hub = weight(0.0, P[f"Jh{k}"], 0.0) + weight(density * cell / 2, 0.0, 0.0, cell / 2)
    return f'<body pos="AT 0 0"><joint name="q{k}" type="hinge" axis="0 0 1"/>{hub}{text}</body>'


class MujocoArm:
    """The arm, ready to run in fixed steps."""

    def __init__(self, motion: str, step: float) -> None:
        tip = '<site name="tip" pos="AT 0 0"/>' + weight(P["mt"], 0.0, 0.0).replace('pos="0.0 0 0"', 'pos="AT 0 0"', 1)
        elbow = weight(P["me"], P["Je"], 0.0).replace('pos="0.0 0 0"', 'pos="AT 0 0"', 1)
        arm = link(1, elbow + link(2, tip)).replace("AT", "0", 1)
        servos = "".join(
            f'<general joint="q{k}" gainprm="1 0 0" biastype="affine" biasprm="0 {-P[f"kp{k}"]} {-P[f"kd{k}"]}"/>'
            for k in (1, 2)
        )
        self.model = mujoco.MjModel.from_xml_string(
            f'<mujoco><option timestep="{step}" gravity="0 {-P["g"]} 0" integrator="implicitfast">'
            f'<flag contact="disable" constraint="disable"/></option><worldbody>{arm}</worldbody>'
            f'<actuator>{servos}</actuator><sensor><framepos objtype="site" objname="tip"/></sensor></mujoco>'
        )
        self.data = mujoco.MjData(self.model)
        self.steps, self.every = round(DURATION / step), round(0.1 / step)
        course = swing(motion)
        # Commands are held over a step: those of its middle are second-order accurate.
        time = (np.arange(self.steps) + 0.5) * step
        speed = 2 * np.pi / course.period
        angle, rate = course.angle(time), course.amplitude / 2 * speed * np.sin(speed * time)
        self.control = np.stack([P[f"kp{k}"] * angle + P[f"kd{k}"] * rate for k in (1, 2)], axis=1)
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self.start = np.zeros(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, self.start, kind)

    def run(self) -> tuple[Array, Array]:
        """Tips (m) and strains at 10 Hz from 0.1 s on."""
        state, sensor = rollout.rollout(self.model, self.data, self.start[None], self.control[None], nstep=self.steps)
        rows = slice(self.every - 1, None, self.every)
        # A row of sensors belongs to the beginning of its step: one row later is the sample.
        tips = sensor[0][np.minimum(np.arange(self.every, self.steps + 1, self.every), self.steps - 1), :2]
        return tips, self._strains(state[0][rows])

    def _strains(self, state: Array) -> Array:
        found = []
        for k in (1, 2):
            cell = P[f"l{k}"] / SEGMENTS
            at = (np.arange(SEGMENTS) + 0.5) * cell
            adr = [self.model.joint(f"e{k}_{segment}").qposadr[0] for segment in range(SEGMENTS)]
            curvature = state[:, 1 + np.array(adr)] / cell  # the state begins with the time
            found.append([np.interp(P["gauge"], at, row) for row in curvature])
        return P["h"] / 2 * np.array(found).T
