"""Environments for gymnasium: one machine, or many copies that the core steps in one call."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vpm.errors import SimulationError, check_known, needs
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import AUTOMATIC
from vpm.stepping import Simulation

with needs("gymnasium", "gym"):
    import gymnasium
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space

#: Rewards (E,) of actions (E, nu) that led to observations (E, m).
Reward = Callable[[Array, Array], Array]


class VectorEnvironment(VectorEnv[Array, Array, Any]):
    """Copies of a machine; a step holds one command per actuator and copy, and the core takes it for all at once.

    A copy that left the bounds of an observed channel, or that the core cannot carry on, is terminated; after
    ``duration`` it is truncated. Either begins anew with the next step, as ``AutoresetMode.NEXT_STEP`` has it.

    Parameters
    ----------
    commands : mapping of str to (float, float)
        Least and largest command of each actuator, in command units. Springs of lines and logged supplies need none:
        those that are not named keep their lengths and pressures, and are no actions.
    reward : callable
        Takes observations (E, m) and the actions (E, nu) that led there, gives rewards (E,).
    time_step : float
        Time between samples of the simulation, s.
    samples : int
        Samples for which an action is held.
    duration : float
        Length of an episode, s.
    bounds : mapping of str to (float, float)
        Of observed channels; those that are not named have none.
    channels : sequence of str, optional
        What is observed; by default positions and velocities of all joints.
    spread : mapping of str to float
        By how much states are off the initial one at most where an episode begins, at random. Of a machine with
        closed loops what `state` and this name closes them.
    state : mapping of str to float, optional
        The initial state, as ``model.state`` takes it.
    integrator, compiled
        As `vpm.Simulation`.

    Raises
    ------
    SimulationError
        A name or a number is wrong.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        model: Model,
        copies: int,
        *,
        commands: Mapping[str, tuple[float, float]],
        reward: Reward,
        time_step: float,
        samples: int = 1,
        duration: float = 10.0,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        channels: Sequence[str] | None = None,
        spread: Mapping[str, float] | None = None,
        state: Mapping[str, float] | None = None,
        integrator: str = AUTOMATIC,
        compiled: bool = False,
    ) -> None:
        if copies < 1 or samples < 1 or not duration > 0.0:
            raise SimulationError(
                f"copies, samples and duration have to be positive, got {copies}, {samples} and {duration}; correct it"
            )
        joints = [f"{joint}.{end}" for joint in model.joints for end in ("position", "velocity")]
        self.model, self.channels = model, tuple(joints if channels is None else channels)
        check_known(self.channels, model.output_channels, SimulationError, "channels:", "is not there")
        check_known(bounds or {}, self.channels, SimulationError, "bounds:", "is not there")
        check_known(spread or {}, model.state_names, SimulationError, "spread:", "is not there")
        self._driven = _driven(model, commands)
        limits = np.array([(bounds or {}).get(name, (-np.inf, np.inf)) for name in self.channels])
        named = [model.inputs[place] for place in self._driven]
        ranges = np.array([commands[name] for name in named], dtype=np.float64).reshape(-1, 2)
        for name, (low, high) in zip((*self.channels, *named), (*limits, *ranges), strict=True):
            if not low < high:
                raise SimulationError(f"{name} has no range from {low:g} to {high:g}; put the lesser one first")
        self._bounds, self._ranges = limits, ranges
        self.num_envs = copies
        # What leaves the bounds is still shown, once.
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (len(self.channels),), np.float64)
        self.single_action_space = gymnasium.spaces.Box(ranges[:, 0], ranges[:, 1], dtype=np.float64)
        self.observation_space = batch_space(self.single_observation_space, copies)
        self.action_space = batch_space(self.single_action_space, copies)
        self._reward, self._samples = reward, samples
        self._steps = max(1, round(duration / (time_step * samples)))
        self._start, self._standing = model.state(state), model.command()
        self._spread = np.array([(spread or {}).get(name, 0.0) for name in model.state_names])
        self._named = [name for name in model.state_names if name in {**(state or {}), **(spread or {})}]
        self._columns = [model.output_channels.index(name) for name in self.channels]
        own = [
            Simulation(model, time_step, integrator=integrator, state=self._start, compiled=compiled)
            for _ in range(copies)
        ]
        self._cores = [simulation.core for simulation in own]
        self._random = [np.random.default_rng() for _ in range(copies)]
        self._count, self._over = np.zeros(copies, dtype=np.int64), np.zeros(copies, dtype=bool)
        self._seen = np.zeros((copies, len(self.channels)))

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Reset the gymnasium environments; copy k takes the seed ``seed + k``, or its own of a list."""
        del options
        if seed is not None:
            seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else seed
            self._random = [np.random.default_rng(one) for one in seeds]
        for number in range(self.num_envs):
            self._begin(number)
        return self._seen.copy(), {}

    def step(self, actions: Array) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Step the gymnasium environments: hold actions (E, nu), clipped to their ranges."""
        from vpm._core import step_all

        low, high = self._ranges.T
        held = np.clip(np.asarray(actions, dtype=np.float64).reshape(self.num_envs, -1), low, high)
        commands = np.tile(self._standing, (self.num_envs, 1))
        commands[:, self._driven] = held
        going, fresh = np.flatnonzero(~self._over), np.flatnonzero(self._over)
        lost = np.zeros(self.num_envs, dtype=bool)
        if going.size:
            outputs, failures = step_all([self._cores[k] for k in going], commands[going], self._samples)
            self._seen[going] = outputs[:, self._columns]
            lost[going] = [failure is not None for failure in failures]
        self._count += 1
        rewards = np.asarray(self._reward(self._seen.copy(), held), dtype=np.float64).reshape(self.num_envs).copy()
        for number in fresh:
            self._begin(int(number))
        rewards[fresh] = 0.0
        out = ((self._seen < self._bounds[:, 0]) | (self._seen > self._bounds[:, 1])).any(axis=1)
        terminated = lost | (out & ~self._over)
        truncated = (self._count >= self._steps) & ~terminated
        self._over = terminated | truncated
        return self._seen.copy(), rewards, terminated, truncated, {}

    def _begin(self, number: int) -> None:
        state = self._start + self._spread * self._random[number].uniform(-1.0, 1.0, self._start.size)
        if self.model.loops:
            state = self.model.state({name: state[self.model.state_names.index(name)] for name in self._named})
        self._cores[number].reset(state)
        self._seen[number] = self._cores[number].outputs[self._columns]
        self._count[number], self._over[number] = 0, False


