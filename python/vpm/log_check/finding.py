"""What a log check says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from vpm.results import Result, Storable


@dataclass(frozen=True, repr=False, eq=False)
class Finding(Storable):
    """One thing that is wrong, or at least odd, in a log.

    Attributes
    ----------
    kind : str
        ``unit``, ``scale``, ``sign``, ``swap``, ``clock`` or ``delay`` of channels, ``side`` of a dead centre;
        ``constant``, ``frozen``,
        ``clipped``, ``spikes``, ``filtered`` or ``coarse`` of one by itself; ``unseen`` of parameters; ``unexplained``
        where nothing helps.
    channels : tuple of str
    records : tuple of str
        Logs in which it is.
    sentence : str
        What is wrong, with the numbers.
    repair : str
        What to do about it.
    mistake : bool
        No machine does that by itself: nothing that follows from the log can be trusted.
    factor : float
        By which the values have to be multiplied.
    delay : float
        By how much later than the others the channels were stamped, s.
    share : tuple of float
        Error power of the worst channel before and after its correction, as a share of what free masses leave.
    lines : dict of str to str
        Entries of the channel table as they should be, by channel.
    """

    kind: str
    channels: tuple[str, ...]
    records: tuple[str, ...]
    sentence: str
    repair: str
    mistake: bool = False
    factor: float = 1.0
    delay: float = 0.0
    share: tuple[float, float] = (0.0, 0.0)
    lines: Mapping[str, str] = field(default_factory=dict)

    def is_alike(self, other: Finding) -> bool:
        """Whether two findings are the same mistake, in whichever records."""
        same = (self.kind, self.channels, self.factor) == (other.kind, other.channels, other.factor)
        return same and self.mistake and other.mistake

    def __str__(self) -> str:
        """Text of a finding: sentence and repair."""
        where = f"{', '.join(self.records)}: " if self.records else ""
        return f"{where}{self.sentence}; {self.repair}"


@dataclass(frozen=True, repr=False, eq=False)
class LogCheck(Result):
    """What is wrong in logs of a machine, as far as its model can say.

    Attributes
    ----------
    findings : tuple of Finding
        Mistakes first.
    shares : dict of str to float
        Error of the model in each channel of the worst record, with uncertain parameters and friction fitted and every
        mistake corrected, as a share of the error power of free masses: 0 explains all, 1 nothing.
    """

    findings: tuple[Finding, ...]
    shares: dict[str, float]

    @property
    def mistakes(self) -> tuple[Finding, ...]:
        """Findings that no machine causes by itself."""
        return tuple(one for one in self.findings if one.mistake)

    def __str__(self) -> str:
        """A line for each finding."""
        if not self.findings:
            return "nothing is wrong with the channels of these logs"
        return "\n".join(str(one) for one in self.findings)
