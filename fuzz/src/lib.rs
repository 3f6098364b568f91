//! Hostile bytes for everything that takes bytes from elsewhere.
//! Each module is a target, which promises: no panic, no abort, no hang, no more memory than the limits of the code,
//! and a refusal changes nothing.
//!
//! `cargo test -p slate-fuzz` runs each target on its corpus in `fuzz/corpus` and on edits of it. `fuzz/run SECONDS` lets
//! a fuzzer run each target for that long, from the corpus on; 0 seconds replay it.
//! `cargo fuzz run --features libfuzzer TARGET` works, too.
//! `cargo run -p slate-fuzz --example corpus` makes the corpus from conversations of real agents.
//! What a fuzzer has found goes into it under a name that says what it was.

pub mod agents;
pub mod bag;
pub mod behavior_tree;
pub mod configuration;
pub mod conversation;
pub mod definition;
pub mod drivers;
pub mod encoding;
pub mod golog;
pub mod idl;
pub mod input;
pub mod interface;
pub mod knowledge;
pub mod knowledge_file;
pub mod logs;
pub mod map_file;
pub mod memory;
pub mod navigation_graph;
pub mod network;
pub mod outline;
pub mod peer;
pub mod petri_net;
pub mod robot;
pub mod shared_memory;
pub mod snapshot;
pub mod state;
pub mod tool;

// What reads the interfaces of a source file belongs to the `slate` command, and calls these by the facade's names.
extern crate self as slate;
#[doc(hidden)]
pub use slate_blackboard as blackboard;
#[doc(hidden)]
pub use slate_interfaces as interfaces;
#[doc(hidden)]
pub use slate_module as module;

use std::path::PathBuf;
use std::sync::OnceLock;

/// A folder of this process in memory, for files and sockets.
pub fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let memory = PathBuf::from("/dev/shm");
        let parent = if memory.is_dir() { memory } else { std::env::temp_dir() };
        let folder = parent.join(format!("slate-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("there is room");
        folder
    })
}
