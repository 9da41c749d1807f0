"""FMUs of the examples, as other programs load them: validated, simulated and differentiated through FMPy."""

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nightly import at_night
from places import EXAMPLES, ROOT
from test_c_source import STRICT, places
from vpm import Model, Simulation, write_fmu
from vpm.linear import LinearModel
from vpm.numbers import Array
from vpm.realtime import Fmu

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install fmpy)")
validation = pytest.importorskip("fmpy.validation", reason="FMPy is not installed (pip install fmpy)")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler `cc` here")


#: Rigid, with three joints, with coupled shafts, flexible, hydraulic, and a leg that lands; with levels of detail.
SIX = {
    "emps/model": None,
    "arm/arm": None,
    "wrist/wrist": None,
    "flexible_pendulum/flexible_pendulum": "bezier(3)",
    "servo_cylinder/rig": None,
    "hyl/rcm": None,
}
#: What takes a compiler longer.
MORE = {
    "spinning_beam/spinning_beam": "bezier(2)",
    "tudor/tudor": "bezier(3)",
    "crane/crane": None,
    "hyl/hydraulic": None,
}
#: Steps that resolve what is fastest, s; the leg begins in the air and lands.
STEPS = dict.fromkeys(
    ("servo_cylinder/rig", "spinning_beam/spinning_beam", "hyl/rcm", "crane/crane", "hyl/hydraulic"), 1e-4
)
HELD = {
    "emps/model": [2.0],
    "arm/arm": [0.4, 1.0, -0.3],
    "wrist/wrist": [0.4, -0.3],
    "servo_cylinder/rig": [2e-3],
    "spinning_beam/spinning_beam": [1.0],
    "tudor/tudor": [0.3, -0.2, 0.1],
    "crane/crane": [0.2],
    "hyl/hydraulic": [1e-3, -1e-3, 0.0],
}
#: A foot 5 mm above the ground, at a metre a second towards it.
LANDING = {
    "slider.position": 0.5343,
    "slider.velocity": -1.0,
    "hip_rotation.position": np.deg2rad(40.0),
    "knee_rotation.position": np.deg2rad(-80.0),
}
STATES: dict[str, dict[str, float]] = {
    "flexible_pendulum/flexible_pendulum": {"pivot.position": 0.3},
    "hyl/rcm": LANDING,
    "hyl/hydraulic": LANDING,
}


def machine(name: str) -> Model:
    model = Model.load(EXAMPLES / f"{name}.toml")
    level = (SIX | MORE)[name]
    return model if level is None else model.at(level)


class Loaded:
    """An FMU that is unpacked, with as many instances of it as are asked for."""

    def __init__(self, written: Fmu, folder: Path) -> None:
        self.folder, self.written = folder, written
        fmpy.extract(str(written.path), unzipdir=str(folder))
        self.description = fmpy.read_model_description(str(folder))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.told: list[str] = []

    def refs(self, names: Any) -> list[int]:
        return [self.references[name] for name in names]

    @contextmanager
    def instance(self, *, exchange: bool = False, start: float = 0.0) -> Iterator[Any]:
        """An instance at work."""
        kind = fmpy.fmi3.FMU3Model if exchange else fmpy.fmi3.FMU3Slave
        fmu = kind(
            guid=self.description.guid,
            unzipDirectory=str(self.folder),
            modelIdentifier=self.written.identifier,
            instanceName="one",
        )
        fmu.instantiate(logMessage=lambda *told: self.told.append(told[3].decode()))
        fmu.enterInitializationMode(startTime=start)
        fmu.exitInitializationMode()
        if exchange:
            fmu.enterContinuousTimeMode()
        try:
            yield fmu
        finally:
            fmu.fmi3FreeInstance(fmu.component)


@pytest.fixture(scope="module")
def cart(tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, Loaded]:
    """The axis of EMPS, whose masses and friction can be set."""
    folder = tmp_path_factory.mktemp("cart")
    model = machine("emps/model")
    written = write_fmu(model, folder / "axis.fmu", name="axis", parameters=["*.mass", "*viscous*"])
    return model, Loaded(written, folder / "axis")


def reference(model: Model, step: float, commands: Array, state: Any) -> Array:
    """What a simulation shows after each step."""
    sim = Simulation(model, step, integrator="rosenbrock", state=state)
    rows = [sim.step(row) for row in commands]
    return np.array(rows)


