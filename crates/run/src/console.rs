//! Console of a run over HTTP.

use std::process::{Command, Stdio};

use slate_runtime::configuration::Configuration;

use crate::RunError;
use crate::mission::MissionRun;

#[cfg(feature = "console")]
mod built_in {
    use std::sync::Arc;

    use serde_json::json;
    use slate_console::{Console, Document, Settings};
    use slate_control::ControlSurface;

    use super::{Configuration, MissionRun, RunError};
    use crate::trails::Trails;

    /// Console of a run, as long as this value lives.
    pub struct RunConsole {
        console: Console,
        _trails: Trails,
    }

    impl RunConsole {
        /// Returns the link that a browser opens.
        pub fn link(&self) -> &str {
            self.console.link()
        }

        /// Returns whether a browser shows the page.
        pub fn has_browser(&self) -> bool {
            self.console.browsers() > 0
        }
    }

    /// Console settings of a configuration.
    pub struct ConsoleOptions {
        settings: Settings,
        is_named: bool,
    }

    impl ConsoleOptions {
        pub fn of(configuration: &Configuration) -> Result<Self, RunError> {
            let is_named = configuration.value(slate_console::TABLE).is_some();
            Ok(Self { settings: Settings::of(configuration)?, is_named })
        }

        /// Opens the console if the run is watched or its configuration requests it.
        pub fn open(
            &self,
            mission: &MissionRun,
            surface: Arc<ControlSurface>,
            is_watched: bool,
        ) -> Result<Option<RunConsole>, RunError> {
            if !self.settings.enabled.unwrap_or(is_watched || self.is_named) {
                return Ok(None);
            }
            let scene = serde_json::to_value(mission.scene()).unwrap_or_default();
            let world = Document { name: "world".into(), read: Arc::new(move || scene.clone()) };
            let trails = Trails::follow(Arc::clone(&mission.observation), mission.agent.clock());
            let trail = Document { name: "trails".into(), read: trails.reader() };
            // The surface keeps its documents.
            let weak = Arc::downgrade(&surface);
            let over =
                move || json!({ "over": weak.upgrade().as_ref().and_then(|surface| surface.run_end()) });
            let run = Document { name: "run".into(), read: Arc::new(over) };
            surface.add_documents([world, trail, run]);
            match Console::start_on(surface, &self.settings, Vec::new()) {
                Ok(console) => {
                    eprintln!("console: {}", console.link());
                    Ok(Some(RunConsole { console, _trails: trails }))
                }
                Err(error) if self.is_named => Err(error.into()),
                // A run without `--console` continues without it.
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
    use std::sync::Arc;

    use slate_control::ControlSurface;

    use super::{Configuration, MissionRun, RunError};

    /// Console of a program without the feature, which never exists.
    pub enum RunConsole {}

    impl RunConsole {
        pub fn link(&self) -> &str {
            match *self {}
        }

        pub fn has_browser(&self) -> bool {
            match *self {}
        }
    }

    pub struct ConsoleOptions;

    impl ConsoleOptions {
        pub fn of(configuration: &Configuration) -> Result<Self, RunError> {
            let Some(table) = configuration.value("console") else { return Ok(Self) };
            let help = "build it with the feature `console`, or take the table away";
            let message = slate_runtime::ErrorCode::Feature.of("this program is built without a console");
            Err(RunError::Configuration(
                configuration.diagnostic(table.span, message, Some(help.into())).into(),
            ))
        }

        pub fn open(
            &self,
            _: &MissionRun,
            _: Arc<ControlSurface>,
            _: bool,
        ) -> Result<Option<RunConsole>, RunError> {
            Ok(None)
        }
    }
}

pub use built_in::{ConsoleOptions, RunConsole};

/// Checks the table `[console]`.
///
/// # Errors
/// A setting that a run would refuse.
pub fn check_console(configuration: &Configuration) -> Result<(), RunError> {
    ConsoleOptions::of(configuration).map(|_| ())
}

/// Makes the system open a link.
///
/// # Errors
/// If the program for it can't be started.
pub fn open_browser(link: &str) -> Result<(), RunError> {
    let usual = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let program = std::env::var("BROWSER").ok().filter(|name| !name.is_empty());
    let program = program.unwrap_or_else(|| usual.into());
    let started = Command::new(&program)
        .arg(link)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    started.map(drop).map_err(|source| RunError::File { path: program.into(), source })
}
