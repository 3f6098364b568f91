//! Scheduling and names of threads: background, precise and of modules.

/// Gives this thread and those that it starts batch scheduling (`SCHED_BATCH`).
/// It runs at once where a processor is free, and its waking preempts no thread that is at work, such as the loop.
///
/// It is Linux's `SCHED_BATCH`, also where the agent was started in real time. Where the system refuses or knows no such thing, the
/// thread remains unchanged.
pub fn set_batch_scheduling() {
    #[cfg(target_os = "linux")]
    {
        let parameters = libc::sched_param { sched_priority: 0 };
        // SAFETY: the parameters live during the call, and 0 is this thread.
        let _ = unsafe { libc::sched_setscheduler(0, libc::SCHED_BATCH, &raw const parameters) };
    }
}

/// Gives this thread, but none that it starts, precedence over ordinary threads.
/// For a thread that does little work and must be punctual.
///
/// It is the lowest real-time priority where the system allows one, else a short time slice, which Linux 6.12 and later
/// takes as a wish to run soon. A thread that has a priority of its own already keeps it.
pub fn raise_priority() {
    #[cfg(target_os = "linux")]
    {
        // SAFETY: it takes no pointer, and 0 is this thread.
        if !matches!(unsafe { libc::sched_getscheduler(0) }, libc::SCHED_OTHER | libc::SCHED_BATCH) {
            return;
        }
        let real_time = |attributes: &mut libc::sched_attr| {
            attributes.sched_policy = libc::SCHED_FIFO as u32;
            attributes.sched_priority = 1;
        };
        let short_slice = |attributes: &mut libc::sched_attr| {
            attributes.sched_policy = libc::SCHED_OTHER as u32;
            attributes.sched_runtime = SHORTEST_TIME_SLICE;
        };
        let _ = set_scheduling(real_time) || set_scheduling(short_slice);
    }
}

/// Shortest time slice of Linux, ns.
#[cfg(target_os = "linux")]
const SHORTEST_TIME_SLICE: u64 = 100_000;

/// Sets the scheduling of this thread, but not of those that it starts.
/// False if the system refuses.
#[cfg(target_os = "linux")]
fn set_scheduling(choose: impl FnOnce(&mut libc::sched_attr)) -> bool {
    // SAFETY: it is made of integers alone.
    let mut attributes: libc::sched_attr = unsafe { std::mem::zeroed() };
    attributes.size = size_of::<libc::sched_attr>() as u32;
    attributes.sched_flags = libc::SCHED_FLAG_RESET_ON_FORK as u64;
    choose(&mut attributes);
    // SAFETY: the attributes live during the call and say their size; 0 is this thread, and there are no flags.
    unsafe { libc::syscall(libc::SYS_sched_setattr, 0, &raw const attributes, 0) == 0 }
}

/// Longest thread name that Linux shows, bytes.
const NAME_LENGTH_LIMIT: usize = 15;

/// Returns the name of a module's thread, at most 15 bytes.
/// A longer name is reduced to the ends of its scope and of its own name, as names of one robot differ there.
pub fn thread_name(module: &str) -> String {
    let tail = |text: &str, length: usize| {
        let mut start = text.len().saturating_sub(length);
        while !text.is_char_boundary(start) {
            start += 1;
        }
        text[start..].to_owned()
    };
    match module.rsplit_once('/') {
        _ if module.len() <= NAME_LENGTH_LIMIT => module.into(),
        Some((scope, name)) => {
            let scope =
                tail(scope, (NAME_LENGTH_LIMIT - 1).saturating_sub(name.len()).max(NAME_LENGTH_LIMIT / 3));
            let length = NAME_LENGTH_LIMIT - 1 - scope.len();
            format!("{scope}/{}", tail(name, length))
        }
        None => tail(module, NAME_LENGTH_LIMIT),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    #[allow(clippy::unwrap_used, reason = "a test that fails panics")]
    fn a_thread_that_gives_way_is_scheduled_as_one_of_a_batch() {
        // SAFETY: it takes no pointer, and 0 is this thread.
        let policy = || unsafe { libc::sched_getscheduler(0) };
        let before = policy();
        let after = std::thread::spawn(move || {
            set_batch_scheduling();
            policy()
        });
        assert_eq!(after.join().unwrap(), libc::SCHED_BATCH);
        assert_eq!(policy(), before);
    }

    #[test]
    #[cfg(target_os = "linux")]
    #[allow(clippy::unwrap_used, reason = "a test that fails panics")]
    fn thread_that_takes_precedence_passes_it_to_no_other() {
        // SAFETY: it takes no pointer, and 0 is this thread.
        let policy = || unsafe { libc::sched_getscheduler(0) } & !RESET_ON_FORK;
        let before = policy();
        let (own, child) = std::thread::spawn(move || {
            raise_priority();
            (policy(), std::thread::spawn(policy).join().unwrap())
        })
        .join()
        .unwrap();
        assert!(matches!(own, libc::SCHED_FIFO | libc::SCHED_OTHER), "{own}");
        assert_eq!((child, policy()), (before, before));
    }

    /// Flag of a scheduling policy that threads do not inherit.
    const RESET_ON_FORK: i32 = 0x4000_0000;

    #[test]
    fn threads_of_long_names_differ() {
        let names = ["r2/planner", "planner_of_long_paths", "robot_1/local_planner", "robot_2/local_planner"];
        let shown = ["r2/planner", "r_of_long_paths", "bot_1/l_planner", "bot_2/l_planner"];
        assert_eq!(names.map(thread_name), shown);
        assert_eq!(thread_name("a_robot_with_a_name/act"), "with_a_name/act");
    }
}
