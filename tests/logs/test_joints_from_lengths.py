"""Joint angles from the wire sensors of cylinders, by the law of cosines."""

import math

import numpy as np
import pytest

import vpm
from vpm import Experiment, Model
from vpm.diagnosing import _of_lengths
from vpm.errors import ExperimentError
from vpm.experiment import joints_from_lengths
from vpm.identify import judged_on

#: Distances of both pins from the axis, m, and the angle between them at zero, rad.
BASE, LEVER, ANGLE = 1.9, 0.43, 2.2
TIME = 0.01 * np.arange(400)
MOVED = -0.2 + 0.5 * np.sin(2.0 * TIME) + 0.1 * np.sin(7.0 * TIME)


def boom(sensor: str = "") -> Model:
    """A boom on a cylinder, with a stick on a cylinder of its own."""
    pins = [[BASE, 0.0, 0.0], [LEVER * math.cos(ANGLE), 0.0, LEVER * math.sin(ANGLE)]]
    return Model.from_toml(f"""
        name = "boom"
        gravity = [0.0, 0.0, -9.81]
        [bodies.boom]
        mass = 100.0
        inertia = [1.0, 40.0, 40.0, 0.0, 0.0, 0.0]
        center_of_mass = [1.0, 0.0, 0.0]
        [bodies.stick]
        mass = 40.0
        inertia = [1.0, 10.0, 10.0, 0.0, 0.0, 0.0]
        [joints.foot]
        type = "revolute"
        parent = "world"
        child = "boom"
        axis = [0.0, -1.0, 0.0]
        [joints.knee]
        type = "revolute"
        parent = "boom"
        child = "stick"
        translation = [2.0, 0.0, 0.0]
        axis = [0.0, -1.0, 0.0]
        [lines.lift]
        from = {{ parent = "world", point = {pins[0]} }}
        to = {{ parent = "boom", point = {pins[1]} }}
        [lines.stay]
        from = {{ parent = "world", point = [0.0, 0.0, 3.0] }}
        to = {{ parent = "stick", point = [1.0, 0.0, 0.0] }}
        [actuators.lift_drive]
        line = "lift"
        gain = 1.0
        {sensor}
    """)


def length(angle: np.ndarray) -> np.ndarray:
    """Length of the cylinder: a turn by -y takes the lever away from the base."""
    return np.sqrt(BASE**2 + LEVER**2 - 2.0 * BASE * LEVER * np.cos(ANGLE + angle))


def record(values: np.ndarray, model: Model) -> Experiment:
    """What a wire sensor logged, and the other joint's encoder."""
    channels = {"lift.length": values, "knee.position": 0.3 * np.cos(TIME), "lift_drive.command": 0.0 * TIME}
    return Experiment.from_arrays(TIME, channels, model=model)


def test_a_length_tells_the_joint_that_moves_it() -> None:
    model = boom()
    told = joints_from_lengths(record(length(MOVED), model), model)
    assert set(told.channels) == {"foot.position", "knee.position", "lift_drive.command"}
    np.testing.assert_allclose(told["foot.position"], MOVED, atol=1e-7)
    assert joints_from_lengths(told, model) is told


def test_the_file_tells_the_side_of_the_dead_centre() -> None:
    """Beyond the dead centre of ``ANGLE + angle = pi`` every length comes a second time."""
    model = boom()
    mirrored = 2.0 * (np.pi - ANGLE) - MOVED  # the other angle of the same length
    np.testing.assert_allclose(length(mirrored), length(MOVED), atol=1e-12)
    told = joints_from_lengths(record(length(mirrored), model), model)
    np.testing.assert_allclose(told["foot.position"], MOVED, atol=1e-7)


def test_gain_and_offset_of_the_sensor_are_undone() -> None:
    sensor = '[sensors.wire]\nmeasures = "lift.length"\n'
    model = boom(sensor).with_effect("sensor_offset", at="wire", value=0.02)
    told = joints_from_lengths(record(length(MOVED) + 0.02, model), model)
    np.testing.assert_allclose(told["foot.position"], MOVED, atol=1e-7)
    with pytest.raises(ExperimentError, match=r"does not follow from lift\.length while wire\.offset\.value counts"):
        joints_from_lengths(record(length(MOVED), model), model, free=["wire.offset.value"])


def test_a_diagnosis_says_that_errors_of_a_length_are_not_tried() -> None:
    """The angle takes the place of the length, so that no candidate is an offset of the wire sensor."""
    model = boom('[sensors.wire]\nmeasures = "lift.length"\n')
    (note,) = _of_lengths(model, [record(length(MOVED), model)])
    assert "gain or delay of wire was tried, for foot.position follows" in note
    assert not _of_lengths(boom(), [record(length(MOVED), boom())])
    assert not _of_lengths(model, [joints_from_lengths(record(length(MOVED), model), model)])


