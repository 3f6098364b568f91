use slate_blackboard::interface::schema_hash;

/// Returns the hash of a service, over its name and the layout of its table.
pub(crate) const fn service_hash(name: &str, size: usize, align: usize) -> u64 {
    let layout = [(size as u64).to_le_bytes(), (align as u64).to_le_bytes()];
    let bytes = layout.as_flattened();
    let (mut hash, mut i) = (schema_hash(name, &[]), 0);
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0100_0000_01b3);
        i += 1;
    }
    hash
}
