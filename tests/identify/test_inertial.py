"""Inertial parameters: exact without noise, base parameters of the textbooks, honest intervals, feasible bodies."""

import runpy
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.optimize import check_grad, nnls
from scipy.signal import lfilter

import vpm
from places import EXAMPLES
from two_link_arm import GRAVITY, MODEL, Arm, record
from vpm.errors import IdentificationError
from vpm.identify.feasibility import WEIGHT, Distance, fault, pseudo_inertia
from vpm.identify.identifiability import find_base
from vpm.identify.inertial_model import InertialModel, inertial_regression
from vpm.identify.inertial_solve import score_covariance
from vpm.linkages import INERTIAL_NAMES, Leg, inertial_values, with_inertial_values
from vpm.model.standard import standard_parameters
from vpm.numbers import Array

# D'Imperio (2016), Table 5.1, CAD column: seven masses, four inertias.
TABLE = np.array([7.360, 0.885, 0.876, 1.216, 0.215, 1.214, 0.215, 2.750e-3, 0.325e-3, 0.338e-3, 0.769e-3])


@cache
def example(folder: str) -> dict[str, Any]:
    return runpy.run_path(str(EXAMPLES / folder / "inertial.py"), run_name="example")


def states(kind: str, count: int = 400, seed: int = 5) -> tuple[Array, Array, Array]:
    """Random states of the leg: whole workspace and fast, or one pose, 2 degrees about it, below 0.1 rad/s."""
    random = np.random.default_rng(seed)
    shape = (count, 2)
    if kind == "wide":
        low, high, rate, acceleration = (-40.0, -140.0), (60.0, -20.0), 10.0, 60.0
    else:
        low, high, rate, acceleration = (18.0, -82.0), (22.0, -78.0), 0.1, 0.5
    angles = np.radians(random.uniform(low, high, shape))
    return angles, random.uniform(-rate, rate, shape), random.uniform(-acceleration, acceleration, shape)


def leg_data(kind: str, noise: float = 0.0, **options: Any) -> vpm.InertialRegression:
    leg, motion = Leg.hyq(), states(kind, **options)
    torques = leg.torques(*motion, derivation="newton_euler")
    torques = torques + noise * np.random.default_rng(1).standard_normal(torques.shape)
    return vpm.InertialRegression.from_arrays(
        leg.regressor(*motion), torques, INERTIAL_NAMES, nominal=1.1 * TABLE, positive=INERTIAL_NAMES
    )


# ---- the leg ---------------------------------------------------------------------------------------------------------


def test_the_legs_torques_are_linear_in_eleven_parameters() -> None:
    leg, motion = Leg.hyq(), states("wide", 50)
    assert inertial_values(leg.parameters) == pytest.approx(TABLE, abs=1e-12)
    table = leg.regressor(*motion)
    # The torques of a leg with other numbers, by the balances of its bodies: another derivation than the regressor's.
    values = TABLE * np.random.default_rng(2).uniform(0.5, 2.0, 11)
    other = Leg(with_inertial_values(leg.parameters, values))
    np.testing.assert_allclose(table @ values, other.torques(*motion, derivation="newton_euler"), rtol=1e-8, atol=1e-8)
    assert leg.regressor(*(table_[0] for table_ in motion)).shape == (2, 11)


def test_all_eleven_without_noise() -> None:
    fit = vpm.identify_inertial(leg_data("wide"))
    assert fit.rank == 11
    np.testing.assert_allclose(fit.values, TABLE, rtol=1e-6)
    assert fit.identifiable == ("yes",) * 11
    assert fit.feasible
    assert fit.base_words == INERTIAL_NAMES
    for options in ({"physical": True}, {"prior": 0.2}, {"complete": True}):
        np.testing.assert_allclose(vpm.identify_inertial(leg_data("wide"), **options).values, TABLE, rtol=1e-6)


