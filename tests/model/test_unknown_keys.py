"""Misspelt keys of tables inside of tables: the choices are the keys of that very table."""

import pytest

from vpm.errors import ModelError
from vpm.model import Model

#: Text with a misspelt key, where it stands, and the repair.
MISSPELT = [
    ('[beams.link.section]\nshape = "rectangle"\nwidht = 0.1', "beams.link.section.widht", 'did you mean "width"?'),
    (
        '[beams.link.section]\nshape = "circle"\nwidth = 0.1',
        "beams.link.section.width",
        "the choices are at, diameter, material, shape",
    ),
    (
        '[[beams.link.sections]]\nshape = "tube"\nouter = { value = 1.0, unti = "m" }',
        "beams.link.sections[0].outer.unti",
        'did you mean "unit"?',
    ),
    (
        '[beams.link.section]\nshape = "circle"\nmaterial = { yuong = 1.0 }',
        "beams.link.section.material.yuong",
        'did you mean "young"?',
    ),
    (
        '[[beams.link.sections]]\nshape = "tube"\nmaterial = { densty = 1.0 }',
        "beams.link.sections[0].material.densty",
        'did you mean "density"?',
    ),
    (
        '[beams.link.section]\nshape = "layers"\nlayers = [{ thicknes = 1.0 }]',
        "beams.link.section.layers[0].thicknes",
        'did you mean "thickness"?',
    ),
    (
        "[beams.link.material]\nyoung = { value = 1.0, mni = 0.0 }",
        "beams.link.material.young.mni",
        'did you mean "min"?',
    ),
    ("[beams.rest.damping]\nratois = [0.1]", "beams.rest.damping.ratois", 'did you mean "ratios"?'),
    ("[[beams.section.rests]]\ntorsoin = 0.1", "beams.section.rests[0].torsoin", 'did you mean "torsion"?'),
    ("[joints.axis.dh]\nalhpa = 1.0", "joints.axis.dh.alhpa", 'did you mean "alpha"?'),
    ("[lines.dh.from]\nponit = [0, 0, 0]", "lines.dh.from.ponit", 'did you mean "point"?'),
    ("[lines.dh.barrel]\ncenter = { vlaue = 1.0 }", "lines.dh.barrel.center.vlaue", 'did you mean "value"?'),
    ("[contacts.foot.plane]\nnromal = 1", "contacts.foot.plane.nromal", 'did you mean "normal"?'),
    ("[contacts.foot.friction]\nstatik = 1", "contacts.foot.friction.statik", 'did you mean "static"?'),
    ("[supplies.pump.oil]\nbulk_modulos = 1", "supplies.pump.oil.bulk_modulos", 'did you mean "bulk_modulus"?'),
    ("[supplies.oil.oil.air]\nfractoin = 1", "supplies.oil.oil.air.fractoin", 'did you mean "fraction"?'),
    (
        '[actuators.drive]\ntype = "hydraulic"\nvalve = { flow_gian = 1 }',
        "actuators.drive.valve.flow_gian",
        'did you mean "flow_gain"?',
    ),
    (
        '[actuators.hydraulic]\ntype = "hydraulic"\ncylinder = { bore = { value = 1.0, maxx = 2.0 } }',
        "actuators.hydraulic.cylinder.bore.maxx",
        'did you mean "max"?',
    ),
    (
        '[actuators.drive]\ntype = "hydraulic"\nfriction = { columb = 1 }',
        "actuators.drive.friction.columb",
        'did you mean "coulomb"?',
    ),
    (
        '[controllers.pd]\ntype = "pd"\nproportional = { value = 1.0, unti = "N" }',
        "controllers.pd.proportional.unti",
        'did you mean "unit"?',
    ),
    (
        '[controllers.servo]\ntype = "pd"\nvelocity = 1.0',
        "controllers.servo.velocity",
        "the choices are actuator, delay, derivative, limit, measures, proportional, sample_time, type",
    ),
    ("[bushings.mount]\nstiffness = [{ vlaue = 1 }]", "bushings.mount.stiffness[0].vlaue", 'did you mean "value"?'),
    ("[bushings.row]\nstiffness = [[{ unti = 1 }]]", "bushings.row.stiffness[0][0].unti", 'did you mean "unit"?'),
    ("[loops.close.a]\nrotatoin = 1", "loops.close.a.rotatoin", 'did you mean "rotation"?'),
    (
        "[transmissions.gear.ratios]\naxis = { valeu = 1 }",
        "transmissions.gear.ratios.axis.valeu",
        'did you mean "value"?',
    ),
    (
        '[channels."axis.position".columns.a]\ncolunm = "q"',
        'channels."axis.position".columns.a.colunm',
        'did you mean "column"?',
    ),
    ("[[effects]]\nviscous = { value = 1, unti = 2 }", "effects[0].viscous.unti", 'did you mean "unit"?'),
]


@pytest.mark.parametrize(("text", "where", "repair"), MISSPELT, ids=[where for _, where, _ in MISSPELT])
def test_the_keys_of_that_table_are_offered(text: str, where: str, repair: str) -> None:
    with pytest.raises(ModelError) as caught:
        Model.from_toml(text)
    assert f"{where} is not a known key; {repair}" in str(caught.value)
