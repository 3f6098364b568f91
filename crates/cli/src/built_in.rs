//! Robots and modules built into the `slate` command.

pub mod absent_kinds;
pub mod examples;

/// Name of each feature, and whether it is built in.
pub const FEATURES: [(&str, bool); 15] = [
    ("console", cfg!(feature = "console")),
    ("dds", cfg!(feature = "dds")),
    ("drivers", cfg!(feature = "drivers")),
    ("evaluate", cfg!(feature = "evaluate")),
    ("groot", cfg!(feature = "groot")),
    ("jpeg", cfg!(feature = "jpeg")),
    ("lua", cfg!(feature = "lua")),
    ("mcp", cfg!(feature = "mcp")),
    ("missions", cfg!(feature = "missions")),
    ("navigation", cfg!(feature = "navigation")),
    ("ros1", cfg!(feature = "ros1")),
    ("ros2", cfg!(feature = "ros2")),
    ("tls", cfg!(feature = "tls")),
    ("vision", cfg!(feature = "vision")),
    ("zenoh", cfg!(feature = "zenoh")),
];
