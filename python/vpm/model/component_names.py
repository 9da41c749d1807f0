"""What a model is made of, by name: components, coordinates, states, channels."""

from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType

from vpm.catalogue import JointKind
from vpm.errors import ModelError
from vpm.model.channels import ChannelEntry
from vpm.model.checked_document import Checked
from vpm.model.drives.answers import DriveComponents
from vpm.model.loops.loop import Loop
from vpm.model.sensor import stated_noise
from vpm.model.splitting import name_behind

#: Drives whose effort follows from the command alone.
DIRECT = frozenset({"ideal", "narx", "maxwell_narx"})


class Components(DriveComponents):
    """The part of a model that answers by name; it relies on the checked document and changes nothing."""

    _checked: Checked

    @property
    def name(self) -> str:
        """Name of the machine."""
        return self._checked.document.name

    # ---- components --------------------------------------------------------------------------------------------------

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of joints with one coordinate each; joint k is coordinate k.

        A joint of the file with several coordinates stands here with each of them, ``wrist_x``, ``wrist_y``,
        ``wrist_z``; a fixed one does not.
        """
        return self._checked.structure.joints

    @property
    def added_joints(self) -> tuple[str, ...]:
        """Names of joints that effects split off, ``axis_deflection``: neither driven nor measured."""
        return self._checked.structure.added

    @property
    def deflections(self) -> tuple[str, ...]:
        """Names of channels that a log may hold and this model takes for zero, such as ``arm_bending.position``."""
        return tuple(self._checked.structure.deflections)

    def joint_behind(self, joint: str) -> str | None:
        """Name of the joint that carries the link where an effect has split ``joint``; None where it is whole."""
        name = name_behind(joint)
        return name if name in self.added_joints else None

    def joint_before(self, site: str) -> str:
        """Name of the joint with one coordinate that moves a body or a beam, or a joint itself.

        Raises
        ------
        ModelError
            There is no such component, or nothing moves it.
        """
        structure = self._checked.structure
        if site in structure.joints:
            return site
        joint = structure.joint_at("body", site) if site in structure.frames else None
        if joint is None:
            raise ModelError(f'{self.name} has no joint that moves "{site}"; name a joint, or what hangs on one')
        return joint

    @property
    def bodies(self) -> tuple[str, ...]:
        """Bodies of a model by name, parents before children."""
        return self._checked.structure.bodies

    @property
    def beams(self) -> tuple[str, ...]:
        """Flexible links of a model by name, parents before children."""
        return self._checked.structure.beams

    @property
    def lines(self) -> tuple[str, ...]:
        """Lines between two points of a model, by name."""
        return tuple(self._checked.document.lines)

    @property
    def transmissions(self) -> tuple[str, ...]:
        """Names of transmissions, shafts that turn with a combination of joints."""
        return tuple(self._checked.document.transmissions)

    def ratios(self, transmission: str) -> Mapping[str, str]:
        """Names of the ratio parameters with which a transmission turns, by joint.

        Raises
        ------
        ModelError
            There is no such transmission.
        """
        entry = self._checked.document.transmissions[self._known(transmission, self.transmissions, "transmission")]
        return {joint: f"{transmission}.ratios.{joint}" for joint in entry.ratios}

    @property
    def gauges(self) -> tuple[str, ...]:
        """Strain gauges of a model, by name."""
        return tuple(self._checked.document.gauges)

    @property
    def markers(self) -> tuple[str, ...]:
        """Frames to watch of a model, by name."""
        return tuple(self._checked.document.markers)

    @property
    def imus(self) -> tuple[str, ...]:
        """Inertial measurement units of a model, by name."""
        return tuple(self._checked.document.imus)

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of all coordinates: `joints`, then those of each beam, ``upper.bending_x.0``."""
        return self._checked.structure.coordinates

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states: position and velocity of coordinates, then states of drives and supplies.

        Per actuator its lag, then of a motor ``current``, of a Maxwell element ``stretch``, of a cylinder ``spool``,
        ``spool_rate``, ``chamber_a`` and ``chamber_b``; then the pressure of supplies that sag,
        then the ``memory`` of each joint with hysteresis.
        """
        positions = [f"{name}.position" for name in self.coordinates]
        velocities = [f"{name}.velocity" for name in self.coordinates]
        return (*positions, *velocities, *self.internal_names)

    @cached_property
    def levels(self) -> Mapping[str, str]:
        """Levels of detail by beam name, as `at` takes them; a rigid beam that an effect bends has a bending level."""
        beams = self._checked.structure.document.beams
        return MappingProxyType({name: str(beams[name].detail) for name in self.beams})

    @cached_property
    def is_linearly_stiff(self) -> bool:
        """Whether it has flexible links, and nothing beside them that is stiff in ways of its own.

        Stiff in ways of their own are contacts, bushings, loops, ends of ways, backlash, and drives that rub or are
        other than ideal and sampled ones.
        """
        document = self._checked.document
        hits = any(effect.traits.impacts for effect in document.effects)
        elastic = any(level != "rigid" for level in self.levels.values())
        direct = all(
            entry.type in DIRECT and not entry.rubs(name, document) for name, entry in document.actuators.items()
        )
        free = not document.contacts and not document.bushings and not document.loops
        return elastic and direct and free and not hits

    @property
    def first_order_beams(self) -> frozenset[str]:
        """Names of beams whose deflection is linear in their coordinates."""
        beams = self._checked.document.beams.items()
        return frozenset(name for name, beam in beams if not beam.second_order)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Sensors of a model, by name."""
        return tuple(self._checked.document.sensors)

    @property
    def controllers(self) -> tuple[str, ...]:
        """Controllers of a model, by name."""
        return tuple(self._checked.document.controllers)

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of contacts of points with planes."""
        return tuple(self._checked.document.contacts)

    @property
    def bushings(self) -> tuple[str, ...]:
        """Names of bushings, elastic connections of two frames."""
        return tuple(self._checked.document.bushings)

    @property
    def loop_entries(self) -> Mapping[str, Loop]:
        """Closed loops by name, as the model file has them."""
        return self._checked.document.loops

    @property
    def load_cells(self) -> tuple[str, ...]:
        """Names of load cells, readings of reaction wrenches at joints."""
        return tuple(self._checked.document.load_cells)

    def joint_kind(self, joint: str) -> JointKind:
        """Kind of a joint by its name: "prismatic", "revolute" or "helical"."""
        return self._checked.structure.joint_kind(self._known(joint, self.joints, "joint"))

    def joint_of_actuator(self, actuator: str) -> str:
        """Name of the joint that an actuator drives.

        Raises
        ------
        ModelError
            There is no such actuator, or it drives a line or a transmission.
        """
        entry = self._checked.document.actuators[self._known(actuator, self.actuators, "actuator")]
        if entry.joint is None:
            rest = f"drives {entry.acted_on}, which moves several joints; ask joints_of_actuator"
            raise ModelError(f"actuator {actuator} {rest}", where=actuator)
        return entry.joint

    def joint_of_body(self, body: str) -> str:
        """Name of the joint that carries a body; "" if no joint does."""
        return next((name for name, joint in self._checked.document.joints.items() if joint.child == body), "")

    def line_of_actuator(self, actuator: str) -> str | None:
        """Name of the line that an actuator drives; None if it drives a joint or a transmission."""
        return self._checked.document.actuators[self._known(actuator, self.actuators, "actuator")].line

    def transmission_of_actuator(self, actuator: str) -> str | None:
        """Name of the transmission that an actuator drives; None for a joint or a line."""
        return self._checked.document.actuators[self._known(actuator, self.actuators, "actuator")].transmission

    def held_channel(self, actuator: str) -> str:
        """Name of the channel that an actuator's controller holds at its reference.

        Raises
        ------
        ModelError
            There is no such actuator, or no controller commands it.
        """
        name = self._known(actuator, self.controlled_actuators, "actuator with a controller")
        return self.held_channels[name]

    @cached_property
    def controlled_actuators(self) -> tuple[str, ...]:
        """Names of actuators that a controller commands, in the order of `actuators`."""
        return tuple(name for name in self.actuators if name in self.held_channels)

    @property
    def held_channels(self) -> Mapping[str, str]:
        """Names of the held channels of all actuators with a controller."""
        return dict(pair for controller in self._checked.document.controllers.values() for pair in controller.pairs)

    # ---- channels ----------------------------------------------------------------------------------------------------

    @cached_property
    def channel_table(self) -> Mapping[str, ChannelEntry]:
        """Names of log columns by channel and ``"time"``; empty if the model does not say."""
        return MappingProxyType(dict(self._checked.document.channels or {}))

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Names of all channels that a log may hold."""
        return self._checked.structure.channels

    @cached_property
    def output_channels(self) -> tuple[str, ...]:
        """Names of the channels that a simulation gives, in the order of the core.

        Per joint position, velocity, acceleration, effort; per actuator command, force; per line length, rate, tension;
        per transmission position, velocity, effort; per gauge strain; per marker its origin x, y, z and its rotation
        vector rx, ry, rz in the world; per hydraulic actuator spool, pressure_a, pressure_b, flow_a, flow_b; per motor
        current; per supply pressure, flow; per contact depth, normal_force and the force fx, fy, fz in world axes; per
        bushing the wrench mx, my, mz, fx, fy, fz on A in its axes; per load cell the reaction mx, my, mz, fx, fy, fz on
        the child in its axes; per spherical or free joint the unit quaternion qw, qx, qy, qz of the child in the frame
        of the joint, and its angular velocity wx, wy, wz in its own axes; per closed loop the wrench mx, my, mz, fx,
        fy, fz on the body of A in the axes of A.
        """
        return self._checked.structure.outputs

    def channel_unit(self, channel: str) -> str:
        """SI unit of a channel by its name.

        Raises
        ------
        ModelError
            There is no such channel; the message names near ones.
        """
        return self._checked.structure.unit(channel)

    @cached_property
    def sensor_noise(self) -> dict[str, float]:
        """Sensor noise by channel name: standard deviation (SI) from noise and rounding in the model file."""
        return stated_noise(self._checked.document, self._checked.structure)

    def sensor_of(self, channel: str) -> str | None:
        """Name of the sensor that reads a channel, if there is one."""
        for name, sensor in self._checked.document.sensors.items():
            if sensor.measures == channel:
                return name
        return None
