"""Drives and supplies of a model file: what reaches the core, what is refused, what a model answers about them."""

import math

import pytest

from drive_texts import MOTOR, RIG, SPRUNG
from model_texts import changed, described, refused
from vpm.errors import ModelError
from vpm.model import Model

LEG_CYLINDER = """
[supplies.pump]
pressure = 16e6
tank_pressure = 1e5
oil = { bulk_modulus = 1.2e9, air = { fraction = 0.005 } }

[actuators.thruster]
type = "hydraulic"
line = "knee_strut"
supply = "pump"
retracted_length = 0.35
command_unit = "%"
valve = { flow_gain = 1e-8, frequency = 1500.0, stroke = 1.0, overlap = 0.02 }
cylinder = { area = 2e-4, area_ratio = 0.6, stroke = 0.1, line_a = 3e-6, line_b = 2e-6, external_leakage = 1e-14 }
friction = { viscous = 30.0, stribeck = 4.0 }
"""


def test_a_servo_cylinder_reaches_the_core_as_it_is_written() -> None:
    told = described(changed(RIG))
    theta = dict(zip(told["parameter_names"], told["parameters"], strict=True))
    names = told["parameter_names"]
    supply, actuator = told["supplies"][0], told["actuators"][0]
    assert (supply["name"], supply["source"], supply["oil"]["air"]) == ("pump", "constant", None)
    assert names[supply["oil"]["bulk_modulus"]] == "pump.oil.bulk_modulus"
    assert theta["pump.pressure"] == 16e6
    assert theta["pump.oil.vapour_pressure"] == 2000.0
    drive = actuator["drive"]
    assert (actuator["on"], drive["type"], drive["supply"]) == ({"joint": 0}, "hydraulic", 0)
    assert names[drive["retracted_length"]] == "servo.retracted_length"
    assert {key: names[place] for key, place in drive["cylinder"]["size"].items()} == {
        "bore": "servo.cylinder.bore",
        "rod": "servo.cylinder.rod",
    }
    assert names[drive["cylinder"]["stop"]["damping"]] == "servo.cylinder.stop_damping"
    assert drive["cylinder"]["seal"] == {"viscous": None, "coulomb": None, "stribeck": None, "pressed": None}
    assert theta["servo.valve.frequency"] == pytest.approx(2 * math.pi * 250.0)
    assert theta["servo.cylinder.stop_stiffness"] == 5e8


def test_a_data_sheet_gives_the_gain_of_a_valve() -> None:
    model = changed(RIG)
    gain = model.parameters["servo.valve.flow_gain"]
    assert gain.value == pytest.approx(7.5e-3 / 60.0 / (10e-3 * math.sqrt(35e5)), rel=1e-14)
    assert gain.value == pytest.approx(6.681531048e-06, rel=1e-9)  # hyd.Kv of the reference values
    assert gain.unit == "m^3/(s A Pa^0.5)"
    assert gain.uncertainty == pytest.approx(0.1 * gain.value)
    again = model.with_parameters({"servo.valve.flow_gain": 5e-6})
    assert again.parameters["servo.valve.flow_gain"].value == 5e-6
    assert "rated" not in again.to_toml()
    given = changed(
        RIG,
        ('rated_flow = { value = 7.5, unit = "l/min", uncertainty = 0.75 }', f"flow_gain = {gain.value!r}"),
        ('rated_drop = { value = 35.0, unit = "bar" } ', ""),
        ('rated_current = { value = 10.0, unit = "mA" }', ""),
    )
    assert given.description() == model.description()


def test_a_cylinder_on_a_line_by_areas_with_friction() -> None:
    model = Model.from_toml(SPRUNG + LEG_CYLINDER)
    drive = described(model)["actuators"][2]["drive"]
    names = model.parameter_names
    assert names[drive["cylinder"]["size"]["area_ratio"]] == "thruster.cylinder.area_ratio"
    seal = drive["cylinder"]["seal"]
    assert seal["coulomb"] is None
    assert names[seal["viscous"]["viscous"]] == "thruster.friction.viscous"
    assert names[seal["stribeck"]["transition_velocity"]] == "thruster.friction.transition_velocity"
    assert names[described(model)["supplies"][0]["oil"]["air"]["exponent"]] == "pump.oil.air.exponent"
    assert model.parameters["thruster.valve.flow_gain"].unit == "m^3/(s Pa^0.5)"
    assert model.parameters["thruster.valve.overlap"].value == 0.02
    assert model.channel_unit("thruster.spool") == "1"
    assert model.joints_of_actuator("thruster") == ("knee",)
    assert model.joints_of_actuator("hip_drive") == ("hip",)
    assert (model.supply_of_actuator("thruster"), model.supply_of_actuator("hip_drive")) == ("pump", None)


