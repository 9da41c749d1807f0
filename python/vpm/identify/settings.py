"""How a fit is done: weights, losses, starts, unknown first states."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from vpm.errors import IdentificationError
from vpm.results import Storable

LOSSES = ("squares", "huber", "soft_l1")
NOISES = ("spread", "estimated", "given")

#: Where so much of what could be explained remains, what was found is not the explanation.
MOSTLY_OPEN = 0.15


@dataclass(frozen=True, repr=False, eq=False)
class Fitting(Storable):
    """Settings of `vpm.identify`; the defaults are those of a fit without it, but for the method of descent.

    Attributes
    ----------
    channels : tuple of str
        Compared outputs; by default all that are measured and not prescribed.
    log : bool
        Move the logarithm of parameters that are positive and must stay so: steps are then factors, for starts that
        are wrong by decades.
    bounds : dict
        ``{parameter: (low, high)}``, SI, inside which the fit stays; others keep the bounds of the model.
    noise : {"spread", "estimated", "given"}
        What residuals of different channels are divided by before they are added: the spread of the measured signal,
        the standard deviation of the channel's own residual (found by repeated fits), or ``noise_levels``.
    noise_levels : dict
        ``{channel: standard deviation}``, SI, for ``noise="given"``.
    loss : {"squares", "huber", "soft_l1"}
        Of the residual in units of its noise; the last two let outliers pull less, by weights that fall beyond
        ``loss_scale`` standard deviations (P. Huber and E. Ronchetti, *Robust Statistics*, 2nd ed., 7.8).
    priors : bool
        Add the uncertainties of the model file as measurements of the parameters themselves.
    starts : int
        Number of fits from different starts, the first from the model's own values.
    seed : int
        Of the starts.
    spread : float
        Factor by which starts differ (one standard deviation) where neither an uncertainty nor bounds say it.
    states : tuple of str
        First states that are fitted, for each record by itself: names as in ``model.state_names``.
    known_states : dict
        ``{state: value}``, SI, of first states that are known, such as a rest: ``{"axis.velocity": 0.0}``. They
        replace what the first samples of a record suggest, and hold for whole records.
    offsets : tuple of str
        Compared channels, such as those of strain gauges and load cells that drift, that are off by a constant of its
        own in each record. It is fitted beside the parameters; no residual holds it. For output-error modes.
    piece : float
        Length, s, of the pieces of multiple shooting, each with first states of its own; 0 for whole records.
    continuity : float
        Weight of the gap between two pieces, in samples of it: a gap of one noise counts like so many pieces of record
        that are one noise off.
    workers : int
        Threads; 0 for one per core. The result does not depend on it.
    most_evaluations : int
        Simulations of all records after which a fit is ended as it stands.
    """

    channels: tuple[str, ...] = ()
    log: bool = False
    bounds: dict[str, tuple[float, float]] = field(default_factory=dict)
    noise: str = "spread"
    noise_levels: dict[str, float] = field(default_factory=dict)
    loss: str = "squares"
    loss_scale: float = 1.345
    priors: bool = False
    starts: int = 1
    seed: int = 0
    spread: float = 3.0
    states: tuple[str, ...] = ()
    known_states: dict[str, float] = field(default_factory=dict)
    offsets: tuple[str, ...] = ()
    piece: float = 0.0
    continuity: float = 10.0
    workers: int = 0
    most_evaluations: int = 60

    def __post_init__(self) -> None:
        """Check the settings of a fit."""
        for value, choices, name in ((self.loss, LOSSES, "loss"), (self.noise, NOISES, "noise")):
            if value not in choices:
                raise IdentificationError(f"{name} is '{value}'; choose one of {', '.join(choices)}")
        if (self.noise == "given") != bool(self.noise_levels):
            raise IdentificationError(
                f"noise is '{self.noise}' with {len(self.noise_levels)} noise_levels; "
                'levels go with noise="given" and nothing else'
            )
        _positive({"loss_scale": self.loss_scale, "continuity": self.continuity, "spread - 1": self.spread - 1.0})
        _positive({f"noise_levels of {name}": level for name, level in self.noise_levels.items()})
        for name, low in (("starts", 1), ("workers", 0), ("most_evaluations", 1), ("seed", 0)):
            if getattr(self, name) < low:
                raise IdentificationError(f"{name} is {getattr(self, name)}; give a whole number of at least {low}")
        both = [name for name in self.known_states if name in self.states]
        if both:
            raise IdentificationError(f"{both[0]} is among known_states and among the fitted states; choose one")
        if self.offsets and self.loss != "squares":
            raise IdentificationError(
                f"offsets are means, which outliers move, and loss is '{self.loss}'; take squares or leave offsets out"
            )
        if not self.piece >= 0.0:
            raise IdentificationError(f"piece is {self.piece} s; give a positive time, or 0 for whole records")

    @property
    def weighs_by_noise(self) -> bool:
        """Whether settings need residuals in units of their noise: asked for, or by loss or priors."""
        return self.noise != "spread" or self.loss != "squares" or self.priors


@dataclass(frozen=True, repr=False, eq=False)
class Checks(Storable):
    """Thresholds at which a fit warns that it may be wrong."""

    level: float = 1e-6  #: Probability of a false warning that an effect is missing, in one fit whose model is right.
    #: Root mean square that the motion explains of a residual, as a share of the measured signal, below which nothing
    #: is said.
    visible: float = 2e-3
    far: float = 3.0  #: Deviations, stated and estimated together, beyond which an estimate contradicts the model file.
    #: Times that an effort at other times has to be larger than the noise, in each direction, to be asked whether it
    #: explains a residual.
    clear: float = 5.0
    #: Waves that laws of position have over its range: ripple of motors and teeth.
    waves: int = 32
    waves_each: int = 4  #: How many of them are asked at a time.
    #: Probability that first states are taken as unknown although those that the log suggests are right.
    begun: float = 0.05
    read_back: float = 0.1  #: Share of the mean square that a fit has to leave less if commands were read back.

    def __post_init__(self) -> None:
        """Check the settings' numbers."""
        names = ("level", "visible", "far", "clear", "waves", "waves_each", "begun", "read_back")
        _positive({name: getattr(self, name) for name in names})


