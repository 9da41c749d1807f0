"""The fitting engine: weights, losses, priors, starts, first states, pieces, intervals, warnings, interruption."""

import signal
import time
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from synthetic import Truth, nominal, simulate_axis
from vpm.errors import DivergedError, IdentificationError
from vpm.experiment import Experiment
from vpm.identify import Fit, Fitting, bootstrap, identify, problem, profile_intervals
from vpm.identify.objective import Objective, losses_and_weights
from vpm.identify.shooting import ShootingProblem
from vpm.identify.solver import Box, Point, descend
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup, simulate

MASS, VISCOUS, STIFFNESS = "block.mass", "slide.friction.viscous", "slide.spring.stiffness"
FREE = (MASS, VISCOUS, STIFFNESS)
TRUTH = {MASS: 2.0, VISCOUS: 3.0, STIFFNESS: 80.0}
SETUP = Setup("rk4", 2)


def oscillator(**changed: float) -> Model:
    """A block on a spring, driven by a force: well known, and stable."""
    model = Model.from_dict(
        {
            "name": "oscillator",
            "gravity": [0, 0, 0],
            "bodies": {"block": {"mass": 2.0}},
            "joints": {"slide": {"type": "prismatic", "parent": "world", "child": "block", "axis": [1, 0, 0]}},
            "actuators": {"push": {"joint": "slide", "gain": 1.0, "command_unit": "N"}},
            "effects": [
                {"type": "viscous_friction", "at": "slide", "viscous": 3.0},
                {"type": "spring", "at": "slide", "stiffness": 80.0},
            ],
        }
    )
    return model.with_parameters({name.replace("__", "."): value for name, value in changed.items()})


def recorded(seed: int = 0, noise: float = 1e-3, start: tuple[float, float] = (0.0, 0.0), n: int = 400) -> Experiment:
    """Position and velocity of the oscillator under noise of force, with noise of position."""
    random, model = np.random.default_rng(seed), oscillator()
    clock = 0.01 * np.arange(n)
    command = {"push.command": np.repeat(10.0 * random.standard_normal(n // 20 + 1), 20)[:n]}
    log = Experiment.from_arrays(clock, command, model=model, name=f"log {seed}")
    run = simulate(model, log, integrator="rk4", substeps=2, initial_state=np.array(start))
    columns = command | {"slide.position": run["slide.position"] + noise * random.standard_normal(n)}
    return Experiment.from_arrays(clock, columns, model=model, name=f"log {seed}")


def wrong() -> Model:
    return oscillator(block__mass=3.0, slide__friction__viscous=1.0, slide__spring__stiffness=120.0)


def fitted(records: Experiment | list[Experiment], model: Model | None = None, **options: Any) -> Fit:
    settings = Fitting(**({"log": True} | options))
    return identify(model or wrong(), records, FREE, mode="free_run", setup=SETUP, fitting=settings)


def errors(fit: Fit) -> Array:
    return np.array([(fit[name] - TRUTH[name]) / TRUTH[name] for name in fit.names])


REST = {"slide.position": 0.0, "slide.velocity": 0.0}


# ---- the solver ------------------------------------------------------------------------------------------------------


def test_descent_finds_the_bounded_minimum_of_a_known_function() -> None:
    """Rosenbrock's valley, least at (1, 1); with x below 0.5, at (0.5, 0.25)."""

    def evaluate(x: Array) -> Point:
        r = np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])
        return Point(x, float(r @ r), r, np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]]), (r, r))

    for top, least in ((np.inf, (1.0, 1.0)), (0.5, (0.5, 0.25))):
        high = np.array([top, np.inf])
        found = descend(
            evaluate,
            evaluate(np.array([-1.2, 1.0])),
            Box(np.array([-2.0, -2.0]), high, scale=np.ones(2)),
            tolerance=1e-10,
            most_evaluations=200,
        )
        np.testing.assert_allclose(found.point.x, least, rtol=1e-7)
        assert found.ended == "converged"