def test_a_velocity_that_shapes_no_friction_is_no_parameter() -> None:
    text = SPRUNG + LEG_CYLINDER.replace("viscous = 30.0, stribeck = 4.0", "viscous = 30.0")
    names = Model.from_toml(text).parameter_names
    assert [name for name in names if name.startswith("thruster.friction")] == ["thruster.friction.viscous"]


def test_a_motor_and_springs() -> None:
    motor = changed(MOTOR)
    drive = described(motor)["actuators"][0]["drive"]
    assert drive["back_emf"] == drive["torque_constant"] == motor.index("motor.torque_constant")
    assert drive["rotor_inertia"] is None
    assert motor.parameters["motor.efficiency"].value == 1.0
    assert motor.channel_unit("motor.command") == "V"
    own = changed(MOTOR, ("gear_ratio = 20.0", "gear_ratio = 20.0\nback_emf = 0.06\nrotor_inertia = 1e-5"))
    assert described(own)["actuators"][0]["drive"]["back_emf"] == own.index("motor.back_emf")
    assert own.parameters["motor.rotor_inertia"].unit == "kg m^2"
    sprung = changed(SPRUNG)
    laws = [actuator["drive"] for actuator in described(sprung)["actuators"]]
    assert [law["type"] for law in laws] == ["spring_damper", "maxwell"]
    assert sprung.parameter_names[laws[1]["relaxation_time"]] == "knee_drive.relaxation_time"
    assert sprung.channel_unit("hip_drive.command") == "m"


def test_an_actuator_without_a_type_is_ideal_and_may_have_a_limit() -> None:
    text = MOTOR[: MOTOR.index("[actuators")] + '[actuators.motor]\njoint = "axis"\ngain = 2.0\n'
    plain, typed = Model.from_toml(text), Model.from_toml(text + 'type = "ideal"\n')
    assert plain == typed
    assert "type" not in plain.to_toml().partition("[actuators.motor]")[2]
    assert described(plain)["actuators"][0]["drive"] == {"type": "ideal", "gain": 10, "limit": None}
    limited = Model.from_toml(text + 'limit = { value = 5.0, unit = "N mm" }\n')
    assert limited.parameters["motor.limit"].value == 5e-3
    assert described(limited)["actuators"][0]["drive"]["limit"] == 11


def test_the_motor_on_a_sliding_joint_counts_turns_per_way() -> None:
    slide = changed(MOTOR, ('"revolute"', '"prismatic"'))
    assert slide.parameters["motor.gear_ratio"].unit == "rad/m"
    assert slide.parameters["motor.transition_velocity"].unit == "m/s"


@pytest.mark.parametrize("text", [RIG, MOTOR, SPRUNG, SPRUNG + LEG_CYLINDER])
def test_written_and_read_again_it_is_the_same_model(text: str) -> None:
    model = Model.from_toml(text)
    assert Model.from_toml(model.to_toml()) == model
    for name in model.parameter_names:  # every parameter has a place in the file, also those at their default
        value = model.parameters[name].value
        other = model.with_parameters({name: value * 0.999})
        assert other.parameters[name].value == value * 0.999


def test_inputs_states_and_channels() -> None:
    logged = changed(RIG, ("oil = {", 'source = "logged"\noil = {'))
    assert logged.input_channels == ("servo.command", "pump.pressure")
    assert logged.inputs == ("servo", "pump.pressure")
    assert logged.logged_supplies == ("pump",)
    sagging = changed(RIG, ("oil = {", 'source = "sagging"\nresistance = 1e10\ncapacitance = 1e-12\noil = {'))
    assert sagging.input_channels == ("servo.command",)
    source = described(sagging)["supplies"][0]["source"]["sagging"]
    assert [sagging.parameter_names[place] for place in source.values()] == ["pump.resistance", "pump.capacitance"]
    inside = ("servo.spool", "servo.spool_rate", "servo.chamber_a", "servo.chamber_b")
    assert sagging.state_names == ("axis.position", "axis.velocity", *inside, "pump.pressure")
    assert sagging.internal_names == (*inside, "pump.pressure")
    own = ("spool", "pressure_a", "pressure_b", "flow_a", "flow_b")
    assert sagging.output_channels[-7:] == (*(f"servo.{name}" for name in own), "pump.pressure", "pump.flow")
    units = [sagging.channel_unit(channel) for channel in sagging.output_channels[-7:]]
    assert units == ["A", "Pa", "Pa", "m^3/s", "m^3/s", "Pa", "m^3/s"]
    assert (changed(MOTOR).state_names[2:], changed(MOTOR).output_channels[-1]) == (("motor.current",), "motor.current")
    assert changed(SPRUNG).state_names[4:] == ("knee_drive.stretch",)
    assert changed(SPRUNG).optional_inputs == {"hip_drive.command", "knee_drive.command"}
    late = changed(RIG).with_effect("actuator_lag", at="servo", time_constant=0.01)
    assert late.state_names[2:4] == ("servo.lag", "servo.spool")