@pytest.mark.parametrize("name", at_night([*SIX, *MORE], but=SIX))
def test_examples_are_valid_and_follow_simulations(name: str, tmp_path: Path) -> None:
    """Co-simulation, to 1e-9 of the largest value of each output, and model exchange by a solver that FMPy has."""
    model, step, state = machine(name), STEPS.get(name, 1e-3), STATES.get(name)
    written = write_fmu(model, tmp_path / "m.fmu", name="m", rate=1.0 / step, state=state)
    assert validation.validate_fmu(str(written.path)) == []
    loaded = Loaded(written, tmp_path / "m")
    count, held = 300, np.array(HELD.get(name, [0.0] * len(model.inputs)))
    turns = np.cos(40.0 * step * np.arange(count))
    commands = turns[:, None] * held[None, :]
    expected = reference(model, step, commands, state)
    columns = [model.output_channels.index(one) for one in written.outputs]
    inputs, outputs = loaded.refs(written.inputs), loaded.refs(written.outputs)
    with loaded.instance() as fmu:
        found = []
        for k, row in enumerate(commands):
            fmu.setFloat64(inputs, row)
            fmu.doStep(k * step, step)
            found.append(fmu.getFloat64(outputs))
        assert loaded.told == []
    size = np.abs(expected[:, columns]).max(axis=0)
    assert np.ptp(expected[:, columns], axis=0).max() > 1e-3
    assert np.all(np.abs(np.array(found) - expected[:, columns]) <= 1e-9 * size + 1e-15)
    if name.startswith("hyl/"):
        force = expected[:, model.output_channels.index("foot.normal_force")]
        assert force[0] == 0.0
        assert force.max() > 10.0
    # CVODE takes more steps on what stretches than FMPy lets it, and steps over contacts of a millisecond.
    if not name.startswith(("spinning_beam/", "hyl/")):
        follows_by_a_solver(model, written, held, count * step, state)


def follows_by_a_solver(model: Model, written: Fmu, held: Array, duration: float, state: Any) -> None:
    """CVODE on the rates of an FMU ends where vpm's own steps do that control their error."""
    run = fmpy.simulate_fmu(
        str(written.path),
        fmi_type="ModelExchange",
        stop_time=duration,
        output_interval=0.1 * duration,
        relative_tolerance=1e-9,
        output=written.states,
        start_values=dict(zip(written.inputs, held, strict=True)),
    )
    sim = Simulation(model, duration, integrator="adaptive(1e-10)", state=state)
    sim.step(held)
    passed = np.array([[row[name] for name in written.states] for row in run])
    # Each of some hundred steps is off by 1e-9 of a state, or of its nominal value, which is 1.
    assert np.all(np.abs(passed[-1] - sim.state) <= 1e-6 * np.maximum(np.abs(passed).max(axis=0), 1.0))


def test_fmpy_simulates_both_kinds_by_itself(cart: tuple[Model, Loaded]) -> None:
    model, loaded = cart
    time = np.arange(201) * 1e-3
    signal = np.array(
        list(zip(time, np.full(201, 0.5), strict=True)), dtype=[("time", float), ("drive.command", float)]
    )
    runs = [
        fmpy.simulate_fmu(
            str(loaded.written.path),
            fmi_type=kind,
            input=signal,
            stop_time=0.2,
            output_interval=1e-3,
            relative_tolerance=1e-9,
            start_values={"state.axis.velocity": 0.1},
        )
        for kind in ("CoSimulation", "ModelExchange")
    ]
    expected = reference(model, 1e-3, np.full((200, 1), 0.5), {"axis.velocity": 0.1})
    place = model.output_channels.index("axis.position")
    np.testing.assert_allclose(runs[0]["axis.position"][1:], expected[:, place], rtol=1e-9)
    # The solver holds its tolerance, in metres, in each of its steps.
    np.testing.assert_allclose(runs[1]["axis.position"][1:], expected[:, place], rtol=0.0, atol=1e-8)