def test_the_published_conditions_have_rank_ten_and_no_single_mass() -> None:
    fit = vpm.identify_inertial(leg_data("narrow", 0.5))
    assert fit.rank == 10
    assert "yes" not in fit.identifiable
    masses = fit.std[:7]
    # "No single mass is known to better than several hundred percent".
    assert np.all(masses > 3.0 * TABLE[:7])
    assert fit.directions == 2
    clean = vpm.identify_inertial(leg_data("narrow"))
    assert clean.rank == 10
    # What hangs together is recovered as a whole although its parts are not. The moments of inertia are left out: the
    # eleventh direction is not exactly none, and what it holds goes where the torques see least of it.
    np.testing.assert_allclose(clean.base_values[:6], clean.combine(TABLE)[:6], rtol=1e-5)
    assert np.isinf(clean.std).sum() == sum(word == "only in combination" for word in clean.identifiable) > 1


def test_deviations_in_fast_motion_are_those_of_the_theory() -> None:
    fit = vpm.identify_inertial(leg_data("wide", 0.5))
    relative = fit.std / TABLE
    # 3 %, 5 % and 46 %, and above 100 % for the others: (F'F)^-1 for 0.5 N m and 800 equations.
    assert relative[[2, 5, 6]] == pytest.approx([0.030, 0.045, 0.47], rel=0.08)
    assert np.all(np.delete(relative, [2, 5, 6]) > 1.0)


# ---- textbook base parameters ----------------------------------------------------------------------------------------


def two_links(q: Array, v: Array, a: Array, length: float = 0.4) -> Array:
    """Torques by M1 X1 Z1 I1 M2 X2 Z2 I2 (first moments, inertia about the joint), written out by hand.

    Arm in the x-z plane, angles about +y, which turn x towards -z; Lagrange's equations with first moments.
    """
    g, (q1, q2), (v1, v2), (a1, a2) = GRAVITY, q, v, a
    c1, s1, c12, s12, c2, s2 = np.cos(q1), np.sin(q1), np.cos(q1 + q2), np.sin(q1 + q2), np.cos(q2), np.sin(q2)
    # The link's first moment along and across the first link; its derivative by q2 is the last factor.
    x2 = np.array(
        [length * (c2 * (2 * a1 + a2) - s2 * (2 * v1 + v2) * v2) - g * c12, length * (c2 * a1 + s2 * v1**2) - g * c12]
    )
    z2 = np.array(
        [length * (s2 * (2 * a1 + a2) + c2 * (2 * v1 + v2) * v2) - g * s12, length * (s2 * a1 - c2 * v1**2) - g * s12]
    )
    columns = [
        [0.0, 0.0],
        [-g * c1, 0.0],
        [-g * s1, 0.0],
        [a1, 0.0],
        [length**2 * a1 - length * g * c1, 0.0],
        x2,
        z2,
        [a1 + a2, a1 + a2],
    ]
    return np.array(columns).T


def test_the_regressor_of_a_model_file_against_equations_by_hand() -> None:
    linear = InertialModel(vpm.Model.from_toml(MODEL), ["shoulder.friction.viscous", "elbow.friction.viscous"])
    random = np.random.default_rng(3)
    motion = tuple(random.uniform(-3.0, 3.0, (30, 2)) for _ in range(3))
    _, table = linear.lacking(motion, np.zeros((30, 2)), 1.0)  # type: ignore[arg-type]  # three of them
    planar = [
        f"{body}.{end}"
        for body in ("upper", "lower")
        for end in ("mass", "first_moment.x", "first_moment.z", "origin_inertia.yy")
    ]
    mine = table[:, :, [linear.names.index(name) for name in planar]]
    by_hand = np.array([two_links(*state) for state in zip(*motion, strict=True)])
    np.testing.assert_allclose(mine, by_hand, rtol=1e-10, atol=1e-10)


