pub fn of(_: &str) -> Option<&'static str> {
    None
}
