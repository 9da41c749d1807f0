//! The monotonic clock, and sleep until a time on it.

#[cfg(target_os = "linux")]
mod system {
    use rustix::io::Errno;
    use rustix::thread::clock_nanosleep_absolute;
    use rustix::time::{ClockId, Timespec, clock_gettime};

    pub(super) fn now() -> u64 {
        let time = clock_gettime(ClockId::Monotonic);
        time.tv_sec.unsigned_abs() * 1_000_000_000 + time.tv_nsec.unsigned_abs()
    }

    pub(super) fn sleep_until(time: u64) -> bool {
        let (seconds, rest) = ((time / 1_000_000_000) as i64, (time % 1_000_000_000) as i64);
        let wanted = Timespec { tv_sec: seconds, tv_nsec: rest };
        !matches!(clock_nanosleep_absolute(ClockId::Monotonic, &wanted), Err(Errno::INTR))
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::sync::LazyLock;
    use std::time::{Duration, Instant};

    static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    /// Sleeps are cut so that somebody can ask in between whether to stop.
    const PIECE: Duration = Duration::from_millis(50);

    pub(super) fn now() -> u64 {
        BEGIN.elapsed().as_nanos() as u64
    }

    pub(super) fn sleep_until(time: u64) -> bool {
        let left = Duration::from_nanos(time.saturating_sub(now()));
        std::thread::sleep(left.min(PIECE));
        left <= PIECE
    }
}

/// Time on the monotonic clock, ns.
pub fn now() -> u64 {
    system::now()
}

/// Sleeps until a time on the monotonic clock, ns; false if it was woken before, as by a signal.
pub fn sleep_until(time: u64) -> bool {
    system::sleep_until(time)
}
