"""The way up: levels of detail, what is fitted at each, and where more detail stops to pay."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from flexible_link import one_flexible_link
from model_texts import effect_text
from vpm import Climb, Experiment, Model, Setup, climb, simulate
from vpm.climb.climbing import ACTUATORS, RIGID, families
from vpm.errors import IdentificationError
from vpm.identify import OutputErrorProblem
from vpm.numbers import Array

SHOWN = ["shoulder.position", "root.strain"]


def arm_text(level: str = "bezier(3)", young: float = 200.0, lag: str = "0.004") -> str:
    text = one_flexible_link(
        level,
        young=f'{{ value = {young}, unit = "GPa", uncertainty = 40.0 }}',
        section=(0.006, 0.02),
        damping=2.0,
        gains=(20.0, 1.5),
    )
    free = text.replace("[0.01, 0.01, 0.01", "[0.01, { value = 0.01, uncertainty = 0.005 }, 0.01")
    return free + effect_text("actuator_lag", "motor", time_constant=lag)


def arm(level: str = "bezier(3)", young: float = 200.0, lag: str = "0.004") -> Model:
    return Model.from_toml(arm_text(level, young, lag))


def swing(truth: Model, seed: int, frequency: float) -> Experiment:
    """A record of another machine: its own level is finer than any that is fitted, with noise on what is seen."""
    time = 2e-3 * np.arange(700)
    wave = 0.2 * (1.0 - np.cos(frequency * time)) + 0.05 * np.sin(2.7 * frequency * time)
    reference = Experiment.from_arrays(time, {"motor.reference": wave}, model=truth, name=f"swing {seed}")
    run = simulate(truth, reference, "closed_loop", integrator="rosenbrock", substeps=2)
    noise = np.random.default_rng(seed)
    channels = {"motor.reference": wave}
    for name in SHOWN:
        channels[name] = run[name] + 0.005 * np.std(run[name]) * noise.standard_normal(time.size)
    return Experiment.from_arrays(time, channels, model=truth, name=f"swing {seed}")


@pytest.fixture(scope="module")
def found() -> Climb:
    truth = arm("elements(8)")
    told: list[str] = []
    nominal = arm("elements(4)", young=170.0, lag="{ value = 0.002, uncertainty = 0.002 }")
    climbed = climb(
        nominal,
        swing(truth, 1, 5.0),
        validate=swing(truth, 2, 6.3),
        channels=SHOWN,
        setup=Setup("rosenbrock", settling=0.5),
        tell=told.append,
    )
    assert told[:2] == [RIGID, ACTUATORS]
    return climbed


def test_detail_pays_up_to_the_first_level_that_bends_right(found: Climb) -> None:
    rows = {level.name: level for level in found.levels}
    # A rigid link has no strain at all: half of what is compared is missing.
    assert rows[RIGID].error > 0.5
    assert rows[ACTUATORS].error > 0.5
    assert found.chosen.error < 0.03
    assert found.top not in (RIGID, ACTUATORS)
    assert not any(level.pays for level in found.levels[found.levels.index(found.chosen) + 1 :])
    assert found.verdict.startswith(f"detail pays up to {found.top}")


def test_new_parameters_are_those_that_data_see_first(found: Climb) -> None:
    freed = [set(level.freed) for level in found.levels]
    assert any("lag" in name for name in freed[1])
    assert "link.young" in freed[2]
    assert all(not names for names in freed[3:])


def test_parameters_come_out_where_the_truth_has_them(found: Climb) -> None:
    young = found.chosen.values["link.young"]
    assert young == pytest.approx(200e9, rel=0.02)
    assert found.model.parameters["link.young"].value == young
    lag = next(value for name, value in found.chosen.values.items() if "lag" in name)
    assert lag == pytest.approx(0.004, rel=0.1)


def test_drifts_are_told_from_the_first_level_on(found: Climb) -> None:
    assert set(found.drifts) <= set(found.chosen.values)
    assert all(np.isfinite(drift) for drift in found.drifts.values())


def test_a_climb_saves_loads_and_draws(found: Climb, tmp_path: Path) -> None:
    assert Climb.load(found.save(tmp_path / "climb.npz")) == found
    axes = found.plot().axes
    assert [text.get_text() for text in axes[1].get_xticklabels()] == [level.name for level in found.levels]
    assert list(found.to_frame()["level"]) == [level.name for level in found.levels]


def test_the_start_of_a_level_is_simulated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    starts: list[tuple[Model, bytes]] = []
    simulated = OutputErrorProblem.evaluate

    def counted(
        self: OutputErrorProblem, model: Model, theta: Array, columns: Sequence[int] = ()
    ) -> tuple[Array, Array]:
        starts.append((model, theta.tobytes()))
        return simulated(self, model, theta, columns)

    monkeypatch.setattr(OutputErrorProblem, "evaluate", counted)
    stiff = arm("rigid", lag="{ value = 0.002, uncertainty = 0.002 }")
    record = swing(arm("rigid"), 1, 5.0)
    climb(stiff, record, validate=swing(arm("rigid"), 2, 6.3), channels=SHOWN[:1])
    first = starts[0]
    assert sum(each[0] is first[0] and each[1] == first[1] for each in starts) == 1


def test_levels_end_with_the_models_own() -> None:
    offered = families(arm("elements(4)"))
    names = [name for family in offered for name, _ in family]
    assert names[:3] == [RIGID, ACTUATORS, "lumped(1)"]
    assert names[-1] == "elements(4)"
    sizes = [machine.core.n_states for family in offered[2:] for _, machine in family]
    assert max(sizes[:-1]) < sizes[-1]
    assert offered[0][0][1].core.n_states < offered[1][0][1].core.n_states


def test_a_model_without_flexible_links_has_two_levels_at_most() -> None:
    rigid = arm("rigid")
    assert [name for family in families(rigid) for name, _ in family] == [RIGID, ACTUATORS]
    assert len(families(rigid.without_effect("actuator_lag", "motor"))) == 1


def test_patience_and_parameters_are_checked() -> None:
    record = swing(arm(), 1, 5.0)
    with pytest.raises(IdentificationError, match="at least 1"):
        climb(arm(), record, validate=record, patience=0)
    fixed = Model.from_toml(
        arm_text("rigid").replace("uncertainty = 0.005", "min = 0.0").replace("uncertainty = 40.0", "min = 1.0")
    )
    with pytest.raises(IdentificationError, match="no parameter is adjustable"):
        climb(fixed, record, validate=record)