def test_sensors_read_what_is_inside_of_a_drive() -> None:
    gauges = '\n[sensors.gauge]\nmeasures = "servo.pressure_b"\n[sensors.meter]\nmeasures = "pump.flow"\n'
    told = described(Model.from_toml(RIG + gauges))["sensors"]
    assert told[0]["channel"] == {"kind": "hydraulic", "hydraulic": 0, "quantity": "pressure_b"}
    assert told[1]["channel"] == {"kind": "supply", "supply": 0, "quantity": "flow"}
    clamp = '\n[sensors.clamp]\nmeasures = "motor.current"\n'
    assert described(Model.from_toml(MOTOR + clamp))["sensors"][0]["channel"] == {"kind": "current", "dc_motor": 0}


def test_every_effect_of_an_actuator_fits_every_drive() -> None:
    sizes = {"input_delay": 0.01, "dead_zone": 0.02, "saturation": 0.5, "actuator_lag": 0.03}
    for text in (RIG, MOTOR, SPRUNG):
        model = Model.from_toml(text)
        at = model.actuators[0]
        for effect, value in sizes.items():
            short = {"input_delay": "time", "dead_zone": "width", "saturation": "limit"}.get(effect, "time_constant")
            model = model.with_effect(effect, at=at, **{short: value})
        told = described(model)["actuators"][0]
        names = [model.parameter_names[told[key]] for key in ("delay", "dead_zone", "saturation", "lag")]
        assert names == [
            f"{at}.{end}" for end in ("delay.time", "dead_zone.width", "saturation.limit", "lag.time_constant")
        ]