def test_what_tells_no_joint_stays_or_is_refused() -> None:
    model = boom()
    stay = Experiment.from_arrays(TIME, {"stay.length": 2.0 + 0.1 * np.sin(TIME)}, model=model)
    assert joints_from_lengths(stay, model) is stay  # both joints move it
    with pytest.raises(ExperimentError, match=r"lift\.length goes from .* but foot moves it from 1\.47 to 2\.33 m"):
        joints_from_lengths(record(1e3 * length(MOVED), model), model)


BEAM = """
    [beams.jib]
    parent = "{parent}"
    length = 1.0
    level = "{level}"
    deforms = ["bending_y"]
    material = {{ young = 2e11, density = 7850.0 }}
    section = {{ shape = "rectangle", width = 0.05, height = 0.05 }}
    [bodies.hook]
    mass = 5.0
    [joints.flange]
    type = "fixed"
    parent = "jib"
    child = "hook"
"""


@pytest.mark.parametrize("level", ["rigid", "strain(2)"])
def test_a_link_that_bends_beyond_the_cylinder_changes_nothing(level: str) -> None:
    model = boom(BEAM.format(parent="stick", level=level))
    told = joints_from_lengths(record(length(MOVED), model), model)
    np.testing.assert_allclose(told["foot.position"], MOVED, atol=1e-7)


def test_a_length_across_a_link_that_bends_tells_no_joint() -> None:
    line = '[lines.rope]\nfrom = { parent = "world", point = [3.0, 0.0, 3.0] }\nto = { parent = "jib" }\n'
    for level, tells in (("rigid", True), ("strain(2)", False)):
        model = boom(BEAM.format(parent="boom", level=level) + line)
        log = Experiment.from_arrays(TIME, {"rope.length": 4.0 + 0.01 * np.sin(TIME)}, model=model)
        assert (joints_from_lengths(log, model) is log) is not tells


def test_a_run_starts_where_the_cylinder_is() -> None:
    model = boom()
    run = vpm.simulate(model, record(length(MOVED), model))
    assert run["foot.position"][0] == pytest.approx(MOVED[0], abs=2e-3)  # a parabola through the first samples


HANGING = """
    name = "hanging arm"
    gravity = [0.0, 0.0, -9.81]
    [bodies.arm]
    mass = { value = 18.0, uncertainty = 3.0 }
    center_of_mass = [0.6, 0.0, 0.0]
    inertia = [0.0, { value = 2.4, uncertainty = 0.6 }, { value = 2.4, uncertainty = 0.6 }, 0.0, 0.0, 0.0]
    [joints.hinge]
    type = "revolute"
    parent = "world"
    child = "arm"
    axis = [0.0, -1.0, 0.0]
    [lines.ram]
    from = { parent = "world", point = [0.3, 0.0, -0.3] }
    to = { parent = "arm", point = [0.8, 0.0, 0.1] }
    [actuators.drive]
    line = "ram"
    gain = 1.0
    command_unit = "N"
"""


def hanging(model: vpm.Model) -> vpm.Experiment:
    """An arm between 80 and 137 degrees below the horizontal: J q'' + m g c cos(q) is its ram's force by the lever."""
    time, drawn = np.arange(4000) / 200.0, np.random.default_rng(8)
    angle = -1.9 + 0.4 * np.sin(1.7 * time) + 0.1 * np.sin(4.1 * time)
    acceleration = -0.4 * 1.7**2 * np.sin(1.7 * time) - 0.1 * 4.1**2 * np.sin(4.1 * time)
    to = 0.8 + 0.1j  # up is the imaginary part
    way = to * np.exp(1j * angle) - (0.3 - 0.3j)
    lever = np.real(np.conj(way) * 1j * to * np.exp(1j * angle)) / np.abs(way)
    force = ((2.0 + 20.0 * 0.6**2) * acceleration + 20.0 * 9.81 * 0.6 * np.cos(angle)) / lever
    values = {
        "ram.length": np.abs(way) + 2e-5 * drawn.standard_normal(time.size),
        "drive.command": force + 0.5 * drawn.standard_normal(time.size),
    }
    return vpm.Experiment.from_arrays(time, values, name="log", model=model)


def test_an_angle_beyond_the_dead_centre_is_found_by_its_weight() -> None:
    model = vpm.Model.from_toml(HANGING)
    (mistake,) = vpm.check_log(model, hanging(model), workers=1).mistakes
    assert (mistake.kind, mistake.channels) == ("side", ("ram.length",))
    # The line passes the hinge where the directions of both ends agree.
    centre = np.arctan2(-0.3, 0.3) - np.arctan2(0.1, 0.8)
    assert f"dead centre of ram at {centre:.3g} rad" in mistake.sentence
    assert mistake.repair.endswith("rotation = [0, 1.9, 0]")
    other = vpm.Model.from_toml(HANGING.replace('child = "arm"', 'child = "arm"\n    rotation = [0.0, 1.9, 0.0]'))
    assert not vpm.check_log(other, hanging(other), workers=1).mistakes
    # A validation record has the length alone, too.
    before, after = judged_on(vpm.identify(other, hanging(other)), other, hanging(other))
    assert after["hinge.effort"][0] < 0.05 * before["hinge.effort"][0]
