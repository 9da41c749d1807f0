"""Rankings of machines with oil: chambers add up what flows in, and friction holds their pistons."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.fit import Fitter
from vpm.ranking.judgement import Judgement
from vpm.ranking.model_structure import Structure
from vpm.ranking.parameter_priors import stated
from vpm.ranking.ranking_search import Search
from vpm.ranking.settings import Settings
from vpm.ranking.tracked_records import TrackedRecords, Tracker, tracker_gains
from vpm.weighing import Prior

RATE = 500.0
PRESSURES = ("servo.pressure_a", "servo.pressure_b")
SENSORS = {"encoder": "axis.position", "gauge_a": PRESSURES[0], "gauge_b": PRESSURES[1]}


def rig(**friction: Any) -> Model:
    """The rig with Coulomb friction, an encoder, and a gauge in each chamber."""
    content = Model.load(EXAMPLES / "servo_cylinder" / "rig.toml").to_dict()
    content["sensors"] = {name: {"measures": channel} for name, channel in SENSORS.items()}
    content["effects"].append({"type": "coulomb_friction", "at": "axis", "coulomb": 20.0, **friction})
    return Model.from_dict(content)


def currents(seconds: float = 8.0) -> Array:
    """Currents of moves to and fro with rests between them, A."""
    time = np.arange(0.0, seconds, 1.0 / RATE)
    return np.asarray(5e-4 * np.sin(2.0 * np.pi * time) * (np.sin(np.pi * time / 2.0) > 0.0))


def logged(machine: Model, sent: Array, seed: int, *, drive: float = 0.0, gauge: float = 3e3) -> Experiment:
    """Log of currents that were ``sent``; the drive adds noise that no log holds."""
    random, time = np.random.default_rng(seed), np.arange(len(sent)) / RATE
    command = Experiment.from_arrays(
        time, {"servo.command": sent + drive * random.standard_normal(len(sent))}, model=machine, name="bench"
    )
    ran = vpm.simulate(machine, command, mode="free_run")
    noise = {"axis.position": 1e-6, **dict.fromkeys(PRESSURES, gauge)}
    read = {name: ran[name] + size * random.standard_normal(len(time)) for name, size in noise.items()}
    return Experiment.from_arrays(time, {"servo.command": sent, **read}, model=machine, name="bench")


def test_a_pressure_is_drawn_to_its_gauge_as_the_integrator_that_it_is() -> None:
    """Its error dies away with a bandwidth of its own: x[k+1] = x[k] + (1 - exp(-2 pi f dt)) (y - x)."""
    model = rig()
    gains = tracker_gains(model, ("axis.position", *PRESSURES), (2.0, 2.0), (400, 1.0 / RATE), model.theta, 30.0)
    place = model.state_names.index("servo.chamber_a")
    assert gains[-1, place, 1] == pytest.approx(-np.expm1(-2.0 * np.pi * 30.0 / RATE))
    assert np.count_nonzero(gains[:, :, 1]) == len(gains)
    assert np.all(np.diff(gains[:, place, 1]) <= 0.0)


def test_noise_of_a_drive_does_not_carry_pressures_away_while_the_piston_stands() -> None:
    model = rig()
    tracked = TrackedRecords(model, [logged(model, currents(), 1, drive=2e-5)], Settings())
    free = TrackedRecords(model, tracked.experiments, Settings())
    free.drawn_to = free.drawn_joints
    assert free.drawn_to == ("axis.position",)
    left = [Fitter(one, Settings()).unfitted(_bare(model), Tracker(1.0)).residual for one in (tracked, free)]
    drawn, undrawn = (np.sqrt(np.mean(one[500:] ** 2, axis=0)) for one in left)
    assert np.all(drawn[1:] < 0.4 * undrawn[1:])


def _bare(model: Model) -> Structure:
    return Structure(model, model.theta, {})


@pytest.mark.parametrize(("drive", "gauge", "band"), [(1e-4, 1e3, np.inf), (0.0, 5e4, 1.0)])
def test_records_tell_how_fast_pressures_are_drawn(drive: float, gauge: float, band: float) -> None:
    """Noise of a drive is in the machine, and followed; that of gauges is not."""
    record = logged(rig(), currents(), 1, drive=drive, gauge=gauge)
    search = Search(rig(), [record], [], Settings(), None, ParallelCandidates(1, None), lambda _: None)
    search.draw_pressures(search.start)
    assert search.fitter.tracked.of_pressures == band


def test_pressures_are_drawn_anew_once_a_leak_was_found() -> None:
    """Gauges of so much noise tell more than a model does that misses the leak, and less than the one that has it."""
    model, tried = rig(), ["internal_leakage"]
    record = logged(model.with_effect("internal_leakage", "servo", coefficient=1e-11), currents(), 2, gauge=6e3)
    search = Search(model, [record], tried, Settings(), None, ParallelCandidates(1, None), lambda _: None)
    search.draw_pressures(search.start)
    assert search.fitter.tracked.of_pressures == 10.0
    assert [one.effect for one in search.run().effects] == tried
    assert search.fitter.tracked.of_pressures == 1.0


def test_what_noise_of_gauges_does_to_a_piston_is_not_missing() -> None:
    """Read pressures push the piston with their noise, many times that of its encoder; the machine is exact."""
    model = rig()
    tracked = TrackedRecords(model, [logged(model, currents(), 3, gauge=2e4)], Settings()).with_pressures(np.inf)
    left = Fitter(tracked, Settings()).unfitted(_bare(model), Tracker(1.0)).residual
    size = float(np.sqrt(np.mean([np.mean(left[part, 0] ** 2) for part in tracked.parts])))
    told = tracked.structured(left, 1.0, tracked.parts, model)[0]
    assert size > 5e-6
    assert told.noise > 0.7 * size


def test_a_late_drive_is_named_and_not_all_of_its_sensors() -> None:
    """One late drive explains what three sensors would. Few steps within a sample diverge while its piston stands."""
    model = rig(coulomb={"value": 24.0, "uncertainty": 6.0})
    late = rig().with_effect("input_delay", "servo", time=7.3e-3)
    ranking = vpm.rank(model, logged(late, currents(), 2, drive=5e-6), effects=["input_delay", "sensor_delay"])
    assert [(one.effect, one.site) for one in ranking.effects] == [("input_delay", "servo")]
    assert ranking.model.parameters["servo.delay.time"].value == pytest.approx(7.3e-3, rel=0.05)


def test_a_value_at_the_end_of_its_range_begins_anew_in_the_middle() -> None:
    model = rig()
    turning, oil, dry = "axis.friction.transition_velocity", "pump.oil.bulk_modulus", "axis.friction.coulomb"
    priors = {
        turning: Prior(1e-3, 1.0, 1e-5, 1e-1, logarithmic=True),
        oil: Prior(1.2e9, 0.2e9, 1e5, np.inf),
        dry: Prior(20.0, 5.0, 0.0, np.inf),
    }
    structure = Structure(model, model.theta, priors)
    freed = structure.at(np.array([-1e3, -1e3, 1.0])).off_its_ends
    assert freed.values == {turning: pytest.approx(1e-3), oil: pytest.approx(1.2e9), dry: pytest.approx(25.0)}
    assert freed.off_its_ends is freed


def test_oil_does_not_become_air_where_a_leak_is_missing() -> None:
    """Pressures that are drawn to their gauges leave no error of soft oil, whatever leaks: nothing was named then."""
    model, oil = rig(), "pump.oil.bulk_modulus"
    leaky = model.with_effect("internal_leakage", "servo", coefficient=2e-12)
    tried = ["internal_leakage", "valve_dynamics", "spring"]
    ranking = vpm.rank(model, logged(leaky, currents(), 2, drive=5e-6), effects=tried)
    (leak,) = ranking.effects
    assert leak.effect == "internal_leakage"
    assert next(iter(leak.values.values())) == pytest.approx(2e-12, rel=0.05)
    assert ranking.model.parameters[oil].value == pytest.approx(model.parameters[oil].value, rel=0.1)


def test_what_no_force_is_linear_in_is_off_by_a_factor() -> None:
    """A deviation up is what the file states, and as many down stay above zero; four are as far as a fit goes."""
    prior = stated(rig())["pump.oil.bulk_modulus"]
    assert [prior.value(1.0), prior.value(-1.0)] == pytest.approx([1.6e9, 0.9e9])
    assert list(prior.ends) == pytest.approx([-4.0, 4.0])


def test_what_takes_nearly_all_of_the_error_counts_though_few_pieces_show_it() -> None:
    """An end of a way that is met twice leaves all other pieces as they are."""
    met_twice = Judgement(removed=0.999, least=0.99, score=1.4, size=0.9, beside=1.0, shape=1.0)
    assert met_twice.counts(Settings())
    assert not replace(met_twice, least=0.5).counts(Settings())


def stopped(**end: float) -> Model:
    """The rig with a stop ahead of the end of its moves."""
    return rig(transition_velocity=2e-4).with_effect("end_stop", "axis", **{"damping": 2.0, "high": 0.032, **end})


def test_derivatives_of_few_steps_are_those_of_the_machine() -> None:
    """Where sharp dry friction meets oil, few steps within a sample are stable, and their derivatives grow to 1e80."""
    model, dry = stopped(stiffness=2e5), "axis.friction.coulomb"
    fitter = Fitter(TrackedRecords(model, [logged(model, currents(), 1, drive=3e-5)], Settings()), Settings())
    structure = Structure(model, model.theta, {dry: Prior(20.0, 5.0, 0.0, np.inf)})
    followed = fitter.followed(structure, Tracker(1.0), [dry])
    more = structure.at(structure.standard + 0.01)
    change = fitter.followed(more, Tracker(1.0), []).residual - followed.residual
    np.testing.assert_allclose(
        np.std(followed.jacobian[:, :, 0] * (more.theta - model.theta)[model.index(dry)], axis=0),
        np.std(change, axis=0),
        rtol=0.2,
    )


def test_oil_that_noise_of_a_drive_moves_hides_no_stop() -> None:
    """Drawn too slowly it gives way to what is missing: the stop had a third of its damping."""
    machine = rig().with_effect("end_stop", "axis", stiffness=2e5, damping=2.0, high=0.032)
    record = logged(machine, currents(), 2, drive=3e-5, gauge=1e4)
    ranking = vpm.rank(rig(), record, effects=["end_stop", "bias_force", "quadratic_drag"])
    (stop,) = ranking.effects
    assert stop.effect == "end_stop"
    assert stop.values["axis.end_stop.damping"] == pytest.approx(2.0, rel=0.1)