FRICTION = "[actuators.servo.friction]\n{}\n[actuators.servo.cylinder]"
REFUSED = [
    (RIG, 'supply = "pump"', 'supply = "pmp"', "actuators.servo.supply", 'did you mean "pump"?'),
    (RIG, 'supply = "pump"\n', "", "actuators.servo.supply", 'for example supply = "pump"'),
    (RIG, '"hydraulic"', '"hydrolic"', "actuators.servo", 'did you mean "hydraulic"?'),
    (
        RIG,
        '"hydraulic"',
        "3",
        "actuators.servo",
        "the choices are dc_motor, hydraulic, ideal, maxwell, maxwell_narx, narx",
    ),
    (RIG, 'type = "hydraulic"\n', "", "actuators.servo.supply", 'belongs to type = "hydraulic", but this is ideal'),
    (RIG, "[actuators.servo]", "[actuators]\nx = 3\n[actuators.servo]", "actuators.x", "has to be a table"),
    (RIG, "frequency", "freqency", "actuators.servo.valve.freqency", 'did you mean "frequency"?'),
    (RIG, "{ value = 7.5", "{ vale = 7.5", "actuators.servo.valve.rated_flow.vale", 'did you mean "value"?'),
    (RIG, '"rev/s"', '"Hz"', "actuators.servo.valve.frequency", 'write 250 rev/s, { value = 250, unit = "rev/s" }'),
    (
        RIG,
        "bore = { value = 16.0",
        "bore = { value = 9.0",
        "actuators.servo.cylinder.rod",
        "thinner than the bore, 0.009",
    ),
    (RIG, "bore = {", "area = {", "actuators.servo.cylinder", "is given by rod and area"),
    (RIG, 'bore = { value = 16.0, unit = "mm" }\n', "", "actuators.servo.cylinder", "add bore"),
    (
        RIG,
        'rated_drop = { value = 35.0, unit = "bar" }',
        "",
        "actuators.servo.valve.rated_drop",
        "is missing; rated_flow",
    ),
    (RIG, "value = 35.0", "value = -35.0", "actuators.servo.valve.rated_drop", "is -35 bar, but only more than 0"),
    (
        RIG,
        "value = 35.0",
        "uncertainty = 3.0, value = 35.0",
        "actuators.servo.valve.rated_drop",
        "follow from rated_flow",
    ),
    (RIG, '35.0, unit = "bar"', '35.0, unit = "m"', "actuators.servo.valve.rated_drop", 'write for example "Pa"'),
    (RIG, "rated_drop", "flow_gain = 1e-6\nrated_drop", "actuators.servo.valve", "remove one"),
    (RIG, "value = 160.0", "value = 0.5", "supplies.pump.pressure", "above the pressure of the tank, 100000 Pa"),
    (
        RIG,
        "tank_pressure = { value = 1.0",
        "tank_pressure = { value = 0.01",
        "supplies.pump.tank_pressure",
        "boils at 2000 Pa",
    ),
    (RIG, "oil = {", 'source = "logd"\noil = {', "supplies.pump.source", 'did you mean "logged"?'),
    (RIG, "oil = {", 'source = "sagging"\noil = {', "supplies.pump.resistance", "a sagging supply needs it"),
    (RIG, "oil = {", "capacitance = 3\noil = {", "supplies.pump.capacitance", 'take source = "sagging"'),
    (
        RIG,
        "oil = {",
        "oil = { air = { fraction = -0.1 },",
        "supplies.pump.oil.air.fraction",
        "only 0 to 1 is physically",
    ),
    (RIG, "oil = {", "oil = { air = { fraktion = 0.1 },", "supplies.pump.oil.air.fraktion", 'did you mean "fraction"?'),
    (RIG, "oil = {", "oil = { air = {},", "supplies.pump.oil.air.fraction", "add it, for example fraction = 0.005"),
    (RIG, "bulk_modulus", "bulk_modulos", "supplies.pump.oil.bulk_modulos", 'did you mean "bulk_modulus"?'),
    (RIG, '1.2, unit = "GPa"', '1.2, unit = "kPa"', "supplies.pump.oil.bulk_modulus", "softer than air at one bar"),
    (RIG, "stroke = { value = 80.0", "stroke = { value = -80.0", "actuators.servo.cylinder.stroke", "is -80 mm"),
    (RIG, "line_a = { value = 2.9e-6", "line_a = { value = 0", "actuators.servo.cylinder.line_a", "more than 0 m^3"),
    (
        RIG,
        "internal_leakage = 1.7e-13",
        'internal_leakage = "x"',
        "actuators.servo.cylinder.internal_leakage",
        "number",
    ),
    (
        RIG,
        "internal_leakage = 1.7e-13",
        "internal_leakage = -1",
        "actuators.servo.cylinder.internal_leakage",
        "against",
    ),
    (RIG, "damping = 0.7", "overlap = 0.01", "actuators.servo.valve.overlap", "so it never opens"),
    (RIG, "[actuators.servo.cylinder]", FRICTION.format("viscos = 3"), "actuators.servo.friction.viscos", '"viscous"?'),
    (RIG, "[actuators.servo.cylinder]", FRICTION.format("coulomb = -3"), "actuators.servo.friction.coulomb", "is -3 N"),
    (
        MOTOR,
        'value = 1.0, unit = "ms"',
        "value = 0.0",
        "actuators.motor.time_constant",
        "only more than 0 s",
    ),
    (MOTOR, "value = 50.0", "value = -50.0", "actuators.motor.torque_constant", "has a negative gear_ratio"),
    (MOTOR, "gear_ratio = 20.0", "efficiency = 1.2", "actuators.motor.efficiency", "more than 0 and up to 1"),
    (MOTOR, "gear_ratio = 20.0", "efficiency = 0.0", "actuators.motor.efficiency", "more than 0 and up to 1"),
    (
        MOTOR,
        "gear_ratio = 20.0",
        "gain = 2.0",
        "actuators.motor.gain",
        'belongs to type = "ideal", but this is dc_motor',
    ),
    (MOTOR, "gear_ratio = 20.0", 'command_unit = "A"', "actuators.motor.command_unit", 'write for example "V"'),
    (MOTOR, "gear_ratio = 20.0", "back_emf = -1.0", "actuators.motor.back_emf", "speed the motor up"),
    (
        MOTOR,
        'resistance = { value = 2.0, unit = "Ohm" }\n',
        "",
        "actuators.motor.resistance",
        'value = 1.2, unit = "Ohm"',
    ),
    (SPRUNG, "value = 83.0", "value = -83.0", "actuators.hip_drive.stiffness", "push away from its free length"),
    (SPRUNG, 'value = 4.0, unit = "ms"', "value = 0.0", "actuators.knee_drive.relaxation_time", "more than 0 s"),
    (SPRUNG, "fast_stiffness", "fast_stifness", "actuators.knee_drive.fast_stifness", 'did you mean "fast_stiffness"?'),
    (SPRUNG, 'line = "hip_strut"', 'joint = "hip"', "actuators.hip_drive", "give line in place of joint"),
    (SPRUNG, 'line = "hip_strut"', 'line = "hip_strat"', "actuators.hip_drive.line", 'did you mean "hip_strut"?'),
]


