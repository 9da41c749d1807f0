"""A loop at a fixed rate, for hardware in the loop."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import NamedTuple, Self

from vpm.errors import SimulationError
from vpm.results import Result

#: Quantiles of times that are told: of steps, wake-ups and work.
QUANTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999, "p99.99": 0.9999, "max": 1.0}


class Tick(NamedTuple):
    """Deadline of a real-time loop: its number and time, how late the wake-up was, and how many were missed."""

    #: Number of the deadline, from 0; grows by more than one where deadlines were missed.
    number: int
    #: Time of the deadline since the loop began, s.
    time: float
    #: Time from the deadline to the wake-up, s.
    late: float
    #: Deadlines that passed while the work before was still going on.
    missed: int


@dataclass(frozen=True, repr=False, eq=False)
class LoopReport(Result):
    """Latency, work and missed deadlines of a real-time loop.

    Attributes
    ----------
    rate : float
        Hz.
    wakes : int
        Deadlines that it woke up for.
    missed : int
        Deadlines that passed while the work before was still going on.
    latency : dict of str to float
        Time from a deadline to its wake-up, s: the machine's part. Quantiles, to three digits.
    work : dict of str to float
        Time from a wake-up to the next wait, s: the work's part.
    memory_locked, priority_raised : str
        "yes", "not asked", or the reason why not.
    """

    rate: float
    wakes: int
    missed: int
    latency: dict[str, float]
    work: dict[str, float]
    memory_locked: str
    priority_raised: str

    def __str__(self) -> str:
        """Text of a loop's report, a few lines for the terminal."""

        def times(values: Mapping[str, float]) -> str:
            return "  ".join(f"{name} {1e6 * value:.3g} us" for name, value in values.items())

        return (
            f"a loop at {self.rate:g} Hz woke up {self.wakes} times and missed {self.missed} deadlines\n"
            f"  wake-up after the deadline: {times(self.latency)}\n"
            f"  work: {times(self.work)}\n"
            f"  memory locked: {self.memory_locked}; priority raised: {self.priority_raised}"
        )

    def _headline(self) -> Mapping[str, object]:
        return {"rate": self.rate, "wakes": self.wakes, "missed": self.missed}


class Loop:
    """Wakes up at a fixed rate, with absolute deadlines: a late wake-up does not move the next one.

    Work that reaches beyond deadlines misses them; the loop goes on with the next that is still to come and counts the
    missed. It belongs to the thread that made it. While it waits, other threads of Python run, and Ctrl-C ends it.

    Parameters
    ----------
    rate : float
        Hz, from 1/60 to 100 000.
    lock_memory : bool
        Keep all memory of the process in RAM, so that no page has to be fetched in the middle of a step, if permitted.
    priority : int, optional
        Run before all ordinary threads, with this priority of ``SCHED_FIFO`` (1 to 99), if permitted. A loop that never
        waits would then block its core.

    Raises
    ------
    SimulationError
        The rate or the priority has no meaning.

    Examples
    --------
    >>> with Loop(1000.0, lock_memory=True, priority=80) as loop:
    ...     for tick in loop.ticks(2.0):
    ...         force = read_sensor()
    ...         write_actuator(sim.step(force)[0])
    >>> print(loop.report())
    """

    def __init__(self, rate: float, *, lock_memory: bool = False, priority: int | None = None) -> None:
        from vpm._core import Loop as Core

        if not rate > 0.0:
            raise SimulationError(f"a rate of {rate:g} Hz is not possible; give a positive number")
        if priority is not None and not 1 <= priority <= 99:
            raise SimulationError(f"a priority of {priority} is none of SCHED_FIFO; give one from 1 to 99")
        try:
            self._core = Core(1.0 / rate, lock_memory, priority)
        except ValueError as error:
            raise SimulationError(f"a loop at {rate:g} Hz is not possible: {error}") from error
        self._rate = rate
        self._rights = self._core.rights

    @property
    def rate(self) -> float:
        """Rate of the real-time loop, Hz."""
        return self._rate

    def wait(self) -> Tick:
        """Wait in the loop until the next deadline; the first call returns at once and begins the clock.

        Raises
        ------
        KeyboardInterrupt
            Somebody pressed Ctrl-C.
        """
        number, late, missed = self._core.wait()
        return Tick(number, number / self._rate, late, missed)

    def ticks(self, seconds: float) -> Iterator[Tick]:
        """Wake up at each deadline for so many seconds of the loop's time."""
        if not seconds >= 0.0:
            raise SimulationError(f"a loop cannot go on for {seconds:g} s; give a time that is not negative")
        first: int | None = None
        while True:
            tick = self.wait()
            first = tick.number if first is None else first
            if tick.number - first >= seconds * self._rate:
                return
            yield tick

    def report(self) -> LoopReport:
        """Report of the loop: latency, work and missed deadlines until now."""
        names, values = list(QUANTILES), list(QUANTILES.values())
        memory, priority = (_told(right) for right in self._rights)
        return LoopReport(
            rate=self._rate,
            wakes=self._core.wakes,
            missed=self._core.missed,
            latency=dict(zip(names, self._core.latencies(values), strict=True)),
            work=dict(zip(names, self._core.work(values), strict=True)),
            memory_locked=memory,
            priority_raised=priority,
        )

    def close(self) -> None:
        """Close the loop: give memory and priority back. The report stays."""
        self._core.close()

    def __enter__(self) -> Self:
        """The loop itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the loop: give memory and priority back."""
        self.close()

    def __repr__(self) -> str:
        return f"Loop({self._rate:g} Hz)"


def _told(right: str | None) -> str:
    if right is None:
        return "not asked"
    return right or "yes"
