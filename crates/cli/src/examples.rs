//! Examples and configurations by name, with the modules of the command.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use slate::blackboard::nearest_names;
use slate::module::Plugin;
use slate::runtime::configuration::{Configuration, Database, Options, Report, Variant, parse_change};
use slate::runtime::plugin::LibraryError;
use slate::runtime::snapshot::{Snapshot, SnapshotError};
use slate_run::{Application, EXTRA_TABLES, PATHS, RunHistory, output};

use crate::FEATURES;
use crate::absent_kinds::check_kinds;

/// Error of finding an application.
#[derive(Debug, thiserror::Error)]
pub enum ExampleError {
    /// Neither an example nor a file.
    #[error("no example or file is named `{name}`")]
    Unknown {
        /// Requested name.
        name: String,
        /// Advice.
        help: String,
    },
    /// Folder in the place of a file.
    #[error("`{}` is a folder, not a configuration file", .path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Configuration file in it, if any.
        inside: Option<PathBuf>,
    },
    /// Library of modules that defines no robot.
    #[error("the library `{}` brings modules, and no robot", .path.display())]
    NoRobot {
        /// The library.
        path: PathBuf,
    },
    /// Pipe or device.
    #[error("`{}` is a pipe or a device: expected a regular file, as a configuration is read more than once", .path.display())]
    Unseekable {
        /// The pipe or device.
        path: PathBuf,
    },
    /// Example of a feature that is not built in.
    #[error("{what} is not built in")]
    NotBuilt {
        /// Missing part.
        what: String,
        /// Feature of the command.
        feature: &'static str,
    },
    /// Setting that chooses another variant than a snapshot has.
    #[error("`--set {set}` has no effect: a resumed run keeps the variant of its snapshot")]
    OtherVariant {
        /// The setting.
        set: String,
    },
    /// Invalid configuration.
    #[error("{0}")]
    Configuration(#[from] Report),
    /// Unsuitable library.
    #[error("{0}")]
    Library(#[from] LibraryError),
    /// Unsuitable snapshot.
    #[error("{0}")]
    Snapshot(#[from] SnapshotError),
    /// File that can't be read.
    #[error("`{path}` can't be used: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
}

impl ExampleError {
    /// Returns the advice, if any.
    pub fn help(&self) -> Option<String> {
        use miette::Diagnostic;
        Some(match self {
            Self::Unknown { help, .. } => help.clone(),
            Self::Folder { inside: Some(file), .. } => format!("name a file in it, such as `{}`", file.display()),
            Self::Folder { inside: None, .. } => "name a file, such as `robot.toml`".into(),
            Self::NoRobot { .. } => {
                "export one, `plugin!(...; robot = rover)`, or run a configuration that names the library as a plugin".into()
            }
            Self::Unseekable { .. } => "write the configuration into a file".into(),
            Self::NotBuilt { feature, .. } => {
                format!("build it with the feature `{feature}`: cargo build --release --features {feature}")
            }
            Self::OtherVariant { .. } => "omit it, or run the example without --resume".into(),
            Self::Library(error) => error.help.clone(),
            Self::Snapshot(error) => error.help()?.to_string(),
            Self::Configuration(_) | Self::File { .. } => return None,
        })
    }
}

/// Example that is linked into the command.
struct Example {
    name: &'static str,
    about: &'static str,
    configuration: &'static str,
    /// Path and text of the files that it includes.
    embedded: &'static [(&'static str, &'static str)],
}

const EXAMPLES: [Example; 4] = [
    Example {
        name: slate_exp1::NAME,
        about: slate_exp1::ABOUT,
        configuration: slate_exp1::CONFIGURATION,
        embedded: &[],
    },
    Example {
        name: slate_exp2::NAME,
        about: slate_exp2::ABOUT,
        configuration: slate_exp2::CONFIGURATION,
        embedded: slate_exp2::EMBEDDED,
    },
    Example {
        name: slate_exp3::NAME,
        about: slate_exp3::ABOUT,
        configuration: slate_exp3::CONFIGURATION,
        embedded: slate_exp3::EMBEDDED,
    },
    Example {
        name: slate_suave::NAME,
        about: slate_suave::ABOUT,
        configuration: slate_suave::CONFIGURATION,
        embedded: &[],
    },
];

/// Example that is a configuration file, in the folder `examples` of the sources.
struct FileExample {
    name: &'static str,
    about: &'static str,
    file: &'static str,
    /// Features of the command that the example needs.
    features: &'static [&'static str],
}

const FILE_EXAMPLES: [FileExample; 24] = [
    FileExample {
        name: "mapping",
        about: "a robot with a laser makes a map and plans its way through it",
        file: "mapping/mapping.toml",
        features: &[],
    },
    FileExample {
        name: "localization",
        about: "a robot with a laser finds its pose in the map of an office and drives by it",
        file: "localization/localization.toml",
        features: &["navigation"],
    },
    FileExample {
        name: "explore",
        about: "a robot with a laser explores an unknown building and saves its map",
        file: "explore/explore.toml",
        features: &["navigation"],
    },
    FileExample {
        name: "slam",
        about: "the laser log of a real building becomes a map",
        file: "slam/intel.toml",
        features: &["navigation"],
    },
    FileExample {
        name: "office",
        about: "a robot with a laser delivers between the rooms of an office",
        file: "office/office.toml",
        features: &["navigation"],
    },
    FileExample {
        name: "adaptation",
        about: "a robot whose sensors fail, and a loop that adapts it",
        file: "adaptation/adaptation.toml",
        features: &[],
    },
    FileExample {
        name: "reflexes",
        about: "reflexes of three ranks",
        file: "reflexes/reflexes.toml",
        features: &[],
    },
    FileExample {
        name: "patrol",
        about: "a robot that visits three places by a Petri Net Plan and lets others pass",
        file: "patrol/patrol.toml",
        features: &["missions"],
    },
    FileExample {
        name: "patrol_golog",
        about: "the same patrol by a Golog program",
        file: "patrol/patrol_golog.toml",
        features: &["missions"],
    },
    FileExample {
        name: "patrol_tree",
        about: "the same patrol by a behavior tree",
        file: "patrol/patrol_tree.toml",
        features: &["missions"],
    },
    FileExample {
        name: "patrol_lua",
        about: "the same patrol by skills in Lua",
        file: "patrol/patrol_lua.toml",
        features: &["lua"],
    },
    FileExample {
        name: "door",
        about: "two robots that pass a door one after the other and come back, by one Petri net",
        file: "door/door.toml",
        features: &["missions"],
    },
    FileExample {
        name: "strategies",
        about: "plans chosen by past outcomes",
        file: "strategies/strategies.toml",
        features: &[],
    },
    FileExample {
        name: "roles",
        about: "two robots that exchange the roles of attacker and defender",
        file: "roles/roles.toml",
        features: &[],
    },
    FileExample {
        name: "camera",
        about: "a camera and the objects in its images",
        file: "camera/camera.toml",
        features: &["vision"],
    },
    FileExample {
        name: "rescue_camera",
        about: "a camera on a pan-tilt head in a damaged building",
        file: "camera/rescue_camera.toml",
        features: &["vision"],
    },
    FileExample {
        name: "rescue",
        about: "a rescue robot that explores a damaged building, reports victims and adapts, in three steps",
        file: "rescue/context.toml",
        features: &["navigation", "missions", "vision"],
    },
    FileExample {
        name: "rescue_reactive",
        about: "a rescue robot that drives to targets in its own frame",
        file: "rescue/reactive.toml",
        features: &["navigation"],
    },
    FileExample {
        name: "rescue_hybrid",
        about: "the same robot, which explores a damaged building and reports victims",
        file: "rescue/hybrid.toml",
        features: &["navigation", "missions", "vision"],
    },
    FileExample {
        name: "rescue_context",
        about: "the same robot, which adapts to the ground and to its speed",
        file: "rescue/context.toml",
        features: &["navigation", "missions", "vision"],
    },
    FileExample {
        name: "sharing",
        about: "two agents, one of which reads the other",
        file: "sharing/team.toml",
        features: &[],
    },
    FileExample {
        name: "exp1_policy",
        about: "EXP1's robot at velocities of a program, such as a policy that learns",
        file: "exp1/exp1_policy.toml",
        features: &[],
    },
    FileExample {
        name: "navigation_policy",
        about: "a robot with a laser in an office, at velocities of a program",
        file: "office/navigation_policy.toml",
        features: &[],
    },
    FileExample {
        name: "team",
        about: "eight robots that explore an arena and tell each other what they find",
        file: "team/team.toml",
        features: &[],
    },
];

impl FileExample {
    /// Returns the first feature that it needs and that is not built in.
    fn missing_feature(&self) -> Option<&'static str> {
        self.features.iter().copied().find(|feature| FEATURES.contains(&(feature, false)))
    }

    /// Returns its file.
    /// It is in the installed folder, or else in the sources that this program was built from, or of the working folder.
    fn path(&self) -> Option<PathBuf> {
        let built = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples")).into();
        let folders = installed().into_iter().chain([built, "examples".into()]);
        folders.map(|folder: PathBuf| folder.join(self.file)).find(|path| path.is_file())
    }
}

