"""Examples with parameters to fit: a log with noise, simulated from the truth, and the fit that has to find it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from places import EXAMPLES
from vpm.experiment import Experiment
from vpm.identify import Fit, Fitting, identify
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup, simulate


@dataclass(frozen=True)
class Case:
    """One example."""

    model: str  #: File below the folder of examples.
    mode: str  #: In which it is fitted; data come from a closed loop where there are references, else from a free run.
    #: Clock of the log.
    step: float
    samples: int
    inputs: Callable[[Array], Mapping[str, Array]]  #: Time to commands or references, by channel.
    noise: Mapping[str, float]  #: Logged outputs, and the standard deviation of their noise, SI.
    free: Mapping[str, float]  #: Free parameters, and the factor by which they start beside the truth.
    #: First states of the record, by their names; the rest as after a long rest.
    start: Mapping[str, float] = field(default_factory=dict)
    fine: Setup = field(default_factory=Setup)  #: How the data are simulated.
    setup: Setup = field(default_factory=Setup)  #: How the fit simulates.
    known: tuple[str, ...] = ()

    @property
    def truth(self) -> Model:
        """The machine as it is."""
        return Model.load(EXAMPLES / self.model)

    def log(self, seed: int = 0) -> Experiment:
        """Record with noise."""
        model = self.truth
        time: Array = np.asarray(self.step * np.arange(self.samples), dtype=np.float64)
        channels = dict(self.inputs(time))
        held = Experiment.from_arrays(time, channels, model=model, name=Path(self.model).stem)
        closed = any(name.endswith(".reference") for name in channels)
        state = self.begin(model) if self.start else None
        run = simulate(
            model,
            held,
            "closed_loop" if closed else "free_run",
            integrator=self.fine.integrator,
            substeps=self.fine.substeps,
            initial_state=state,
        )
        random = np.random.default_rng(seed)
        for name, noise in self.noise.items():
            channels[name] = run[name] + noise * random.standard_normal(time.size)
        return Experiment.from_arrays(time, channels, model=model, name=Path(self.model).stem)

    def begin(self, model: Model) -> Array:
        """First state, flexible links in their equilibrium there."""
        state = model.state(dict(self.start) or None)
        if model.beams:
            state[: len(model.coordinates)] = model.equilibrium(state[: len(model.joints)])[0]
        return state

    @property
    def begun(self) -> Model:
        """The machine with its free parameters off."""
        model = self.truth
        return model.with_parameters({name: share * model.parameters[name].value for name, share in self.free.items()})

    @property
    def fitting(self) -> Fitting | None:
        """First states that are known."""
        if not self.known:
            return None
        model = self.truth
        every = dict(zip(model.state_names, map(float, self.begin(model)), strict=True))
        return Fitting(known_states={name: every[name] for name in self.known}, noise="estimated")

    def fit(self, record: Experiment) -> Fit:
        """What comes back."""
        return identify(self.begun, record, list(self.free), mode=self.mode, setup=self.setup, fitting=self.fitting)


def steps(time: Array, size: float, hold: float, seed: int) -> Array:
    """Values of a normal distribution, each held for a while."""
    count = np.floor(time / hold + 1e-9).astype(int)
    return np.asarray(size * np.random.default_rng(seed).standard_normal(count[-1] + 1)[count])


def chirp(time: Array, size: float, low: float, high: float) -> Array:
    """Sine that sweeps from one frequency to another, Hz."""
    return np.asarray(size * np.sin(2.0 * np.pi * (low + (high - low) * time / (2.0 * time[-1])) * time))


CHIRP_OF_EMPS = {"drive.reference": lambda t: chirp(t, 0.008, 0.3, 3.0)}
MOTION, DRIVE = ("position", "velocity"), ("spool", "spool_rate", "chamber_a", "chamber_b")
HELD = tuple(f"axis.{kind}" for kind in MOTION) + tuple(f"servo.{kind}" for kind in DRIVE)
FALLING = {
    "slider.position": 0.5793367101952138 - 0.045,  # the foot 5 mm above the ground
    "hip_rotation.position": np.radians(40.0),
    "knee_rotation.position": np.radians(-80.0),
}
BEFORE_THE_FALL = {
    "hand.command": lambda t: 0.0 * t,
    "hip_drive.reference": lambda t: 0.0 * t + np.radians(40.0),
    "knee_drive.reference": lambda t: 0.0 * t + np.radians(-80.0),
}
AT_REST = (*FALLING, *(name.replace("position", "velocity") for name in FALLING))
LEG = {"slider.position": 1e-4, "hip_rotation.position": 2e-4, "knee_rotation.position": 2e-4}


def given(signals: Mapping[str, Callable[[Array], Array]]) -> Callable[[Array], Mapping[str, Array]]:
    """Signals by channel, as functions of time together."""
    return lambda time: {name: signal(time) for name, signal in signals.items()}


CASES = {
    "emps, inverse dynamics": Case(
        "emps/model.toml",
        "inverse_dynamics",
        1e-3,
        4000,
        given(CHIRP_OF_EMPS),
        {"axis.position": 2e-6, "drive.command": 1e-2},
        {"carriage.mass": 0.7, "axis.friction.viscous": 1.5},
        fine=Setup(substeps=4),
    ),
    "emps, closed loop": Case(
        "emps/model.toml",
        "closed_loop",
        1e-3,
        2000,
        given(CHIRP_OF_EMPS),
        {"axis.position": 2e-6, "drive.command": 1e-2},
        {"carriage.mass": 0.7, "axis.friction.viscous": 1.5},
        fine=Setup(substeps=4),
        setup=Setup(substeps=4),
        known=("axis.position", "axis.velocity"),
    ),
    "crane, free run": Case(
        "crane/crane.toml",
        "free_run",
        0.05,
        400,
        given({"lift.command": lambda t: steps(t, 0.15, 0.5, 4)}),
        {"boom.position": 2e-3, "lift.pressure_a": 2e4},
        {"lift.valve.flow_gain": 0.8, "boom.friction.viscous": 0.7, "arm.mass": 1.2},
        fine=Setup("rosenbrock", 4),
        setup=Setup("rosenbrock", 2),
        known=tuple(f"boom.{kind}" for kind in MOTION) + tuple(f"lift.{kind}" for kind in DRIVE),
    ),
    "servo_cylinder, free run": Case(
        "servo_cylinder/rig.toml",
        "free_run",
        1e-3,
        500,
        given({"servo.command": lambda t: chirp(t, 5e-4, 1.0, 20.0)}),
        {"axis.position": 2e-5, "servo.pressure_a": 2e4, "servo.pressure_b": 2e4},
        {"pump.oil.bulk_modulus": 0.5, "servo.valve.flow_gain": 0.5},
        fine=Setup("rk4", 8),
        setup=Setup("rk4", 4),
        known=HELD,
    ),
    "servo_cylinder, input error": Case(
        "servo_cylinder/rig.toml",
        "input_error",
        1e-3,
        1000,
        given({"servo.command": lambda t: steps(t, 2e-3, 5e-3, 0)}),
        {"axis.position": 2e-5, "servo.pressure_a": 2e4, "servo.pressure_b": 2e4},
        {"pump.oil.bulk_modulus": 0.7, "servo.valve.flow_gain": 0.7},
        fine=Setup("rk4", 8),
        setup=Setup("rk4", 4, horizon=0.02),
    ),
    "servo_actuator, closed loop": Case(
        "servo_actuator/servo.toml",
        "closed_loop",
        1e-3,
        500,
        given({"servo.reference": lambda t: chirp(t, 5e-3, 1.0, 15.0)}),
        {"ram.length": 1e-5, "specimen.force": 10.0},
        {"servo.valve.flow_gain": 0.9, "specimen.stiffness": 1.2, "slip.friction.viscous": 0.8},
        fine=Setup("adaptive(1e-8)"),
        setup=Setup("linearly_implicit", 8),
        known=HELD,
    ),
    "flexible_pendulum, free run": Case(
        "flexible_pendulum/flexible_pendulum.toml",
        "free_run",
        2e-3,
        100,
        given({}),
        {"tip.x": 2e-4, "tip.z": 2e-4},
        {"strip.young": 0.9},
        start={"pivot.position": np.radians(30.0)},
        fine=Setup("rosenbrock", 6),
        setup=Setup("rosenbrock", 3),
        known=("pivot.position", "pivot.velocity"),
    ),
    "spinning_beam, free run": Case(
        "spinning_beam/spinning_beam.toml",
        "free_run",
        1e-2,
        200,
        given({"motor.command": lambda t: steps(t, 50.0, 0.2, 1)}),
        {"spin.position": 1e-4, "tip.x": 1e-3, "tip.y": 1e-3},
        {"arm.young": 0.9, "arm.density": 1.1},
        fine=Setup("linearly_implicit", 2),
        setup=Setup("linearly_implicit", 2),
        known=("spin.position", "spin.velocity"),
    ),
    "tudor, closed loop": Case(
        "tudor/tudor.toml",
        "closed_loop",
        4e-3,
        500,
        given(
            {
                "motor_1.reference": lambda t: 0.0 * t,
                "motor_2.reference": lambda t: chirp(t, 0.3, 0.3, 2.0),
                "motor_3.reference": lambda t: chirp(t, 0.3, 0.5, 3.0),
            }
        ),
        {"joint_2.position": 1e-4, "joint_3.position": 1e-4, "gauge_1.strain": 5e-6, "gauge_2.strain": 5e-6},
        {"elbow_drive.mass": 0.9, "strip_1.young": 1.05, "strip_2.young": 0.95},
        fine=Setup("linearly_implicit", 2),
        setup=Setup("linearly_implicit", 2),
        known=tuple(f"joint_{k}.{kind}" for k in (1, 2, 3) for kind in MOTION),
    ),
    "hyl, closed loop": Case(
        "hyl/rcm.toml",
        "closed_loop",
        1e-3,
        150,
        given(BEFORE_THE_FALL),
        {**LEG, "foot.normal_force": 5.0},
        {"foot.damping": 0.8, "carriage.mass": 1.1},
        start=FALLING,
        setup=Setup("adaptive(1e-6)"),
        fine=Setup("adaptive(1e-8)"),
        known=AT_REST,
    ),
    "hyl, restarts": Case(
        "hyl/rcm.toml",
        "restarts",
        1e-3,
        400,
        given(BEFORE_THE_FALL),
        {**LEG, "hip_drive.command": 0.1, "knee_drive.command": 0.1},
        {"carriage.mass": 1.1},
        start=FALLING,
        setup=Setup("adaptive(1e-6)", horizon=0.05),
        fine=Setup("adaptive(1e-8)"),
    ),
    "hyl with hydraulics, closed loop": Case(
        "hyl/hydraulic.toml",
        "closed_loop",
        1e-3,
        150,
        given(BEFORE_THE_FALL),
        {**LEG, "knee_drive.pressure_a": 2e4, "knee_drive.pressure_b": 2e4},
        {"pump.oil.bulk_modulus": 0.9, "knee_drive.valve.flow_gain": 1.1},
        start=FALLING,
        setup=Setup("adaptive(1e-6)"),
        fine=Setup("adaptive(1e-8)"),
        known=AT_REST,
    ),
}


@cache
def record_of(name: str) -> Experiment:
    """The log of a case, simulated once."""
    return CASES[name].log()


@cache
def fit_of(name: str) -> Fit:
    """What comes back from it, fitted once."""
    return CASES[name].fit(record_of(name))