def test_base_parameters_of_a_planar_arm_are_those_of_khalil_and_dombre() -> None:
    model = vpm.Model.from_toml(MODEL)
    fit = vpm.identify_inertial(model, record(Arm(), 10.0, 1))
    # W. Khalil, E. Dombre 2002, table of the planar arm: ZZ1 + d^2 M2, MX1 + d M2, MY1, ZZ2, MX2, MY2; here about y.
    assert set(fit.base_words) == {
        "upper.first_moment.x +0.4 lower.mass",
        "upper.first_moment.z",
        "upper.origin_inertia.yy +0.16 lower.mass",
        "lower.first_moment.x",
        "lower.first_moment.z",
        "lower.origin_inertia.yy",
        "shoulder.friction.viscous",
        "elbow.friction.viscous",
    }
    assert fit.identifiable[fit.names.index("upper.mass")] == "no"
    assert fit.identifiable[fit.names.index("lower.mass")] == "only in combination"
    # A record that was simulated without vpm, with encoder noise: every sum within four deviations of the truth.
    arm = Arm()
    (m1, m2), (c1, c2), (i1, i2) = arm.masses, arm.centres, arm.inertias
    true = {
        "upper.first_moment.x": m1 * c1 + 0.4 * m2,
        "upper.origin_inertia.yy": i1 + m1 * c1**2 + 0.16 * m2,
        "lower.first_moment.x": m2 * c2,
        "lower.origin_inertia.yy": i2 + m2 * c2**2,
        "upper.first_moment.z": 0.0,
        "lower.first_moment.z": 0.0,
        "shoulder.friction.viscous": arm.viscous[0],
        "elbow.friction.viscous": arm.viscous[1],
    }
    expected = np.array([true[name] for name in fit.base_names])
    np.testing.assert_allclose(fit.base_values, expected, atol=2e-3)
    assert np.all(np.abs(fit.base_values - expected) < 4.0 * fit.base_std)


def test_base_parameters_do_not_depend_on_how_they_are_chosen() -> None:
    random = np.random.default_rng(4)
    core = random.standard_normal((200, 4))
    columns = np.column_stack([core, core @ random.standard_normal((4, 3)), np.zeros(200)])
    for prefer in ((), (6, 5, 4), (7, 0, 4)):
        base = find_base(columns, prefer=prefer)
        assert base.rank == 4
        assert base.unseen == (7,)
        np.testing.assert_allclose(columns[:, list(base.kept)] @ base.map, columns, atol=1e-9)
        assert set(prefer) - {7} <= set(base.kept)
        assert base.singular_values[3] > 1e-3
        assert base.singular_values[4] < 1e-12


def test_the_arm_of_three_links() -> None:
    module = example("arm")
    linear = InertialModel(module["machine"](), [])
    random = np.random.default_rng(6)
    q, v, a = (random.uniform(-3.0, 3.0, (200, 3)) for _ in range(3))
    _, table = linear.lacking((q, v, a), np.zeros((200, 3)), 1.0)
    efforts = np.array([linear.model.inverse_dynamics(*state) for state in zip(q, v, a, strict=True)])
    held, _ = linear.lacking((q, v, a), np.zeros((200, 3)), 1.0)
    np.testing.assert_allclose(table @ linear.nominal - held, efforts, rtol=1e-9, atol=1e-9)
    # Without noise the sums are exact; 15 for an arm of one vertical and two parallel horizontal axes.
    data = vpm.InertialRegression.from_arrays(table, table @ linear.nominal, linear.names, nominal=0.0 * linear.nominal)
    fit = vpm.identify_inertial(data)
    assert fit.rank == 15
    np.testing.assert_allclose(fit.base_values, fit.combine(linear.nominal), rtol=1e-9, atol=1e-9)

    target = module["motion"](evaluations=60)
    log = module["measured"](target)
    noisy = vpm.identify_inertial(module["nominal"](), log)
    assert noisy.rank == 21
    apart = (noisy.base_values - module["truth"](noisy)) / noisy.base_std
    assert np.abs(apart).max() < 4.0
    assert np.sqrt(np.mean(apart**2)) < 1.6
    physical = vpm.identify_inertial(module["nominal"](), log, physical=True)
    assert not noisy.feasible
    assert physical.feasible
    assert physical.residual < 1.01


