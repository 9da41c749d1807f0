"""Which of several models the records speak for, and with which probability.

Every model follows the records with its own observer and its own noise, at the values that records and prior knowledge
make most likely. Its evidence is the probability density of the records under the model, whatever the values: by
Laplace's method about these (D. MacKay, *Neural Computation* 4, 1992). A parameter that explains nothing costs what the
records could have said of it, so that more parameters are no advantage by themselves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from vpm.errors import IdentificationError
from vpm.experiment import Experiment, as_records
from vpm.identify import Block, PredictionErrorProblem, estimate
from vpm.model import Model
from vpm.numbers import Array
from vpm.observer import Record
from vpm.results import Result
from vpm.simulate import Setup
from vpm.weighing.priors import Prior, log_share, priors_of

#: Times that an observer gets the gains of the values that it led to, and the gain (nats) after which it need not.
RENEWALS, SETTLED = 5, 0.05


@dataclass(frozen=True, repr=False, eq=False)
class Weighing(Result):
    """Models in the order of their probability.

    Attributes
    ----------
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
        """Probability of one weighed model."""
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
    """Weigh models: how probable each of several is.

    Parameters
    ----------
    models : mapping of str to Model
        Their adjustable parameters are fitted. The prior of each is the uncertainty in the model file. Sizes of effects
        without one may reach a third of what the records show of their kind (effort, speed, way), and shapes of laws a
        factor of ten on either side.
    experiments : Experiment or sequence of Experiment
        With commands, and any of the outputs.
    channels : sequence of str, optional
        Outputs that are compared; by default those that every log holds and every model has.
    setup : Setup, optional
        Integrator, substeps and hold.

    Raises
    ------
    IdentificationError
        No model or record was given, or nothing is known of a parameter that the records give no size.

    Examples
    --------
    >>> dry = model.with_effect("coulomb_friction", at="axis")
    >>> weigh({"as it is": model, "dry friction": dry}, log)["dry friction"]
    0.9999
    """
    if not models:
        raise IdentificationError("no model was given to weigh; pass at least two by name")
    records = as_records(experiments)
    if not records:
        raise IdentificationError("no experiment was given; pass at least one")
    # Densities compare only where they are of the same readings.
    pairs = [Record.of(model, record, channels).channels for model in models.values() for record in records]
    shared = [name for name in pairs[0] if all(name in names for names in pairs)]
    weighed = {name: _weighed(model, records, shared, setup) for name, model in models.items()}
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
    model: Model, records: Sequence[Experiment], channels: Sequence[str], setup: Setup | None
) -> tuple[float, float, Model]:
    """Evidence, log likelihood and the model at its most likely values."""
    data = PredictionErrorProblem(model, records, channels=channels, setup=setup)
    priors = priors_of(model, data)
    names = tuple(priors)
    best = (-np.inf, -np.inf, model)
    for _ in range(RENEWALS):
        known = _Known(data, priors)
        fitted = model
        if names:
            found = estimate(model, known, names, bounds={name: (p.low, p.high) for name, p in priors.items()})
            fitted = found.on(model)
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
        """Residual and derivative with prior rows, to weigh models; see `vpm.identify.Problem`."""
        residual, jacobian = self.data.evaluate(model, theta, columns)
        off, slopes = self.standard(model, theta)
        rows = np.zeros((len(off), len(columns)))
        for row, name in enumerate(self.priors):
            if (at := model.index(name)) in columns:
                rows[row, list(columns).index(at)] = 1.0 / slopes[row]
        return np.concatenate([residual, off]), np.concatenate([jacobian, rows])

    def standard(self, model: Model, theta: Array) -> tuple[Array, Array]:
        """Parameters of a weighed model in prior deviations, and their change by a deviation."""
        values = [(prior, float(theta[model.index(name)])) for name, prior in self.priors.items()]
        return np.array([p.standard(x) for p, x in values]), np.array([p.slope(x) for p, x in values])


def _evidence(model: Model, known: _Known) -> tuple[float, float]:
    """Evidence to weigh a model by Laplace's method, and its log likelihood.

    In deviations ``z`` of the priors: ``l - z'z/2 - ln det(1 + J'J)/2``, with the share of each parameter's bell that
    is possible, after the records and before.
    """
    columns = [model.index(name) for name in known.priors]
    residual, jacobian = known.data.evaluate(model, model.theta, columns)
    likelihood = known.data.log_likelihood(residual)
    if not columns:
        return likelihood, likelihood
    z, changes = known.standard(model, model.theta)
    slopes = jacobian * changes
    curvature = np.eye(len(z)) + slopes.T @ slopes
    gradient = slopes.T @ residual + z
    total = likelihood - 0.5 * float(z @ z) - 0.5 * float(np.linalg.slogdet(curvature)[1])
    widths = np.sqrt(np.diag(np.linalg.inv(curvature)))
    for prior, own, width, pull in zip(known.priors.values(), z, widths, gradient, strict=True):
        total += _inside(prior, float(own), float(width), float(pull)) - log_share(*prior.ends)
    return total, likelihood


def _inside(prior: Prior, own: float, width: float, pull: float) -> float:
    """Log-share of a bell within what is possible, to weigh models; at a bound it falls off with ``pull``."""
    low, high = prior.ends
    resting = own - low < 1e-3 * width or high - own < 1e-3 * width
    lean = pull * width if resting else 0.0
    return 0.5 * lean**2 + log_share((low - own) / width + lean, (high - own) / width + lean)
