"""Laws of a crease: damage by its first fold, and a bent panel solved without vpm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from vpm.errors import VpmError
from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm.model import Model

Folded = TypeVar("Folded")

NAME = "damaged_crease"


@dataclass(frozen=True)
class Damage:
    """Loss of stiffness by folding, ``D(q) = share (1 - exp(-q / scale))`` of the largest angle so far."""

    share: float  #: Part of the stiffness that is lost in the end, from 0 to below 1.
    scale: float  #: rad.

    def __post_init__(self) -> None:
        if not (0.0 <= self.share < 1.0 and self.scale > 0.0):
            raise VpmError(
                f"a crease cannot lose the share {self.share:.3g} of its stiffness over {self.scale:.3g} rad; "
                "the share is from 0 to below 1, the angle above 0"
            )

    def at(self, angle: float) -> float:
        """Part of a crease's stiffness that is lost after a fold to an angle (rad)."""
        return float(-self.share * np.expm1(-angle / self.scale))

    def lost(self, stiffness: float, angle: float) -> float:
        """Energy that a crease's first fold to an angle takes, J."""
        x = angle / self.scale
        kept = 0.5 * (1.0 - self.share) * angle**2 + self.share * self.scale**2 * (1.0 - np.exp(-x) * (1.0 + x))
        return float(stiffness * (kept - 0.5 * (1.0 - self.at(angle)) * angle**2))


def damaged(
    make: Callable[..., Model], fold: Callable[[Model], Folded], damage: Damage, angle: float = 0.5 * np.pi
) -> tuple[Folded, Folded]:
    """First fold of a crease, by which it is damaged, and the second one of what is left; the panel is rigid."""
    from vpm.catalogue import register, unregister

    model = make(level="rigid")
    stiffness = model.parameters["crease.spring.stiffness"].value
    register(
        NAME,
        law="-stiffness*q*(1 - share*(1 - exp(-abs(q)/scale)))",
        sizes={"stiffness": "{E}/{C}"},
        shapes={"share": ("1", damage.share), "scale": ("{C}", damage.scale)},
        sentence="{at} is a crease of {stiffness} that loses {share} of it over {scale}.",
        not_negative=("stiffness", "scale"),
    )
    try:
        own = next(effect for effect in model.effects if effect.at == "crease")
        bare = model.without_effect(own.name, own.at)
        values = {"stiffness": stiffness, "share": damage.share, "scale": damage.scale}
        first = fold(bare.with_effect(NAME, "crease", **values))
    finally:
        unregister(NAME)
    return first, fold(make({"crease.spring.stiffness": stiffness * (1.0 - damage.at(angle))}, level="rigid"))


def elastica(angle: float, stiffness: float, lever: float, model: Model) -> float:
    """Force on a far bent panel at a crease, N: Euler's elastica, solved by scipy alone.

    The finger is a smooth plane through the crease, turned by `angle` against the rest of the carton, and touches the
    panel at the arc length `lever`. With the slope p of the panel against that plane and the force F normal to it:
    ``E I p'' = F cos p``, ``E I p'(0) = -K (angle - p(0))`` at the crease, and at the end no moment and no distance.
    """
    from scipy.integrate import solve_bvp

    width, height = (model.parameters[f"panel.section.{side}"].value for side in ("width", "height"))
    bending = model.parameters["panel.young"].value * height * width**3 / 12.0

    def law(_: Array, y: Array, load: Array) -> Array:
        return np.stack([y[1], load[0] / bending * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a: Array, b: Array, _: Array) -> Array:
        return np.array([a[2], a[3], a[1] + stiffness * (angle - a[0]) / bending, b[1], b[3]])

    first = stiffness * angle / (lever * (1.0 + stiffness * lever / (3.0 * bending)))
    s = np.linspace(0.0, lever, 41)
    slope = first * lever**2 / bending * (1.0 / 3.0 - s / lever + 0.5 * (s / lever) ** 2)
    guess = np.stack([slope, np.gradient(slope, s), s, np.zeros_like(s)])
    found = solve_bvp(law, ends, s, guess, p=[first], tol=1e-8, max_nodes=20_000)
    if not found.success or found.p is None:
        raise VpmError(f"no balance of a panel folded by {np.degrees(angle):.3g} degrees was found: {found.message}")
    return float(found.p[0])