def test_the_example_of_the_arm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example("arm")["main"](tmp_path)
    printed = capsys.readouterr().out
    assert "rank 21 of 36" in printed
    assert "physically feasible" in printed
    assert (tmp_path / "arm_inertial.png").stat().st_size > 5000


def test_two_records_say_more_than_one() -> None:
    model = vpm.Model.from_toml(MODEL)
    one, two = record(Arm(), 10.0, 1), record(Arm(), 10.0, 2)
    alone, both = vpm.identify_inertial(model, one), vpm.identify_inertial(model, [one, two])
    assert both.samples > 1.9 * alone.samples
    # Twice the samples: deviations smaller by the root of two, about.
    assert 0.5 < np.exp(np.mean(np.log(both.base_std / alone.base_std))) < 0.95


def test_the_regressor_against_pinocchio() -> None:
    pin: Any = pytest.importorskip("pinocchio", reason="the extra peers is not installed")
    linear = InertialModel(example("arm")["nominal"](), [])
    axes = {"waist": (pin.JointModelRZ, (0.0, 0.0, 0.0)), "shoulder": (pin.JointModelRY, (0.05, 0.0, 0.0))}
    axes["elbow"] = (pin.JointModelRY, (0.40, 0.0, 0.0))
    other, parent = pin.Model(), 0
    for name, (kind, place) in axes.items():
        parent = other.addJoint(parent, kind(), pin.SE3(np.eye(3), np.array(place)), name)
    other.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    data, random = other.createData(), np.random.default_rng(7)
    order = [0, 1, 2, 3, 4, 6, 9, 5, 7, 8]  # theirs: m, mc, xx, xy, yy, xz, yz, zz
    motion = tuple(random.uniform(-3.0, 3.0, (20, 3)) for _ in range(3))
    _, table = linear.lacking(motion, np.zeros((20, 3)), 1.0)  # type: ignore[arg-type]  # three of them
    for row, state in enumerate(zip(*motion, strict=True)):
        theirs = np.array(pin.computeJointTorqueRegressor(other, data, *state)).reshape(3, 3, 10)[:, :, order]
        np.testing.assert_allclose(table[row], theirs.reshape(3, 30), rtol=1e-9, atol=1e-10)


# ---- intervals -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_intervals_hold_what_they_promise(memory: float) -> None:
    course = example("hyq_leg")["WIDE"].at(np.arange(1500) * 0.01)
    table = Leg.hyq().regressor(*course)
    hits, white, seeds = np.zeros(11), np.zeros(11), 120
    for seed in range(seeds):
        shocks = np.random.default_rng(seed).standard_normal((1800, 2))
        noise = 0.5 * lfilter([1.0], [1.0, -memory], shocks, axis=0)[300:]
        data = vpm.InertialRegression.from_arrays(table, table @ TABLE + noise, INERTIAL_NAMES, nominal=TABLE)
        fit = vpm.identify_inertial(data)
        low, high = fit.intervals.T
        hits += np.abs(TABLE - 0.5 * (low + high)) <= 0.5 * (high - low)
        # As if the noise were white.
        scaled = table / fit.noise[:, None]
        textbook = np.sqrt(np.diag(np.linalg.inv(np.einsum("tci,tcj->ij", scaled, scaled))))
        white += np.abs(fit.values - TABLE) < 1.96 * textbook
    # The standard deviation of a share of 95 % in 120 trials is 2 points; parameters are correlated.
    assert np.all(hits / seeds > 0.88)
    assert 0.91 < np.mean(hits) / seeds < 0.985
    if memory:
        assert np.mean(white) / seeds < 0.8, "counting samples would have promised too much"


