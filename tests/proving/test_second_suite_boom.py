"""The boom of the second suite keeps the laws of mechanics, of oil and of valves."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from second_suite import boom
from second_suite.loop import Gauges
from second_suite.machine import columns_of
from second_suite.oil import AT_REST, OilPlant, Spool
from second_suite.plant import Hidden

M, V = boom.MACHINE, boom.VALUES
SMOOTH = {"luff.coulomb": 0.0, "seals.coulomb": 0.0}
FREE = SMOOTH | {"luff.viscous": 0.0, "seals.viscous": 0.0}
#: A boom of hardly any mass, so that the valve alone says how fast it goes.
LIGHT = FREE | {"boom.mass": 1e-6, "boom.inertia": 1.0}


def plant(*hidden: Hidden, step: float = 5e-4, place: float = 0.3, **numbers: float) -> OilPlant:
    """One boom that stands on its oil."""
    made = OilPlant(M, columns_of(V | numbers, 1), hidden, step)
    made.start(np.array([[place]]))
    return made


def run(made: OilPlant, command: float, time: float) -> None:
    """Go on with one command."""
    for _ in range(round(time / made.step)):
        made.advance(np.array([[command]]))


def push(made: OilPlant) -> float:
    """Force of the oil on the piston."""
    return float((made.area * made.pressures()).sum())


def weight(q: float, mass: float = 220.0, tip: float = 0.0) -> float:
    """Torque of gravity about the pin."""
    return 9.81 * float(mass * (1.2 * np.cos(q) - 0.06 * np.sin(q)) + tip * 2.4 * np.cos(q))


def lever_at(q: float) -> float:
    """By differences of the distance between the ends of the cylinder."""

    def length(angle: float) -> float:
        turned = np.exp(1j * angle) * complex(*boom.EYE)
        return float(abs(turned - complex(*boom.FOOT)))

    return 5e4 * (length(q + 1e-5) - length(q - 1e-5))


def test_the_lever_is_what_the_cylinder_gains_per_angle_and_its_piston_stays_within_its_stroke() -> None:
    angles = np.linspace(-0.25, 0.9, 40)
    length, lever = boom.line({}, angles)
    assert lever == pytest.approx([lever_at(float(q)) for q in angles], rel=1e-8)
    assert ((length > boom.RETRACTED) & (length < boom.RETRACTED + boom.STROKE)).all()


def test_pressures_at_rest_carry_the_load() -> None:
    for payload in (0.0, 20.0):
        hidden = (Hidden("payload", "boom", {"mass": payload}),) * bool(payload)
        made = plant(*hidden, **FREE)
        assert push(made) * lever_at(0.3) == pytest.approx(weight(0.3, tip=payload), rel=1e-8)
        assert made.pressures()[1] == pytest.approx(AT_REST)
        run(made, 0.0, 1.0)
        assert made.q[0, 0] == pytest.approx(0.3, abs=1e-12)


def oil_energy(made: OilPlant) -> float:
    """Energy of all oil by the work that it gives out down to no pressure, at constant modulus."""
    x = made.p / V["oil.modulus"]
    return float((made.volume * V["oil.modulus"] * (np.exp(x) - 1.0 - x)).sum())


def mechanical(made: OilPlant) -> float:
    """Kinetic and potential energy."""
    mass, _ = made.mass_and_load(made.q, made.v)
    height = 1.2 * np.sin(made.q[0, 0]) + 0.06 * np.cos(made.q[0, 0])
    return float(0.5 * mass[0, 0, 0] * made.v[0, 0] ** 2 + 9.81 * 220.0 * height)


def test_energy_swings_between_boom_and_oil_and_none_is_made_with_a_valve_that_is_shut() -> None:
    made = plant(**FREE)
    made.v[:] = 0.02
    oil, first = [oil_energy(made)], oil_energy(made) + mechanical(made)
    errors = []
    for _ in range(4000):
        made.advance(np.zeros((1, 1)))
        oil.append(oil_energy(made))
        errors.append(oil[-1] + mechanical(made) - first)
    # Errors of a step swing with the boom and do not add up, in fourteen swings.
    assert np.abs(errors).max() < 1e-3 * np.ptp(oil)
    assert abs(np.mean(errors[-1000:]) - np.mean(errors[:1000])) < 1e-5 * np.ptp(oil)


def test_work_of_the_pump_is_found_in_boom_oil_valve_and_friction() -> None:
    made = plant(Hidden("internal_leakage", "lifter", {"coefficient": 5e-13}), step=2e-4)
    first, work, lost = oil_energy(made) + mechanical(made), 0.0, 0.0
    for k in range(6000):
        v, p, flow = made.v[0, 0], made.p.copy(), made._flow(made.p, made.drop)[0]
        made.advance(np.full((1, 1), 4.0 if k < 3000 else -3.0))
        middle, speed = 0.5 * (p + made.p), 0.5 * (v + made.v[0, 0])
        flow = 0.5 * (flow + made._flow(made.p, made.drop)[0])
        # Oil at a pressure p that flows in brings its elastic energy beside the work p per volume.
        work += float((V["oil.modulus"] * np.expm1(middle / V["oil.modulus"]) * flow).sum()) * made.step
        viscous = V["luff.viscous"] + V["seals.viscous"] * made.lever[0] ** 2
        dry = V["luff.coulomb"] + V["seals.coulomb"] * made.lever[0]
        lost += float(viscous * speed**2 + dry * abs(speed)) * made.step
    assert lost > 50.0
    assert oil_energy(made) + mechanical(made) + lost - first == pytest.approx(work, abs=2e-3 * abs(lost))


def test_a_shut_valve_holds_the_oil_and_an_open_one_settles_at_the_speed_of_both_edges() -> None:
    ratio, area = V["piston.ratio"], V["piston.area"]
    for command, ends in ((3.0, 180.0 - ratio * 2.0), (-3.0, ratio * 180.0 - 2.0)):
        made = plant(**LIGHT)
        run(made, command, 0.6)
        rate = made.lever[0] * made.v[0, 0]
        # Both drops over equal edges, with flows in the ratio of the areas, and no load.
        drop = ends * 1e5 / (1.0 + ratio**3)
        assert rate == pytest.approx(V["valve.gain"] * command * np.sqrt(drop) / area, rel=1e-3)
        assert abs(push(made)) < 5e-3 * area * 1e7


def test_edges_to_the_tank_that_pass_less_and_a_pump_that_gives_way_slow_it_down() -> None:
    def rate(*hidden: Hidden) -> float:
        made = plant(*hidden, **LIGHT)
        run(made, 3.0, 0.6)
        return float(made.lever[0] * made.v[0, 0])

    ratio, area, gain = V["piston.ratio"], V["piston.area"], V["valve.gain"] * 3.0
    uneven = rate(Hidden("uneven_edges", "lifter", {"less": 0.2}))
    drop = (180.0 - ratio * 2.0) * 1e5 / (1.0 + ratio**3 / 0.8**2)
    assert uneven == pytest.approx(gain * np.sqrt(drop) / area, rel=1e-3)
    late = rate(Hidden("supply_drop", "pump", {"resistance": 1e10, "time_constant": 0.02}))
    left = 1.8e7 - 1e10 * area * late - ratio * 2e5
    assert late == pytest.approx(gain * np.sqrt(left / (1.0 + ratio**3)) / area, rel=1e-3)


def test_a_leak_past_the_piston_lets_a_boom_sink() -> None:
    made = plant(Hidden("internal_leakage", "lifter", {"coefficient": 5e-13}), **SMOOTH)
    run(made, 0.0, 1.0)
    place, sum_before = made.q.copy(), made.volume * np.exp(made.p / V["oil.modulus"])
    past = 5e-13 * float(made.p[0, 0] - made.p[1, 0])
    run(made, 0.0, 0.2)
    assert made.q[0, 0] < place[0, 0]
    gained = made.volume * np.exp(made.p / V["oil.modulus"]) - sum_before
    assert gained[:, 0] == pytest.approx(0.2 * past * np.array([-1.0, 1.0]), rel=0.02)


def test_oil_with_air_is_squeezed_by_what_its_modulus_says() -> None:
    made = plant(Hidden("entrained_air", "pump", {"fraction": 0.06}), **FREE)
    before, volume = made.p.copy(), made.volume.copy()
    for k in range(200):
        made._follow(np.full(1, 0.3 - 0.0002 * (k + 1)), np.zeros(1))

    def softness(p: float) -> float:
        air = 0.06 * float((101325.0 / p) ** (1.0 / 1.4))
        return (1.0 / V["oil.modulus"] + air / (1.4 * p)) / (1.0 + air)

    for chamber in range(2):
        squeezed = float(np.log(volume[chamber, 0] / made.volume[chamber, 0]))
        start = float(before[chamber, 0])

        def left(p: float, start: float = start, squeezed: float = squeezed) -> float:
            return float(quad(softness, start, p)[0]) - squeezed

        assert made.p[chamber, 0] == pytest.approx(brentq(left, 3e3, 1e9), rel=1e-3)


def test_a_spool_answers_to_a_step_as_an_oscillator_does_and_stops_at_its_stroke() -> None:
    w, d, u = 250.0, 0.8, 4.0
    spool = Spool(np.array([w]), np.array([d]), np.array([10.0]), 1e-3)
    turn, times = w * np.sqrt(1.0 - d * d), 1e-3 * np.arange(1, 30)
    seen = []
    for _ in times:
        spool.mean_opening(np.array([u]))
        seen.append(float(spool.opening[0]))
    answer = u * (1.0 - np.exp(-d * w * times) * (np.cos(turn * times) + d * w / turn * np.sin(turn * times)))
    assert seen == pytest.approx(answer, abs=1e-9)
    spool.mean_opening(np.array([50.0]))
    for _ in range(100):
        assert spool.mean_opening(np.array([50.0]))[0] <= 10.0
    assert spool.opening[0] == pytest.approx(10.0)


def test_halved_steps_make_a_quarter_of_the_error_with_oil_that_flows() -> None:
    ends = []
    for steps in (100, 200, 800):
        made = plant(step=0.2 / steps, **SMOOTH)
        run(made, 5.0, 0.2)
        ends.append(np.concatenate([made.q[0], 1e-9 * made.p[:, 0]]))
    coarse, half = (np.abs(end - ends[2]).max() for end in ends[:2])
    assert coarse / half == pytest.approx(4.2, rel=0.1)
    # Half a millisecond is what records are made of: far below a count of the encoder.
    assert abs(ends[1][0] - ends[2][0]) < 0.1 * M.joints[0].resolution


def test_a_boom_sticks_until_the_oil_outweighs_its_friction() -> None:
    made = plant(step=1e-4)
    dry = V["luff.coulomb"] + V["seals.coulomb"] * made.lever[0]
    pushes: list[float] = []
    while abs(made.v[0, 0]) < 1e-9 and len(pushes) < 20_000:
        pushes.append(push(made) * float(made.lever[0]) - weight(0.3))
        made.advance(np.full((1, 1), 0.05))
    assert made.q[0, 0] == pytest.approx(0.3, abs=1e-6)
    assert len(pushes) > 100
    assert pushes[-1] == pytest.approx(dry, rel=0.01)
    assert max(pushes) < 1.001 * dry


def test_seals_that_chambers_press_upon_hold_with_their_share_of_both_pressures() -> None:
    made = plant(Hidden("seal_friction", "lifter", {"share": 0.03}), step=1e-4, **SMOOTH)
    while abs(made.v[0, 0]) < 1e-9:
        held = push(made) * float(made.lever[0]) - weight(0.3)
        pressed = 0.03 * V["piston.area"] * float(made.p.sum() * made.lever[0])
        made.advance(np.full((1, 1), 0.1))
    assert held == pytest.approx(pressed, rel=0.01)


def test_gauges_are_scaled_shifted_and_count() -> None:
    hidden = (Hidden("sensor_gain", "gauge_a", {"value": 1.1}), Hidden("sensor_offset", "gauge_b", {"value": 4e5}))
    gauges, true = Gauges(M, hidden), np.array([[5.0e6, 5.0e6], [3.0e6, 3.0e6]])
    seen = gauges.read(true, np.zeros((2, 2)), np.array([False, True]))
    assert seen[:, 0] == pytest.approx([5.5e6, 3.4e6])
    assert seen[:, 1] == pytest.approx([5.5e6, 3.4e6], abs=0.5 * M.gauges[0].resolution)
    many = gauges.read(
        np.full((2, 4000), 4e6), np.random.default_rng(0).standard_normal((2, 4000)), np.full(4000, True)
    )
    assert many.std(axis=1) == pytest.approx(M.gauges[0].noise, rel=0.05)