@pytest.mark.parametrize("loss", ["squares", "huber", "soft_l1"])
def test_weights_are_slopes_of_losses(loss: str) -> None:
    r = np.array([-4.0, -1.0, 0.3, 2.0, 30.0])
    _, weights = losses_and_weights(r, loss, 1.5)
    sides = [losses_and_weights(r + sign * 1e-6, loss, 1.5)[0] for sign in (1, -1)]
    np.testing.assert_allclose(weights * 2.0 * r, (sides[0] - sides[1]) / 2e-6, rtol=1e-6)


# ---- what a fit finds ------------------------------------------------------------------------------------------------


def test_noise_free_data_give_the_truth() -> None:
    fit = fitted(recorded(noise=0.0), known_states=REST)
    assert np.max(np.abs(errors(fit))) < 1e-8
    assert fit.ended == "converged"


def test_the_result_does_not_depend_on_the_number_of_workers() -> None:
    records = [recorded(seed) for seed in range(3)]
    for starts in (1, 4):
        one, four = (fitted(records, workers=workers, starts=starts) for workers in (1, 4))
        assert np.array_equal(one.values, four.values)
        assert np.array_equal(one.std, four.std)


def test_outliers_pull_less_through_a_robust_loss() -> None:
    record = recorded(noise=1e-3)
    spoiled = record["slide.position"].copy()
    spoiled[::17] += 0.2
    columns = {"push.command": record["push.command"], "slide.position": spoiled}
    spoiled_record = Experiment.from_arrays(record.time, columns, model=oscillator(), name="spoiled")
    plain = np.max(np.abs(errors(fitted(spoiled_record, known_states=REST))))
    for loss in ("huber", "soft_l1"):
        assert np.max(np.abs(errors(fitted(spoiled_record, known_states=REST, loss=loss)))) < 0.25 * plain


def test_outputs_are_weighted_by_their_estimated_noise() -> None:
    record, random = recorded(noise=1e-3), np.random.default_rng(5)
    clean = recorded(noise=0.0)["slide.position"]
    columns = {name: record[name] for name in ("push.command", "slide.position")}
    columns["slide.velocity"] = np.gradient(clean, record.time) + 0.3 * random.standard_normal(len(record))
    both = Experiment.from_arrays(record.time, columns, model=oscillator(), name="both")
    fit = fitted(both, known_states=REST, noise="estimated")
    assert fit.noise["slide.position"] == pytest.approx(1e-3, rel=0.15)
    assert fit.noise["slide.velocity"] == pytest.approx(0.3, rel=0.15)
    assert np.all(fit.std < fitted(both, known_states=REST).std)


def test_a_prior_holds_what_the_data_do_not() -> None:
    """Mass with a sharp uncertainty stays near it; without the prior the short noisy record moves it more."""
    content = wrong().to_dict()
    content["bodies"]["block"]["mass"] = {"value": 2.0, "unit": "kg", "uncertainty": 1e-4}
    known, short = Model.from_dict(content), recorded(noise=0.02, n=100)
    held, loose = (fitted(short, known, known_states=REST, priors=priors) for priors in (True, False))
    assert abs(held[MASS] - 2.0) < 3e-4
    assert held.std[0] == pytest.approx(1e-4, rel=0.05)
    assert loose.std[0] > 10.0 * held.std[0]


def test_starts_are_seeded_inside_the_bounds_and_counted() -> None:
    bounds = {MASS: (0.5, 8.0), VISCOUS: (0.1, 50.0), STIFFNESS: (10.0, 1000.0)}
    fit, again = (fitted(recorded(), starts=6, seed=3, bounds=bounds, known_states=REST) for _ in range(2))
    assert np.array_equal(fit.costs, again.costs)
    assert fit.costs.size == 6
    assert 2 <= fit.agreeing <= 6
    assert fit.agreeing == np.sum(fit.costs <= 1.01 * fit.costs.min())
    assert np.max(np.abs(errors(fit))) < 0.02


# ---- first states and pieces -----------------------------------------------------------------------------------------


def test_unknown_first_states_are_found() -> None:
    record = recorded(noise=0.0, start=(0.05, -0.4))
    fit = fitted(record, states=("slide.position", "slide.velocity"))
    assert list(fit.states) == ["log 0, 0 s: slide.position", "log 0, 0 s: slide.velocity"]
    np.testing.assert_allclose(list(fit.states.values()), [0.05, -0.4], rtol=1e-6)
    assert np.max(np.abs(errors(fit))) < 1e-6
    assert np.max(np.abs(errors(fitted(record)))) > 1e-5  # a parabola through the first samples is not the truth