/// Folder of the examples' files, given by a program of which this is a part.
static FOLDER: OnceLock<PathBuf> = OnceLock::new();

/// Sets the folder of the examples' files; the first call counts.
pub fn set_folder(folder: PathBuf) {
    // A second folder is that of the same package.
    let _ = FOLDER.set(folder);
}

/// Returns the folder of the examples' files that a package has installed.
/// It is `share/slate/examples` beside the folder of the program, unless [set](set_folder).
fn installed() -> Option<PathBuf> {
    let beside = || Some(std::env::current_exe().ok()?.parent()?.parent()?.join("share/slate/examples"));
    FOLDER.get().cloned().or_else(beside)
}

/// Returns the file of a name: an example's, or that of the name itself.
fn file_of(name: &str) -> PathBuf {
    let own = Path::new(name);
    let example = FILE_EXAMPLES.iter().find(|example| example.name == name).filter(|_| !own.is_file());
    example.and_then(FileExample::path).unwrap_or_else(|| own.to_owned())
}

/// Returns the feature that an example's file needs and that is not built in.
fn missing_feature_of(file: &Path) -> Option<&'static str> {
    FILE_EXAMPLES
        .iter()
        .find(|example| example.path().as_deref() == Some(file))
        .and_then(FileExample::missing_feature)
}