def test_the_covariance_of_scores_is_that_of_its_noise() -> None:
    random = np.random.default_rng(8)
    table = np.cumsum(random.standard_normal((400, 2, 3)), axis=0) / 10.0
    mixing = np.array([[1.0, 0.0], [0.8, 0.6]])  # channels share a part of their shocks
    shocks = random.standard_normal((300_000, 2)) @ mixing.T
    noise = np.stack([lfilter([1.0], [1.0, -0.8], shocks[:, 0]), lfilter([1.0], [1.0, -0.5], shocks[:, 1])], axis=1)
    repeated = np.tile(table, (750, 1, 1))[: len(noise)]
    records = [slice(400 * k, 400 * (k + 1)) for k in range(750)]
    found = score_covariance(repeated, noise, records) / 750

    def cross(first: float, second: float, shared: float) -> Array:
        """Covariance of two autoregressions, E x_s y_t, at all pairs of 400 times."""
        lags = np.arange(400)
        power = shared / (1.0 - first * second)
        return toeplitz(power * first**lags, power * second**lags)

    exact = sum(
        table[:, c].T @ cross(*roots, shared) @ table[:, d]
        for c, d, roots, shared in (
            (0, 0, (0.8, 0.8), 1.0), (1, 1, (0.5, 0.5), 1.0), (0, 1, (0.8, 0.5), 0.8), (1, 0, (0.5, 0.8), 0.8),
        )
    )  # fmt: skip
    np.testing.assert_allclose(found, exact, rtol=0.03, atol=0.03 * np.abs(exact).max())


def test_channels_are_weighted_by_their_noise() -> None:
    random = np.random.default_rng(9)
    table, true = random.standard_normal((500, 2, 3)), np.array([1.0, 2.0, 3.0])
    noise = random.standard_normal((500, 2)) * (0.01, 10.0)
    fit = vpm.identify_inertial(vpm.InertialRegression.from_arrays(table, table @ true + noise, ["a", "b", "c"]))
    assert fit.noise == pytest.approx([0.01, 10.0], rel=0.1)
    # As precise as the good channel alone: 0.01 / sqrt(500).
    assert fit.std == pytest.approx(0.01 / np.sqrt(500.0), rel=0.15)


# ---- feasible bodies -------------------------------------------------------------------------------------------------


def body(random: np.random.Generator, points: int = 8) -> Array:
    """Ten parameters of a cloud of point masses: such a body exists."""
    masses, places = random.uniform(0.1, 1.0, points), random.uniform(-0.3, 0.3, (points, 3))
    inertia = sum(m * ((r @ r) * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, places, strict=True))
    first = masses @ places
    return np.array([masses.sum(), *first, *inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])


def test_clouds_of_points_are_bodies_and_others_are_not() -> None:
    random = np.random.default_rng(10)
    for _ in range(50):
        ten = body(random)
        assert fault(ten) == ""
        assert np.linalg.eigvalsh(pseudo_inertia(ten))[0] > 0.0
    center = np.array([0.1, 0.0, 0.2])
    plate = standard_parameters(2.0, center, np.array([0.1, 0.2, 0.31, 0.0, 0.0, 0.0]))
    assert "0.31 kg m^2 is above the sum of the others, 0.3 kg m^2" in fault(plate)
    assert np.linalg.eigvalsh(pseudo_inertia(plate))[0] < 0.0
    assert "mass -1 kg" in fault(np.array([-1.0, *[0.0] * 9]))
    negative = standard_parameters(2.0, center, np.array([-0.1, 0.2, 0.2, 0.0, 0.0, 0.0]))
    assert "principal moment -0.1 kg m^2" in fault(negative)


def full_body(effort_noise: float, seed: int, samples: int = 60) -> tuple[vpm.InertialRegression, Array]:
    """Force and moment of one free body of random motion: ten columns, all seen."""
    random = np.random.default_rng(seed)
    true = body(random)
    names = [f"load.{k}" for k in range(10)]
    table = random.standard_normal((samples, 6, 10))
    effort = table @ true + effort_noise * random.standard_normal((samples, 6))
    nominal = body(np.random.default_rng(99))
    data = vpm.InertialRegression.from_arrays(table, effort, names, nominal=nominal, bodies={"load": tuple(names)})
    return data, true