@pytest.mark.parametrize("piece", [0.0, 0.5])
def test_derivatives_by_parameters_and_first_states_match_differences(piece: float) -> None:
    model, records = wrong(), [recorded(0, n=200), recorded(1, n=150)]
    data = ShootingProblem(
        model, records, "free_run", Fitting(states=("slide.position", "slide.velocity"), piece=piece), setup=SETUP
    )
    columns = [model.index(name) for name in FREE]
    first = data.first_states
    _, jacobian = data.evaluate(model, model.theta, columns, first)
    for k in range(jacobian.shape[1]):
        sides = []
        for sign in (1.0, -1.0):
            theta, states = model.theta.copy(), first.copy()
            step = 1e-6 * (theta[columns[k]] if k < 3 else 1.0)
            if k < 3:
                theta[columns[k]] += sign * step
            else:
                states[k - 3] += sign * step
            sides.append(data.evaluate(model, theta, (), states)[0])
        difference = (sides[0] - sides[1]) / (2.0 * step)
        np.testing.assert_allclose(jacobian[:, k], difference, atol=1e-6 * np.max(np.abs(difference)) + 1e-12)


def inverted() -> Model:
    """A pendulum that stands on its joint."""
    return Model.from_dict(
        {
            "name": "inverted",
            "gravity": [0, 0, -9.81],
            "bodies": {
                "rod": {"mass": 1.0, "center_of_mass": [0, 0, 0.3], "inertia": [0.05, 0.01, 0.05, 0.0, 0.0, 0.0]}
            },
            "joints": {"foot": {"type": "revolute", "parent": "world", "child": "rod", "axis": [0, 1, 0]}},
            "actuators": {"motor": {"joint": "foot", "gain": 1.0, "command_unit": "N m"}},
            "effects": [{"type": "viscous_friction", "at": "foot", "viscous": 0.2}],
        }
    )