/// Creates an application with the modules that are linked into the command.
fn application(name: &str, database: Database) -> Result<Application, ExampleError> {
    check_kinds(&database.current())?;
    Ok(Application::new(name, database, plugins()))
}

/// Returns the modules that are linked into the command.
pub fn plugins() -> Vec<Plugin> {
    vec![
        slate::sim::plugin(),
        slate_wheeled::plugin(),
        slate_adaptation::plugin(),
        #[cfg(feature = "drivers")]
        slate_arcos::plugin(),
        #[cfg(feature = "drivers")]
        slate_drivers::plugin(),
        #[cfg(feature = "missions")]
        slate_executive::plugin(),
        #[cfg(feature = "navigation")]
        slate_exploration::plugin(),
        #[cfg(feature = "navigation")]
        slate_localization::plugin(),
        slate_mapping::plugin(),
        #[cfg(feature = "navigation")]
        slate_navigation::plugin(),
        #[cfg(feature = "navigation")]
        slate_slam::plugin(),
        #[cfg(feature = "vision")]
        slate_vision::plugin(),
        slate_exp3::plugin(),
        slate_suave::plugin(),
        slate_roles::plugin(),
        slate_team::plugin(),
    ]
}

/// Returns the agents that a file describes, if it describes several.
pub fn agents(name: &str, host: Option<&Path>) -> Result<Vec<String>, ExampleError> {
    let path = file_of(name);
    if EXAMPLES.iter().any(|example| example.name == name) || !path.is_file() || is_library(&path) {
        return Ok(Vec::new());
    }
    Ok(Configuration::agents(&path, &Options { host: host.map(Into::into), ..Options::default() })?)
}

/// Returns whether a file is a plugin's library, which may define a robot.
fn is_library(path: &Path) -> bool {
    path.extension().is_some_and(|end| end == "so")
}

/// Returns the robot configuration of a library, and the setting that loads it.
/// The setting makes the library its plugin.
fn robot_of(path: &Path) -> Result<(String, String), ExampleError> {
    let Some((plugin, text)) = slate::runtime::plugin::robot_of(path)? else {
        return Err(ExampleError::NoRobot { path: path.into() });
    };
    let file =
        std::path::absolute(path).map_err(|source| ExampleError::File { path: path.into(), source })?;
    let file = file.display().to_string();
    Ok((text, format!("plugins.{}.file={file:?}", plugin.name())))
}

/// Returns the first file in a folder that may be a configuration.
fn first_toml(folder: &Path) -> Option<PathBuf> {
    let files = std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    files.filter(|path| path.extension().is_some_and(|end| end == "toml") && path.is_file()).min()
}

