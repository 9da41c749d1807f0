"""An observer that is fed sample by sample: state, covariance and innovations for a controller at work."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import DivergedError, SimulationError, check_known, refused_as
from vpm.model import Model
from vpm.numbers import Array, array_of
from vpm.observer.filtering import first_deviations
from vpm.observer.noise import Noise
from vpm.simulate import AUTOMATIC, Setup


class SteadyGain(NamedTuple):
    """A gain that stays, with what it leaves unknown."""

    #: Correction of the state by the innovations (nx, m).
    gain: Array
    #: Covariance of the corrected state (nx, nx), and of the innovations (m, m).
    covariance: Array
    spread: Array
    #: What the observer's step makes of the corrected state (nx, nx), and the measured outputs by the state (m, nx).
    transition: Array
    output: Array


class Observer:
    """An extended Kalman filter of a machine, as `vpm.observe` runs over a record, one sample at a time.

    At each sample `step` corrects the state by what was measured and carries it to the next under inputs that are
    held. Linear models are the exact derivatives of the integrator's steps. A steady observer keeps the gain that the
    filter settles to about the first state.

    Parameters
    ----------
    model : Model
        Without delays, which remember what no state holds.
    time_step : float
        Time between samples, s.
    channels : sequence of str
        Outputs that are measured, for example ``["axis.position"]``.
    noise : Noise
        Deviations of readings, and of the forces and states that move for no known reason.
    state : mapping of str to float, or array_like of shape (nx,), optional
        First state, as ``model.state`` takes it.
    deviations : array_like, shape (nx,), optional
        How far off it may be; by default 0.01 of coordinates, 1 of rates, a tenth of what drives hold.
    steady : bool
        Keep one gain.
    inputs : mapping of str to float, or array_like of shape (nu,), optional
        Under which a steady observer's gain is found, as ``model.command`` takes them.
    integrator, substeps
        See :class:`vpm.simulate.Setup`.

    Raises
    ------
    SimulationError, ModelError
        A name or a number is wrong, or no steady gain exists: something that drifts is not seen.
    CoreError
        The machine has delays or drives in sampled time.

    Examples
    --------
    >>> observer = Observer(model, 1e-3, ["axis.position"], Noise({"axis.position": 1e-4}, {"axis": 0.5}))
    >>> state = observer.step([0.1], [0.0])
    """

    def __init__(
        self,
        model: Model,
        time_step: float,
        channels: Sequence[str],
        noise: Noise,
        *,
        state: Mapping[str, float] | ArrayLike | None = None,
        deviations: ArrayLike | None = None,
        steady: bool = False,
        inputs: Mapping[str, float] | ArrayLike | None = None,
        integrator: str = AUTOMATIC,
        substeps: int = 1,
    ) -> None:
        from vpm._core import Kalman

        self.model, self.channels = model, tuple(channels)
        if not self.channels:
            raise SimulationError("an observer needs readings; name at least one channel")
        check_known(self.channels, model.output_channels, SimulationError, "channels:", "is unknown")
        first = model.state(state)
        spread = first_deviations(model, first) if deviations is None else deviations
        self._first, self._deviations = first, array_of(spread, "the deviations of the first state", SimulationError)
        readings, forces, states = noise.placed(model, self.channels)
        setup = Setup(integrator, substeps)
        with refused_as(SimulationError, model.name):
            self._core = Kalman(
                model.core,
                model.theta,
                first,
                [model.output_channels.index(name) for name in self.channels],
                (readings, forces, states, self._deviations),
                float(time_step),
                substeps,
                setup.method(model),
            )
        self._readings = readings
        self._innovation = np.zeros(len(self.channels))
        self._estimate = first.copy()
        if steady:
            self.keep(self.settled(first, model.command(inputs)))

    def step(self, measurements: ArrayLike, inputs: ArrayLike | Mapping[str, float] = ()) -> Array:
        """Step of the online observer: state at this sample, corrected by readings; inputs are held.

        Parameters
        ----------
        measurements : array_like, shape (m,)
            In the order of `channels`; not a number where a reading did not come. A steady observer takes that one to
            be as expected.
        inputs : array_like of shape (nu,), or mapping of str to float
            Commands that stand from now on; in a mapping as ``model.command`` takes them.

        Returns
        -------
        ndarray, shape (nx,)
            Named by ``model.state_names``.

        Raises
        ------
        SimulationError
            A size is wrong, or a number is infinite.
        DivergedError
            A state left its bounds; only `reset` leads on.
        """
        from vpm._core import Diverged

        command = self.model.command(inputs) if isinstance(inputs, Mapping) else inputs
        try:
            self._estimate, self._innovation = self._core.step(np.atleast_1d(measurements), np.atleast_1d(command))
        except Diverged as error:
            raise DivergedError(f"{self.model.name}: {error}", run=None, time=None) from None
        except ValueError as error:
            raise SimulationError(f"{self.model.name}: {error}") from error
        return self._estimate

    @property
    def state(self) -> Array:
        """Last state that the online observer estimated, shape (nx,)."""
        return self._estimate

    @property
    def covariance(self) -> Array:
        """Covariance of the online observer's last estimate, shape (nx, nx)."""
        return self._core.covariances()[0]

    @property
    def innovation(self) -> Array:
        """Innovation of the online observer: measurements less what was expected, shape (m,)."""
        return self._innovation

    @property
    def innovation_covariance(self) -> Array:
        """Covariance of the online observer's innovations, shape (m, m)."""
        return self._core.covariances()[1]

    @property
    def predicted(self) -> Array:
        """State that the online observer expects at the coming sample, shape (nx,)."""
        return self._core.expected()

    def reset(self, state: Mapping[str, float] | ArrayLike | None = None, covariance: ArrayLike | None = None) -> None:
        """Reset the online observer, by default to its own first state and deviations.

        Parameters
        ----------
        state : mapping of str to float, or array_like of shape (nx,), optional
        covariance : array_like, shape (nx, nx), optional
        """
        first = self._first if state is None else self.model.state(state)
        spread = np.diag(self._deviations**2) if covariance is None else covariance
        with refused_as(SimulationError, self.model.name):
            self._core.reset(first, spread)
        self._estimate, self._innovation = first.copy(), np.zeros(len(self.channels))

    def settled(self, state: Mapping[str, float] | ArrayLike, inputs: Mapping[str, float] | ArrayLike) -> SteadyGain:
        """Steady-state gain of the online observer near a state under standing inputs; it begins again.

        Law: the algebraic Riccati equation (R. Kalman, *J. Basic Engineering* 82, 1960).

        Raises
        ------
        SimulationError
            No steady gain exists: something that drifts is not seen.
        """
        from scipy.linalg import solve_discrete_are

        self.reset(state)
        readings = np.diag(self._readings**2)
        try:
            transition, output, process = self._core.linearised(self.model.command(inputs))
            before = solve_discrete_are(transition.T, output.T, process, readings)
            spread = output @ before @ output.T + readings
            gain: Array = np.linalg.solve(spread, output @ before).astype(np.float64).T
            left = np.abs(np.linalg.eigvals(transition - transition @ gain @ output)).max()
            if not left < 1.0 - 1e-9:
                raise np.linalg.LinAlgError(f"errors die out by a factor of {left:.6g} in a sample")
        except (ValueError, np.linalg.LinAlgError) as error:
            raise SimulationError(
                f"{self.model.name}: no steady gain exists about the first state ({error}); measure what drifts, give "
                "noise to what nothing moves, or leave steady out"
            ) from error
        left_over: Array = (before - gain @ spread @ gain.T).astype(np.float64)
        return SteadyGain(gain, left_over, spread.astype(np.float64), transition, output)

    def keep(self, steady: SteadyGain) -> None:
        """Keep a gain of the online observer from now on, until another is kept."""
        self._core.hold_gain(steady.gain, steady.covariance, steady.spread)

    def __repr__(self) -> str:
        return f"Observer({self.model.name!r}, channels={', '.join(self.channels)})"
