"""The regression of a model file's machine: standard inertial parameters of its bodies, and what else is linear."""

from collections.abc import Mapping, Sequence

import numpy as np

from vpm.errors import IdentificationError, check_known
from vpm.experiment import Experiment, as_records
from vpm.identify.feasibility import fault
from vpm.identify.inertial_regression import InertialRegression
from vpm.identify.inverse_dynamics import InverseDynamicsProblem
from vpm.model import Model
from vpm.model.standard import OF_FILE, PLAIN, STANDARD, UNITS, of_file
from vpm.numbers import Array

#: Difference of efforts, relative to their size, below which they agree: rounding of long sums.
AGREE = 1e-8


def repaired(model: Model, values: Mapping[str, float]) -> Model:
    """A model with standard inertial parameters, and others, in place of its own.

    ``values``: as `inertial_regression` names them, all ten of a body.
    Raises `IdentificationError`: a name is none of the model's, or no body can have the values.
    """
    changed = dict(values)
    for body in model.bodies:
        ten = [f"{body}.{end}" for end in STANDARD]
        if not all(name in changed for name in ten):
            continue
        numbers = np.array([changed.pop(name) for name in ten])
        if wrong := fault(numbers):
            raise IdentificationError(
                f"{body}: no body has the values of this fit, {wrong}; fit with physical=True, or record more"
            )
        changed |= {f"{body}.{end}": float(x) for end, x in zip(OF_FILE, of_file(numbers), strict=True)}
    check_known(changed, model.parameters, IdentificationError, f"{model.name} has no parameter", "of this fit")
    return model.with_parameters(changed)


class InertialModel:
    """A model's effort as ``offset + regressor @ parameters``, exact to rounding.

    With the centre of mass in the origin, the derivatives by mass, centre and inertia are those by the standard
    parameters, since then ``d(m c) = m dc`` and ``d(origin inertia) = d(inertia)`` (C. Atkeson, C. An, J. Hollerbach,
    "Estimation of inertial parameters of manipulator loads and links", *Int. J. Robotics Research* 5, 1986). So the
    core is asked at bodies with their centres in their origins.

    ``others``: further parameters that are sought.
    """

    def __init__(self, model: Model, others: Sequence[str]) -> None:
        self.model = model
        self.bodies = model.standard_bodies
        self.others = tuple(others)
        own = {f"{body}.{end}" for body in self.bodies for end in OF_FILE}
        check_known(self.others, model.parameters, IdentificationError, f"{model.name} has no parameter")
        for name in self.others:
            if name in own:
                raise IdentificationError(
                    f"{name} belongs to a body, and all ten parameters of every body are sought anyway; name others"
                )
        self._places = [model.index(f"{body}.{end}") for body in self.bodies for end in OF_FILE]
        self._columns = [*self._places, *(model.index(name) for name in self.others)]
        self.names = (*model.standard_names, *self.others)
        self.units = (*UNITS * len(self.bodies), *(model.parameters[name].unit for name in self.others))
        self._plain = model.theta.copy()
        self._plain[self._places] = np.tile(PLAIN, len(self.bodies))

    @property
    def nominal(self) -> Array:
        """Standard parameters of the model file (p,)."""
        others = [self.model.index(name) for name in self.others]
        return np.concatenate([self.model.standard_parameters, self.model.theta[others]])

    def lacking(self, state: tuple[Array, Array, Array], inputs: Array, dt: float) -> tuple[Array, Array]:
        """Missing effort for the sought inertial parameters (N, n), and the regressor (N, n, p)."""
        core = self.model.core
        required, applied, table = core.inverse_dynamics(self._plain, *state, inputs, dt, self._columns)
        plain = np.tile(PLAIN, len(self.bodies))
        rest = self.model.theta[[self.model.index(name) for name in self.others]]
        return applied - required + table @ np.concatenate([plain, rest]), table

    def check(self, state: tuple[Array, Array, Array], inputs: Array, dt: float) -> None:
        """Refuse an inertial model whose effort is not linear in what is sought."""
        effort, table = self.lacking(state, inputs, dt)
        for name in (None, *self.others):
            theta, values = self.model.theta.copy(), self.nominal
            if name is not None:
                place = self.names.index(name)
                changed = 1.5 * values[place] or 1.0
                theta[self.model.index(name)], values[place] = changed, changed
            required, applied, _ = self.model.core.inverse_dynamics(theta, *state, inputs, dt, [])
            apart = np.abs(applied - required - (effort - table @ values)).max()
            size = np.abs(required).max() + np.abs(applied).max()
            if apart > AGREE * size:
                what = f"{name}" if name else "the bodies' parameters"
                raise IdentificationError(
                    f"the effort of {self.model.name} is not linear in {what}: it misses the linear law by {apart:.2g} "
                    f"of {size:.3g}; hold that parameter, or use vpm.identify, which needs no linear law",
                    parameters=() if name is None else (name,),
                )