def _driven(model: Model, commands: Mapping[str, object]) -> list[int]:
    """Places of the inputs that actions of an environment command."""
    check_known(commands, model.inputs, SimulationError, "commands:", "is not there")
    needed = [name for name in model.actuators if f"{name}.command" not in model.optional_inputs]
    for name in needed:
        if name not in commands:
            raise SimulationError(f'commands lack "{name}"; give a range to each of {", ".join(needed)}')
    return [place for place, name in enumerate(model.inputs) if name in commands]


class Environment(gymnasium.Env[Array, Array]):
    """One machine; the same as a `VectorEnvironment` of one copy, to the last bit.

    Parameters
    ----------
    **settings
        As `VectorEnvironment` takes them.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(self, model: Model, **settings: Any) -> None:  # noqa: ANN401
        self.render_mode = None
        self._one = VectorEnvironment(model, 1, **settings)
        self.observation_space = self._one.single_observation_space
        self.action_space = self._one.single_action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Reset the gymnasium environment, from this seed on where one is given."""
        super().reset(seed=seed)
        seen, told = self._one.reset(seed=seed, options=options)
        return seen[0], told

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Step the gymnasium environment: hold an action (nu,) over the samples of a step."""
        seen, rewards, terminated, truncated, told = self._one.step(np.asarray(action)[None])
        return seen[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), told
