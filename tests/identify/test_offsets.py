"""Constants that gauges are off by in each record: estimated beside the parameters, and no part of what is left."""

import numpy as np
import pytest

import vpm
from test_along import arm
from vpm.errors import IdentificationError
from vpm.identify import Fit, Fitting, OutputErrorProblem, problem
from vpm.identify.problem import less_means

STRAIN, DENSITY, CUTOFF = "root.strain", "link.density", 25.0
NOISE, OFF = 1e-6, {"first": 4e-5, "second": -1e-4}
UNITS = {"shoulder.position": "rad", "motor.command": "A", STRAIN: "1"}
BESIDE = Fitting(offsets=(STRAIN,))


@pytest.fixture(scope="module")
def machine() -> vpm.Model:
    """A well damped arm in a vertical plane, with a gauge on its link."""
    text = arm("bezier(3)").to_toml().replace("gravity = [0.0, 0.0, 0.0]", "gravity = [0.0, -9.81, 0.0]")
    text = text.replace("0.03, 0.03, 0.03, 0.03", "0.3, 0.3, 0.3, 0.3")
    gauge = '\n[gauges.root]\nbeam = "link"\nat = 0.05\nx = 0.0\ny = 0.001\n'
    return vpm.Model.from_toml(text + gauge + '\n[sensors.bridge]\nmeasures = "root.strain"\n')


def record(model: vpm.Model, name: str, swing: float) -> vpm.Experiment:
    """A slow swing from rest to rest, and a strain that is off by its record's constant."""
    time = 4e-3 * np.arange(500)
    # Still at both ends, so that a simulation that begins later forgets nothing.
    inside = np.clip((time - 0.4) / 1.2, 0.0, 1.0)
    position = 0.3 + swing * np.sin(np.pi * inside) ** 4
    given = {"shoulder.position": position, "motor.command": 0.1 * np.sin(time)}
    units = {channel: UNITS[channel] for channel in given}
    run = vpm.simulate(model, vpm.Experiment.from_arrays(time, given, units=units), "prescribed_motion", cutoff=CUTOFF)
    strain = np.interp(time, run.time, run[STRAIN])
    noise = NOISE * np.random.default_rng(len(name)).standard_normal(time.size)
    return vpm.Experiment.from_arrays(time, {**given, STRAIN: strain + noise + OFF[name]}, units=UNITS, name=name)


@pytest.fixture(scope="module")
def records(machine: vpm.Model) -> list[vpm.Experiment]:
    """Two swings of one machine; the gauge has drifted between them."""
    return [record(machine, "first", 0.8), record(machine, "second", 1.1)]


def fitted(model: vpm.Model, records: list[vpm.Experiment], free: list[str], fitting: Fitting) -> Fit:
    """A fit of strains, from a link that is a fifth too heavy."""
    begun = model.with_parameters({DENSITY: 1.2 * model.parameters[DENSITY].value})
    return vpm.identify(begun, records, free, mode="prescribed_motion", cutoff=CUTOFF, fitting=fitting, tolerance=1e-12)


def test_columns_of_ones_and_means_that_are_taken_off_give_the_same(
    machine: vpm.Model, records: list[vpm.Experiment]
) -> None:
    blocks = problem(machine, records, "prescribed_motion", cutoff=CUTOFF).blocks
    random, n = np.random.default_rng(0), blocks[-1].samples.stop
    slopes = random.standard_normal((n, 3)) + 1.0
    ones = np.zeros((n, len(blocks)))
    for column, block in enumerate(blocks):
        ones[block.samples, column] = 1.0
    residual = slopes @ np.array([1.0, 2.0, 3.0]) + ones @ np.array([4.0, 5.0]) + random.standard_normal(n)
    whole = np.column_stack([slopes, ones])
    expected = np.linalg.lstsq(whole, residual)[0][:3]
    left, columns = less_means(residual, blocks), less_means(slopes, blocks)
    assert np.linalg.lstsq(columns, left)[0] == pytest.approx(expected, rel=1e-12)
    covariance = np.linalg.inv(whole.T @ whole)[:3, :3]
    np.testing.assert_allclose(np.linalg.inv(columns.T @ columns), covariance, rtol=1e-11, atol=1e-18)
    assert not np.any(less_means(ones, blocks)), "rounding of a constant would look like something that data see"


