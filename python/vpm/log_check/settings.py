"""Every number that decides in a log check."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Thresholds of the log check: bandwidth, stretch, shares and sizes."""

    band: float = 1.0  #: Bandwidth of the tracker that keeps the model on the log, Hz.
    #: Least ratio of that to the rate at which the machine falls over where it stands on its joints: drawn back four
    #: times as hard as it falls, it is off by a third more than a machine that does not fall.
    firm: float = 2.0
    #: Largest product of bandwidth and sample time: in a log whose time is wrong the tracker is slower.
    turn: float = 0.02
    still: float = 0.003  #: Share of the motion of a record, as squares of its steps, that has gone by where it begins.
    before: float = 0.5  #: Time before that which belongs to it, s.
    part: float = 0.2  #: Least share of it in the stretch that is looked at.
    window: float = 5.0  #: Least length of that stretch, s.
    samples: tuple[int, int] = (2000, 10000)  #: Fewest and most samples of that stretch.
    fewest: int = 20  #: Fewest samples from which a noise is estimated.
    judged: int = 200  #: Fewest samples of a record that say anything of units and clocks.
    #: Share of the error power of free masses that a model may leave of a channel. Where it leaves more, after its
    #: uncertain parameters and the friction of its joints were fitted, units, signs and names of channels are tried.
    doubtful: float = 0.1
    #: Such a share of which a wrong clock leaves more, of one channel at least: a motion that is all friction looks
    #: alike at any speed.
    lost: float = 0.8
    negligible: float = 1e-5  #: Such a share that is as good as nothing.
    #: A channel has noise if that is more than such a share of its usual steps, and more than the digits show.
    quiet: float = 1e-3
    #: A mistake explains a record if its correction leaves at most this share of the channels that it affects.
    better: float = 0.1
    periods: float = 2.0  #: Least length of a record that says anything of delays, in periods of the bandwidth.
    pieces: int = 3  #: Pieces of a record in each of which a delay has to explain what was left.
    throughout: float = 0.5  #: Largest share of what was left that it leaves in each of these.
    #: Another correction explains it as well if it leaves no more than 1/alike times what the best one leaves.
    alike: float = 0.5
    finalists: int = 4  #: Corrections for which the model is fitted, of those that were tried at its own values.
    #: Pairs of corrections of one joint for which the model is fitted: each alone hides what the other one does.
    fitted: int = 24
    hopeful: float = 3.0  #: Those among them leave at most exp(hopeful) times what the best one leaves.
    far: float = 5.0  #: Stated deviations of a parameter of the model by which the model file rules a value out.
    #: A mistake also explains a record if its correction makes the values that explain it likelier by so many nats,
    likelier: float = 10.0
    believable: float = 1e-3  #: and leaves such values that larger deviations have at least this chance.
    branches: int = 3  #: Corrections with each of which another one is tried where none explains a record alone.
    #: Most steps of a fit: by secants they are cheap, and long delays are far from where derivatives were worked out.
    steps: int = 16
    rounds: int = 3  #: Most mistakes of a record that are found one after the other.
    smallest: float = 2.0  #: Factor, or its inverse, from which on a wrong scale is no fault of a machine.
    #: Delays of channels that are tried, s: by these the change of what is left is taken as linear.
    delays: tuple[float, ...] = (0.01, 0.05)
    longest_delay: float = 0.1  #: Longest delay that is reported, s.
    held: float = 0.75  #: Delays of fewer samples are how commands are held from one sample to the next.
    #: Share of a channel that harms no conclusion. A delay that leaves no more is reported, but is no mistake; of such
    #: ones no two are tried.
    harmless: float = 1e-3
    delay_tolerance: float = 0.1  #: A search for a delay ends when the delay moves by less, in samples.
    stuck: int = 20  #: Samples of one value, in a channel with noise, that no sensor gives by chance.
    jump: float = 3.0  #: A channel stood still if it ends that by a step of so many times its largest other one.
    #: Share of samples at the largest or smallest value from which on a channel is cut off there.
    clipped: float = 0.01
    #: It comes there by steps of at least this share of its usual ones; a machine that rests comes slowly.
    abrupt: float = 0.2
    levels: int = 20  #: A channel with fewer values is a square wave or a switch: it is not cut off, and has no noise.
    #: A sample is a spike if it differs from its neighbours by so many times the noise of the channel.
    spike: float = 30.0
    #: Power of noise in an octave, beside that in the octave before it, below which a channel was filtered.
    filtered: float = 0.05
    level: float = 2.0  #: Two octaves have the same noise if its powers differ by less than this factor.
    digits: float = 8e3  #: Noise of fewer roundings of a floating-point number is none.
    #: A record does not show a parameter if it leaves more than this share of its stated uncertainty.
    undetermined: float = 0.9
    coarse: float = 0.01  #: Resolution, as a share of the range of a channel, from which on it is reported.
