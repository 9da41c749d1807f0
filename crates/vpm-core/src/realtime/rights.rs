//! What a loop asks of the operating system so that nothing else gets in its way: memory that stays, and a priority before all others.

#[cfg(target_os = "linux")]
use rustix::mm::{MlockAllFlags, mlockall, munlockall};
#[cfg(target_os = "linux")]
use rustix::process::{Resource, geteuid, getpriority_process, getrlimit};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id, thread_schedule_policy_param,
};

/// Whether something asked for was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Right {
    /// Not asked for.
    NotAsked,
    /// Given.
    Given,
    /// Not given: one sentence why, with the repair.
    Refused(String),
}

/// What this thread was given; goes back when dropped. It belongs to the thread that asked.
#[derive(Debug)]
pub struct Rights {
    /// All memory of the process stays in RAM: no page has to be fetched in the middle of a step.
    pub memory: Right,
    /// The thread runs before all ordinary ones (`SCHED_FIFO`).
    pub priority: Right,
    before: Option<(ThreadSchedulePolicy, ThreadPriority)>,
}

impl Rights {
    /// Asks for the rights of a real-time loop; what is not permitted is told, and no error.
    ///
    /// `priority` is that of `SCHED_FIFO`, 1 to 99; 80 lies above the interrupt threads of Linux with real-time patches (50).
    pub fn ask(lock_memory: bool, priority: Option<u8>) -> Self {
        let memory = if lock_memory { lock() } else { Right::NotAsked };
        let (priority, before) = priority.map_or((Right::NotAsked, None), raise);
        Self { memory, priority, before }
    }
}

impl Drop for Rights {
    fn drop(&mut self) {
        if let Some((policy, priority)) = self.before.take() {
            // What was there before needs no permission.
            let _ = set_thread_priority_and_policy(thread_native_id(), priority, policy);
        }
        #[cfg(target_os = "linux")]
        if self.memory == Right::Given {
            let _ = munlockall();
        }
    }
}

/// Right to locked memory: locks what there is and that to come. Under a limit what is to come could be refused in the
/// middle of a run: then not at all.
#[cfg(target_os = "linux")]
fn lock() -> Right {
    if let (Some(limit), false) = (getrlimit(Resource::Memlock).current, geteuid().is_root()) {
        return Right::Refused(format!(
            "this user may lock {} kB only; raise it, for example by `ulimit -l unlimited` or in /etc/security/limits.conf",
            limit / 1024
        ));
    }
    match mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE) {
        Ok(()) => Right::Given,
        Err(error) => {
            Right::Refused(format!("the operating system refuses to lock memory ({error}); run with CAP_IPC_LOCK"))
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn lock() -> Right {
    Right::Refused("memory can be locked on Linux only; run the loop there".to_owned())
}

fn raise(priority: u8) -> (Right, Option<(ThreadSchedulePolicy, ThreadPriority)>) {
    let Ok(value) = ThreadPriorityValue::try_from(priority) else {
        return (
            Right::Refused(format!("a priority of {priority} is none of SCHED_FIFO; give one from 1 to 99")),
            None,
        );
    };
    let before = thread_schedule_policy_param(thread_native_id()).ok().map(|(policy, params)| {
        let value = match policy {
            ThreadSchedulePolicy::Normal(_) => as_nice(nice()),
            ThreadSchedulePolicy::Realtime(_) => u8::try_from(params.sched_priority).unwrap_or(0),
        };
        (policy, ThreadPriorityValue::try_from(value).map_or(ThreadPriority::Min, ThreadPriority::Crossplatform))
    });
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    match set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy) {
        Ok(()) => (Right::Given, before),
        Err(error) => {
            let message = format!(
                "the operating system refuses the priority {priority} ({error}); run with CAP_SYS_NICE, or allow `rtprio` in /etc/security/limits.conf"
            );
            (Right::Refused(message), None)
        }
    }
}

/// Nice value of this thread, -20 to 19, for its rights.
#[cfg(target_os = "linux")]
fn nice() -> i32 {
    getpriority_process(None).unwrap_or(0)
}

#[cfg(not(target_os = "linux"))]
fn nice() -> i32 {
    0
}

/// Value from 0 to 99 that `thread_priority` takes as a right for a nice value. It cuts 39 (1 - value / 99) - 20 to a
/// whole number.
///
/// With the lowest one instead, an ordinary thread would come out of a loop as the last of all (nice 19), and only root
/// could change that.
fn as_nice(nice: i32) -> u8 {
    let value = 99.0 * (1.0 - (f64::from(nice) + 20.5) / 39.0);
    value.round().clamp(0.0, 99.0) as u8
}
