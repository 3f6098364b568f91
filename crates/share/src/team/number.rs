use slate_sorted::SortedMap;

/// Returns the number of a robot, a hash of its name.
pub fn robot_number(name: &str) -> u32 {
    // The lower half.
    xxhash_rust::xxh3::xxh3_64(name.as_bytes()) as u32
}

/// Refuses names with the same number.
pub(super) fn check<'a>(own: &'a str, others: impl Iterator<Item = &'a str>) -> Result<(), String> {
    let mut numbers = SortedMap::from([(robot_number(own), own)]);
    for name in others {
        if let Some(known) = numbers.insert(robot_number(name), name)
            && known != name
        {
            return Err(clash(known, name));
        }
    }
    Ok(())
}

/// Returns the error of two robots whose names have the same number.
pub(super) fn clash(one: &str, other: &str) -> String {
    format!(
        "the robots `{one}` and `{other}` can't be in one team: their names have the same number, {:08x}; rename one \
         of them",
        robot_number(one)
    )
}
