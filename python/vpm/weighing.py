"""Which of several models the records speak for, and with which probability.

Every model follows the records with its own observer and its own noise, at the values that records and prior knowledge
make most likely. Its evidence is the probability density of the records under the model, whatever the values: by
Laplace's method about these (D. MacKay, *Neural Computation* 4, 1992). A parameter that explains nothing costs what the
records could have said of it, so that more parameters are no advantage by themselves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp

from vpm.catalogue import EffectParameter
from vpm.errors import IdentificationError
from vpm.experiment import Experiment, as_records
from vpm.identify import Block, PredictionErrorProblem, estimate
from vpm.model import Effect, Model
from vpm.observer import Record, filtered
from vpm.results import Result
from vpm.simulate import Setup

Array = NDArray[np.float64]

#: Times that an observer gets the gains of the values that it led to, and the gain (nats) after which it need not.
RENEWALS, SETTLED = 5, 0.05
#: What an effect may amount to, as a share of what the records show of its kind.
SHARE = 0.3
#: The same for numbers that are near a value by nature, such as a gain.
NEAR = 0.1
#: Logarithm of the factor by which a shape may differ from where it starts.
FACTOR = float(np.log(10.0))


@dataclass(frozen=True)
class Prior:
    """What is known of a parameter before the records.

    Attributes
    ----------
    centre, spread : float
        Mean and standard deviation, SI; of the logarithm where it is ``logarithmic``, centre being the median.
    logarithmic : bool
    low, high : float
        What is possible, SI.
    """

    centre: float
    spread: float
    low: float
    high: float
    logarithmic: bool = False

    def standard(self, value: float) -> float:
        """The value in deviations from the centre."""
        if self.logarithmic:
            return float(np.log(max(value, 1e-300) / self.centre)) / self.spread
        return (value - self.centre) / self.spread

    def slope(self, value: float) -> float:
        """Change of the value by a deviation."""
        return self.spread * (max(value, 1e-300) if self.logarithmic else 1.0)

    def possible(self) -> float:
        """Logarithm of the share of the prior that is possible."""
        low = -np.inf if self.logarithmic and self.low <= 0.0 else self.standard(self.low)
        return float(np.log(max(np.exp(log_ndtr(self.standard(self.high))) - np.exp(log_ndtr(low)), 1e-300)))


@dataclass(frozen=True, repr=False, eq=False)
class Weighing(Result):
    """Models in the order of their probability.

    Attributes
    ----------
    names : tuple of str
    probability : ndarray, shape (k,)
        That of each, if one of them is right and all were as likely before; not calibrated.
    evidence : ndarray, shape (k,)
        Logarithm of the probability density of the records under each model, in nats more than under the best.
    log_likelihood : ndarray, shape (k,)
        The same at its best values.
    models : tuple of Model
        With these values.
    """

    names: tuple[str, ...]
    probability: Array
    evidence: Array
    log_likelihood: Array
    models: tuple[Model, ...]

    def __getitem__(self, name: str) -> float:
        """Probability of one of the models."""
        if name not in self.names:
            raise IdentificationError(f'"{name}" was not weighed; weighed were {", ".join(self.names)}')
        return float(self.probability[self.names.index(name)])

    def _headline(self) -> Mapping[str, object]:
        return dict(zip(self.names, map(float, self.probability), strict=True))

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "name": list(self.names),
            "probability": self.probability,
            "evidence": self.evidence,
            "log_likelihood": self.log_likelihood,
        }


def weigh(
    models: Mapping[str, Model],
    experiments: Experiment | Sequence[Experiment],
    *,
    channels: Sequence[str] | None = None,
    setup: Setup | None = None,
) -> Weighing:
    """Tell how probable each of several models is.

    Parameters
    ----------
    models : mapping of str to Model
        Their adjustable parameters are fitted. The uncertainty in the model file is what is known of each before; sizes
        of effects of which nothing is known may amount to a third of what the records show of their kind (effort,
        speed, way), shapes of laws to a factor of ten on either side.
    experiments : Experiment or sequence of Experiment
        With commands, and any of the outputs.
    channels : sequence of str, optional
        Outputs that are compared; by default all that each log holds.
    setup : Setup, optional
        Integrator, substeps and hold.

    Returns
    -------
    Weighing

    Raises
    ------
    IdentificationError
        No model was given, or nothing is known of a parameter that the records give no size.

    Examples
    --------
    >>> dry = model.with_effect("coulomb_friction", at="axis")
    >>> weigh({"as it is": model, "dry friction": dry}, log)["dry friction"]
    0.9999
    """
    if not models:
        raise IdentificationError("no model was given to weigh; pass at least two by name")
    records = as_records(experiments)
    weighed = {name: _weighed(model, records, channels, setup) for name, model in models.items()}
    order = sorted(weighed, key=lambda name: -weighed[name][0])
    evidence = np.array([weighed[name][0] for name in order])
    return Weighing(
        tuple(order),
        np.exp(evidence - logsumexp(evidence)),
        evidence - evidence[0],
        np.array([weighed[name][1] for name in order]),
        tuple(weighed[name][2] for name in order),
    )


def _weighed(
    model: Model, records: Sequence[Experiment], channels: Sequence[str] | None, setup: Setup | None
) -> tuple[float, float, Model]:
    """Evidence, log likelihood and the model at its most likely values."""
    priors = priors_of(model, records, channels, setup)
    names = tuple(priors)
    data = PredictionErrorProblem(model, records, channels=channels, setup=setup)
    best = (-np.inf, -np.inf, model)
    for _ in range(RENEWALS):
        known = _Known(data, priors)
        fitted = model
        if names:
            found = estimate(model, known, names, bounds={name: (p.low, p.high) for name, p in priors.items()})
            fitted = model.with_parameters(dict(zip(names, map(float, found.values), strict=True)))
        data = data.renewed(fitted)
        here = (*_evidence(fitted, _Known(data, priors)), fitted)
        if here[0] <= best[0] + SETTLED:
            return max(best, here, key=lambda one: one[0])
        best, model = here, fitted
    return best


class _Known:
    """Innovations, and beside them each parameter as a measurement of itself by its prior."""

    mode = PredictionErrorProblem.mode

    def __init__(self, data: PredictionErrorProblem, priors: Mapping[str, Prior]) -> None:
        self.data, self.priors = data, priors
        blocks, start = list(data.blocks), data.blocks[-1].samples.stop
        for place, name in enumerate(priors):
            rows, one = slice(start + place, start + place + 1), np.ones(1)
            blocks.append(Block("", name, "1", rows, np.zeros(1), 1.0, 1.0, one))
        self.blocks = tuple(blocks)

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """See `vpm.identify.Problem`."""
        residual, jacobian = self.data.evaluate(model, theta, columns)
        places = [model.index(name) for name in self.priors]
        off = np.array([p.standard(float(theta[at])) for p, at in zip(self.priors.values(), places, strict=True)])
        rows = np.zeros((len(places), len(columns)))
        for row, (prior, at) in enumerate(zip(self.priors.values(), places, strict=True)):
            if at in columns:
                rows[row, list(columns).index(at)] = 1.0 / prior.slope(float(theta[at]))
        return np.concatenate([residual, off]), np.concatenate([jacobian, rows])


def _evidence(model: Model, known: _Known) -> tuple[float, float]:
    """Evidence by Laplace's method about the values of the model, and the log likelihood there.

    In deviations ``z`` of the priors: ``l - z'z/2 - ln det(1 + J'J)/2``, with the share of each parameter's bell that
    is possible, after the records and before.
    """
    names, priors = list(known.priors), list(known.priors.values())
    columns = [model.index(name) for name in names]
    likelihood = known.data.log_likelihood(model, model.theta)
    if not names:
        return likelihood, likelihood
    values = model.theta[columns]
    residual, jacobian = known.data.evaluate(model, model.theta, columns)
    slopes = jacobian * np.array([prior.slope(float(x)) for prior, x in zip(priors, values, strict=True)])
    z = np.array([prior.standard(float(x)) for prior, x in zip(priors, values, strict=True)])
    curvature = np.eye(len(z)) + slopes.T @ slopes
    gradient = slopes.T @ residual + z
    total = likelihood - 0.5 * float(z @ z) - 0.5 * float(np.linalg.slogdet(curvature)[1])
    widths = np.sqrt(np.diag(np.linalg.inv(curvature)))
    for prior, own, width, pull in zip(priors, z, widths, gradient, strict=True):
        total += _inside(prior, float(own), float(width), float(pull)) - prior.possible()
    return total, likelihood


def _inside(prior: Prior, own: float, width: float, pull: float) -> float:
    """Logarithm of the share of a bell of that width within what is possible; at a bound it falls off with ``pull``."""
    low = -np.inf if prior.logarithmic and prior.low <= 0.0 else prior.standard(prior.low)
    high = prior.standard(prior.high)
    resting = own - low < 1e-3 * width or high - own < 1e-3 * width
    lean = pull * width if resting else 0.0
    upper, lower = (high - own) / width + lean, (low - own) / width + lean
    # The smaller tails are differences of numbers near zero, not near one.
    pair = (-lower, -upper) if lower > 0.0 else (upper, lower)
    first, second = log_ndtr(pair[0]), log_ndtr(pair[1])
    return float(0.5 * lean**2 + first + np.log1p(-np.exp(min(second - first, -1e-300))))


def priors_of(
    model: Model, records: Sequence[Experiment], channels: Sequence[str] | None = None, setup: Setup | None = None
) -> dict[str, Prior]:
    """What is known of each adjustable parameter before the records.

    Raises
    ------
    IdentificationError
        Nothing is known of one, and the records give it no size.
    """
    unknown = {p.name for p in model.parameters.values() if p.adjustable and not np.isfinite(p.uncertainty or np.inf)}
    owners = {name: (effect, short) for effect in model.effects for short, name in effect.parameter_names.items()}
    sizes = _Sizes(model, records, channels, setup) if unknown else None
    priors = {}
    for parameter in model.parameters.values():
        if not parameter.adjustable or parameter.uncertainty is None:
            continue
        box = (parameter.minimum, parameter.maximum)
        if parameter.name not in unknown or sizes is None:
            priors[parameter.name] = Prior(parameter.value, parameter.uncertainty, *box)
            continue
        if parameter.name not in owners:
            raise IdentificationError(
                f'nothing is known of "{parameter.name}" before the records; give it an uncertainty in the model file'
            )
        effect, short = owners[parameter.name]
        priors[parameter.name] = sizes.prior(effect, effect.type.parameter(short), parameter.value, box)
    return priors


class _Sizes:
    """How large what the records show is, by kind: the natural sizes of effects."""

    def __init__(
        self, model: Model, records: Sequence[Experiment], channels: Sequence[str] | None, setup: Setup | None
    ) -> None:
        self.model = model
        taken = [Record.of(model, record, channels) for record in records]
        noise = PredictionErrorProblem(model, records[:1], channels=channels, setup=setup).noise
        states = np.concatenate([filtered(model, record, noise, setup=setup).states for record in taken])
        self._inputs = np.concatenate([record.inputs for record in taken])
        self._readings = {name: taken[0].readings[:, at] for at, name in enumerate(taken[0].channels)}
        n = len(model.coordinates)
        self._ways = 0.5 * np.ptp(states[:, :n], axis=0)
        self._speeds = np.sqrt(np.mean(states[:, n : 2 * n] ** 2, axis=0))

    def prior(self, effect: Effect, parameter: EffectParameter, value: float, box: tuple[float, float]) -> Prior:
        """Prior of a parameter of which the model file says nothing."""
        size = parameter.neutral is not None and not parameter.shape
        if box[0] > 0.0 or (not size and box[0] == 0.0 and value > 0.0):
            return Prior(value, FACTOR, *box, logarithmic=True)
        centre = parameter.neutral if size and parameter.neutral is not None else value
        share = NEAR if parameter.scale == "one" else SHARE
        return Prior(centre, share * self._size(effect, parameter), *box)

    def _size(self, effect: Effect, parameter: EffectParameter) -> float:
        """Size of a kind of quantity at the joint of an effect, in the records.

        Raises
        ------
        IdentificationError
            The records do not show it.
        """
        joint = self._joint(effect.at)
        way, speed = float(self._ways[joint]), float(self._speeds[joint])
        effort, command = self._effort(), float(np.sqrt(np.mean(self._inputs**2)))
        reading = self._readings.get(self._measured(effect.at), np.ones(1))
        sizes = {
            "one": 1.0,
            "effort": effort,
            "effort_per_speed": effort / speed if speed else 0.0,
            "effort_per_coordinate": effort / way if way else 0.0,
            "coordinate": way,
            "speed": speed,
            "mass": effort * way / speed**2 if speed else 0.0,
            "inertia": effort * way / speed**2 if speed else 0.0,
            "time": NEAR * way / speed if speed else 0.0,
            "command": command,
            "channel": float(np.sqrt(np.mean(reading**2))),
            "one_per_speed": 1.0 / speed if speed else 0.0,
        }
        size = sizes.get(parameter.scale, 0.0)
        if not (np.isfinite(size) and size > 0.0):
            raise IdentificationError(
                f'the records give "{effect.parameter_names[parameter.name]}" no size ({parameter.scale}); '
                "give it an uncertainty in the model file"
            )
        return size

    def _joint(self, site: str) -> int:
        if site in self.model.joints:
            return self.model.joints.index(site)
        if site in self.model.actuators:
            return self.model.joints.index(self.model.joints_of_actuator(site)[0])
        return 0

    def _measured(self, site: str) -> str:
        return next((name for name in self._readings if self.model.sensor_of(name) == site), "")

    def _effort(self) -> float:
        """Root mean square of what ideal drives deliver."""
        gains = [
            self.model.parameters[f"{name}.gain"].value if f"{name}.gain" in self.model.parameters else 1.0
            for name in self.model.actuators
        ]
        return float(np.sqrt(np.mean((self._inputs[:, : len(gains)] * gains) ** 2)))
