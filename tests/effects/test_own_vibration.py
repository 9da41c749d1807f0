"""A rhythm in time that is the own vibration of a flexible link, and one that is not."""

from functools import cache

import numpy as np
import pytest

import vpm
from flexible_link import one_flexible_link

TEXT = one_flexible_link("strain(2)", young="1.5e10", section=(0.03, 0.004), damping=1.0, gains=(40.0, 4.0))
MODEL = vpm.Model.from_toml(TEXT)
OWN = float(MODEL.natural_frequencies([0.0])[0])


@cache
def swung(rate: float) -> vpm.Run:
    time = 0.002 * np.arange(3000)
    swing = np.minimum(time, 1.0) * (0.6 * np.sin(rate * time) + 0.2 * np.sin(2.6 * rate * time))
    asked = vpm.Experiment.from_arrays(time, {"motor.reference": swing}, {}, name="swing", model=MODEL)
    return vpm.simulate(MODEL, asked, mode="closed_loop")


def record(rate: float, line: float) -> vpm.Experiment:
    run, noise = swung(rate), np.random.default_rng(3)
    drawn = run["motor.command"] + 0.05 * np.sin(2.0 * np.pi * line * run.time)
    columns = {
        "shoulder.position": run["shoulder.position"] + 1e-6 * noise.standard_normal(run.time.size),
        "motor.command": drawn + 0.005 * noise.standard_normal(run.time.size),
    }
    return vpm.Experiment.from_arrays(run.time, columns, {}, name=f"swing {rate}", model=MODEL)


@pytest.mark.parametrize(("line", "said"), [(OWN, "it rings at"), (0.6 * OWN, "something outside of the machine")])
def test_a_rhythm_of_links_is_no_disturbance(line: float, said: str) -> None:
    records = [record(rate, line) for rate in (3.1, 2.5, 2.8)]
    why = vpm.diagnose(MODEL, records[:2], records[2:], effects=["bias_force"])
    assert not why.effects
    assert said in why.summary