@pytest.fixture(scope="module")
def wrist(tmp_path_factory: pytest.TempPathFactory) -> tuple[LinearModel, Loaded]:
    """A wrist that begins away from rest, with the linear model of it there."""
    folder, model = tmp_path_factory.mktemp("wrist"), machine("wrist/wrist")
    linear = places(model, 1)[0]
    written = write_fmu(model, folder / "w.fmu", name="w", state=linear.state, parameters=["*.mass"])
    return linear, Loaded(written, folder / "w")


@pytest.mark.parametrize("exchange", [False, True])
def test_directional_derivatives_are_those_of_a_linear_model(exchange: bool, wrist: tuple[LinearModel, Loaded]) -> None:
    linear, loaded = wrist
    written = loaded.written
    rates = loaded.refs(f"der({name})" for name in written.states)
    states, inputs, outputs = map(loaded.refs, (written.states, written.inputs, written.outputs))
    rows = [linear.outputs.index(name) for name in written.outputs]
    rng = np.random.default_rng(3)
    with loaded.instance(exchange=exchange) as fmu:
        if exchange:
            fmu.fmi3EnterEventMode(fmu.component)
        fmu.setFloat64(inputs, linear.command)
        for unknowns, by_x, by_u in ((rates, linear.A, linear.B), (outputs, linear.C[rows], linear.D[rows])):
            whole = np.hstack([by_x, by_u])
            forward, backward = rng.normal(size=whole.shape[1]), rng.normal(size=whole.shape[0])
            found = fmu.getDirectionalDerivative(unknowns, states + inputs, forward)
            size = np.abs(whole).max()
            np.testing.assert_allclose(found, whole @ forward, rtol=1e-11, atol=1e-11 * size)
            found = fmu.getAdjointDerivative(unknowns, states + inputs, backward, nSensitivity=whole.shape[1])
            np.testing.assert_allclose(found, backward @ whole, rtol=1e-11, atol=1e-11 * size)
        check_parameter(fmu, rates, loaded.refs(written.parameters))


def check_parameter(fmu: Any, rates: list[int], parameters: list[int]) -> None:
    """Derivatives by a parameter, beside differences of second order: steps of 1e-4 leave 1e-8 of them."""
    values = np.array(fmu.getFloat64(parameters))
    slopes = [fmu.getDirectionalDerivative(rates, [one], [1.0]) for one in parameters]
    for place, own in enumerate(parameters):
        sides = []
        for sign in (1.0, -1.0):
            fmu.setFloat64([own], [values[place] * (1.0 + 1e-4 * sign)])
            sides.append(np.array(fmu.getFloat64(rates)))
        fmu.setFloat64([own], [values[place]])
        quotient = (sides[0] - sides[1]) / (2e-4 * values[place])
        np.testing.assert_allclose(slopes[place], quotient, rtol=1e-6, atol=1e-6 * np.abs(sides[0]).max())


def test_parameters_that_are_set_are_those_of_another_model(cart: tuple[Model, Loaded]) -> None:
    model, loaded = cart
    free = loaded.written.parameters
    values = {name: 1.3 * model.parameters[name].value for name in free}
    expected = reference(model.with_parameters(values), 1e-3, np.full((50, 1), 1.0), None)
    with loaded.instance() as fmu:
        fmu.setFloat64(loaded.refs(["drive.command", *free]), [1.0, *values.values()])
        for k in range(50):
            fmu.doStep(k * 1e-3, 1e-3)
        found = fmu.getFloat64(loaded.refs(loaded.written.outputs))
    shown = [model.output_channels.index(name) for name in loaded.written.outputs]
    np.testing.assert_allclose(found, expected[-1, shown], rtol=1e-9, atol=1e-14)
    bounds = next(v for v in loaded.description.modelVariables if v.name == free[0])
    assert float(bounds.min) == model.parameters[free[0]].minimum