def test_gauges_that_drift_between_records_bias_nothing(machine: vpm.Model, records: list[vpm.Experiment]) -> None:
    truth = machine.parameters[DENSITY].value
    without, beside = (fitted(machine, records, [DENSITY], how) for how in (Fitting(), BESIDE))
    print(without, beside, beside.std, beside.offsets, beside.offsets_std, beside.after, without.after)
    assert abs(without[DENSITY] / truth - 1.0) > 0.2
    assert abs(beside[DENSITY] - truth) < 3.0 * beside.std[0] < 0.03 * truth
    for name, off in OFF.items():
        label = f"{name}: {STRAIN}"
        assert abs(beside.offsets[label] - off) < 3.0 * beside.offsets_std[label] < 1e-6
    assert beside.after[STRAIN][0] == pytest.approx(NOISE, rel=0.1)
    assert without.after[STRAIN][0] > 20.0 * NOISE
    assert not without.offsets
    assert not any("effect may be missing" in sentence for sentence in beside.warnings)


def test_one_record_says_the_same_as_with_the_offset_of_its_sensor(
    machine: vpm.Model, records: list[vpm.Experiment]
) -> None:
    shifted, name = machine.with_effect("sensor_offset", at="bridge"), "bridge.offset.value"
    beside = fitted(machine, records[:1], [DENSITY], BESIDE)
    explicit = fitted(shifted, records[:1], [DENSITY, name], Fitting())
    label = f"first: {STRAIN}"
    print(beside.std, explicit.std, beside.offsets_std)
    assert beside[DENSITY] == pytest.approx(explicit[DENSITY], rel=1e-6)
    assert beside.offsets[label] == pytest.approx(explicit[name], rel=1e-6)
    # Corrections for few samples know of the constant in one and not in the other.
    assert beside.std[0] == pytest.approx(explicit.std[0], rel=0.02)
    assert beside.offsets_std[label] == pytest.approx(explicit.std[1], rel=0.02)


def test_the_offset_of_that_sensor_cannot_be_told_beside_it(machine: vpm.Model, records: list[vpm.Experiment]) -> None:
    name = "bridge.offset.value"
    found = fitted(machine.with_effect("sensor_offset", at="bridge"), records, [DENSITY, name], BESIDE)
    assert [c.names for c in found.unidentifiable] == [(name,)]
    (told,) = [sentence for sentence in found.warnings if name in sentence]
    assert told.startswith(f"not identifiable from these data: {name} adds a constant to {STRAIN} and does nothing")
    alone = fitted(machine, records, [DENSITY], BESIDE)
    assert list(found.offsets_std.values()) == pytest.approx(list(alone.offsets_std.values()), rel=1e-6)


def test_offsets_are_as_sure_beside_two_parameters_of_which_the_ratio_counts(
    machine: vpm.Model, records: list[vpm.Experiment]
) -> None:
    both = fitted(machine, records, [DENSITY, "link.young"], BESIDE)
    assert both.unidentifiable
    alone = fitted(machine, records, [DENSITY], BESIDE)
    assert list(both.offsets_std.values()) == pytest.approx(list(alone.offsets_std.values()), rel=1e-2)


