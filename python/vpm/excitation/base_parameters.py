"""What can be identified at all: the parameters that a regressor determines, and which others hang on them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vpm.errors import ExcitationError, check_known
from vpm.identify.identifiability import find_base
from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Storable
from vpm.simulate import check_balance

#: Random states at which a regressor shows its rank.
STATES = 400


@dataclass(frozen=True, repr=False, eq=False)
class BaseParameters(Storable):
    """Parameters that motions can determine, and what each of them stands for.

    Attributes
    ----------
    names : tuple of str
        One for each column that is independent of the others.
    combinations : tuple of str
        What is seen in place of each: the parameter alone, or a sum with parameters that hang on it, in SI units.
    unseen : tuple of str
        Parameters that no motion shows.
    """

    names: tuple[str, ...]
    combinations: tuple[str, ...]
    unseen: tuple[str, ...]


def regressor(model: Model, position: Array, velocity: Array, acceleration: Array, names: Sequence[str]) -> Array:
    """Derivative of the effort that a motion needs by parameters, exact to rounding.

    - ``position``, ``velocity``, ``acceleration``: shape (N, n)
    - ``names``: k dotted names

    Result: shape (N, n, k).
    """
    inputs = np.zeros((len(position), len(model.inputs)))
    columns = [model.index(name) for name in names]
    return model.core.inverse_dynamics(model.theta, position, velocity, acceleration, inputs, 1.0, columns)[2]


def parameter_scales(model: Model, names: Sequence[str]) -> Array:
    """Size of a change of each parameter that matters: its uncertainty, or its value where that is not finite, or 1."""
    scales = []
    for name in names:
        parameter = model.parameters[name]
        spread = parameter.uncertainty
        known = spread is not None and np.isfinite(spread)
        scales.append(float(spread or 0.0) if known else abs(parameter.value) or 1.0)
    return np.array(scales)


def free_names(model: Model, free: Sequence[str] | None) -> tuple[str, ...]:
    """Named parameters, or those with an uncertainty; refuses unknown names and models without inverse dynamics."""
    check_balance(model)
    names = tuple(free) if free is not None else model.adjustable
    check_known(names, model.parameters, ExcitationError, f"{model.name} has no parameter")
    if not names:
        raise ExcitationError(
            f"{model.name}: no parameter is free; give some an uncertainty in the model file or name them in free="
        )
    return names


def base_parameters(model: Model, free: Sequence[str] | None = None, *, seed: int = 0) -> BaseParameters:
    """Parameters that the inverse dynamics of a model can determine from motion and effort.

    A QR factorisation with column pivoting of the regressor at random states reveals its rank (M. Gautier, "Numerical
    calculation of the base inertial parameters of robots", *J. Robotic Systems* 8, 1991; G. Golub and C. Van Loan,
    *Matrix Computations*, 4th ed., 5.4).

    Parameters
    ----------
    model : Model
        Its rank is that at its present values, where the effort is not linear in a parameter.
    free : sequence of str, optional
        By default every parameter with an uncertainty.
    seed : int
        Of the random states, positions within 2 rad or m, velocities within 5 and accelerations within 20 per second
        and per second squared.

    Raises
    ------
    ExcitationError
        Nothing is free, or a name is unknown.
    SimulationError
        The model has elastic coordinates or actuators that are not ideal.
    """
    names = free_names(model, free)
    rng = np.random.default_rng(seed)
    shape = (STATES, len(model.joints))
    position, velocity, acceleration = (rng.uniform(-limit, limit, shape) for limit in (2.0, 5.0, 20.0))
    columns = regressor(model, position, velocity, acceleration, names).reshape(-1, len(names))
    base = find_base(columns)
    if not base.kept:
        raise ExcitationError(f"{model.name}: no motion shows any of {', '.join(names)}; free other parameters")
    kept = tuple(names[place] for place in base.kept)
    return BaseParameters(kept, base.words(names), tuple(names[place] for place in base.unseen))
