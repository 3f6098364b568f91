//! Threads: those beside the loop that are in no hurry, and how those of modules are named.

/// Lets this thread, and those that it starts, wake up behind all others: it runs at once where a processor is free, and its waking
/// takes none away from a thread that is at work, such as the loop.
///
/// It is Linux's `SCHED_BATCH`, also where the agent was started in real time. Where the system refuses or knows no such thing, the
/// thread stays as it is.
pub fn give_way() {
    #[cfg(target_os = "linux")]
    {
        let parameters = libc::sched_param { sched_priority: 0 };
        // SAFETY: the parameters live during the call, and 0 is this thread.
        let _ = unsafe { libc::sched_setscheduler(0, libc::SCHED_BATCH, &raw const parameters) };
    }
}

/// What Linux shows of a thread's name, bytes.
const SHOWN: usize = 15;

/// The name of a module's thread. Of one that is too long the end of its scope and the end of its own name are kept, as
/// names of one robot differ there.
pub fn thread_name(module: &str) -> String {
    let tail = |text: &str, length: usize| {
        let mut start = text.len().saturating_sub(length);
        while !text.is_char_boundary(start) {
            start += 1;
        }
        text[start..].to_owned()
    };
    match module.rsplit_once('/') {
        _ if module.len() <= SHOWN => module.into(),
        Some((scope, name)) => {
            let scope = tail(scope, (SHOWN - 1).saturating_sub(name.len()).max(SHOWN / 3));
            let rest = SHOWN - 1 - scope.len();
            format!("{scope}/{}", tail(name, rest))
        }
        None => tail(module, SHOWN),
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
            give_way();
            policy()
        });
        assert_eq!(after.join().unwrap(), libc::SCHED_BATCH);
        assert_eq!(policy(), before);
    }

    #[test]
    fn threads_of_long_names_differ() {
        let names = ["r2/planner", "planner_of_long_paths", "robot_1/local_planner", "robot_2/local_planner"];
        let shown = ["r2/planner", "r_of_long_paths", "bot_1/l_planner", "bot_2/l_planner"];
        assert_eq!(names.map(thread_name), shown);
        assert_eq!(thread_name("a_robot_with_a_name/act"), "with_a_name/act");
    }
}