def test_instances_side_by_side_do_not_meet_and_states_come_back_to_the_last_bit(cart: tuple[Model, Loaded]) -> None:
    _, loaded = cart
    command, shown = loaded.refs(["drive.command"]), loaded.refs(loaded.written.outputs)

    def onward(fmu: Any, value: float, k: int) -> list[float]:
        fmu.setFloat64(command, [value])
        fmu.doStep(k * 1e-3, 1e-3)
        found: list[float] = fmu.getFloat64(shown)
        return found

    with loaded.instance() as alone:
        expected = [onward(alone, 1.0, k) for k in range(40)]
    with loaded.instance() as one, loaded.instance() as other:
        for k in range(20):
            assert onward(one, 1.0, k) == expected[k]
            onward(other, -2.0, k)
        kept = one.getFMUState()
        bytes_of = one.serializeFMUState(kept)
        for _ in range(2):
            assert [onward(one, 1.0, k) for k in range(20, 40)] == expected[20:]
            one.setFMUState(kept)
        # Another instance, from bytes, which are the same again.
        read = other.deserializeFMUState(bytes_of)
        other.setFMUState(read)
        assert other.serializeFMUState(read) == bytes_of
        assert [onward(other, 1.0, k) for k in range(20, 40)] == expected[20:]
        one.fmi3Reset(one.component)
        one.enterInitializationMode(startTime=0.0)
        one.exitInitializationMode()
        assert onward(one, 1.0, 0) == expected[0]
        for fmu, state in ((one, kept), (other, read)):
            fmu.freeFMUState(state)


def test_steps_of_any_length_are_divided_evenly(cart: tuple[Model, Loaded]) -> None:
    model, loaded = cart
    sim = Simulation(model, 2.5e-3, integrator="rosenbrock", substeps=3)
    sim.step([1.0])
    with loaded.instance(start=5.0) as fmu:
        fmu.setFloat64(loaded.refs(["drive.command"]), [1.0])
        assert fmu.doStep(5.0, 2.5e-3)[3] == 5.0 + 2.5e-3
        found = fmu.getFloat64(loaded.refs(loaded.written.states))
    np.testing.assert_allclose(found, sim.state, rtol=1e-9)


#: Status codes of the standard.
DISCARD, ERROR = 2, 3


def test_wrong_calls_are_errors_with_a_sentence(cart: tuple[Model, Loaded]) -> None:
    _, loaded = cart
    command, axis = loaded.refs(["drive.command"]), loaded.refs(["state.axis.position"])
    mass = loaded.refs([loaded.written.parameters[0]])
    wrong: dict[str, Callable[[Any], object]] = {
        "`drive` cannot be nan": lambda fmu: fmu.setFloat64(command, [np.nan]),
        "cannot be set now": lambda fmu: fmu.setFloat64(axis, [1.0]),
        "give a number from": lambda fmu: fmu.setFloat64(mass, [-1.0]),
        "no variable of reference 9999": lambda fmu: fmu.getFloat64([9999]),
        "go on from there": lambda fmu: fmu.doStep(0.5, 1e-3),
        "a communication step of -1": lambda fmu: fmu.doStep(0.0, -1.0),
        "a communication step of 1e+09": lambda fmu: fmu.doStep(0.0, 1e9),
        "is no unknown": lambda fmu: fmu.getDirectionalDerivative(command, command, [1.0]),
        "all variables are Float64": lambda fmu: fmu.getInt32([1]),
        "a mode that has no such function": lambda fmu: fmu.fmi3EnterEventMode(fmu.component),
        "are no state of this kind": lambda fmu: fmu.deserializeFMUState(
            b"\0" * len(fmu.serializeFMUState(fmu.getFMUState()))
        ),
    }
    for sentence, call in wrong.items():
        loaded.told.clear()
        with loaded.instance() as fmu:
            with pytest.raises(fmpy.fmi1.FMICallException) as error:
                call(fmu)
            assert error.value.status == ERROR
            assert len(loaded.told) == 1
            assert sentence in loaded.told[0]
            # What follows an error is one, until the instance is reset.
            with pytest.raises(fmpy.fmi1.FMICallException):
                fmu.doStep(0.0, 1e-3)
            fmu.fmi3Reset(fmu.component)
            fmu.enterInitializationMode()
            fmu.exitInitializationMode()
            fmu.doStep(0.0, 1e-3)
    loaded.told.clear()
    fmu = fmpy.fmi3.FMU3Slave(
        guid="{other}", unzipDirectory=str(loaded.folder), modelIdentifier="axis", instanceName="one"
    )
    with pytest.raises(Exception, match="Failed to instantiate"):
        fmu.instantiate(logMessage=lambda *told: loaded.told.append(told[3].decode()))
    assert "the instantiation token is {other}" in loaded.told[0]


