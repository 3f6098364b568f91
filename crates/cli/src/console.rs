//! How a run is reached over HTTP.

use slate::runtime::configuration::Configuration;

use crate::failure::Failure;
use crate::mission::MissionRun;

#[cfg(feature = "console")]
mod built_in {
    use std::path::Path;
    use std::sync::{Arc, OnceLock};

    use serde_json::json;
    use slate::console::{Console, Document, Settings};
    use slate::control::ControlSurface;

    use super::{Configuration, Failure, MissionRun};
    use crate::recording::known;
    use crate::trails::Trails;

    /// A run is reached as long as this lives.
    pub struct Opened {
        console: Console,
        _trails: Trails,
        over: Arc<OnceLock<String>>,
    }

    impl Opened {
        /// Returns the link that a browser opens.
        pub fn link(&self) -> &str {
            self.console.link()
        }

        /// Whether a browser shows the page.
        pub fn has_browser(&self) -> bool {
            self.console.browsers() > 0
        }

        /// Tells those who look that the run is over, and how it ended.
        pub fn tell_over(&self, how: &str) {
            // It ends once.
            let _ = self.over.set(how.to_owned());
        }
    }

    /// Begins for a recording that is played, at this computer alone: what the recorded run says of addresses and secrets is for
    /// that run. The world is that of the recorded configuration, if it can still be read.
    pub fn open_playback(surface: Arc<ControlSurface>, file: &Path) -> Option<Console> {
        let scene = known(file).map(|known| serde_json::to_value(known.scene).unwrap_or_default());
        let world =
            scene.map(|scene| Document { name: "world".into(), read: Arc::new(move || scene.clone()) });
        surface.add_documents(world);
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

    /// Console settings of a configuration.
    pub struct Wish {
        settings: Settings,
        is_named: bool,
    }

    impl Wish {
        pub fn of(configuration: &Configuration) -> Result<Self, Failure> {
            let is_named = configuration.value(slate::console::TABLE).is_some();
            Ok(Self { settings: Settings::of(configuration)?, is_named })
        }

        /// Begins, in a run that somebody watches or whose configuration asks for it.
        pub fn open(
            &self,
            mission: &MissionRun,
            surface: Arc<ControlSurface>,
            is_watched: bool,
        ) -> Result<Option<Opened>, Failure> {
            if !self.settings.enabled.unwrap_or(is_watched || self.is_named) {
                return Ok(None);
            }
            let scene = serde_json::to_value(mission.scene()).unwrap_or_default();
            let world = Document { name: "world".into(), read: Arc::new(move || scene.clone()) };
            let trails = Trails::follow(Arc::clone(&mission.observation), mission.agent.clock());
            let trail = Document { name: "trails".into(), read: trails.reader() };
            let over = Arc::<OnceLock<String>>::default();
            let told = Arc::clone(&over);
            let run = Document { name: "run".into(), read: Arc::new(move || json!({ "over": told.get() })) };
            surface.add_documents([world, trail, run]);
            match Console::start_on(surface, &self.settings, Vec::new()) {
                Ok(console) => {
                    eprintln!("console: {}", console.link());
                    Ok(Some(Opened { console, _trails: trails, over }))
                }
                Err(error) if self.is_named => Err(error.into()),
                // A run that nobody has asked it of goes on without.
                Err(error) => {
                    eprintln!("{error}");
                    Ok(None)
                }
            }
        }
    }
}

#[cfg(not(feature = "console"))]
mod built_in {
    use std::path::Path;
    use std::sync::Arc;

    use slate::control::ControlSurface;

    use super::{Configuration, Failure, MissionRun};

    pub fn open_playback(_: Arc<ControlSurface>, _: &Path) -> Option<()> {
        None
    }

    /// There is none.
    pub enum Opened {}

    impl Opened {
        pub fn link(&self) -> &str {
            match *self {}
        }

        pub fn has_browser(&self) -> bool {
            match *self {}
        }

        pub fn tell_over(&self, _: &str) {
            match *self {}
        }
    }

    pub struct Wish;

    impl Wish {
        pub fn of(configuration: &Configuration) -> Result<Self, Failure> {
            let Some(table) = configuration.value("console") else { return Ok(Self) };
            let help = "build it with the feature `console`, or take the table away";
            let message = "this program is built without a console";
            Err(Failure::Configuration(
                configuration.diagnostic(table.span, message, Some(help.into())).into(),
            ))
        }

        pub fn open(
            &self,
            _: &MissionRun,
            _: Arc<ControlSurface>,
            _: bool,
        ) -> Result<Option<Opened>, Failure> {
            Ok(None)
        }
    }
}

pub use built_in::{Opened, Wish, open_playback};
