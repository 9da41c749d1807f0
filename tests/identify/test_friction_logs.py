"""A measured magneto-rheological damper at 0.5 A: named effects and a NARX model, judged on unseen motions.

Data: github.com/DanielMaurelE/vRTHS_AMBC_MRdamper (MIT licence), measured at UTFSM, Chile. Errors are relative root
mean squares of the force, 100 norm(F - F*) / norm(F) with the Euclidean norm over the samples of one record.
"""

from pathlib import Path

import numpy as np
import pytest

from vpm.diagnosing import diagnose
from vpm.discrepancy import Diagnosis
from vpm.errors import DivergedError
from vpm.experiment import Experiment
from vpm.identify import identify
from vpm.model import Model
from vpm.narx import Narx, split_in_time, validate
from vpm.narx import identify as identify_narx
from vpm.numbers import Array

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "mr_damper_hysteresis"

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the damper's records are absent: ../shared/data")

#: Fitted: the slowest and the fastest motion. Judged: what lies between them.
TRAINING = ("25mm0p25Hz", "2mm5Hz")
UNSEEN = ("25mm0p5Hz", "5mm3Hz")


def table(motion: str, every: int = 1) -> dict[str, Array]:
    columns = np.genfromtxt(DATA / f"sine_{motion}_0p5A.csv", delimiter=",", names=True)
    return {name: np.array(columns[name])[::every] for name in columns.dtype.names or ()}


def damper() -> Model:
    """An axis that the press moves; the rod's inertia counts for nothing beside 900 N."""
    return Model.from_dict(
        {
            "name": "damper",
            "gravity": [0, 0, 0],
            "bodies": {"rod": {"mass": 1e-3}},
            "joints": {"axis": {"type": "prismatic", "parent": "world", "child": "rod", "axis": [1, 0, 0]}},
            "actuators": {"press": {"joint": "axis", "gain": 1.0, "command_unit": "N"}},
            "sensors": {"stroke": {"measures": "axis.position"}},
            "effects": [
                {"type": "viscous_friction", "at": "axis", "viscous": {"value": 1e3, "uncertainty": 1e4, "min": 0.0}}
            ],
        }
    )


def record(motion: str) -> Experiment:
    columns = table(motion)
    channels = {"axis.position": 1e-3 * columns["x_mm"], "press.command": columns["force_N"]}
    units = {"axis.position": "m", "press.command": "N"}
    return Experiment.from_arrays(columns["time_s"], channels, units=units, name=motion)


def error(model: Model, motion: str) -> float:
    """Relative error of the force in percent, of the record as it is: measured place and velocity, no filter."""
    columns = table(motion)
    force = columns["force_N"][:, None]
    place, speed = (1e-3 * columns[name][:, None] for name in ("x_mm", "v_mm_s"))
    step = float(columns["time_s"][1] - columns["time_s"][0])
    required = model.core.inverse_dynamics(model.theta, place, speed, np.zeros_like(place), force, step, [])[0]
    return float(100.0 * np.linalg.norm(force - required) / np.linalg.norm(force))


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    return diagnose(damper(), [record(motion) for motion in TRAINING], [record(motion) for motion in UNSEEN])


@pytest.mark.nightly
def test_a_diagnosis_names_dry_friction_then_hysteresis(diagnosis: Diagnosis) -> None:
    assert [(effect.name, effect.site) for effect in diagnosis.effects] == [
        ("coulomb_friction", "axis"),
        ("hysteresis", "axis"),
    ]


@pytest.mark.nightly
def test_the_model_of_the_diagnosis_predicts_motions_that_were_not_fitted(diagnosis: Diagnosis) -> None:
    for motion in UNSEEN:
        assert error(diagnosis.model, motion) < 13.5  # 12.5 by a fit of the force; this one follows the positions, too


def fitted(*effects: str) -> Model:
    model = damper()
    for effect in effects:
        model = model.with_effect(effect, at="axis")
    return identify(model, [record(motion) for motion in TRAINING]).model


def test_named_effects_predict_motions_that_were_not_fitted() -> None:
    model = fitted("coulomb_friction", "hysteresis")
    assert all(model.parameters[f"axis.{name}"].value > 0.0 for name in ("friction.coulomb", "hysteresis.force"))
    assert 1e-4 < model.parameters["axis.hysteresis.displacement"].value < 2e-3
    without = fitted("coulomb_friction")
    for motion in UNSEEN:
        assert error(model, motion) < 12.5
        assert error(without, motion) > 1.3 * error(model, motion)


def narx(train: list[dict[str, Array]], back: int, past: list[int]) -> Narx:
    return identify_narx(
        train,
        output="force_N",
        inputs=["x_mm", "v_mm_s"],
        output_lags=back,
        input_lags=past,
        degree=3,
        criterion="free_run_tail",
        max_terms=20,
    )


def test_a_polynomial_model_predicts_a_frequency_that_was_not_trained() -> None:
    # A difference equation has one sampling time: the record at 3 Hz is thinned to the 5 ms of the others.
    train = [table("25mm0p25Hz"), table("2mm5Hz"), table("5mm3Hz", 5)]
    heads, tails = zip(*(split_in_time(part, 0.6) for part in train), strict=True)

    def kept_out(order: tuple[int, list[int]]) -> float:
        """Mean error in free run on the last two fifths of the training records."""
        try:
            model = narx(list(heads), *order)
            return float(np.mean([100.0 - validate(model, tail).free_run_fit[0] for tail in tails]))
        except DivergedError:
            return float("inf")

    orders = [(back, past) for back in (1, 2) for past in ([0, 1], [0, 1, 2], [0, 2, 4], [0, 4, 8])]
    best = min(orders, key=kept_out)
    run = narx(train, *best).simulate_free_run(table("25mm0p5Hz"))
    assert best[0] == 1
    assert 100.0 - run.fit < 12.5
