//! Console of a replayed recording over HTTP.

#[cfg(feature = "console")]
mod built_in {
    use std::path::Path;
    use std::sync::Arc;

    use slate::console::{Console, Document, Settings};
    use slate::control::ControlSurface;

    use crate::recording::known;

    /// Adds the world of a recorded run, if its configuration can still be read.
    pub fn add_world(surface: &ControlSurface, file: &Path) {
        let scene = known(file).map(|known| serde_json::to_value(known.scene).unwrap_or_default());
        let world =
            scene.map(|scene| Document { name: "world".into(), read: Arc::new(move || scene.clone()) });
        surface.add_documents(world);
    }

    /// Starts the console of a replayed recording, on this machine alone.
    /// Addresses and secrets of the recorded run apply to that run only. The world is that of the recorded
    /// configuration, if it can still be read.
    pub fn open_playback(surface: Arc<ControlSurface>, file: &Path) -> Option<Console> {
        add_world(&surface, file);
        match Console::start_on(surface, &Settings::default(), Vec::new()) {
            Ok(console) => {
                eprintln!("console: {}", console.link());
                Some(console)
            }
            // It is played all the same.
            Err(error) => {
                eprintln!("{error}");
                None
            }
        }
    }
}

#[cfg(not(feature = "console"))]
mod built_in {
    use std::path::Path;
    use std::sync::Arc;

    use slate::control::ControlSurface;

    pub fn open_playback(_: Arc<ControlSurface>, _: &Path) -> Option<()> {
        None
    }
}

#[cfg(feature = "console")]
pub use built_in::add_world;
pub use built_in::open_playback;