def balanced(seconds: float = 8.0) -> Experiment:
    """The pendulum held upright by a feedback that the log does not name, with noise of its encoder."""
    model, random, step = inverted(), np.random.default_rng(2), 0.01
    count = round(seconds / step)
    push = np.repeat(0.5 * random.standard_normal(count // 20 + 1), 20)[:count]
    state, commands, places = np.array([0.05, 0.0]), np.zeros(count), np.zeros(count)
    for k in range(count):
        places[k], commands[k] = state[0], push[k] - 8.0 * state[0] - 1.0 * state[1]
        held = np.full((2, 1), commands[k])
        state = model.core.simulate(model.theta, state, held, step, 2, "rk4")[1][1]
    columns = {"motor.command": commands, "foot.position": places + 2e-4 * random.standard_normal(count)}
    return Experiment.from_arrays(step * np.arange(count), columns, model=model, name="balanced")


def test_pieces_find_an_unstable_machine_that_a_whole_record_loses() -> None:
    record, free = balanced(), ("rod.inertia.yy", "foot.friction.viscous")
    start = inverted().with_parameters({free[0]: 0.03, free[1]: 0.5})
    whole = identify(start, record, free, mode="free_run", setup=SETUP, fitting=Fitting(log=True))
    fit = identify(start, record, free, mode="free_run", setup=SETUP, fitting=Fitting(log=True, piece=0.5))
    assert len(fit.states) == 2 * 16
    assert fit.ended == "converged"
    np.testing.assert_allclose(fit.values, [0.01, 0.2], atol=4.0 * float(fit.std.max()), rtol=0.02)
    assert fit[free[1]] == pytest.approx(0.2, rel=0.02)
    assert abs(whole[free[1]] / 0.2 - 1.0) > 0.05
    assert fit.after["foot.position"][0] == pytest.approx(2e-4, rel=0.1)


def test_pieces_take_the_steps_that_suit_the_model() -> None:
    record, free = balanced(2.0), ("foot.friction.viscous",)
    chosen, named = (
        identify(inverted(), record, free, mode="free_run", setup=setup, fitting=Fitting(piece=0.5))
        for setup in (None, Setup("linearly_implicit"))
    )
    assert np.array_equal(chosen.values, named.values)


# ---- intervals -------------------------------------------------------------------------------------------------------


def test_profile_and_bootstrap_agree_with_the_standard_interval() -> None:
    record = recorded(noise=2e-3)
    fit = fitted(record, known_states=REST, noise="estimated")
    for profile, (low, high) in zip(profile_intervals(fit, record), fit.intervals, strict=True):
        assert profile.low == pytest.approx(low, abs=0.1 * (high - low))
        assert profile.high == pytest.approx(high, abs=0.1 * (high - low))
    drawn, again = (bootstrap(fit, record, replicates=300, seed=1) for _ in range(2))
    assert np.array_equal(drawn.values, again.values)
    np.testing.assert_allclose(drawn.std, fit.std, rtol=0.35)
    refitted = bootstrap(fit, record, replicates=6, seed=1, refit=True)
    np.testing.assert_allclose(
        refitted.values, bootstrap(fit, record, replicates=6, seed=1).values, atol=float(fit.std.max()), rtol=0.02
    )


def test_a_parameter_that_nobody_freed_has_no_profile() -> None:
    record = recorded()
    with pytest.raises(IdentificationError, match="was not free"):
        profile_intervals(fitted(record), record, ["slide.spring.rest"])


# ---- warnings --------------------------------------------------------------------------------------------------------


def test_warnings_name_the_parameter() -> None:
    record = recorded()
    bound = fitted(record, known_states=REST, bounds={MASS: (2.5, 5.0)})
    assert any(w.startswith(f"{MASS} rests on its lower bound 2.5") for w in bound.warnings)
    still = fitted(record, fitted(record, known_states=REST).model, known_states=REST)
    assert any(w.startswith(f"{MASS} is still at its start") for w in still.warnings)
    few = fitted(recorded(n=20), known_states=REST)
    assert any("20 samples are too few for 3 unknowns" in w for w in few.warnings)
    assert fitted(record, known_states=REST).warnings == ()


def test_a_free_run_that_loses_an_unstable_machine_is_told_with_its_parameters() -> None:
    free = ("rod.inertia.yy", "foot.friction.viscous")
    fit = identify(inverted(), balanced(20.0), free, mode="free_run", setup=SETUP)
    (told,) = [w for w in fit.warnings if "loses the record" in w]
    assert told.startswith("foot.position is ")
    assert "rod.inertia.yy, foot.friction.viscous mean nothing; take restarts, pieces" in told


def test_a_free_run_that_leaves_the_finite_numbers_is_one_sentence() -> None:
    stiff = oscillator(slide__spring__stiffness=1e7)
    for settings in (None, Fitting(log=True)):
        with pytest.raises(DivergedError, match=r"`slide` is .*, beyond .* use more substeps"):
            identify(stiff, recorded(n=2000), [MASS], mode="free_run", setup=SETUP, fitting=settings)


def test_a_pair_that_shows_together_is_named() -> None:
    """Ten samples of one push: mass, friction and spring all slow the block down in much the same way."""
    fit = fitted(recorded(n=60).trim(0.0, 0.195), known_states=REST)
    (told,) = [sentence for sentence in fit.warnings if "are collinear, correlation" in sentence]
    assert VISCOUS in told


def test_a_name_that_comes_twice_is_refused() -> None:
    with pytest.raises(IdentificationError, match=r'"block\.mass" is named 2 times in free=; name it once'):
        identify(wrong(), recorded(), [MASS, MASS], mode="free_run", setup=SETUP)


def test_warnings_tell_what_cannot_be_seen() -> None:
    doubled = oscillator().with_effect("payload", at="block", mass=0.5)
    names = [MASS, "block.payload.mass"]
    fit = identify(doubled, recorded(), names, mode="free_run", setup=SETUP, fitting=Fitting(known_states=REST))
    assert any(w.startswith("not identifiable") and MASS in w for w in fit.warnings)
    assert np.isinf(fit.std).all()


def test_constant_channels_are_told() -> None:
    record = recorded()
    columns = {"push.command": np.zeros(len(record)), "slide.position": record["slide.position"]}
    still = Experiment.from_arrays(record.time, columns, model=oscillator(), name="idle")
    fit = identify(oscillator(), still, [VISCOUS], mode="free_run", setup=SETUP)
    assert any(w.startswith("push.command is constant in idle") for w in fit.warnings)


# ---- interruption, files, errors -------------------------------------------------------------------------------------


@pytest.mark.parametrize("settings", [None, Fitting(log=True, known_states=REST)])
def test_ctrl_c_keeps_the_best_until_then(settings: Fitting | None) -> None:
    told: list[float] = []

    def impatient(_: int, gap: float) -> None:
        told.append(gap)
        if len(told) == 4 + 4 * (settings is not None):
            raise KeyboardInterrupt

    fit = identify(wrong(), recorded(), FREE, mode="free_run", setup=SETUP, fitting=settings, progress=impatient)
    assert fit.interrupted
    assert fit.warnings[0].startswith("stopped by Ctrl-C")
    assert fit.after["slide.position"][0] < fit.before["slide.position"][0]  # better than the start...
    assert max(abs(errors(fit))) > 1e-4  # ... and not yet the end


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs an alarm")
def test_ctrl_c_ends_starts_on_threads() -> None:
    """The signal reaches the main thread, which waits; the core stops the others, and finished starts are kept."""
    records, begun = [recorded(seed, n=4000) for seed in range(2)], time.process_time()

    def pressed(_: int, frame: FrameType | None) -> None:
        # Elsewhere Python may have to swallow it, as in a callback of the garbage collector: then a little later again.
        if frame is None or frame.f_code.co_name != "wait":
            signal.setitimer(signal.ITIMER_PROF, 0.05)
            return
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGPROF, pressed)
    signal.setitimer(signal.ITIMER_PROF, 2.0)  # processor time, so that some starts have ended
    try:
        fit = fitted(records, starts=4000, workers=2, known_states=REST)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    assert fit.interrupted
    assert 1 <= fit.costs.size < 4000
    assert time.process_time() - begun < 20.0


def test_fit_with_settings_saves_and_loads(tmp_path: Path) -> None:
    fit = fitted(recorded(), states=("slide.velocity",))
    assert Fit.load(fit.save(tmp_path / "fit.npz")) == fit


def test_other_modes_take_the_engine_too() -> None:
    record = simulate_axis(replace(Truth(mass=21.3, viscous=71.0)), 1, 10.0, first_seed=3)[0]
    plain = identify(nominal(), record)
    weighed = identify(nominal(), record, fitting=Fitting(log=True))
    # The plain one is less what its balance leaves of its own simulation.
    np.testing.assert_allclose(weighed.values, plain.values, rtol=2e-4)
    closed = identify(nominal(), record, mode="closed_loop", setup=Setup(substeps=2), fitting=Fitting(log=True))
    assert closed["slide.mass"] == pytest.approx(21.3, rel=2e-2)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"loss": "cubes"}, "choose one of squares, huber, soft_l1"),
        ({"noise": "given"}, "levels go with noise"),
        ({"starts": 0}, "starts is 0"),
        ({"piece": -1.0}, "piece is -1"),
        ({"states": ("slide.speed",)}, 'no state "slide.speed"'),
        ({"channels": ("slide.speed",)}, 'no output "slide.speed"'),
        ({"bounds": {"block.inertia.xx": (0.0, 1.0)}}, "is not free"),
        ({"bounds": {MASS: (2.0, 1.0)}}, "give the lower one first"),
        ({"states": ("slide.velocity",), "known_states": {"slide.velocity": 0.0}}, "choose one"),
    ],
)
def test_settings_that_cannot_be_meant_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(IdentificationError, match=words):
        fitted(recorded(), **options)


def test_problem_takes_channels_and_workers() -> None:
    records = [recorded(0), recorded(1)]
    one, two = (problem(wrong(), records, "free_run", setup=SETUP, workers=workers) for workers in (1, 2))
    columns = [wrong().index(name) for name in FREE]
    for a, b in zip(
        one.evaluate(wrong(), wrong().theta, columns), two.evaluate(wrong(), wrong().theta, columns), strict=True
    ):
        assert np.array_equal(a, b)
    assert Objective(wrong(), one, FREE, (np.zeros(3), np.full(3, np.inf)), Fitting(log=True)).log.all()