def test_the_gradient_of_the_distance() -> None:
    data, true = full_body(0.0, 0)
    distance = Distance(data)
    assert distance(distance.start) == pytest.approx(0.0, abs=1e-12)

    def slope(values: Array) -> Array:
        root, right = distance.root(values)
        return np.asarray(root.T @ right)

    assert check_grad(distance, slope, true) < 1e-4 * np.linalg.norm(slope(true))
    root, _ = distance.root(true)
    step = 1e-6 * np.random.default_rng(1).standard_normal(10) * np.abs(true)
    curved = slope(true + step) - slope(true - step)
    np.testing.assert_allclose(root.T @ root @ (2.0 * step), curved, rtol=1e-5, atol=1e-5 * np.abs(curved).max())
    assert distance(-true) == np.inf


def test_an_infeasible_estimate_becomes_a_feasible_one() -> None:
    # Measured so badly that least squares finds moments of inertia of no body.
    found = 0
    for seed in range(6):
        data, _ = full_body(1.0, seed)
        free, bound = vpm.identify_inertial(data), vpm.identify_inertial(data, physical=True)
        assert bound.feasible
        assert np.linalg.eigvalsh(pseudo_inertia(bound.values))[0] > 0.0
        if free.feasible:
            continue
        found += 1
        assert any(free.faults.values())
        assert bound.residual > free.residual
        # Nearest in the norm of the data: no feasible point on the way to another body is better.
        table, effort = data.regressor / free.noise[:, None], data.effort / free.noise
        cost: Callable[[Array], float] = lambda p: float(np.sum((table @ p - effort) ** 2))  # noqa: E731, B023
        for other in (body(np.random.default_rng(k)) for k in range(5)):
            for share in (0.001, 0.01, 0.1, 1.0):
                assert cost(bound.values + share * (other - bound.values)) > cost(bound.values) - 0.2
    assert found >= 3


def test_a_point_mass_of_a_model_is_a_start() -> None:
    data, true = full_body(0.01, 3)
    point = standard_parameters(float(true[0]), true[1:4] / true[0], np.zeros(6))
    fit = vpm.identify_inertial(replace(data, nominal=point), physical=True)
    assert fit.feasible
    np.testing.assert_allclose(fit.values, true, atol=5.0 * fit.std.max())
    wrong = standard_parameters(1.0, np.zeros(3), np.array([1.0, 1.0, 3.0, 0.0, 0.0, 0.0]))
    with pytest.raises(IdentificationError, match="the nominal values of load are those of no body: principal"):
        vpm.identify_inertial(replace(data, nominal=wrong), physical=True)


def test_positive_parameters_against_nonnegative_least_squares() -> None:
    data = leg_data("wide", 0.5)
    free, bound = vpm.identify_inertial(data), vpm.identify_inertial(data, physical=True)
    assert not free.feasible
    assert bound.feasible
    assert np.all(bound.values > 0.0)
    table = (data.regressor / free.noise[:, None]).reshape(-1, 11)
    effort = (data.effort / free.noise).ravel()
    lengths = np.linalg.norm(table, axis=0)
    found, _ = nnls(table / lengths, effort)
    best = found / lengths  # some of it zero, where the distance is infinite: a step inside
    inside = best + 1e-3 * data.nominal
    distance = Distance(data)

    def cost(p: Array) -> float:
        return 0.5 * float(np.sum((table @ p - effort) ** 2))

    assert np.any(best == 0.0)
    assert cost(best) <= cost(bound.values) < cost(best) + 1.0
    assert cost(bound.values) + WEIGHT * distance(bound.values) < cost(inside) + WEIGHT * distance(inside)


