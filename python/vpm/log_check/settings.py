"""Every number that decides in a log check."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Thresholds of the log check: bandwidth, stretch, shares and sizes.

    Attributes
    ----------
    band : float
        Bandwidth of the tracker that keeps the model on the log, Hz.
    turn : float
        Largest product of bandwidth and sample time: in a log whose time is wrong the tracker is slower.
    still : float
        Share of the motion of a record, as squares of its steps, that has gone by where it begins.
    before : float
        Time before that which belongs to it, s.
    part : float
        Least share of it in the stretch that is looked at.
    window : float
        Least length of that stretch, s.
    samples : tuple of int
        Fewest and most samples of that stretch.
    fewest : int
        Fewest samples from which a noise is estimated.
    judged : int
        Fewest samples of a record that say anything of units and clocks.
    doubtful : float
        Share of the error power of free masses that a model may leave of a channel. Where it leaves more, after its
        uncertain parameters and the friction of its joints were fitted, units, signs and names of channels are tried.
    lost : float
        Such a share of which a wrong clock leaves more, of one channel at least: a motion that is all friction looks
        alike at any speed.
    negligible : float
        Such a share that is as good as nothing.
    quiet : float
        A channel has noise if that is more than such a share of its usual steps, and more than the digits show.
    better : float
        A mistake explains a record if its correction leaves at most this share of the channels that it affects.
    periods : float
        Least length of a record that says anything of delays, in periods of the bandwidth.
    pieces : int
        Pieces of a record in each of which a delay has to explain what was left.
    throughout : float
        Largest share of what was left that it leaves in each of these.
    alike : float
        Another correction explains it as well if it leaves no more than 1/alike times what the best one leaves.
    finalists : int
        Corrections for which the model is fitted, of those that were tried at its own values.
    fitted : int
        Pairs of corrections of one joint for which the model is fitted: each alone hides what the other one does.
    hopeful : float
        Those among them leave at most exp(hopeful) times what the best one leaves.
    far : float
        Stated deviations of a parameter of the model by which the model file rules a value out.
    likelier : float
        A mistake also explains a record if its correction makes the values that explain it likelier by so many nats,
    believable : float
        and leaves such values that larger deviations have at least this chance.
    branches : int
        Corrections with each of which another one is tried where none explains a record alone.
    steps : int
        Most steps of a fit: by secants they are cheap, and long delays are far from where derivatives were worked out.
    rounds : int
        Most mistakes of a record that are found one after the other.
    smallest : float
        Factor, or its inverse, from which on a wrong scale is no fault of a machine.
    delays : tuple of float
        Delays of channels that are tried, s: by these the change of what is left is taken as linear.
    longest_delay : float
        Longest delay that is reported, s.
    held : float
        Delays of fewer samples are how commands are held from one sample to the next.
    harmless : float
        Share of a channel that harms no conclusion. A delay that leaves no more is reported, but is no mistake; of such
        ones no two are tried.
    delay_tolerance : float
        A search for a delay ends when the delay moves by less, in samples.
    stuck : int
        Samples of one value, in a channel with noise, that no sensor gives by chance.
    jump : float
        A channel stood still if it ends that by a step of so many times its largest other one.
    clipped : float
        Share of samples at the largest or smallest value from which on a channel is cut off there.
    abrupt : float
        It comes there by steps of at least this share of its usual ones; a machine that rests comes slowly.
    levels : int
        A channel with fewer values is a square wave or a switch: it is not cut off, and has no noise.
    spike : float
        A sample is a spike if it differs from its neighbours by so many times the noise of the channel.
    filtered : float
        Power of noise in an octave, beside that in the octave before it, below which a channel was filtered.
    level : float
        Two octaves have the same noise if its powers differ by less than this factor.
    digits : float
        Noise of fewer roundings of a floating-point number is none.
    undetermined : float
        A record does not show a parameter if it leaves more than this share of its stated uncertainty.
    coarse : float
        Resolution, as a share of the range of a channel, from which on it is reported.
    """

    band: float = 1.0
    turn: float = 0.02
    still: float = 0.003
    before: float = 0.5
    part: float = 0.2
    window: float = 5.0
    samples: tuple[int, int] = (2000, 10000)
    fewest: int = 20
    judged: int = 200
    doubtful: float = 0.1
    lost: float = 0.8
    negligible: float = 1e-5
    quiet: float = 1e-3
    better: float = 0.1
    periods: float = 2.0
    pieces: int = 3
    throughout: float = 0.5
    alike: float = 0.5
    finalists: int = 4
    fitted: int = 24
    hopeful: float = 3.0
    far: float = 5.0
    likelier: float = 10.0
    believable: float = 1e-3
    branches: int = 3
    steps: int = 16
    rounds: int = 3
    smallest: float = 2.0
    delays: tuple[float, ...] = (0.01, 0.05)
    longest_delay: float = 0.1
    held: float = 0.75
    harmless: float = 1e-3
    delay_tolerance: float = 0.1
    stuck: int = 20
    jump: float = 3.0
    clipped: float = 0.01
    abrupt: float = 0.2
    levels: int = 20
    spike: float = 30.0
    filtered: float = 0.05
    level: float = 2.0
    digits: float = 8e3
    undetermined: float = 0.9
    coarse: float = 0.01
