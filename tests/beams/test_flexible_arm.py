"""The two-link flexible arm from a model file: its converged motions, in large steps."""

import numpy as np
import pytest

import vpm
from reference_arm import MOTIONS, P, errors, log, tip_and_strains
from validation.machines import arm


def found(motion: str, level: str, step: float, hold: str = "cubic") -> tuple[float, np.ndarray]:
    """Errors of tip (m) and strains (relative) in steps of that length (s)."""
    model = arm(P, level)
    start = np.zeros(model.core.n_states)
    run = vpm.simulate(model, log(motion, step), integrator="additive", hold=hold, initial_state=start)
    return errors(motion, *tip_and_strains(run))


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("level", ["strain(4)", "bezier(5)"])
def test_steps_of_10_ms_track_the_converged_motion(motion: str, level: str) -> None:
    tip, strain = found(motion, level, 1e-2)
    assert tip <= 3e-5
    assert strain[0] <= 4e-4
    assert strain[1] <= 2.5e-3


def test_the_error_falls_with_detail_and_with_the_step() -> None:
    tips = [found("fast", f"strain({count})", 1e-2)[0] for count in (1, 2, 3)]
    assert tips[0] > 3.0 * tips[1] > 9.0 * tips[2]
    coarse, fine = (found("fast", "strain(4)", step)[1] for step in (2e-2, 1e-2))
    assert coarse[1] > 8.0 * fine[1]


def test_commands_in_stairs_ring_in_the_strains() -> None:
    held, smooth = (found("fast", "strain(4)", 1e-2, hold)[1] for hold in ("zero_order", "cubic"))
    assert held[1] > 10.0 * smooth[1]
