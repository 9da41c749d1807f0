"""Priors of parameters: from the model file, or from the natural sizes of the records."""

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from vpm.catalogue import EffectParameter
from vpm.errors import IdentificationError
from vpm.identify import PredictionErrorProblem
from vpm.model import Effect, Model

#: What an effect may amount to, as a share of what the records show of its kind.
SHARE = 0.3
#: The same for numbers that are near a value by nature, such as a gain.
NEAR = 0.1
#: Logarithm of the factor by which a shape may differ from where it starts.
FACTOR = float(np.log(10.0))
#: Values at which an effect does nothing that are natural sizes themselves, not limits that nothing reaches.
NATURAL = (0.0, 1.0)


@dataclass(frozen=True)
class Prior:
    """Prior of a parameter: what is known of it before the records."""

    #: Mean and standard deviation, SI; of the logarithm where it is ``logarithmic``, centre being the median.
    centre: float
    spread: float
    #: What is possible, SI.
    low: float
    high: float
    logarithmic: bool = False

    def standard(self, value: float) -> float:
        """Value in deviations from the prior's centre."""
        if self.logarithmic:
            return float(np.log(max(value, 1e-300) / self.centre)) / self.spread
        return (value - self.centre) / self.spread

    def value(self, standard: float) -> float:
        """Value that lies so many prior deviations from the centre, as far as it is possible."""
        far = self.spread * standard
        value = self.centre * float(np.exp(far)) if self.logarithmic else self.centre + far
        return min(max(value, self.low), self.high)

    def slope(self, value: float) -> float:
        """Change of the value by one prior deviation."""
        return self.spread * (max(value, 1e-300) if self.logarithmic else 1.0)

    @property
    def ends(self) -> tuple[float, float]:
        """Bounds of a parameter, in deviations from the centre of its prior."""
        low = -np.inf if self.logarithmic and self.low <= 0.0 else self.standard(self.low)
        return low, self.standard(self.high)


def natural_sizes(effort: float, speed: float, way: float) -> dict[str, float]:
    """Natural sizes for priors of each kind of quantity at a joint with this effort, speed and way."""
    return {
        "one": 1.0,
        "effort": effort,
        "effort_per_speed": effort / speed if speed else 0.0,
        "effort_per_speed_squared": effort / speed**2 if speed else 0.0,
        "effort_per_coordinate": effort / way if way else 0.0,
        "effort_per_coordinate_cubed": effort / way**3 if way else 0.0,
        "coordinate": way,
        "speed": speed,
        "mass": effort * way / speed**2 if speed else 0.0,
        "inertia": effort * way / speed**2 if speed else 0.0,
        "one_per_speed": 1.0 / speed if speed else 0.0,
    }


def log_share(lower: float, upper: float) -> float:
    """Logarithm of the share of a prior's normal bell between two ends, in deviations."""
    # The smaller tails are differences of numbers near zero, not near one.
    pair = (-lower, -upper) if lower > 0.0 else (upper, lower)
    first, second = log_ndtr(pair[0]), log_ndtr(pair[1])
    return float(first + np.log1p(-np.exp(min(second - first, -1e-300))))


def priors_of(model: Model, data: PredictionErrorProblem) -> dict[str, Prior]:
    """Priors of each adjustable parameter before the records."""
    unknown = {p.name for p in model.parameters.values() if p.adjustable and not np.isfinite(p.uncertainty or np.inf)}
    owners = {name: (effect, short) for effect in model.effects for short, name in effect.parameter_names.items()}
    sizes = _Sizes(model, data) if unknown else None
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
    """Natural sizes of effects, from how large the outputs of the records are."""

    def __init__(self, model: Model, data: PredictionErrorProblem) -> None:
        self.model = model
        outputs = data.outputs(model)
        self._shown = {name: outputs[:, at] for at, name in enumerate(model.output_channels)}

    def prior(self, effect: Effect, parameter: EffectParameter, value: float, box: tuple[float, float]) -> Prior:
        """Prior of a parameter of which the model file says nothing."""
        neutral = None if parameter.shape else parameter.neutral
        if neutral in NATURAL and neutral is not None:
            share = NEAR if parameter.scale == "one" else SHARE
            return Prior(neutral, share * self._size(effect, parameter), *box)
        if box[0] < 0.0 or value == 0.0:  # a place, which may be on either side
            return Prior(value, SHARE * self._size(effect, parameter), *box)
        if value == neutral:
            raise IdentificationError(
                f'"{effect.parameter_names[parameter.name]}" is {value:g}, where the effect does nothing; '
                "give it a value to begin with"
            )
        return Prior(value, FACTOR, *box, logarithmic=True)

    def _size(self, effect: Effect, parameter: EffectParameter) -> float:
        """Size for priors of a kind of quantity at the joint of an effect, in the records."""
        joint = self._joint(effect.at)
        way, speed = 0.5 * float(np.ptp(self._shown[f"{joint}.position"])), self._strength(f"{joint}.velocity")
        effort = self._strength(f"{joint}.effort") or max(
            self._strength(f"{name}.effort") for name in (*self.model.joints, *self.model.transmissions)
        )
        sizes = {
            **natural_sizes(effort, speed, way),
            "time": NEAR * way / speed if speed else 0.0,
            "command": self._strength(f"{effect.at}.command"),
            "channel": self._strength(self._measured(effect.at)),
        }
        size = sizes.get(parameter.scale, 0.0)
        if not (np.isfinite(size) and size > 0.0):
            raise IdentificationError(
                f'the records give "{effect.parameter_names[parameter.name]}" no size ({parameter.scale}); '
                "give it an uncertainty in the model file"
            )
        return size

    def _joint(self, site: str) -> str:
        """Joint or transmission of an effect for its priors; the first joint where it acts on all."""
        if site in (*self.model.joints, *self.model.transmissions):
            return site
        if site in self.model.actuators:
            return self.model.joints_of_actuator(site)[0]
        return self.model.joints[0]

    def _measured(self, site: str) -> str:
        return next((name for name in self._shown if self.model.sensor_of(name) == site), "")

    def _strength(self, channel: str) -> float:
        """Root mean square of a channel for priors; zero where there is none."""
        return float(np.sqrt(np.mean(self._shown[channel] ** 2))) if channel in self._shown else 0.0
