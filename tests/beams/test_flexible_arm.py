"""The two-link flexible arm from a model file: its converged motions, in other steps than the validation table."""

import numpy as np

import vpm
from reference_arm import P, errors, log, tip_and_strains
from validation.machines import arm


def found(motion: str, level: str, step: float, hold: str = "cubic") -> tuple[float, np.ndarray]:
    """Errors of tip (m) and strains (relative) in steps of that length (s)."""
    model = arm(P, level)
    start = np.zeros(model.core.n_states)
    run = vpm.simulate(model, log(motion, step), integrator="additive", hold=hold, initial_state=start)
    return errors(motion, *tip_and_strains(run))


def test_the_error_falls_with_detail_and_with_the_step() -> None:
    tips = [found("fast", f"strain({count})", 1e-2)[0] for count in (1, 2, 3)]
    assert tips[0] > 3.0 * tips[1] > 9.0 * tips[2]
    coarse, fine = (found("fast", "strain(4)", step)[1] for step in (2e-2, 1e-2))
    assert coarse[1] > 8.0 * fine[1]


def test_commands_in_stairs_ring_in_the_strains() -> None:
    held, smooth = (found("fast", "strain(4)", 1e-2, hold)[1] for hold in ("zero_order", "cubic"))
    assert held[1] > 10.0 * smooth[1]