def test_a_step_that_leads_nowhere_is_discarded_and_the_state_kept(cart: tuple[Model, Loaded]) -> None:
    _, loaded = cart
    loaded.told.clear()
    with loaded.instance() as fmu:
        states = loaded.refs(loaded.written.states)
        before = fmu.getFloat64(states)
        fmu.setFloat64(loaded.refs(["drive.command"]), [1e308])
        with pytest.raises(fmpy.fmi1.FMICallException) as error:
            fmu.doStep(0.0, 1e-3)
        assert error.value.status == DISCARD
        assert "is no number after" in loaded.told[-1]
        assert fmu.getFloat64(states) == before


#: A program that calls every kind of function, for sanitizers; allocations are counted while it steps.
PROGRAM = ROOT / "tests" / "fuzz" / "c" / "fmu.c"


def test_sources_are_strict_and_clean_under_sanitizers(cart: tuple[Model, Loaded], tmp_path: Path) -> None:
    _, loaded = cart
    headers = ["-I", str(loaded.folder / "sources")]
    files = [str(loaded.folder / "sources" / name) for name in ("axis.c", "fmu.c")]
    # As sources that are linked statically are compiled; the programs below take the names of libraries.
    compiled(tmp_path, [*STRICT, "-c", *headers, files[1], "-o", "fmu.o"])
    watched = ["-g", "-O1", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
    token = f'-DTOKEN="{loaded.written.token}"'
    rate = f"-DTHE_RATE={loaded.references['der(state.axis.position)']}"
    words = ["-DFMI3_OVERRIDE_FUNCTION_PREFIX=1", token, rate, *headers, str(PROGRAM), *files]
    for options, output in ((watched, "watched"), (["-O1", "-DCOUNTED"], "counted")):
        compiled(tmp_path, [*STRICT, *options, *words, "-o", output, "-lm"])
        done = subprocess.run([tmp_path / output], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        if output == "counted":
            # The last is on purpose: what counts is seen to count.
            assert done.stdout.split() == ["0", "1"]


def test_functions_are_those_of_the_standard(cart: tuple[Model, Loaded], tmp_path: Path) -> None:
    """A compiler that has seen the standard's own headers accepts the declarations, and finds all functions."""
    _, loaded = cart
    official = Path(fmpy.__file__).parent / "c-code"
    if not (official / "fmi3Functions.h").exists():
        pytest.skip("this FMPy comes without the headers of the standard")
    (tmp_path / "both.c").write_text('#include "fmi3Functions.h"\n#include "fmu.c"\n', encoding="utf-8")
    own = ["-I", str(official), "-I", str(loaded.folder / "sources")]
    override = "-DFMI3_OVERRIDE_FUNCTION_PREFIX=1"
    compiled(tmp_path, ["-std=c99", "-Wall", "-Werror", "-Wno-strict-prototypes", override, *own, "-c", "both.c"])
    listed = (official / "fmi3Functions.h").read_text(encoding="utf-8").split("fmi3FullName(name) name", 1)[1]
    names = {word for line in listed.splitlines() if line.startswith("#define fmi3") for word in line.split()[1:2]}
    names.discard("fmi3Version")
    library = ctypes.CDLL(str(next((loaded.folder / "binaries").glob("*/axis.*"))))
    assert len(names) > 70
    assert [name for name in names if not hasattr(library, name)] == []
    # Nothing else is seen from outside: two FMUs in one program do not meet.
    assert not hasattr(library, "axis_evaluate_rates")


def compiled(folder: Path, words: list[str]) -> None:
    done = subprocess.run(["cc", *words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]


def test_dependencies_hold_every_entry_of_the_linear_model(wrist: tuple[LinearModel, Loaded]) -> None:
    linear, loaded = wrist
    names = [*loaded.written.states, *loaded.written.inputs]
    listed = [{variable.name for variable in unknown.dependencies} for unknown in loaded.description.derivatives]
    for own, row in zip(listed, np.hstack([linear.A, linear.B]), strict=True):
        assert {name for name, entry in zip(names, row, strict=True) if entry != 0.0} <= own
    assert listed[0] == {"state.pitch.velocity"}
    free = [{variable.name for variable in unknown.dependencies} for unknown in loaded.description.initialUnknowns]
    assert any(set(loaded.written.parameters) & own for own in free)
