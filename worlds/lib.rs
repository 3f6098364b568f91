//! Worlds as TOML. `slate-sim` reads them by name.

/// Name and description of each world.
pub const WORLDS: [(&str, &str); 2] =
    [("rescue_arena", include_str!("rescue_arena.toml")), ("rocs_arena", include_str!("rocs_arena.toml"))];
