/// Formats nanoseconds as seconds, exactly.
pub fn seconds(time: u64) -> String {
    format!("{}.{:09}", time / 1_000_000_000, time % 1_000_000_000)
}
