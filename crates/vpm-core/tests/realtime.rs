//! A loop at a fixed rate keeps its rate, counts what it misses, and allocates nothing.
//!
//! A program of its own: the memory that it locks is that of the whole process, and its deadlines pass while other tests compute.

use std::cell::Cell;

use allocation_counter::measure;
use vpm_core::realtime::{Loop, Right, Rights, now, sleep_until};

/// Work that takes this long by the clock, ns.
fn work(duration: u64) {
    let end = now() + duration;
    while now() < end {}
}

#[test]
fn deadlines_do_not_drift() {
    let (period, count) = (2e-3, 50);
    let mut clock = Loop::new(period).unwrap();
    let begin = now();
    let mut last = None;
    assert!(clock.run(
        count,
        || false,
        |tick| {
            last = Some(tick);
            true
        }
    ));
    // Deadline k lies at k periods after the first wait: never earlier, and late by no more than the last wake-up was.
    let tick = last.unwrap();
    let (passed, due) = (now() - begin, tick.number * 2_000_000);
    assert!(passed >= due, "{passed} ns passed before {due} ns");
    assert_eq!(tick.number, count - 1 + clock.missed());
    assert_eq!(clock.wakes(), count - 1);
    assert!(clock.latency(0.0) <= clock.latency(1.0));
}

#[test]
fn work_beyond_deadlines_misses_them_and_stays_on_the_grid() {
    let mut clock = Loop::new(10e-3).unwrap();
    assert_eq!(clock.wait(|| false).unwrap().number, 0);
    // Deadlines 1 and 2 pass during the work; the next is 3, or later on a machine that slept on it.
    work(25_000_000);
    let tick = clock.wait(|| false).unwrap();
    assert!(tick.missed >= 2, "{tick:?}");
    assert_eq!(tick.number, 1 + tick.missed);
    assert_eq!(clock.missed(), tick.missed);
    assert!(clock.work(1.0) >= 0.0249, "the work took {} s", clock.work(1.0));
}

#[test]
fn waiting_allocates_nothing() {
    let mut clock = Loop::new(1e-4).unwrap();
    clock.wait(|| false);
    let info = measure(|| {
        for _ in 0..100 {
            clock.wait(|| false);
        }
    });
    assert_eq!(info.count_total, 0);
}

#[test]
fn sleep_reaches_the_time_and_a_past_time_costs_nothing() {
    let time = now() + 3_000_000;
    while !sleep_until(time) {}
    assert!(now() >= time);
    let before = now();
    while !sleep_until(time) {}
    // It would sleep for hours if it took the time for a duration; a busy machine may hold it up for a while.
    assert!(now() - before < 600_000_000_000);
}

#[test]
fn a_period_without_meaning_is_refused() {
    for period in [0.0, -1e-3, f64::NAN, f64::INFINITY, 1e-7, 100.0] {
        let error = Loop::new(period).unwrap_err().to_string();
        assert!(error.starts_with("period must lie between"), "{error}");
    }
}

#[test]
fn work_can_end_the_loop() {
    let (mut clock, done) = (Loop::new(1e-4).unwrap(), Cell::new(0));
    assert!(clock.run(
        100,
        || false,
        |_| {
            done.set(done.get() + 1);
            done.get() < 3
        }
    ));
    assert_eq!(done.get(), 3);
}

#[test]
fn rights_are_given_or_refused_with_a_reason() {
    let rights = Rights::ask(false, None);
    assert_eq!((&rights.memory, &rights.priority), (&Right::NotAsked, &Right::NotAsked));
    let wrong = Rights::ask(false, Some(200));
    assert!(matches!(&wrong.priority, Right::Refused(reason) if reason.contains("1 to 99")));
    let asked = Rights::ask(true, Some(10));
    for right in [&asked.memory, &asked.priority] {
        assert!(matches!(right, Right::Given | Right::Refused(_)));
    }
}

/// Nice value and policy of this thread as Linux tells them.
#[cfg(target_os = "linux")]
fn scheduled() -> Option<(String, String)> {
    let stat = std::fs::read_to_string("/proc/thread-self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    Some(((*fields.get(16)?).to_owned(), (*fields.get(38)?).to_owned()))
}

#[test]
#[cfg(target_os = "linux")]
fn a_thread_is_scheduled_afterwards_as_it_was_before() {
    let (nice, policy) = scheduled().unwrap();
    for _ in 0..3 {
        let rights = Rights::ask(false, Some(40));
        if rights.priority == Right::Given {
            assert_ne!(scheduled().unwrap().1, policy, "SCHED_FIFO was given, and nothing changed");
        }
        drop(rights);
        assert_eq!(scheduled().unwrap(), (nice.clone(), policy.clone()));
    }
}
