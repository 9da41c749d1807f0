"""Two flexible links in a plane as chains of point masses, with all of the geometry, many cases side by side.

A link is cut into segments; half of a segment's mass sits at each of its ends, a spring keeps its length, and at each
node a rotary spring of the beam's bending stiffness per segment resists the turn, at clamped ends one of twice that.
Its damping is a spring and a damper in a row beside each rotary spring (a standard linear solid), at low frequencies
that of Kelvin and Voigt with the same time. Places are complex numbers; both links stand in one array of the shape
(2, segments, columns). Forces are exact gradients of the energy, steps those of a leapfrog.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from blind.loads import Array, Column, JointLoads, clip, stack

Complex = NDArray[np.complex128]
SEGMENTS = 8
#: Speed of waves along a link [m/s], far below that of metal, and relaxation time of the damping [s].
AXIAL_WAVE, RELAXATION = 300.0, 1e-3
LINKS, JOINTS = ("upper", "lower"), ("shoulder", "elbow")
GRAVITY = 9.81


class Chain:
    """Hub, flexible link, elbow with its motor, flexible link, load."""

    def __init__(self, columns: Sequence[Column], step: float) -> None:
        def get(name: str, default: float = 0.0) -> Array:
            return stack(columns, LINKS, name, default)

        self.h = step
        self.length = get("length")
        self.ds = (self.length / SEGMENTS)[:, None]
        self.density = get("line_density")
        self.thickness = get("thickness")
        bending = (get("bending") * get("link_flexibility.share", 1.0))[:, None]
        self.inner, self.clamp = bending / self.ds, 2.0 * bending / self.ds
        self.axial = self.density[:, None] * AXIAL_WAVE**2
        share = get("structural_damping.time")[:, None] / RELAXATION
        self.branch = share * np.concatenate([self.clamp, *[self.inner] * (SEGMENTS - 1)], 1)
        self.last_branch = share[0, 0] * self.clamp[0, 0]
        self.fade = np.exp(-step / RELAXATION)
        self.mass = self._masses(columns)
        self.hubs = stack(columns, JOINTS, "hub_inertia")
        self.elbow = stack(columns, ["elbow"], "housing_inertia")[0]
        self.loads = JointLoads(JOINTS, columns, step)
        self.down = -1j * GRAVITY * np.sin(stack(columns, ["world"], "gravity_tilt.angle")[0])
        places = self.ds * np.arange(1, SEGMENTS + 1)[None, :, None]
        places[1] += self.length[0]
        self.z: Complex = places.astype(np.complex128)
        self.dz = np.zeros_like(self.z)
        self.angle, self.rate = np.zeros_like(self.hubs), np.zeros_like(self.hubs)
        self.housing, self.housing_rate = np.zeros_like(self.elbow), np.zeros_like(self.elbow)
        self.turn, self.last_turn = np.zeros(self.z.shape), np.zeros_like(self.elbow)
        self.slow, self.last_slow = np.zeros(self.z.shape), np.zeros_like(self.elbow)

    def _masses(self, columns: Sequence[Column]) -> Array:
        """Mass of each node; the end of the first link carries the elbow and the first half segment of the second."""
        piece = self.density[:, None] * self.ds
        mass = np.repeat(piece, SEGMENTS, 1)
        tip = stack(columns, LINKS, "tip_mass") + stack(columns, LINKS, "payload.mass")
        mass[:, -1] = 0.5 * piece[:, 0] + tip
        mass[0, -1] += 0.5 * piece[1, 0]
        return mass

    def joint_angles(self) -> Array:
        """What the encoders show."""
        return np.array([self.angle[0], self.angle[1] - self.housing])

    def strains(self) -> Array:
        """Strain on the positive side of each link, one segment away from its root."""
        return 0.5 * self.thickness * self.turn[:, 1] / self.ds[:, 0]

    def advance(self, effort: Array, time: float) -> None:
        """One step under torques of both motors."""
        half = 0.5 * self.h
        z = self.z + half * self.dz
        angle, housing = self.angle + half * self.rate, self.housing + half * self.housing_rate
        forces, moments, reaction = self._elastic(z, angle, housing)
        q = np.array([angle[0], angle[1] - housing])
        v = np.array([self.rate[0], self.rate[1] - self.housing_rate])
        push = effort - self.loads.smooth(q, v, time + half, effort)
        dry = self.loads.dry(q, v, time + half, effort)
        self.dz = self.dz + self.h * (forces / self.mass + self.down)
        rate = self.rate + self.h * (push + moments) / self.hubs
        back = self.housing_rate + self.h * (reaction - push[1]) / self.elbow
        if dry is not None:
            rate, back = self._brake(rate, back, self.h * dry)
        self.rate, self.housing_rate = rate, back
        self.z, self.angle, self.housing = z + half * self.dz, angle + half * rate, housing + half * back

    def _brake(self, rate: Array, back: Array, limit: Array) -> tuple[Array, Array]:
        """Impulses of dry friction: of the first joint against the ground, of the second against its housing."""
        moving = np.array([self.hubs[0], 1.0 / (1.0 / self.hubs[1] + 1.0 / self.elbow)])
        relative = np.array([rate[0], rate[1] - back])
        impulse = clip(moving * relative, -limit, limit)
        return rate - impulse / self.hubs, back + impulse[1] / self.elbow

    def _elastic(self, z: Complex, angle: Array, housing: Array) -> tuple[Complex, Array, Array]:
        """Forces on the nodes, moments on both hubs and on the housing of the elbow."""
        segment = np.empty_like(z)
        segment[:, 1:] = z[:, 1:] - z[:, :-1]
        segment[0, 0], segment[1, 0] = z[0, 0], z[1, 0] - z[0, -1]
        before = np.empty_like(z)
        before[:, 1:] = segment[:, :-1]
        before[:, 0] = self.ds[:, 0] * np.exp(1j * angle)
        after = self.ds[0, 0] * np.exp(1j * housing)
        square = self.ds * self.ds
        turn = (before.conj() * segment).imag / square
        last = (segment[0, -1].conj() * after).imag / square[0, 0]
        moment = self.inner * turn
        moment[:, 0] *= 2.0
        self.slow = self.fade * (self.slow + self.branch * (turn - self.turn))
        self.last_slow = self.fade * (self.last_slow + self.last_branch * (last - self.last_turn))
        self.turn, self.last_turn = turn, last
        moment += self.slow
        end = self.clamp[0, 0] * last + self.last_slow
        moment /= square
        end = end / square[0, 0]
        long = np.abs(segment)
        pull = (self.axial * (1.0 / long - 1.0 / self.ds)) * segment
        pull -= 1j * moment * before
        pull[:, :-1] += 1j * moment[:, 1:] * segment[:, 1:]
        pull[0, -1] += 1j * end * after
        forces = pull.copy()
        forces[:, :-1] -= pull[:, 1:]
        forces[0, -1] -= pull[1, 0]
        on_hubs = moment[:, 0] * (before[:, 0].conj() * segment[:, 0]).real
        on_housing = -end * (segment[0, -1].conj() * after).real
        return forces, on_hubs, on_housing
