"""Stiffness and damping of joints: factors of stops, gains of controllers seen at cylinders, laws from loops."""

import numpy as np
from scipy.integrate import solve_ivp

from validation.row import Array, Row, accepted, row
from vpm import impedance

#: Gain P (N m/rad) and lever (m) of the hip: 8.23e4 and 1.65e5 N/m, D'Imperio (2016), table 5.2: 8.30e4, 1.84e5 N/m.
GAINS, LEVER, DERIVATIVE = (150.0, 300.0), 42.7e-3, 6.0
MASS, SPEED, GRAVITY = 12.0, 1.0, 9.81
WANTED = accepted("joints")


def joint_loop(proportional: float) -> impedance.Loop:
    """Loop of a cylinder on a constant lever that a PD controller drives, its joint moved as a sine of 0.2 Hz."""
    t, w = np.arange(25_000) * 1e-3, 2.0 * np.pi * 0.2
    q, rate = 0.1 * np.sin(w * t), 0.1 * w * np.cos(w * t)
    force = -(proportional * q + DERIVATIVE * rate) / LEVER
    return impedance.identify_loop({"time": t, "s": LEVER * q, "F": force}, "s", "F", sense="reaction")


def landing(ratio: float, proportional: float = 150.0) -> tuple[dict[str, Array], float, float]:
    """Mass that lands on a spring with a damper; the record, k and c."""
    k = proportional / LEVER**2
    c = 2.0 * ratio * np.sqrt(k * MASS)
    t = np.arange(1600) / 4000.0
    found = solve_ivp(
        lambda _, y: (y[1], GRAVITY - (k * y[0] + c * y[1]) / MASS),
        (0.0, 0.4),
        (0.0, SPEED),
        method="DOP853",
        t_eval=t,
        rtol=1e-11,
        atol=1e-14,
    )
    return {"time": t, "x": found.y[0], "v": found.y[1], "f": k * found.y[0] + c * found.y[1]}, k, c


def rows() -> list[Row]:
    """Closed forms, and motions by SciPy's DOP853 whose stiffness and damping are known."""
    loops = [joint_loop(gain) for gain in GAINS]
    closed = "closed form: energy of a sine through a damper, D'Imperio (2016), eqs 5.26, 5.27 corrected"
    planted = "SciPy's DOP853 at 1e-11 with known k, c"
    table = [
        row(
            "ident.loss_factor_stop, of a stop, stop and rebound, full cycle",
            [impedance.stop_factor(quarters) for quarters in (1, 2, 4)],
            WANTED["ident.loss_factor_stop"]["value"],
            "E dt/(c dl^2)",
            closed,
            relative=1e-9,
        ),
        row(
            "ident.stiffness_from_gain, of loops: P / l^2, lever 42.7 mm, P = 150 and 300 N m/rad",
            [loop.stiffness for loop in loops],
            WANTED["ident.stiffness_from_gain"]["value"],
            "N/m",
            "closed form: P / l^2",
            relative=1e-9,
        ),
        row(
            "damping of loops: D / l^2",
            [loop.damping for loop in loops],
            [DERIVATIVE / LEVER**2] * 2,
            "N s/m",
            "closed form: D / l^2",
            relative=1e-7,
        ),
        row(
            "energy of a loop",
            [loop.energy for loop in loops],
            [np.pi * DERIVATIVE * 2.0 * np.pi * 0.2 * 0.1**2] * 2,
            "J",
            closed,
            relative=1e-7,
        ),
    ]
    for ratio in (0.1, 1.2):
        record, k, c = landing(ratio)
        by_force = impedance.identify_landing(record, "x", "f")
        by_motion = impedance.identify_decay(record, "x", MASS)
        for name, found, allowed in (("by force and stroke", by_force, 1e-4), ("by the free motion", by_motion, 1e-6)):
            table.append(
                row(
                    f"landing {name}, damping ratio {ratio:g}: k, c",
                    [found.stiffness, found.damping],
                    [k, c],
                    "N/m, N s/m",
                    planted,
                    relative=allowed,
                )
            )
    record, k, c = landing(0.1)
    decrement = impedance.logarithmic_decrement(record, "x")
    table.append(
        row(
            "logarithmic decrement, damping ratio 0.1",
            decrement.decrement,
            2.0 * np.pi * 0.1 / np.sqrt(1.0 - 0.1**2),
            "1",
            "closed form: 2 pi zeta / sqrt(1 - zeta^2)",
            relative=2e-4,
        )
    )
    gap = impedance.impulse_balance(record, "f", MASS, -SPEED, -float(record["v"][-1])).gap
    table.append(row("impulse of a landing less weight and momentum", gap, 0.0, "N s", planted, absolute=1e-3))
    return table
