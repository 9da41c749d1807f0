"""Closed linkages from Python: files, errors, examples; their published values are in the validation table."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from command_line import ran
from places import EXAMPLES
from validation.linkages import disagreement
from vpm import linkages
from vpm.errors import ModelError
from vpm.linkages import DropLimit, Karl, KarlGeometry, KarlPoses, Leg, LegParameters, ShareMap, drop_limit
from vpm.studies.linkages.leg import ShareDefinition
from vpm.studies.linkages.leg_parameters import HyqSet

KARL_FILE = EXAMPLES / "karl" / "karl.toml"
LEG_FILE = EXAMPLES / "hyq_leg" / "leg.toml"

TOLERANCE = 0.05


def load_karl() -> Karl:
    karl = linkages.load(KARL_FILE)
    assert isinstance(karl, Karl)
    return karl


def load_leg() -> Leg:
    leg = linkages.load(LEG_FILE)
    assert isinstance(leg, Leg)
    return leg


@pytest.mark.parametrize("data", ["table", "identified", "plausible"])
def test_derivations_agree_with_every_set_of_parameters(data: HyqSet) -> None:
    assert disagreement(Leg.hyq(data, shank=0.36, thigh=0.33)) < 1e-10


def test_the_files_are_the_published_machines() -> None:
    assert load_leg().parameters.to_stored().keys() == LegParameters.hyq().to_stored().keys()
    left, right = load_leg(), Leg.hyq("table")
    q = np.radians([[20.0, -80.0], [0.0, -50.0]])
    np.testing.assert_allclose(left.terms(q, q).mass_matrix, right.terms(q, q).mass_matrix, rtol=1e-14)
    np.testing.assert_allclose(load_karl().geometry.sliders, KarlGeometry().sliders, atol=1e-16)
    assert load_karl().geometry.medial == pytest.approx(KarlGeometry().medial, abs=1e-15)


def test_torques_and_forces_undo_each_other() -> None:
    karl, leg = Karl(), Leg.hyq()
    poses, forces = karl.direct((0.21, 0.19)), np.array([120.0, -300.0])
    torques = karl.torques(poses.angles, poses.strokes, forces)
    np.testing.assert_allclose(karl.forces(poses.angles, poses.strokes, torques), np.tile(forces, (4, 1)))
    # Power: the force times the rate of the stroke, here by a difference quotient of the strokes.
    near = karl.direct((0.21 + 1e-7, 0.19))
    rate = (near.angles[0, 0] - poses.angles[0, 0]) / 1e-7
    assert forces[0] == pytest.approx(torques[0, 0] * rate, rel=1e-5)
    q = np.radians([10.0, -70.0])
    np.testing.assert_allclose(leg.joint_torques(q, leg.cylinder_forces(q, [5.0, -7.0])), [5.0, -7.0])


def test_a_leg_falls_as_its_terms_say() -> None:
    leg, q, v = Leg.hyq("plausible"), np.radians([[20.0, -80.0], [-10.0, -60.0]]), [[1.0, 2.0], [0.0, 0.0]]
    a = leg.accelerations(q, v, [3.0, -4.0])
    np.testing.assert_allclose(leg.torques(q, v, a), np.tile([3.0, -4.0], (2, 1)), atol=1e-10)


def test_singular_strokes_know_their_kind() -> None:
    singular = Karl().singularities()
    assert singular.kind == ("direct",) * 8
    assert set(singular.where) == {"boundary"}
    # A short rod on a long arm: the joint has a range of its own, at whose ends the rod is perpendicular to the stroke.
    odd = Karl(KarlGeometry(distal_anchor=(-0.20, 0.0), rods=(0.230, 0.10)))
    inverse = odd.singularities().of(1, "inverse")
    assert len(inverse) == 2 or len(inverse) == 4
    frame = odd.singularities()
    for actuator, kind, stroke, angle in zip(frame.actuator, frame.kind, frame.strokes, frame.angles, strict=True):
        angles, strokes = np.zeros(2), np.full(2, 0.2)
        angles[actuator], strokes[actuator] = angle, stroke
        value = odd.transmission(angles, strokes)[actuator]
        assert (abs(value) > 1e6) if kind == "direct" else (abs(value) < 1e-6), (kind, stroke)


def test_rods_that_reach_nothing_leave_no_singular_strokes() -> None:
    loose = Karl(KarlGeometry(rods=(0.002, 0.001)))
    assert len(loose.singularities().to_frame()) == 0
    assert loose.summary == tuple(f"actuator {k}: no stroke assembles it; its rod is too short" for k in (1, 2))
    with pytest.raises(ModelError, match="actuator 1 has 0 positive singular strokes"):
        loose.plot()


@pytest.mark.parametrize("definition", ["sum_of_norms", "norm_of_absolute_sum", "root_of_squares", "torque"])
def test_shares_follow_their_definition(definition: ShareDefinition) -> None:
    leg, q = Leg.hyq(), np.radians([20.0, -80.0])
    found = leg.shares((4.0, 3.0), first=q[:1], second=q[1:], samples=4, definition=definition)
    v = np.array(np.meshgrid(*[np.linspace(-4.0, 4.0, 4)] * 2)).reshape(2, -1).T
    a = np.array(np.meshgrid(*[np.linspace(-3.0, 3.0, 4)] * 2)).reshape(2, -1).T
    terms = leg.terms(np.tile(q, (16, 1)), v)
    parts = np.stack(
        [
            np.broadcast_to((terms.mass_matrix[0] @ a.T).T[None], (16, 16, 2)),
            np.broadcast_to(terms.velocity[:, None], (16, 16, 2)),
            np.broadcast_to(terms.gravity[:, None], (16, 16, 2)),
        ]
    )
    norms = np.linalg.norm(parts, axis=-1)
    whole = {
        "sum_of_norms": norms.sum(axis=0),
        "norm_of_absolute_sum": np.linalg.norm(np.abs(parts).sum(axis=0), axis=-1),
        "root_of_squares": np.sqrt((norms**2).sum(axis=0)),
        "torque": np.linalg.norm(parts.sum(axis=0), axis=-1),
    }[definition]
    np.testing.assert_allclose(found.mean, (norms / whole).max(axis=(1, 2)), rtol=1e-12)


def test_shares_tell_how_far_they_are() -> None:
    told: list[tuple[int, int]] = []
    Leg.hyq().shares("low", progress=lambda done, total: told.append((done, total)))
    assert told[0] == (1, 11)
    assert told[-1] == (11, 11)


def test_results_print_store_and_become_tables(tmp_path: Path) -> None:
    poses, shares = Karl().direct((0.20, 0.18)), Leg.hyq().shares("low")
    assert repr(poses).startswith("KarlPoses(configurations=4")
    assert "mu_G=0.99" in repr(shares)
    assert list(poses.to_frame()) == [
        "q1_rad", "q2_rad", "stroke1_m", "stroke2_m", "lambda1_rad_per_m", "lambda2_rad_per_m", "tip_x_m", "tip_y_m",
    ]  # fmt: skip
    assert shares.to_frame().shape == (143, 5)
    assert KarlPoses.load(poses.save(tmp_path / "poses.npz")) == poses
    assert ShareMap.load(shares.save(tmp_path / "shares.npz")) == shares
    workspace = Karl().workspace(np.linspace(0.16, 0.25, 10), np.linspace(0.14, 0.24, 11))
    assert 0.5 < workspace.share < 1.0
    assert workspace.to_frame().shape == (110, 8)
    assert len(Karl().singularities().to_frame()) == 8
    reactions = Leg.hyq().reactions([0.3, -1.2], [0.0, 0.0], [0.0, 0.0])
    assert reactions.to_frame().shape == (1, 7)
    assert len(Leg.hyq().terms([0.3, -1.2], [0.0, 0.0]).to_frame()) == 1


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("rods = ", "rod = "), "rods is missing; add it"),
        (('type = "karl"', 'type = "carl"'), 'type is "carl", which is no linkage; did you mean "karl"?'),
        (('300.0, unit = "mm"', '300.0, unit = "kg"'), 'distal has a wrong unit: unit "kg" is of the kind kg'),
        (("value = [230.0, 150.0]", "value = 230.0"), "rods has to be a list of two numbers"),
        (("[230.0, 150.0]", "[230.0, -150.0]"), "`karl.second.rod` must be positive, got -0.15"),
        (("medial = {", "colour = 1\nmedial = {"), "colour is not a known key"),
        (("300.0,", "true,"), "distal is True, but has to be a number"),
    ],
)
def test_wrong_files_are_refused_in_one_sentence(change: tuple[str, str], sentence: str, tmp_path: Path) -> None:
    text = KARL_FILE.read_text(encoding="utf-8")
    assert change[0] in text
    path = tmp_path / "karl.toml"
    path.write_text(text.replace(*change, 1), encoding="utf-8")
    with pytest.raises(ModelError) as error:
        linkages.load(path)
    assert str(path) in str(error.value)
    assert sentence in str(error.value)
    assert error.value.path == str(path)


def test_what_cannot_be_is_said_with_its_numbers() -> None:
    karl, leg = Karl(), Leg.hyq()
    with pytest.raises(ModelError, match=r"cannot be assembled at stroke \(m\) = 0.3"):
        karl.direct((0.30, 0.18))
    with pytest.raises(ModelError, match=r"distance of the end point \(m\) = 0.7"):
        karl.inverse((0.7, 0.0))
    with pytest.raises(ModelError, match="did you mean"):
        leg.shares("midium")
    with pytest.raises(ModelError, match="be 2 or more"):
        leg.shares(samples=1)
    with pytest.raises(ModelError, match=r"needs the shape \(2,\) or \(N, 2\), got \(3,\)"):
        leg.strokes([1.0, 2.0, 3.0])
    with pytest.raises(ModelError, match=r"leg\.upper\.mass"):
        Leg(replace(leg.parameters, upper=replace(leg.parameters.upper, mass=-1.0)))
    with pytest.raises(ModelError, match="the choices are table, identified, plausible"):
        LegParameters.hyq("cad")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("file", "word"),
    [(KARL_FILE, "singularity at +0.253443 m, extended"), (LEG_FILE, "hip cylinder: 0.282239 to 0.360181")],
)
def test_the_command_line_tells_and_plots(file: Path, word: str, tmp_path: Path) -> None:
    done = ran("linkage", str(file), "--plot", str(tmp_path / "out.png"))
    assert word in done.stdout
    assert (tmp_path / "out.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("script", "pictures"),
    [
        ("karl", {"workspace.png", "modes.png"}),
        ("hyq_leg", {"strokes.png", "shares_low.png", "shares_medium.png", "shares_high.png"}),
    ],
)
def test_examples_run_and_plot(
    script: str, pictures: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["run.py", str(tmp_path)])
    runpy.run_path(str(EXAMPLES / script / "run.py"), run_name="__main__")
    assert {path.name for path in tmp_path.iterdir()} == pictures
    assert all(path.stat().st_size > 5000 for path in tmp_path.iterdir())


def test_a_cylinder_without_a_lever_is_refused_with_the_angles() -> None:
    leg = Leg.hyq()
    from dataclasses import replace

    hip = replace(leg.parameters.hip, attachment=replace(leg.parameters.hip.attachment, base_angle=0.0))
    level = Leg(replace(leg.parameters, hip=hip))
    with pytest.raises(ModelError, match="the cylinder of the hip has no lever at hip 90 deg and knee -60 deg"):
        level.cylinder_forces([np.pi / 2.0, -np.pi / 3.0], [1.0, 1.0])


@pytest.fixture(scope="module")
def leg() -> Leg:
    return Leg.hyq()


@pytest.fixture(scope="module")
def velocity(leg: Leg) -> DropLimit:
    return drop_limit(leg, "velocity", TOLERANCE)


def share(leg: Leg, q: NDArray[np.float64], v: NDArray[np.float64], a: NDArray[np.float64], term: str) -> float:
    """The missing share from torques alone: differences of them with and without motion, no shares asked for."""
    still = np.zeros(2)
    weight = leg.torques(q, still, still)
    moving = leg.torques(q, v, still) - weight
    inertia = leg.torques(q, still, a) - weight
    norms = {"velocity": np.linalg.norm(moving), "inertia": np.linalg.norm(inertia), "weight": np.linalg.norm(weight)}
    return float(norms[term] / sum(norms.values()))


def worst(leg: Leg, limit: float, term: str) -> float:
    """Largest missing share on the edge of the allowed motions, at the configurations of the map and between them."""
    found = 0.0
    for q1 in np.radians(np.arange(-40.0, 61.0, 5.0)):
        for q2 in np.radians(np.arange(-140.0, -19.0, 5.0)):
            for signs in ((1.0, 1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 1.0)):
                v, a = (
                    (np.array(signs) * limit, np.zeros(2))
                    if term == "velocity"
                    else (np.zeros(2), np.array(signs) * limit)
                )
                found = max(found, share(leg, np.array([q1, q2]), v, a, term))
    return found


@pytest.mark.parametrize("term", ["velocity", "inertia"])
def test_no_more_is_missing_than_is_said(leg: Leg, term: str) -> None:
    found = drop_limit(leg, term, TOLERANCE)  # type: ignore[arg-type]
    # A fifth more: between the configurations of the map, and between the sampled motions.
    assert 0.9 * TOLERANCE < worst(leg, found.limit, term) < 1.2 * TOLERANCE


def test_velocity_terms_may_go_at_low_rates_and_not_at_high_ones(velocity: DropLimit) -> None:
    # At low duty (2.5 rad/s) weight is most of the effort, and still a third of the effort can be velocity terms.
    assert velocity.limit < 2.5
    assert velocity.share_of_workspace(0.5 * velocity.limit) == 1.0
    assert velocity.share_of_workspace(10.0) < 0.1


def test_limits_of_velocity_terms_grow_with_the_root_of_the_tolerance(leg: Leg) -> None:
    # V ~ v^2 beside a weight that stays: for small shares twice the rate means four times the share.
    small, large = (drop_limit(leg, "velocity", tolerance).limit for tolerance in (0.005, 0.02))
    assert large / small == pytest.approx(2.0, rel=0.02)


def test_other_motion_leaves_less_missing(leg: Leg, velocity: DropLimit) -> None:
    quiet = drop_limit(leg, "inertia", TOLERANCE)
    assert drop_limit(leg, "inertia", TOLERANCE, other=3.0).limit >= quiet.limit
    assert velocity.unit == "rad/s"
    assert quiet.unit == "rad/s^2"


def test_it_says_saves_and_draws(velocity: DropLimit, tmp_path: Path) -> None:
    assert "velocity terms may be left out up to" in str(velocity)
    assert DropLimit.load(velocity.save(tmp_path / "limit.npz")) == velocity
    assert velocity.to_frame().shape == (143, 3)
    assert velocity.plot().axes


@pytest.mark.parametrize(
    ("term", "tolerance", "other", "words"),
    [
        ("gravity", 0.1, 0.0, 'a term "gravity" cannot be left out'),
        ("velocity", 0.0, 0.0, "a tolerance of 0"),
        ("velocity", 1.5, 0.0, "a tolerance of 1.5"),
        ("inertia", 0.1, -1.0, "a limit of -1"),
    ],
)
def test_questions_without_meaning_are_refused(leg: Leg, term: str, tolerance: float, other: float, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        drop_limit(leg, term, tolerance, other=other)  # type: ignore[arg-type]