def test_what_data_know_stays_what_the_nominal_values_do_not_move() -> None:
    random = np.random.default_rng(12)
    table, true = random.standard_normal((300, 1, 3)), np.array([1.0, 2.0, 3.0])
    effort = table @ true + 0.01 * random.standard_normal((300, 1))
    data = vpm.InertialRegression.from_arrays(
        table, effort, ["a", "b", "c"], nominal=[2.0, 1.0, 5.0], positive=["a", "b", "c"]
    )
    free, bound = vpm.identify_inertial(data), vpm.identify_inertial(data, physical=True)
    np.testing.assert_allclose(bound.values, free.values, atol=0.05 * free.std.max())


def test_a_prior_weighs_as_much_as_it_says() -> None:
    random = np.random.default_rng(13)
    table, true = random.standard_normal((4000, 1, 2)), np.array([1.0, 2.0])
    effort = table @ true + random.standard_normal((4000, 1))
    data = vpm.InertialRegression.from_arrays(table, effort, ["a", "b"], nominal=[1.5, 2.0])
    free = vpm.identify_inertial(data)
    fit = vpm.identify_inertial(data, prior={"a": float(free.std[0])})
    # Equal deviations of data and prior: half way between, and 1/sqrt(2) of the deviation.
    assert fit["a"] == pytest.approx(0.5 * (free["a"] + 1.5), abs=0.05 * free.std[0])
    assert fit.std[0] == pytest.approx(free.std[0] / np.sqrt(2.0), rel=0.05)
    assert fit.std[1] == pytest.approx(free.std[1], rel=0.05)


# ---- the example, the result -----------------------------------------------------------------------------------------


def test_the_example_of_the_leg(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    module = example("hyq_leg")
    true = inertial_values(module["built"]().parameters)
    wide = vpm.identify_inertial(module["measured"](module["WIDE"]))
    narrow = vpm.identify_inertial(module["measured"](module["NARROW"]))
    known = {name for name, word in zip(wide.names, wide.identifiable, strict=True) if word == "yes"}
    assert {"lower.mass", "knee_barrel.mass", "lower.inertia"} <= known
    assert "yes" not in narrow.identifiable
    assert np.all(np.abs(wide.values - true) < 4.0 * wide.std)
    module["main"](tmp_path)
    printed = capsys.readouterr().out
    assert "without noise: rank 11 of 11" in printed
    assert "without noise: rank 10 of 11" in printed
    assert {path.name for path in tmp_path.iterdir()} == {"leg_wide.png", "leg_narrow.png"}


def test_manners_of_the_result(tmp_path: Path) -> None:
    fit = vpm.identify_inertial(leg_data("narrow", 0.5))
    assert vpm.InertialFit.load(fit.save(tmp_path / "fit.npz")) == fit
    text = str(fit)
    assert "only in combination" in text
    assert "rank 10 of 11" in text
    assert "hip_rod.mass" in text
    frame = fit.to_frame()
    assert list(frame["parameter"]) == list(INERTIAL_NAMES)
    assert len(fit.plot().axes) == 2
    assert len(vpm.identify_inertial(leg_data("wide", 0.5)).plot().axes) == 1
    assert "InertialFit(parameters=11, rank=10" in repr(fit)
    with pytest.raises(IdentificationError, match=r'no parameter "lower\.mas"; did you mean "lower\.mass"'):
        _ = fit["lower.mas"]


# ---- bad input -------------------------------------------------------------------------------------------------------


def spoiled(change: Callable[[Array, Array], None], **options: Any) -> vpm.InertialRegression:
    motion = states("wide", options.pop("count", 40))
    leg = Leg.hyq()
    table, torques = leg.regressor(*motion), leg.torques(*motion)
    change(table, torques)
    return vpm.InertialRegression.from_arrays(table, torques, INERTIAL_NAMES, channels=("hip", "knee"), **options)


def put(at: tuple[int, ...], value: float, *, effort: bool) -> Callable[[Array, Array], None]:
    def change(table: Array, torques: Array) -> None:
        (torques if effort else table)[at] = value

    return change


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: spoiled(lambda *_: None, count=10), "10 samples of 2 channels are 20 equations for 11 parameters"),
        (lambda: spoiled(put((7, 1), np.nan, effort=True)), "the effort is nan at sample 7, channel knee; leave"),
        (lambda: spoiled(put((3, 0, 2), np.inf, effort=False)), "regressor is inf at sample 3, channel hip, param"),
        (lambda: spoiled(lambda _, y: y[:, 1].fill(3.0)), "the effort of knee is 3 in all 40 samples"),
        (lambda: spoiled(lambda t, _: t.__setitem__(slice(None), t[0])), "stands still: all 40 samples have the same"),
        (lambda: spoiled(lambda *_: None, positive=("lower.mas",)), 'no parameter "lower.mas"; did you mean'),
        (lambda: spoiled(lambda *_: None, nominal=TABLE[:5]), "5 nominal values do not fit, 11 are needed"),
        (lambda: spoiled(lambda *_: None, records=(10, 10)), "20 samples in records do not fit, 40 are needed"),
        (lambda: spoiled(lambda *_: None, bodies={"lower": ("lower.mass",)}), "the body lower has 1 parameters"),
        (lambda: vpm.InertialRegression.from_arrays(np.ones((4, 3)), np.ones(5), ["a"] * 3), r"shape \(4, 1, 3\) does"),
    ],
)  # fmt: skip
def test_bad_data_are_refused_in_a_sentence(make: Callable[[], object], words: str) -> None:
    with pytest.raises(IdentificationError, match=words):
        make()


