"""Masses and inertias by least squares: Table 5.1, its recovery, ranks, and the textbooks' base parameters."""

import numpy as np

import vpm
from places import EXAMPLES
from validation.row import Array, Row, accepted, against, row
from vpm.identify.inertial_model import InertialModel
from vpm.linkages import INERTIAL_NAMES, Leg, LegParameters, inertial_values


def reference() -> list[Row]:
    """Rows of the leg, and of an arm of three links."""
    return [*_leg(), *_arm()]


def _leg() -> list[Row]:
    wanted = accepted("inertial")
    drawn, identified = (inertial_values(LegParameters.hyq(column)) for column in ("table", "identified"))
    rows = [
        against(wanted["ident.table5_1.cad_mass"], drawn[:7]),
        against(wanted["ident.table5_1.identified_mass"], identified[:7]),
        against(wanted["ident.total_mass"], [drawn[:7].sum(), identified[:7].sum()]),
    ]
    wide = _fit((-40.0, -140.0), (60.0, -20.0), 10.0, 60.0)
    narrow = _fit((18.0, -82.0), (22.0, -78.0), 0.1, 0.5)
    masses, source = wide.values[:7], "Table 5.1, torques by Newton and Euler without noise"
    rows.append(
        row("masses from fast motion", masses, wanted["ident.table5_1.cad_mass"]["value"], "kg", source, relative=1e-6)
    )
    inertias = [2.750e-3, 0.325e-3, 0.338e-3, 0.769e-3]
    rows.append(row("inertias from fast motion", wide.values[7:], inertias, "kg m^2", source, relative=1e-6))
    rows.append(row("rank, whole workspace and fast", wide.rank, 11, "1", "recomputed: singular values"))
    rows.append(row("rank, one pose and slow", narrow.rank, 10, "1", "recomputed: singular values"))
    return rows


def _fit(low: tuple[float, float], high: tuple[float, float], rate: float, acceleration: float) -> vpm.InertialFit:
    """Least squares over 400 random states without noise; the torques know nothing of the regressor."""
    leg, random, shape = Leg.hyq(), np.random.default_rng(5), (400, 2)
    motion = (
        np.radians(random.uniform(low, high, shape)),
        random.uniform(-rate, rate, shape),
        random.uniform(-acceleration, acceleration, shape),
    )
    torques = leg.torques(*motion, derivation="newton_euler")
    return vpm.identify_inertial(vpm.InertialRegression.from_arrays(leg.regressor(*motion), torques, INERTIAL_NAMES))


def _arm() -> list[Row]:
    """An axis up and two parallel ones across it: regrouping in closed form (as Khalil and Dombre, 2002)."""
    linear = InertialModel(vpm.Model.load(EXAMPLES / "arm" / "arm.toml"), [])
    random = np.random.default_rng(6)
    motion: list[Array] = [random.uniform(-3.0, 3.0, (200, 3)) for _ in range(3)]
    _, table = linear.lacking((motion[0], motion[1], motion[2]), np.zeros((200, 3)), 1.0)
    fit = vpm.identify_inertial(
        vpm.InertialRegression.from_arrays(
            table, table @ linear.nominal, linear.names, prefer=[n for n in linear.names if not n.endswith("mass")]
        )
    )
    value = dict(zip(linear.names, linear.nominal, strict=True))
    offset, length = 0.05, 0.40
    mass = value["fore.mass"]
    closed = {
        "upper.first_moment.x": value["upper.first_moment.x"] + length * mass,
        "upper.origin_inertia.yy": value["upper.origin_inertia.yy"] + length**2 * mass,
        "upper.origin_inertia.xy": value["upper.origin_inertia.xy"] - length * value["fore.first_moment.y"],
        "column.origin_inertia.zz": value["column.origin_inertia.zz"]
        + value["upper.origin_inertia.zz"]
        + value["fore.origin_inertia.zz"]
        + offset**2 * (value["upper.mass"] + mass)
        + length**2 * mass,
        "fore.origin_inertia.xx": value["fore.origin_inertia.xx"] - value["fore.origin_inertia.zz"],
    }
    found = dict(zip(fit.base_names, fit.base_values, strict=True))
    names, source = list(closed), "closed form: regrouping by hand"
    return [
        row("base parameters of an arm of three links", fit.rank, 15, "1", "regrouping by hand"),
        row(
            "their sums", [found[name] for name in names], [closed[name] for name in names], "kg m, kg m^2", source,
            relative=1e-8,
        ),
    ]  # fmt: skip
