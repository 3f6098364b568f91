//! Threads beside the loop that are in no hurry.

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

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::give_way;

    #[test]
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
}
