"""How far a reduced model is off: its parameters are fitted on some records, and it is judged on others."""

from collections.abc import Sequence
from dataclasses import replace

from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem, OutputErrorProblem, Problem, estimate, gaps
from vpm.identify.response_along_motion import SAMPLED_TYPES, has_own_drives
from vpm.model import Model
from vpm.one_thread import in_one_thread
from vpm.simplify.replacement import commanded
from vpm.simulate import Setup, judging_mode, places_joints, simulate

#: How many steps finer the full model is simulated than the controller's period, where it is the reference.
FINER = 2
#: Integrator of fits: the one that is stable whatever the reduced model is like.
FITTING = "linearly_implicit"
#: Fits end where parameters or sum of squares move by less than this share, and after so many evaluations in any case:
#: what is left of both is far less than a tolerance asks about.
FIT_TOLERANCE, FIT_EVALUATIONS = 1e-3, 20


class Judge:
    """Errors of models on records, in steps of the controller.

    - ``model``: the full one
    - ``records``, ``validation``: to fit on, and to judge on
    - ``rate``: steps per second, Hz
    - ``channels``: what is compared; by default all that can be
    """

    def __init__(
        self,
        model: Model,
        records: Sequence[Experiment],
        validation: Sequence[Experiment],
        rate: float,
        mode: str,
        channels: Sequence[str] | None = None,
    ) -> None:
        self.model = model
        self.records, self.validation, self.mode, self.rate = tuple(records), tuple(validation), mode, rate
        self.channels = tuple(channels) if channels is not None else None
        self.per_sample = steps_per_sample((*self.records, *self.validation), rate)
        self._balances = mode != "prescribed_motion" and not model.beams and not has_own_drives(model)

    @property
    def driven(self) -> Experiment:
        """Record whose commands drive a timed model, for its judgement."""
        return self.validation[0]

    @in_one_thread
    def fitted(self, model: Model) -> Model:
        """Fitted model to be judged, with adjustable parameters from its training records.

        By the inverse-dynamics residual where the machine has nothing that nobody measures, which is quick; by
        simulation in the mode it is judged in where it has.
        """
        free = model.adjustable
        # Elements in sampled time were fitted as a whole, and no parameter of the machine can be fitted beside them.
        if not free or any(model.actuator_type(name) in SAMPLED_TYPES for name in model.actuators):
            return model
        data: Problem
        if self._balances:
            data = InverseDynamicsProblem(model, self.records)
        else:
            data = self._outputs(model, self.records, Setup(FITTING, self.per_sample))
        found = estimate(model, data, free, tolerance=FIT_TOLERANCE, most_evaluations=FIT_EVALUATIONS)
        if found.interrupted:
            # Ctrl-C is meant for the whole search, not for this one fit.
            raise KeyboardInterrupt
        return found.on(model)

    def errors(self, model: Model, setup: Setup) -> dict[str, float]:
        """Relative error of each channel on the records to judge on.

        ``setup``: its substeps are those of one step of the controller.
        Raises `SimulationError`: the simulation fails in these steps.
        """
        stepped = replace(setup, substeps=setup.substeps * self.per_sample)
        data = self._outputs(model, self.validation, stepped)
        residual, _ = data.evaluate(model, model.theta)
        return {channel: share for channel, (_, share, _) in gaps(data, residual).items()}

    def _outputs(self, model: Model, records: Sequence[Experiment], setup: Setup) -> OutputErrorProblem:
        driven = [commanded(model, self.model, each) for each in records]
        mode = "free_run" if self.mode == "closed_loop" and not model.controlled_actuators else self.mode
        return OutputErrorProblem(model, driven, mode, channels=self.channels, setup=setup)


def steps_per_sample(records: Sequence[Experiment], rate: float) -> int:
    """Steps of the controller between two samples of the records that judge.

    ``rate``: Hz.
    """
    counts = {round(record.dt * rate, 6) for record in records}
    for record in records:
        steps = record.dt * rate
        if steps < 1.0 - 1e-6 or abs(steps - round(steps)) > 1e-3 * steps or len(counts) > 1:
            raise SimulationError(
                f"{record.name}: a sample lasts {record.dt:g} s, which is {steps:g} steps at {rate:g} Hz, but has to "
                "be the same whole number for all records; load them with `resample` at the rate or a whole part of it"
            )
    return round(records[0].dt * rate)


def by_the_model(model: Model, experiment: Experiment, mode: str, rate: float, channels: Sequence[str]) -> Experiment:
    """Record to judge by, with what the full model does in the place of what was measured.

    - ``experiment``: its commands or references count
    - ``mode``: one of "free_run", "closed_loop"
    - ``rate``: Hz; the full model takes twice as many steps, at least
    """
    if mode not in ("free_run", "closed_loop"):
        raise SimulationError(
            f"the mode {mode} starts from the measured motion, so a model cannot be its own reference there; "
            "choose free_run or closed_loop, or compare with the data"
        )
    run = simulate(model, experiment, mode, substeps=FINER * steps_per_sample([experiment], rate))
    # What is not compared stays as it was measured: simulations start from it, the full model's and the others' alike.
    kept = {name: experiment[name] for name in experiment.channels if name not in channels}
    answers = {name: run[name] for name in channels}
    return Experiment.from_arrays(run.time, {**kept, **answers}, model=model, name=experiment.name)


def shown(model: Model) -> tuple[str, ...]:
    """Channels to judge by: strains, marker places and pressures, or joint positions without those."""
    inner = tuple(
        n for n in model.output_channels if n.endswith((".strain", ".x", ".y", ".z", ".pressure_a", ".pressure_b"))
    )
    return inner or tuple(f"{joint}.position" for joint in model.joints)


def reference_mode(model: Model, experiments: Sequence[Experiment], against: str, mode: str | None) -> str:
    """Mode to judge in: what was asked for, or the one that says most.

    ``against``: one of "data", "model". Restarts need to know where every joint is.
    """
    if mode is not None:
        return mode
    best = judging_mode(model, experiments)
    runs = against == "model" or not all(places_joints(model, experiment) for experiment in experiments)
    return "free_run" if runs and best == "restarts" else best
