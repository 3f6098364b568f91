//! Shared setup of the works that measure Zenoh.

use zenoh::Wait;

/// Opens a session without discovery.
/// It listens or connects at the port, or is alone.
pub fn session(at: Option<(&str, &str)>) -> zenoh::Session {
    let mut config = zenoh::Config::default();
    let mut set = |key: &str, value: &str| config.insert_json5(key, value).expect("a setting of Zenoh");
    set("mode", "\"peer\"");
    set("scouting/multicast/enabled", "false");
    set("scouting/gossip/enabled", "false");
    set("listen/endpoints", "[]");
    if let Some((which, port)) = at {
        set(&format!("{which}/endpoints"), &format!("[\"tcp/127.0.0.1:{port}\"]"));
    }
    zenoh::open(config).wait().expect("it can listen or connect")
}
