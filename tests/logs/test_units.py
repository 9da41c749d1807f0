"""Units: values against scipy's table of constants, and the algebra as properties."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import constants

from vpm.errors import UnitError
from vpm.units import convert, factor_to_si, parse_unit, require_dimension, si_unit

SYMBOLS = ["m", "mm", "inch", "kg", "g", "lb", "s", "ms", "min", "h", "rad", "deg", "rev", "rpm", "Hz", "%", "N", "kN"]
SYMBOLS += ["lbf", "J", "W", "Pa", "bar", "psi", "A", "mA", "C", "V", "uV", "Ohm", "H", "F", "T", "Wb", "K", "l", "kgf"]


@st.composite
def expressions(draw: st.DrawFn) -> str:
    """A unit of one to four powers, with at most one parenthesised divisor."""
    power = st.builds(
        lambda symbol, exponent: symbol if exponent == 1 else f"{symbol}^{exponent}",
        st.sampled_from(SYMBOLS),
        st.sampled_from([1, 1, 1, 2, 3, -1, 0.5, 1.1]),
    )
    above = draw(st.lists(power, min_size=1, max_size=2))
    below = draw(st.lists(power, max_size=2))
    text = draw(st.sampled_from([" ", "*", "·"])).join(above)
    return f"{text}/({' '.join(below)})" if below else text


@pytest.mark.parametrize(
    ("unit", "value"),
    [
        ("inch", constants.inch),
        ("ft", constants.foot),
        ("lb", constants.pound),
        ("lbf", constants.pound_force),
        ("kgf", constants.kilogram_force),
        ("psi", constants.psi),
        ("bar", constants.bar),
        ("min", constants.minute),
        ("h", constants.hour),
        ("l", constants.liter),
        ("deg", constants.degree),
        ("arcmin", constants.arcminute),
        ("arcsec", constants.arcsecond),
        ("mgn", 1e-3 * constants.g),
        ("ustrain", constants.micro),
        ("µε", constants.micro),
        ("microstrain", constants.micro),
        ("ppm", constants.micro),
        ("t", constants.metric_ton),
        ("mm", constants.milli),
        ("uV", constants.micro),
        ("MPa", constants.mega),
        ("rpm", 2 * constants.pi / constants.minute),
        ("l/min", constants.liter / constants.minute),
        ("N mm/deg", constants.milli / constants.degree),
        ("g/s^2", constants.gram),
        ("%", 0.01),
        ("bar^0.5", math.sqrt(constants.bar)),
        ("l/(min A bar^0.5)", constants.liter / constants.minute / math.sqrt(constants.bar)),
        ("N/mm^1.1", 1e3**1.1),
        ("(mm^0.5)^2", constants.milli),
        ("mm^-1.50", constants.milli**-1.5),
        ("1", 1.0),
        ("", 1.0),
    ],
)
def test_values(unit: str, value: float) -> None:
    assert factor_to_si(unit) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("unit", "definition"),
    [
        ("N", "kg m/s^2"),
        ("Pa", "N/m^2"),
        ("J", "N m"),
        ("W", "J/s"),
        ("C", "A s"),
        ("V", "W/A"),
        ("Ohm", "V/A"),
        ("F", "C/V"),
        ("H", "Wb/A"),
        ("T", "Wb/m^2"),
        ("Wb", "V s"),
        ("Hz", "1/s"),
    ],
)
def test_derived_units_follow_from_their_definitions(unit: str, definition: str) -> None:
    assert parse_unit(unit).dimension == parse_unit(definition).dimension
    assert factor_to_si(unit) == factor_to_si(definition) == 1.0


@pytest.mark.parametrize(
    ("written", "unit"),
    [
        ("Nm", "N m"),
        ("mNm", "mN m"),
        ("Nmm", "N mm"),
        ("kNm/deg", "kN m/deg"),
        ("Nms/rad", "N m s/rad"),
        ("N-m", "N m"),
        ("N.m", "N m"),
        ("N⋅m", "N m"),
        ("N•m-s/rad", "N m s/rad"),
        ("kgm^2", "kg m^2"),
        ("kgm2", "kg m^2"),
        ("kgcm²", "kg cm^2"),
        ("m/s²", "m/s^2"),
        ("m/s2", "m/s^2"),
        ("rad s⁻¹", "rad/s"),
        ("rad.s-1", "rad/s"),
        ("cm3/min", "cm^3/min"),
        ("deg/sec", "deg/s"),
        ("RPM", "rpm"),
        ("r/min", "rpm"),
        ("U/min", "rpm"),
        ("revs/minute", "rpm"),
        ("msec", "ms"),
        ("Volts", "V"),
        ("Amps", "A"),
        ("Bar", "bar"),
        ("percent", "%"),
    ],
)
def test_units_as_logs_write_them(written: str, unit: str) -> None:
    assert parse_unit(written).dimension == parse_unit(unit).dimension
    assert parse_unit(written).si == parse_unit(unit).si
    assert factor_to_si(written) == factor_to_si(unit)


@pytest.mark.parametrize("unit", ["°{}", "deg{}", "deg {}"])
def test_temperatures_count_from_their_own_zero(unit: str) -> None:
    celsius, fahrenheit = unit.format("C"), unit.format("F")
    assert convert(0.0, celsius, "K") == constants.zero_Celsius
    assert convert(-40.0, fahrenheit, celsius) == pytest.approx(-40.0, rel=1e-13)
    assert convert(212.0, fahrenheit, "K") == pytest.approx(constants.zero_Celsius + 100.0, rel=1e-14)
    assert convert(constants.zero_Celsius, "K", celsius) == 0.0
    assert parse_unit(celsius).si == parse_unit(fahrenheit).si == "K"
    assert factor_to_si(fahrenheit) == pytest.approx(constants.degree_Fahrenheit, rel=1e-15)


@given(expressions(), st.floats(-1e12, 1e12))
def test_there_and_back(unit: str, value: float) -> None:
    target = si_unit(unit)
    assert convert(convert(value, unit, target), target, unit) == pytest.approx(value, rel=1e-14)


@given(expressions())
def test_the_si_unit_is_of_the_same_kind_and_its_own_si_unit(unit: str) -> None:
    target = si_unit(unit)
    require_dimension(unit, target)
    assert factor_to_si(target) == 1.0
    assert si_unit(target) == target


@given(expressions(), expressions())
def test_products_and_quotients(left: str, right: str) -> None:
    a, b = parse_unit(left), parse_unit(right)
    product, quotient = parse_unit(f"({left})({right})"), parse_unit(f"({left})/({right})")
    assert product.factor == pytest.approx(a.factor * b.factor, rel=1e-14)
    assert quotient.factor == pytest.approx(a.factor / b.factor, rel=1e-14)
    assert product.dimension == tuple(x + y for x, y in zip(a.dimension, b.dimension, strict=True))
    assert quotient.dimension == tuple(x - y for x, y in zip(a.dimension, b.dimension, strict=True))


@given(expressions(), st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=5))
def test_arrays_convert_as_numbers_do(unit: str, values: list[float]) -> None:
    target = si_unit(unit)
    together = convert(np.array(values), unit, target)
    assert together.tolist() == [convert(value, unit, target) for value in values]


@given(st.one_of(st.text(max_size=12), st.text("Nmskg/^()*19 -", max_size=12)))
def test_any_text_is_a_unit_or_a_unit_error(text: str) -> None:
    try:
        unit = parse_unit(text)
    except UnitError:
        return
    assert math.isfinite(unit.factor)
    assert unit.factor > 0.0


def test_the_same_unit_changes_no_bit() -> None:
    assert convert(0.1, "mm", "mm") == 0.1
    assert convert(0.3, "N s/m", "kg/s") == 0.3


def test_a_minute_is_no_milli_inch() -> None:
    assert factor_to_si("min") == 60.0
    assert factor_to_si("m in") == pytest.approx(0.0254)


@pytest.mark.parametrize(
    ("unit", "words"),
    [
        ("Vs", '"V s", with a space'),
        ("kWh", '"kW h", with a space'),
        ("W/°C", "counts from a zero of its own"),
        ("J degC", "counts from a zero of its own"),
        ("m10", "stands where a symbol is needed"),
        ("foo", 'unknown symbol "foo"'),
        ("knot", "known symbols are"),
        ("rpn", '"rpm"'),
        ("J/kg K", "put the divisor into parentheses"),
        ("(N", 'a ")" is missing'),
        ("N)", '")" is not expected'),
        ("N^x", "a number has to follow"),
        ("N^", "a number has to follow"),
        ("m^100", "beyond 99"),
        ("m^99.5", "beyond 99"),
        ("m^0.33333333", "too many digits"),
        ("m^0.", '"." is not part of a unit'),
        ("GPa^99", "too large"),
        ("nm^99", "too small"),
        ("3 m", '"3" stands where a symbol is needed'),
        ("/s", '"/" stands where a symbol is needed'),
        ("m/", "ends where a symbol is needed"),
        ("m$", '"$" is not part of a unit'),
    ],
)
def test_what_cannot_be_read(unit: str, words: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(unit)
    assert words in str(caught.value)
    assert f'"{unit}"' in str(caught.value)
    assert caught.value.unit == unit


def test_a_wrong_kind_names_both_kinds_and_a_right_unit() -> None:
    with pytest.raises(UnitError) as caught:
        require_dimension("N", "N s/m")
    for part in ('"N"', "kg m/s^2", "kg/s", '"N s/m"'):
        assert part in str(caught.value)
    assert caught.value.expected == "N s/m"
    with pytest.raises(UnitError):
        convert(1.0, "N", "N s/m")