@pytest.mark.parametrize(("text", "old", "new", "where", "words"), REFUSED)
def test_what_cannot_be_right_is_refused(text: str, old: str, new: str, where: str, words: str) -> None:
    refused(where, words, text, (old, new))


def test_drives_on_what_they_cannot_drive_are_refused() -> None:
    turning = [
        ('"prismatic"', '"revolute"'),
        ('unit = "N s/m"', 'unit = "N m s/rad"'),
        ('unit = "N/m"', 'unit = "N m"'),
    ]
    with pytest.raises(ModelError, match='a hydraulic cylinder on the revolute joint "axis", but a piston moves'):
        changed(RIG, *turning)
    line = MOTOR[MOTOR.index("[actuators") :].replace('joint = "axis"', 'line = "hip_strut"')
    with pytest.raises(ModelError, match='is a dc_motor on the line "hip_strut", but a motor turns a joint'):
        Model.from_toml(SPRUNG + line)
    with pytest.raises(ModelError, match=r"add a table \[supplies.pump\]"):
        Model.from_toml(RIG[: RIG.index("[supplies")] + RIG[RIG.index("[actuators") :])


def test_a_change_that_crosses_another_value_is_refused() -> None:
    with pytest.raises(ModelError, match="has to be thinner than the bore"):
        changed(RIG).with_parameters({"servo.cylinder.rod": 0.02})
    with pytest.raises(ModelError, match="above the pressure of the tank"):
        changed(RIG).with_parameters({"pump.pressure": 5e4})
    limits = changed(RIG).parameters
    assert limits["pump.oil.bulk_modulus"].minimum == 1e5  # no fit tries an oil that is softer than air
    assert 0.0 < limits["servo.valve.flow_gain"].minimum < 1e-12
    assert limits["servo.cylinder.internal_leakage"].minimum == 0.0


@pytest.mark.parametrize("text", [RIG, MOTOR, SPRUNG + LEG_CYLINDER])
def test_the_core_takes_every_value_that_a_file_may_give(text: str) -> None:
    """Also at the ends of the physical ranges: both sides have to agree on what a parameter may be."""
    model = Model.from_toml(text)
    components = (*model.actuators, *model.supplies)
    for name in [name for name in model.parameter_names if name.partition(".")[0] in components]:
        parameter = model.parameters[name]
        ends = [end for end in (parameter.minimum, parameter.maximum) if math.isfinite(end)]
        for value in (0.5 * parameter.value, 2.0 * parameter.value, *ends):
            try:
                changed_model = model.with_parameters({name: value})
            except ModelError:
                continue  # outside of its range, or against another value
            internal = model.core.internal_state(changed_model.theta, [0.0] * len(model.coordinates))
            assert len(internal) == len(model.internal_names), name


def test_logs_may_hold_what_is_inside_of_drives() -> None:
    table = """
[channels]
"servo.command" = { column = "i", unit = "mA" }
"servo.pressure_a" = { column = "pa", unit = "bar" }
"servo.spool" = { column = "z", unit = "%", scale = 1.0 }
"pump.pressure" = { column = "ps", unit = "MPa" }
"""
    with pytest.raises(ModelError) as caught:
        Model.from_toml(RIG + table)
    assert caught.value.where == 'channels."servo.spool".unit'
    model = Model.from_toml(RIG + table.replace('"%"', '"mA"'))
    assert model.channel_table["pump.pressure"].unit == "MPa"
    with pytest.raises(ModelError, match="is no channel of the model"):
        Model.from_toml(RIG + table.replace('"%"', '"mA"').replace("pressure_a", "presure_a"))
    with pytest.raises(ModelError, match="is no output of the model"):
        Model.from_toml(RIG + '\n[sensors.gauge]\nmeasures = "servo.current"\n')
