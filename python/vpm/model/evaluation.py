"""What a model answers about a single state: rest, vibrations, linear behaviour."""

from collections.abc import Iterator, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import CoreError, ModelError, near_match
from vpm.linear import LinearModel
from vpm.model.drives.states import follow, rest
from vpm.model.loops.closure import Loops
from vpm.model.loops.states import close, reduced, resting
from vpm.model.motions import Motions
from vpm.numbers import Array, array_of, number_of


class Evaluations(Motions):
    """The part of a model that asks the core about rest and about one state of a simulation."""

    @cached_property
    def loops(self) -> Loops:
        """Closed loops to evaluate: assemblies, independent coordinates, efforts, rest, singularities."""
        return Loops(self)

    # ---- rest --------------------------------------------------------------------------------------------------------

    def equilibrium(self, q: ArrayLike) -> tuple[Array, Array]:
        """Evaluate rest under gravity with the joints held: sag of flexible links, and holding efforts.

        Parameters
        ----------
        q : array_like, shape (joints,)
            Positions of the joints. With closed loops those of `Loops.independent` are held, the others follow.

        Returns
        -------
        coordinates : ndarray, shape (n,)
            ``q``, then the elastic coordinates.
        effort : ndarray, shape (joints,)
            N or N m; springs and loads of the joints are carried too, and springs of lines carry their part.

        Raises
        ------
        CoreError
            The length is wrong, or there is no rest: what the links carry buckles them.
        """
        if self.loops:
            return resting(self, q)
        return self.core.equilibrium(self.theta, q)

    def natural_frequencies(self, q: ArrayLike) -> Array:
        """Evaluate frequencies of free vibration about rest with the joints locked, without damping.

        Parameters
        ----------
        q : array_like, shape (joints,)
            Positions of the joints.

        Returns
        -------
        ndarray, shape (elastic coordinates,)
            Hz, slowest first; a negative one is the rate of growth of a link that buckles.

        Raises
        ------
        CoreError
            As `equilibrium`.
        ModelError
            The machine has closed loops.
        """
        if self.loops:
            raise ModelError(
                f"{self.name} has closed loops, which joints that are locked do not leave free; ask linearize for its "
                "frequencies"
            )
        return self.core.natural_frequencies(self.theta, q)

    @property
    def slope_limits(self) -> Array:
        """Evaluate the slope (rad) of each flexible link up to which its kinematics are right within 1 %.

        To first order a link under a force across its tip does not get shorter by 0.4 times its slope, measured in
        its deflection: ``int v'^2 / 2`` over ``v`` of ``v' = slope (1 - (1 - z/L)^2)``.
        """
        linear = self.first_order_beams
        return np.array([0.01 / 0.4 if name in linear else self.core.slope_limit for name in self.beams])

    @property
    def beam_summary(self) -> tuple[str, ...]:
        """Flexible links in sentences: levels, coordinates, frequencies and sag, evaluated with joints at zero.

        Where loops are closed joints cannot be locked there, and the last two are left out.
        """
        sentences = []
        for beam in self.beams:
            own = [name for name in self.coordinates if name.startswith(f"{beam}.")]
            shapes = ", ".join(dict.fromkeys(name.split(".")[-2] for name in own)) or "none"
            sentences.append(f"beam {beam}: level {self.levels[beam]}, {len(own)} elastic coordinates ({shapes})")
        if self.core.n_elastic and not self.loops:
            sentences += self._locked_summary()
        return tuple(sentences)

    def _locked_summary(self) -> Iterator[str]:
        rest = np.zeros(len(self.joints))
        try:
            coordinates, _ = self.equilibrium(rest)
            frequencies = self.natural_frequencies(rest)
        except CoreError as error:
            yield f"warning: no rest with all joints at zero: {error}"
            return
        more = ", ..." if frequencies.size > 4 else ""
        yield (
            "natural frequencies with all joints locked at zero: "
            + ", ".join(f"{f:.4g}" for f in frequencies[:4])
            + (f"{more} Hz")
        )
        if frequencies[0] < 0.0:
            yield "warning: a link buckles under its load there; make it stiffer, or lighter what it carries"
        states = np.zeros((1, self.core.n_states))
        states[0, : coordinates.size] = coordinates
        slopes = self.core.slopes(self.theta, states)[0]
        for beam, slope, limit in zip(self.beams, slopes, self.slope_limits, strict=True):
            if slope > limit:
                first = beam in self.first_order_beams
                what = "a deflection to first order" if first else f"its level {self.levels[beam]}"
                exact = "cut it into several links" if "reduced" in self.levels[beam] else 'use level = "bezier(4)"'
                repair = "remove second_order = false" if first else exact
                yield (
                    f"warning: {beam} sags by {slope:.3g} rad at rest, but {what} is right within 1 % up to "
                    f"{limit:.3g} rad only; {repair}"
                )

    # ---- linear models -----------------------------------------------------------------------------------------------

    def state(self, values: Mapping[str, float] | ArrayLike | None = None) -> Array:
        """Evaluate the state of a simulation from names.

        Parameters
        ----------
        values : mapping of str to float, or array_like of shape (nx,), optional
            By name as in ``model.state_names``, ``{"axis.position": 0.1}``; what is not named is zero, or closes the
            loops with what is named, and drives
            and supplies of which nothing is named are as after a long rest without commands at these positions.

        Returns
        -------
        ndarray, shape (nx,)

        Raises
        ------
        ModelError
            A name is unknown, or the array has another length.
        """
        filled = self._filled(values, self.state_names, "state")
        if values is None or isinstance(values, Mapping):
            if self.loops:
                close(self, filled, values or {})
            self._keep_named(filled, rest(self, self.theta, filled[: len(self.coordinates)]), values or {})
        return filled

    def _keep_named(self, state: Array, internal: Array, named: Mapping[str, float]) -> None:
        """Put in what drives and supplies hold for an evaluation, but for what is named."""
        for place, name in enumerate(self.internal_names):
            if name not in named:
                state[2 * len(self.coordinates) + place] = internal[place]

    @property
    def state_units(self) -> tuple[str, ...]:
        """SI units of the states to evaluate at, in the order of ``state_names``."""
        return tuple(self._state_units())

    def command(self, values: Mapping[str, float] | ArrayLike | None = None) -> Array:
        """Evaluate commands from names, ``{"drive": 1.0}``, and supply pressures, ``{"pump.pressure": 1.6e7}``.

        A command that is not named is zero, a pressure the nominal one of its supply.

        Parameters
        ----------
        values : mapping of str to float, or array_like of shape (nu,), optional

        Returns
        -------
        ndarray, shape (nu,)

        Raises
        ------
        ModelError
            A name is unknown, or the array has another length.
        """
        if isinstance(values, Mapping):
            values = {name.removesuffix(".command"): value for name, value in values.items()}
        filled = self._filled(values, self.inputs, "actuator")
        for place, name in enumerate(self.inputs):
            if name in self.parameters and (values is None or (isinstance(values, Mapping) and name not in values)):
                filled[place] = self.parameters[name].value
        return filled

    def linearize(
        self,
        state: Mapping[str, float] | ArrayLike | None = None,
        inputs: Mapping[str, float] | ArrayLike | None = None,
    ) -> LinearModel:
        """Evaluate the linear model of small deviations from a state, by exact derivatives.

        Of a machine with closed loops its states are positions and velocities of independent coordinates.

        Parameters
        ----------
        state : mapping of str to float, or array_like of shape (nx,), optional
            As in `state`; by default all joints are at zero and at rest. Flexible links of which no coordinate is named
            rest under gravity; lags, spools and currents that are not named have settled on their commands, chambers
            have no net force.
        inputs : mapping of str to float, or array_like of shape (nu,), optional
            As in `command`; the commands that stand.

        Raises
        ------
        ModelError
            A name or a length is wrong.
        CoreError
            A derivative is not finite there, or an actuator acts at samples of its own.
        """
        command = self.command(inputs)
        place = self._settled(state, command)
        A, B, C, D = self.core.linearize(self.theta, place, command)
        names, units = self.state_names, tuple(self._state_units())
        if self.loops:
            kept, (A, B, C) = reduced(self, place, (A, B, C))
            names, units, place = tuple(names[k] for k in kept), tuple(units[k] for k in kept), place[kept]
        return LinearModel(
            self.name,
            A,
            B,
            C,
            D,
            names,
            self.input_channels,
            self.output_channels,
            units,
            tuple(self.channel_unit(name) for name in self.input_channels),
            tuple(self.channel_unit(name) for name in self.output_channels),
            place,
            command,
            {name: float(p.value) for name, p in self.parameters.items() if name.endswith(".delay.time")},
        )

    def _settled(self, values: Mapping[str, float] | ArrayLike | None, command: Array) -> Array:
        """State for an evaluation in which unnamed flexible links rest and unnamed drives follow their command."""
        place = self.state(values)
        if values is None or isinstance(values, Mapping):
            named = values or {}
            joints, coordinates = len(self.joints), len(self.coordinates)
            if coordinates > joints and not any(name in named for name in self.state_names[joints:coordinates]):
                place[:coordinates] = self.equilibrium(place[:joints])[0]
            internal = rest(self, self.theta, place[:coordinates])
            follow(self, self.theta, internal, command, place[coordinates : coordinates + joints])
            self._keep_named(place, internal, named)
        return place

    def _state_units(self) -> Iterator[str]:
        for rate in ("", "/s"):
            for name in self.coordinates:
                unit = self.channel_unit(f"{name}.position") if name in self.joints else "1"
                yield unit + rate if unit != "1" else "1" + rate
        yield from map(self.internal_unit, self.internal_names)

    def _filled(self, values: Mapping[str, float] | ArrayLike | None, names: tuple[str, ...], what: str) -> Array:
        filled = np.zeros(len(names))
        if isinstance(values, Mapping):
            for name, value in values.items():
                if name not in names:
                    repair = near_match(name, names, what="it has")
                    raise ModelError(f'{self.name} has no {what} "{name}"; {repair}', where=name)
                filled[names.index(name)] = number_of(value, f"{self.name}: {name}", ModelError)
        elif values is not None:
            given = array_of(values, f"{self.name}: {what}", ModelError)
            if given.shape != filled.shape and not (given.ndim == 0 and filled.size == 1):
                listed = ", ".join(names) or "none"
                raise ModelError(
                    f"{self.name} has {filled.size} entries of {what} ({listed}), but an array of shape {given.shape} "
                    "was given; give one number for each, or names with numbers"
                )
            filled[:] = given
        return filled
