"""NARX models of public records, where they are at hand: structure from one part alone, judged on another."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from vpm.errors import DivergedError
from vpm.narx import Narx, identify, split_in_time, validate

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
CRANE = DATA / "hydraulic_crane_actuator" / "actuator.csv"
DAMPER = DATA / "mr_damper_hysteresis"
ARM = DATA / "daisy_robot_arm" / "robot_arm.csv"

Record = Mapping[str, ArrayLike]


def read(path: Path) -> Record:
    table = np.genfromtxt(path, delimiter=",", names=True)
    return {name: np.array(table[name]) for name in table.dtype.names or ()}


@pytest.mark.skipif(not CRANE.exists(), reason="the crane's record is not at hand: ../shared/data is absent")
def test_crane_pressure_in_free_run() -> None:
    train, test = split_in_time(read(CRANE), 0.5)
    best: Narx | None = None
    for degree in (1, 2, 3):
        for back in (2, 3, 4, 6):
            for past in (2, 3, 4, 6):
                if degree == 3 and back + past > 8:  # more candidates than samples of the fit
                    continue
                model = identify(
                    train,
                    output="oil_pressure",
                    inputs=["valve_u"],
                    output_lags=back,
                    input_lags=past,
                    degree=degree,
                    criterion="free_run_tail",
                    max_terms=25,
                )
                if best is None or model.criterion.min() < best.criterion.min():
                    best = model
    assert best is not None
    assert max(len(term) for term in best.terms) == 3
    assert best.longest_lag <= 6
    judged = validate(best, test)
    assert judged.free_run_rmse[0] < 0.60
    assert judged.prediction_rmse[0] < 0.15


@pytest.mark.skipif(not ARM.exists(), reason="the arm's record is not at hand: ../shared/data is absent")
def test_flexible_arm_in_free_run() -> None:
    train, test = split_in_time(read(ARM), 0.5)

    def linear(record: Record, order: int) -> Narx:
        return identify(
            record,
            output="y_accel",
            inputs=["u_torque"],
            output_lags=order,
            input_lags=range(order + 1),
            constant=False,
            n_terms="all",
        )

    def held_out(order: int) -> float:
        head, tail = split_in_time(train, 0.7, overlap=order)
        try:
            return linear(head, order).simulate_free_run(tail).fit
        except DivergedError:
            return float("-inf")

    order = max((2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 30, 40), key=held_out)
    assert order == 10
    assert linear(train, order).simulate_free_run(test).fit > 96.0


@pytest.mark.skipif(not DAMPER.exists(), reason="the damper's records are not at hand: ../shared/data is absent")
def test_damper_on_a_motion_that_was_not_trained() -> None:
    # The motion at 3 Hz was sampled five times as often as the others.
    train = [read(DAMPER / f"sine_{motion}_1A.csv") for motion in ("25mm0p25Hz", "2mm5Hz", "5mm3Hz")]
    train[2] = {name: np.asarray(values)[::5] for name, values in train[2].items()}
    model = identify(
        train,
        output="force_N",
        inputs=["x_mm", "v_mm_s"],
        input_lags=[0, 1, 2],
        degree=3,
        criterion="free_run_tail",
        max_terms=20,
    )
    judged = validate(model, read(DAMPER / "sine_25mm0p5Hz_1A.csv"))
    assert judged.free_run_fit[0] > 88.0
    assert judged.prediction_fit[0] > 99.0