@dataclass(frozen=True)
class OwnSimulation:
    """Settings of the simulations of its own model that a fit is compared with."""

    #: Bandwidths with which a simulation is drawn to its log, Hz: the slower, the less it hears of the noise of the
    #: log.
    bands: tuple[float, ...] = (0.3, 1.0, 3.0)
    damping: float = 0.5**0.5  #: Damping ratio of that controller.
    away: float = 0.3  #: Share of its motion by which a joint may be away from its log.
    #: Integrator. Where dry friction turns round, longer steps would be an error of the simulation that a fit takes
    #: for the machine's.
    method: str = "adaptive(1e-7)"
    #: A model that leaves so many times more of a log than of its own simulation lacks something, which is more
    #: than this.
    alike: float = 2.0
    #: Pairs of simulated logs, one with the noise of the other turned round. What is linear in noise cancels from
    #: their mean, so that it adds next to nothing to the variance of a fit (antithetic variates: J. Hammersley and
    #: K. Morton, *Proc. Cambridge Philosophical Society* 52, 1956).
    pairs: int = 3
    #: Most simulations that correct a fit; one more where the last one moved a value by more than its deviation.
    rounds: int = 2
    draws: int = 20  #: Draws of the noise that tell how far it moves a fit.
    contradicted: float = 0.05  #: Probability that a log is taken to be noisier than the draws although it is not.


def _positive(numbers: Mapping[str, float]) -> None:
    for name, number in numbers.items():
        if not number > 0.0:
            raise IdentificationError(f"{name} is {number:g}; give a positive number")
