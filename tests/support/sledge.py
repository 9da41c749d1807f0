"""A sledge that a motor pushes, by elementary laws in small explicit steps: dry friction, lag, delay and stops."""

from collections import deque

import numpy as np
from scipy.signal import lfilter

from model_texts import effect_text, on_rail
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array

#: A sledge that a motor pushes, with friction of oil; the file is a tenth off.
SLEDGE = on_rail("sledge", "{ value = 3.3, uncertainty = 0.33 }", joint="way", drive="motor", gain="4.0") + effect_text(
    "viscous_friction", "way", viscous="{ value = 7.0, uncertainty = 1.5 }"
)
#: The sledge with an encoder, which may show too much.
SEEN = SLEDGE + '[sensors.encoder]\nmeasures = "way.position"\n'
#: The sledge with dry friction.
DRY = SLEDGE + effect_text("coulomb_friction", "way", coulomb="{ value = 3.4, uncertainty = 0.4 }")
#: Way after which dry friction repeats, and the torque constant of the motor, m.
WAVE, TURN = 1.5, 0.4
#: Speed at which an excess of friction close to rest has faded to a part, m/s.
FADING = 0.2
MASS, OIL, GAIN, STEP, FINE, READING = 3.0, 8.0, 4.0, 2e-3, 10, 5e-6


def pushed(
    *,
    dry: float = 0.0,
    uneven: float = 0.0,
    wavy: float = 0.0,
    excess: float = 0.0,
    bell: float = 0.0,
    drag: float = 0.0,
    winding: float = 0.0,
    lag: float = 0.0,
    late: float = 0.0,
    pole: float = 0.0,
    ends: float = np.inf,
    seed: int = 0,
    duration: float = 8.0,
) -> Experiment:
    """The sledge by small explicit steps: dry friction as an impulse that at most stops it, a delay as a queue.

    Dry friction may differ between the two directions by ``uneven``, and from place to place by ``wavy`` either way;
    close to rest it has an ``excess`` that falls off by the square of the speed, and one that is a ``bell`` of it. What
    surrounds it resists by a ``drag`` times the square of the speed. The force of the motor differs by a share
    ``winding`` of it, and goes by a difference equation with a ``pole``.
    """
    random, samples, h = np.random.default_rng(seed), round(duration / STEP), STEP / FINE
    time = STEP * np.arange(samples)
    phases = random.uniform(0.0, 2.0 * np.pi, 3)
    swing = (
        np.sin(2.1 * time + phases[0]) + 0.6 * np.sin(5.3 * time + phases[1]) + 0.3 * np.sin(17.0 * time + phases[2])
    )
    command = 5.0 * swing * np.minimum(time, 1.0)
    sent = lfilter([1.0 - pole], [1.0, -pole], command)
    place, speed, force = 0.0, 0.0, 0.0
    queue = deque([0.0] * round(late / h))
    places = np.empty(samples)
    for sample in range(samples):
        places[sample] = place
        for _ in range(FINE):
            queue.append(sent[sample])
            asked, before = GAIN * queue.popleft() * (1.0 - winding * np.sin(2.0 * np.pi * place / TURN)), speed
            mean = asked + (force - asked) * (_mean_decay(h / lag) if lag else 0.0)
            force = asked + (force - asked) * (np.exp(-h / lag) if lag else 0.0)
            stop = -4e4 * (place - np.clip(place, -ends, ends)) - drag * speed * abs(speed)
            speed = speed * np.exp(-h * OIL / MASS) + h * _mean_decay(h * OIL / MASS) * (mean + stop) / MASS
            level = dry + 0.5 * uneven * np.sign(speed) + wavy * np.cos(2.0 * np.pi * place / WAVE)
            fast = (speed / FADING) ** 2
            level += excess / (1.0 + fast) + bell * np.exp(-fast)
            speed -= np.clip(speed, -h * level / MASS, h * level / MASS)
            place += 0.5 * h * (before + speed)
    readings = places + READING * random.standard_normal(samples)
    return Experiment.from_arrays(
        time, {"motor.command": command, "way.position": readings}, model=Model.from_toml(SLEDGE), name=f"push {seed}"
    )


#: Pole of a drive that goes by a difference equation, and the sledge with it.
POLE = 0.9
SAMPLED = SLEDGE.replace(
    "gain = 4.0",
    f"""type = "narx"
sample_time = {STEP}
inputs = {{ u = "motor.command" }}
terms = {{ "effort[k-1]" = {POLE}, "u[k]" = {(1.0 - POLE) * GAIN} }}""",
)
#: What hangs behind a spring on the sledge, and how its deflection is read.
LINK, STIFFNESS, DAMPING, GAUGE = 2.2, 2e5, 40.0, 5e-6


def wound(seed: int, *, logged: bool) -> Experiment:
    """The sledge as a motor and a link behind a spring; the log holds the deflection of that, or not."""
    random, samples, fine = np.random.default_rng(seed), 2000, 20
    time, h, motor = STEP * np.arange(samples), STEP / fine, MASS - LINK
    phases = random.uniform(0.0, 2.0 * np.pi, 3)
    waves = zip((5.0, 3.0, 1.5), (2.1, 5.3, 17.0), phases, strict=True)
    command = np.minimum(time, 1.0) * np.sum(
        [size * np.sin(turn * time + phase) for size, turn, phase in waves], axis=0
    )
    place, speed, bent, rate = 0.0, 0.0, 0.0, 0.0
    shown = np.empty((samples, 2))
    for sample in range(samples):
        shown[sample] = place, bent
        for _ in range(fine):
            spring = STIFFNESS * bent + DAMPING * rate
            acceleration = (GAIN * command[sample] - OIL * speed + spring) / motor
            speed, rate = speed + h * acceleration, rate - h * (spring / LINK + acceleration)
            place, bent = place + h * speed, bent + h * rate
    shown += np.array([READING, GAUGE]) * random.standard_normal(shown.shape)
    channels = {"motor.command": command, "way.position": shown[:, 0]}
    if logged:
        channels["way_deflection.position"] = shown[:, 1]
    return Experiment.from_arrays(time, channels, model=Model.from_toml(SLEDGE), name=f"wound {seed}")


def _mean_decay(turn: float) -> float:
    """Mean of ``exp(-x)`` for x from 0 to ``turn``."""
    return float(-np.expm1(-turn) / turn)


def swung(seed: int, tide: float = 0.0) -> Experiment:
    """The sledge from rest under a force that is read and not sent: ``m v' = f sin wt - c v``, summed over three w.

    A slow force of the size ``tide`` acts beside it, of which no log tells.
    """
    random, time = np.random.default_rng(seed), np.arange(0.0, 6.0, 5e-3)
    command, place = np.zeros_like(time), tide * _swing(0.5, time)
    for turn in random.uniform((2.0, 6.0, 20.0), (4.0, 12.0, 40.0)):
        command += 5.0 * np.sin(turn * time)
        place += 5.0 * GAIN * _swing(turn, time)
    readings = place + READING * random.standard_normal(len(time))
    channels = {"motor.command": command, "way.position": readings}
    return Experiment.from_arrays(time, channels, model=Model.from_toml(SLEDGE), name=f"swing {seed}")


def _swing(turn: float, time: Array) -> Array:
    """Place of the sledge from rest under a force ``sin wt`` of size one."""
    slow, decay = MASS * turn, MASS / OIL * -np.expm1(-OIL / MASS * time)
    swing = OIL / turn * (1.0 - np.cos(turn * time)) - MASS * np.sin(turn * time) + slow * decay
    return np.asarray(swing / (OIL**2 + slow**2))