def inertial_regression(
    model: Model,
    records: Experiment | Sequence[Experiment],
    *,
    others: Sequence[str] | None = None,
    cutoff: float | None = None,
) -> InertialRegression:
    """The regression of a model from its records: ten parameters for each body, and what else has an uncertainty.

    Motion and efforts pass the same filters as in an identification by inverse dynamics, and samples at which a joint
    stands still do not count, see `InverseDynamicsProblem`.

    Parameters
    ----------
    model : Model
        Rigid, with ideal actuators; its values are the nominal ones. Payloads, springs and rotors that it has are held.
    records : Experiment or sequence of Experiment
        Each with the position of every joint and the command of every actuator.
    others : sequence of str, optional
        Parameters beside those of bodies, such as ``shoulder.friction.viscous``; by default all with an uncertainty.
    cutoff : float, optional
        Hz, of the motion filter.
    """
    given = as_records(records)
    if not given:
        raise IdentificationError("no record was given; pass at least one")
    sought = [p.name for p in model.parameters.values() if p.adjustable and not _of_body(model, p.name)]
    linear = InertialModel(model, sought if others is None else others)
    balance = InverseDynamicsProblem(model, given, cutoff=cutoff)
    _check_motion(model, given)
    tables, efforts, count = [], [], len(model.joints)
    for at, m in enumerate(balance.motions):
        state = (m.position, m.velocity, m.acceleration)
        some = m.retained
        linear.check((m.position[some], m.velocity[some], m.acceleration[some]), m.inputs[some], m.dt)
        effort, table = linear.lacking(state, m.inputs, m.dt)
        blocks = balance.blocks[at * len(balance.blocks) // len(given) : (at + 1) * len(balance.blocks) // len(given)]
        driven = [model.joints.index(block.channel.rpartition(".")[0]) for block in blocks]
        counted = np.stack([block.moving for block in blocks], axis=1)
        # No equation stands at the ends, in which the filter settles: as zeros they would make the noise look smaller.
        equations = np.flatnonzero(counted.any(axis=1))
        inner = slice(equations[0], equations[-1] + 1)
        flat = m.parallel(table.reshape(len(m.time), -1))
        lines = flat.reshape(len(flat), count, -1)[:, driven] * counted[:, :, None]
        tables.append(lines[inner])
        efforts.append((m.parallel(effort)[:, driven] * counted)[inner])
    masses = tuple(f"{body}.mass" for body in linear.bodies)
    moments = tuple(name for name in linear.names if ".first_moment." in name)
    turning = tuple(name for name in linear.names if ".origin_inertia." in name)
    return InertialRegression.from_arrays(
        np.concatenate(tables),
        np.concatenate(efforts),
        linear.names,
        nominal=linear.nominal,
        units=linear.units,
        channels=tuple(block.channel for block in blocks),
        bodies={body: tuple(f"{body}.{end}" for end in STANDARD) for body in linear.bodies},
        positive=tuple(name for name in linear.others if _not_negative(model, name)),
        # As in the textbooks, masses and moments of outer links are regrouped with those of inner ones.
        prefer=(*linear.others, *turning, *moments, *masses),
        records=tuple(len(effort) for effort in efforts),
    )


def _of_body(model: Model, name: str) -> bool:
    return any(name == f"{body}.{end}" for body in model.bodies for end in OF_FILE)


def _not_negative(model: Model, name: str) -> bool:
    return model.parameters[name].minimum >= 0.0 and model.parameters[name].value > 0.0


def _check_motion(model: Model, records: Sequence[Experiment]) -> None:
    for joint in model.joints:
        channel = f"{joint}.position"
        unit = model.channel_unit(channel)
        if all(np.ptp(record[channel]) == 0.0 for record in records):
            raise IdentificationError(
                f"the joint {joint} never moves: {channel} is {records[0][channel][0]:.4g} {unit} "
                "in all samples; move it in at least one record, or describe it as fixed"
            )
