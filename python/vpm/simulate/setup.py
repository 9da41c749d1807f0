"""How a simulation steps."""

import math
from dataclasses import dataclass

from vpm.errors import SimulationError, refused_as
from vpm.model import Model
from vpm.results import Storable

#: Integrators of fixed steps, whose work is bounded.
FIXED_STEP = ("linearly_implicit", "additive", "crank_nicolson", "rosenbrock", "rk4", "semi_implicit")
#: Chooses by what a machine contains.
AUTOMATIC = "auto"
INTEGRATORS = (AUTOMATIC, *FIXED_STEP, "guarded", "adaptive")
#: What commands of a log do between its samples.
HOLDS = ("zero_order", "first_order", "cubic")
#: Said where logs show that commands were read back.
READ_BACK = "commands run from sample to sample, as readings of a drive do; simulate with hold {hold} too"

#: Most integration steps per sample, as the core has it.
MOST_SUBSTEPS = 1_000_000


@dataclass(frozen=True)
class Setup(Storable):
    """Settings of how a simulation steps: integrator, substeps, hold.

    Attributes
    ----------
    integrator : str
        One of ``auto``, ``linearly_implicit``, ``additive``, ``crank_nicolson``, ``rosenbrock``, ``rk4``,
        ``semi_implicit``, ``guarded``, ``adaptive`` and, with a tolerance, ``adaptive(1e-8)``.
        ``auto`` is ``adaptive`` for machines with contacts or hydraulic drives, which impacts and oil make abrupt,
        ``additive`` for machines with flexible links and nothing else that is stiff (ideal drives, no contacts), and
        ``linearly_implicit`` for all others and where joints follow a measured motion.
        ``linearly_implicit`` and ``rosenbrock`` are stable whatever is stiff, of order 2 and 4; the first of them also
        stops on dry friction far sharper than a step, to a tenth of what that brakes in a step.
        ``additive`` has order 4 as well, without a Jacobian: stable
        however stiff links, springs and friction of joints are, explicit in all else. ``crank_nicolson`` treats the
        same forces so with order 2, for one evaluation of the dynamics a step in place of six: for links of many
        elements in short steps. It remembers one step, so that the first after a jump of the state costs three
        evaluations. ``rk4`` and ``semi_implicit`` are explicit, but for the constant stiffness of flexible links in
        the second.
        ``adaptive`` takes as many steps of ``rosenbrock`` as keep the error of each within a tolerance, 1e-6 or the
        one in brackets, relative to each state and its natural size: for impacts, oil and other things that change
        between microseconds and seconds. Its time is not bounded. ``guarded`` is its counterpart for real time: one
        step of ``rosenbrock``, or up to 16 where an impact or a jump makes its error larger than 1 %.
    substeps : int
        Integration steps per sample of the log; with ``adaptive`` and ``guarded`` pieces of a sample that take one
        step at least.
    horizon : float
        Length of each restart, s.
    settling : float
        Time at the beginning of each record, s, that a fit simulates but does not compare: until what nobody knows of
        the first state, such as vibrations, has died away. Restarts have none.
    hold : {"auto", "zero_order", "first_order", "cubic"}
        What commands and logged pressures do between samples of a log, in free runs, restarts and balances.
        ``zero_order`` keeps each until the next sample, as the output of a digital controller does. ``first_order``
        goes straight to the next sample, ``cubic`` smoothly: for signals that are continuous and were sampled, such as
        an analog reference or a command of a far faster controller. What controllers of the model command is always
        held.
        ``auto`` is ``zero_order``, but where `vpm.rank` or `vpm.identify` finds out from the logs. Logged lengths that
        move springs cannot jump: with ``auto`` they run on there, and in `vpm.diagnose`, beside held commands.
    """

    integrator: str = AUTOMATIC
    substeps: int = 1
    horizon: float = 0.25
    settling: float = 0.0
    hold: str = AUTOMATIC

    def __post_init__(self) -> None:
        """Check the setup of a simulation."""
        _check_integrator(self.integrator)
        if self.substeps % 1 or not 1 <= self.substeps <= MOST_SUBSTEPS:
            raise SimulationError(f"substeps is {self.substeps}; give a whole number from 1 to {MOST_SUBSTEPS}")
        if not 0.0 < self.horizon < math.inf:
            raise SimulationError(f"horizon is {self.horizon} s; give a positive time")
        if not 0.0 <= self.settling < math.inf:
            raise SimulationError(f"settling is {self.settling} s; give a time that is not negative")
        if self.hold not in (choices := (AUTOMATIC, *HOLDS)):
            raise SimulationError(f"unknown hold '{self.hold}'; choose one of {', '.join(choices)}")

    @property
    def course(self) -> str:
        """Hold of commands between samples in the setup, as the core names it."""
        return HOLDS[0] if self.hold == AUTOMATIC else self.hold

    def method(self, model: Model, *, bounded: bool = False, guided: bool = False, drawn: bool = False) -> str:
        """Integrator in the setup for a model, as the core names it.

        Parameters
        ----------
        bounded : bool
            Where ``auto`` would step adaptively, take ``guarded``, whose time has a bound.
        guided : bool
            Whether the joints follow a measured motion, so that no step has their equations to solve.
        drawn : bool
            Whether an observer draws the model back at every sample, so that errors of steps cannot add up: then steps
            of one length do where ``auto`` would step adaptively.
        """
        if self.integrator != AUTOMATIC:
            return self.integrator
        if model.is_abrupt and not drawn:
            return "guarded" if bounded else "adaptive"
        return "additive" if model.is_linearly_stiff and not guided else "linearly_implicit"


def _check_integrator(name: str) -> None:
    """Refuse a setup with an unknown integrator, or a meaningless tolerance."""
    from vpm._core import check_integrator

    if name in INTEGRATORS:
        return
    if not name.startswith("adaptive("):
        choice = ", ".join(INTEGRATORS)
        raise SimulationError(
            f"unknown integrator '{name}'; choose one of {choice} or, with a tolerance, adaptive(1e-8)"
        )
    with refused_as(SimulationError):
        check_integrator(name)
