//! Shared setup of the works that measure iceoryx2.

use std::sync::atomic::{AtomicU64, Ordering};

use iceoryx2::prelude::*;

/// A node, and a name that no other service has.
pub fn node(what: &str) -> (Node<ipc::Service>, ServiceName) {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    (plain_node(), name(&format!("slate-bench/{what}/{}/{number}", std::process::id())))
}

/// A node.
pub fn plain_node() -> Node<ipc::Service> {
    set_log_level(LogLevel::Error);
    let node = NodeBuilder::new().signal_handling_mode(SignalHandlingMode::Disabled).create();
    node.expect("iceoryx2 has its folders in /tmp and /dev/shm")
}

/// A service's name.
pub fn name(text: &str) -> ServiceName {
    text.try_into().expect("it is short and has no strange letters")
}
