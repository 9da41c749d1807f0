"""Whether a case can be solved: how far the hidden effect stands clear of the noise, for one who knows everything.

The generator itself runs each record once more without noise and once more without the effect. The difference of the
two is what the effect does to the record; what is left of it after the best change of the calibratable parameters
(least squares with sensitivities by finite differences, on the training records) is what only the effect can explain.
Both are compared with what noise does to the same channel in the same loop, all of it below ``BAND``, since the
difference quotients of a controller make noise that is mostly above.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

Array = NDArray[np.float64]
#: Frequency below which effects and noise are compared [Hz].
BAND = 25.0
#: Root mean square of the recalibrated gap, in deviations of the noise, from which a case counts as solvable.
CLEAR = 1.0


@dataclass(frozen=True)
class Oracle:
    """What only the generator knows."""

    #: Outputs without noise and counts of each record (training records first), by channel.
    with_effect: tuple[Mapping[str, Array], ...]
    without_effect: tuple[Mapping[str, Array], ...]
    sensor_noise: Mapping[str, float]  #: Standard deviation of noise and counts of each sensed channel.
    #: Standard deviation, below 25 Hz, that noise brings into each channel of the closed loop.
    noise: Mapping[str, float]
    #: Root mean square, on the validation records and below 25 Hz, of what the effect changes in each channel, and
    #: of what is left of it after a recalibration, both in units of ``noise``. Beside the channels there may be
    #: weighted sums of them that show an effect better, such as the force of a cylinder.
    gap: Mapping[str, float]
    recalibrated: Mapping[str, float]
    #: What is left after the recalibration on the training records. An effect that shows on none of them, such as a
    #: stop that only the validation record runs into, can be told by nobody who fits on the others.
    taught: Mapping[str, float]

    @property
    def strength(self) -> float:
        """Largest recalibrated gap of all channels in units of the noise, on the records where it is less."""
        return min(max(self.recalibrated.values()), max(self.taught.values()))

    @property
    def solvable(self) -> bool:
        """Whether the effect is visible behind noise and free parameters at all."""
        return self.strength > CLEAR


def judge(
    channels: Sequence[str],
    sensed: Array,
    pieces: Sequence[Array],
    training: Sequence[bool],
    nudge: float,
    dt: float,
    mixed: Mapping[str, Mapping[str, float]],
) -> Oracle:
    """Oracle of a case.

    - ``channels``: sensed channels, then commands
    - ``sensed``: shape (sensors,), standard deviations of the sensors
    - ``pieces``: each of shape (samples, channels, 3 + parameters), as measured, without noise, without the effect, and
      that with each parameter ``nudge`` larger
    - ``training``: which pieces a calibration may use
    - ``nudge``: relative change of the parameters
    - ``dt``: sampling interval [s]
    - ``mixed``: further channels as weighted sums
    """
    judged = [*channels, *mixed]
    weights = np.vstack([np.eye(len(channels)), *([[w.get(c, 0.0) for c in channels]] for w in mixed.values())])
    rate = 1.0 / dt
    sections = butter(4, min(BAND, 0.4 * rate), fs=rate, output="sos")
    stride = max(1, int(rate / (4.0 * BAND)))
    slow = [np.einsum("ij,njk->nik", weights, sosfiltfilt(sections, piece, axis=0)[::stride]) for piece in pieces]
    noise = np.sqrt(np.mean(np.concatenate([(p[:, :, 0] - p[:, :, 1]) ** 2 for p in slow]), 0))
    noise = np.maximum(noise, 1e-300)
    gaps = [(p[:, :, 1] - p[:, :, 2]) / noise for p in slow]
    slopes = [(p[:, :, 3:] - p[:, :, 2:3]) / noise[:, None] / nudge for p in slow]
    learned = [k for k, used in enumerate(training) if used]
    unseen = [k for k, used in enumerate(training) if not used]
    width = slopes[0].shape[2]
    change = np.zeros(width)
    if width:
        matrix = np.concatenate([slopes[k].reshape(-1, width) for k in learned])
        target = np.concatenate([gaps[k].ravel() for k in learned])
        change = np.linalg.lstsq(matrix, target, rcond=1e-9)[0]
    left = [gap - slope @ change for gap, slope in zip(gaps, slopes, strict=True)]

    def size(parts: Sequence[Array]) -> dict[str, float]:
        return dict(zip(judged, np.sqrt(np.mean(np.concatenate(parts) ** 2, 0)).tolist(), strict=True))

    def named(column: int) -> tuple[dict[str, Array], ...]:
        order = [*learned, *unseen]
        return tuple({c: pieces[k][:, j, column].copy() for j, c in enumerate(channels)} for k in order)

    return Oracle(
        with_effect=named(1),
        without_effect=named(2),
        sensor_noise=dict(zip(channels, sensed.tolist(), strict=False)),
        noise=dict(zip(judged, noise.tolist(), strict=True)),
        gap=size([gaps[k] for k in unseen]),
        recalibrated=size([left[k] for k in unseen]),
        taught=size([left[k] for k in learned]),
    )