/// Finds an example by name, from any directory, or reads a configuration file.
/// `agent` selects one of its agents; `defaults` apply to what is not set otherwise.
pub fn find(
    name: &str,
    agent: Option<&str>,
    defaults: Vec<String>,
    sets: Vec<String>,
    host: Option<&Path>,
) -> Result<Application, ExampleError> {
    let options = |sets| Options {
        defaults: defaults.clone(),
        sets,
        host: host.map(Into::into),
        agent: agent.map(Into::into),
        extra_tables: EXTRA_TABLES.map(Into::into).to_vec(),
        paths: PATHS.map(Into::into).to_vec(),
        ..Options::default()
    };
    if let Some(example) = EXAMPLES.iter().find(|example| example.name == name) {
        let file = format!("{name}.toml");
        let options = Options { embedded: example.embedded, ..options(sets) };
        return application(name, Database::from_text(&file, example.configuration, options)?);
    }
    let path = file_of(name);
    let path = path.as_path();
    if let Some(feature) = missing_feature_of(path) {
        return Err(ExampleError::NotBuilt { what: format!("what `{name}` runs"), feature });
    }
    if path.is_dir() {
        return Err(ExampleError::Folder { path: path.into(), inside: first_toml(path) });
    }
    if path.exists() && !path.is_file() {
        return Err(ExampleError::Unseekable { path: path.into() });
    }
    if !path.is_file() {
        let near = nearest_names(name, names());
        let all = names().collect::<Vec<_>>().join(", ");
        let help = match near.first() {
            Some(near) => format!("did you mean `{near}`? Examples: {all}; or name a configuration file"),
            None => format!("examples: {all}; or name a configuration file"),
        };
        return Err(ExampleError::Unknown { name: name.into(), help });
    }
    let stem = path.file_stem().map_or_else(|| name.into(), |stem| stem.to_string_lossy().into_owned());
    let stem = if is_library(path) { stem.trim_start_matches("lib").to_owned() } else { stem };
    // Reports of several agents go to folders of their own.
    let run = agent.map_or_else(|| stem.clone(), |agent| format!("{stem}-{agent}"));
    let (text, sets) = match is_library(path) {
        true => {
            let (text, plugin) = robot_of(path)?;
            (Some(text), std::iter::once(plugin).chain(sets).collect())
        }
        false => (None, sets),
    };
    let database = match &text {
        Some(text) => Database::from_text(&format!("{stem}.toml"), text, options(sets))?,
        None => Database::open(path, options(sets))?,
    };
    application(&run, database)
}

/// Returns the application of a snapshot, with its configuration of that time.
/// `sets` override it.
pub fn of(snapshot: &Snapshot, sets: Vec<String>) -> Result<Application, ExampleError> {
    let name = RunHistory::name_in(snapshot).unwrap_or_else(|| snapshot.agent().into());
    let database = snapshot.configuration(sets.clone())?;
    let configuration = database.current();
    // An unreadable file is reported with all other errors.
    let is_variant = |set: &String| {
        let path = parse_change(set).map(|(path, _)| path).unwrap_or_default();
        Variant::chosen(&configuration).any(|variant| variant.choice == path)
    };
    if let Some(set) = sets.into_iter().find(is_variant) {
        return Err(ExampleError::OtherVariant { set });
    }
    application(&name, database)
}

/// Returns the names of the examples.
pub fn names() -> impl Iterator<Item = &'static str> {
    EXAMPLES.iter().map(|example| example.name).chain(FILE_EXAMPLES.iter().map(|example| example.name))
}

/// Prints the examples.
pub fn list(json: bool) {
    if json {
        let one = |example: &Example| serde_json::json!({"name": example.name, "about": example.about});
        let file = |example: &FileExample| {
            let path = format!("examples/{}", example.file);
            serde_json::json!({
                "name": example.name, "about": example.about, "file": path, "missing_feature": example.missing_feature(),
            })
        };
        let all: Vec<_> = EXAMPLES.iter().map(one).chain(FILE_EXAMPLES.iter().map(file)).collect();
        output::document("slate.examples/1", &serde_json::json!({ "examples": all }));
        return;
    }
    for example in &EXAMPLES {
        output::line(format_args!("{:12} {}", example.name, example.about));
    }
    for example in &FILE_EXAMPLES {
        let missing = example.missing_feature();
        let missing = missing.map(|feature| format!("; build with --features {feature}")).unwrap_or_default();
        output::line(format_args!(
            "{:12} {}  (examples/{}{missing})",
            example.name, example.about, example.file
        ));
    }
}