def test_bad_questions_are_refused_in_a_sentence() -> None:
    data = leg_data("narrow", 0.5)
    with pytest.raises(
        IdentificationError, match=r"10 of 11 parameters can be told from these data: .*hip_rod\.mass"
    ) as info:
        vpm.identify_inertial(data, complete=True)
    assert "slider.mass" in info.value.parameters
    with pytest.raises(IdentificationError, match=r'prior: there is no parameter "lower\.mas"'):
        vpm.identify_inertial(data, prior={"lower.mas": 0.1})
    with pytest.raises(IdentificationError, match="a regression holds its own data"):
        vpm.identify_inertial(data, cutoff=3.0)
    bare = vpm.InertialRegression.from_arrays(data.regressor, data.effort, INERTIAL_NAMES, positive=["lower.mass"])
    with pytest.raises(
        IdentificationError, match=r"the nominal value of lower\.mass is nan; a physical fit begins there"
    ):
        vpm.identify_inertial(bare, physical=True)
    with pytest.raises(IdentificationError, match=r"prior: slider.mass has the nominal value nan"):
        vpm.identify_inertial(bare, prior={"slider.mass": 0.1})


def test_bad_models_and_records_are_refused_in_a_sentence() -> None:
    model = vpm.Model.from_toml(MODEL)
    log = record(Arm(), 4.0, 2)
    with pytest.raises(IdentificationError, match="no record was given"):
        vpm.identify_inertial(model)
    with pytest.raises(IdentificationError, match=r'has no parameter "elbow\.friction\.viscos"; did you mean'):
        inertial_regression(model, log, others=["elbow.friction.viscos"])
    with pytest.raises(IdentificationError, match=r"lower\.mass belongs to a body"):
        inertial_regression(model, log, others=["lower.mass"])
    channels = {name: log[name] for name in log.channels}
    channels["elbow.position"] = np.full(len(log.time), 0.3)
    still = vpm.Experiment.from_arrays(log.time, channels, model=model, name="held")
    with pytest.raises(
        IdentificationError, match=r"the joint elbow never moves: elbow\.position is 0\.3 rad in all samples"
    ):
        vpm.identify_inertial(model, still)
    curved = MODEL + '\n[[effects]]\ntype = "coulomb_friction"\nat = "elbow"\ncoulomb = 0.3\n'
    arm = vpm.Model.from_toml(curved)
    with pytest.raises(IdentificationError, match=r"not linear in elbow\.friction\.transition_velocity"):
        inertial_regression(arm, log, others=["elbow.friction.transition_velocity"])
    assert "elbow.friction.coulomb" in inertial_regression(arm, log, others=["elbow.friction.coulomb"]).names
