"""Beams in large overall motion, against converged solutions of other codes."""

import numpy as np

import vpm
from places import EXAMPLES
from reference_arm import P, errors, log, samples, tip_and_strains
from validation.machines import arm
from validation.row import Array, Row, row, values


def example(name: str) -> vpm.Model:
    """Model file of an example."""
    return vpm.Model.load(EXAMPLES / name / f"{name}.toml")


def spin_up(model: vpm.Model, time: Array, full: float = 15.0, speed: float = 6.0) -> dict[str, Array]:
    """The manoeuvre of Kane, Ryan and Banerjee: smoothly to 6 rad/s within 15 s, the hub's motion given."""
    turning = time < full
    wave = 2.0 * np.pi / full
    rest = speed / full
    angle = np.where(
        turning, rest * (0.5 * time**2 + (np.cos(wave * time) - 1.0) / wave**2), speed * (time - 0.5 * full)
    )
    rate = np.where(turning, rest * (time - np.sin(wave * time) / wave), speed)
    acceleration = np.where(turning, rest * (1.0 - np.cos(wave * time)), 0.0)
    position, velocity, change = (column[:, None] for column in (angle, rate, acceleration))
    step = float(time[1] - time[0])
    outputs, *_ = model.core.simulate_prescribed(
        model.theta, position, velocity, change, step, 1, "linearly_implicit", []
    )
    seen = dict(zip(model.output_channels, outputs.T, strict=True))
    along = seen["tip.x"] * np.cos(angle) + seen["tip.y"] * np.sin(angle)
    across = seen["tip.y"] * np.cos(angle) - seen["tip.x"] * np.sin(angle)
    return {"along": along - 10.0, "across": across}


def spinning() -> list[Row]:
    """Spin-up of a flexible arm: exact, and by interpolated deflection, which promises 1 % of the largest."""
    case = values("beams")["spin_up_manoeuvre"]
    wanted = np.array(case["rows"])
    model = example("spinning_beam")
    time = np.arange(0.0, 20.0 + 1e-3, 2.5e-3)
    at = np.rint(wanted[:, 0] / 2.5e-3).astype(int)
    rows = []
    for level, tolerance in (("strain(6)", 2e-4), ("bezier(7)", 2e-4), ("deflection(6)", 0.01 * 0.5738)):
        seen = spin_up(model.at(level), time)
        for name, column in (("along", 1), ("across", 2)):
            source = "two independent codes, converged"
            rows.append(
                row(f"spin-up, tip {name}, {level}", seen[name][at], wanted[:, column], "m", source, absolute=tolerance)
            )
    late = spin_up(model, time)["along"][-1]
    stretch = case["steady_axial_extension_analytic"]
    return [*rows, row("spin-up, steady stretch", late, stretch, "m", "closed form", absolute=2e-5)]


def falling() -> list[Row]:
    """A soft pendulum that falls from the horizontal, without and with shear and stretch."""
    case = values("beams")["falling_flexible_pendulum"]
    model = example("flexible_pendulum")
    content = model.to_dict()
    content["beams"]["strip"]["deforms"] = ["bending_y", "shear_x", "extension"]
    rows = []
    for name, machine in (("euler_bernoulli", model.at("strain(11)")), ("reissner", sheared(content))):
        wanted = np.array(case[name]["rows"])
        seen, drift = fall(machine, float(wanted[-1, 0]))
        at = np.rint(wanted[:, 0] / 1e-3).astype(int)
        source = "two independent codes, converged"
        rows.append(
            row(f"falling pendulum, {name}", seen[at], wanted[:, 1:], "m", source, absolute=case["suggested_abs_tol_m"])
        )
        rows.append(row(f"falling pendulum, {name}, energy", drift, 0.0, "1", "conservation", absolute=1e-6))
    return rows


def sheared(content: dict[str, object]) -> vpm.Model:
    """The pendulum with shear and stretch; the reference has GA without a shear factor."""
    strip = dict(content["beams"]["strip"])  # type: ignore[index]
    area, moment = 2e-4, 0.02 * 0.01**3 / 12.0
    strip["section"] = {
        "shape": "given",
        "area": area,
        "moment_x": 0.01 * 0.02**3 / 12.0,
        "moment_y": moment,
        "torsion": moment,
        "shear_x": 6535.947712418301 / (area * 1e8 / 2.6),
        "shear_y": 1.0,
    }
    return vpm.Model.from_dict(content | {"beams": {"strip": strip}}).at("strain(10)")


def fall(model: vpm.Model, seconds: float) -> tuple[Array, float]:
    """Places of the tip every millisecond, and the change of the energy in units of what the fall sets free."""
    count = round(seconds / 1e-3) + 1
    start = np.zeros(model.core.n_states)
    none = np.zeros((count, 0))
    outputs, states, _ = model.core.simulate(model.theta, start, none, 1e-3, 2, "rosenbrock", [])
    seen = dict(zip(model.output_channels, outputs.T, strict=True))
    n = len(model.coordinates)
    energies = np.array([model.core.energy(model.theta, x[:n], x[n : 2 * n]) for x in states[::50]])
    total = energies.sum(axis=1)
    return np.column_stack([seen["tip.x"], seen["tip.z"]]), float(np.ptp(total) / energies[:, 0].max())


def two_links() -> list[Row]:
    """The planar two-link arm over 24 s, in steps of 10 ms."""
    rows = []
    for motion in ("slow", "fast"):
        for level in ("strain(4)", "bezier(5)"):
            model = arm(P, level)
            start = np.zeros(model.core.n_states)
            run = vpm.simulate(model, log(motion, 1e-2), integrator="additive", hold="cubic", initial_state=start)
            distance, (first, second) = errors(motion, *tip_and_strains(run))
            source = f"8 terms of curvature, converged; {len(samples(motion))} samples"
            where = f"two-link arm, {motion}, {level}"
            rows += [
                row(f"{where}, tip, RMS error", distance, 0.0, "m", source, absolute=3e-5),
                row(f"{where}, strain 1, relative RMS error", first, 0.0, "1", source, absolute=4e-4),
                row(f"{where}, strain 2, relative RMS error", second, 0.0, "1", source, absolute=2.5e-3),
            ]
    return rows


def rows() -> list[Row]:
    """All of them."""
    return [*spinning(), *falling(), *two_links()]