def test_nothing_changes_without_it(machine: vpm.Model, records: list[vpm.Experiment]) -> None:
    plain = OutputErrorProblem(machine, records, "prescribed_motion", cutoff=CUTOFF)
    beside = OutputErrorProblem(machine, records, "prescribed_motion", cutoff=CUTOFF, offsets=(STRAIN,))
    residual, _ = plain.evaluate(machine, machine.theta)
    again, _ = beside.with_offsets_left().evaluate(machine, machine.theta)
    assert np.array_equal(residual, again)
    for block, each in zip(plain.blocks, records, strict=True):
        run = vpm.simulate(machine, each, "prescribed_motion", cutoff=CUTOFF)
        rows = np.searchsorted(each.time, block.time - 1e-9)
        expected = (each[STRAIN][rows] - run[STRAIN]) * (block.weight * block.moving)
        assert np.array_equal(residual[block.samples], expected)


def test_first_states_go_with_offsets(machine: vpm.Model) -> None:
    time = 4e-3 * np.arange(250)
    told = {"motor.command": 0.3 * np.sin(7.0 * time)}
    run = vpm.simulate(machine, vpm.Experiment.from_arrays(time, told, units={"motor.command": "A"}))
    noise = np.random.default_rng(1).standard_normal((2, time.size))
    seen = {"shoulder.position": run["shoulder.position"] + 1e-5 * noise[0], STRAIN: run[STRAIN] + NOISE * noise[1]}
    log = vpm.Experiment.from_arrays(time, {**told, **seen, STRAIN: seen[STRAIN] + 5e-5}, units=UNITS, name="run")
    how = Fitting(offsets=(STRAIN,), states=("shoulder.position", "shoulder.velocity"), noise="estimated")
    found = vpm.identify(machine, log, [DENSITY], mode="free_run", fitting=how)
    label = f"run: {STRAIN}"
    print(found, found.states, found.offsets, found.offsets_std, found.std)
    assert abs(found.offsets[label] - 5e-5) < 3.0 * found.offsets_std[label] < 1e-6
    assert abs(found[DENSITY] - machine.parameters[DENSITY].value) < 3.0 * found.std[0]


def test_deviations_know_what_is_known_of_the_parameters(machine: vpm.Model, records: list[vpm.Experiment]) -> None:
    deviations = {}
    for known in (1e-3, 1e5):
        text = machine.to_toml().replace(
            "density = 2700.0", f'density = {{ value = 2700.0, unit = "kg/m^3", uncertainty = {known} }}'
        )
        how = Fitting(offsets=(STRAIN,), priors=True)
        found = vpm.identify(
            vpm.Model.from_toml(text), records[0], [DENSITY], mode="prescribed_motion", cutoff=CUTOFF, fitting=how
        )
        deviations[known] = found.offsets_std[f"first: {STRAIN}"]
    unknown = fitted(machine, records[:1], [DENSITY], BESIDE).offsets_std[f"first: {STRAIN}"]
    samples = problem(machine, records[:1], "prescribed_motion", cutoff=CUTOFF).blocks[0].samples.stop
    assert deviations[1e5] == pytest.approx(unknown, rel=1e-3)
    assert deviations[1e-3] == pytest.approx(NOISE / samples**0.5, rel=0.25)
    assert deviations[1e-3] < 0.8 * unknown


@pytest.mark.parametrize(
    ("mode", "channel", "loss", "words"),
    [
        ("inverse_dynamics", STRAIN, "squares", "mode 'inverse_dynamics' is none of free_run"),
        ("prescribed_motion", "root.strains", "squares", 'not compared .* did you mean "root.strain"'),
        ("free_run", "shoulder.position", "squares", "the simulation begins at what"),
        ("free_run", STRAIN, "huber", "loss is 'huber'"),
    ],
)
def test_what_has_no_offset_is_refused(
    machine: vpm.Model, records: list[vpm.Experiment], mode: str, channel: str, loss: str, words: str
) -> None:
    with pytest.raises(IdentificationError, match=words):
        vpm.identify(machine, records, [DENSITY], mode=mode, fitting=Fitting(offsets=(channel,), loss=loss))
