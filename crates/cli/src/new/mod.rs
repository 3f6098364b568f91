//! Writes projects that are tested, built and run at once.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;

use slate_headers::HEADERS;

use crate::failure::Failure;
use crate::interface::export::{self, HeaderLanguage};
use crate::{examples, output};

/// Template of a project.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Template {
    /// A robot in MAPE-K: Monitor, Analyze, Plan, Execute and a reflex
    Mapek,
    /// A module beside the blocks of a robot:
    /// it finds the nearest obstacle in the sonar ranges
    Module,
    /// A plugin with one module that drives a robot
    Plugin,
    /// Such a plugin in C++17, with CMake
    #[value(skip)]
    Cpp,
    /// Such a plugin in C11, with CMake
    #[value(skip)]
    C,
}

#[derive(Debug, Args)]
pub struct NewOptions {
    /// Name of the project and its folder
    name: String,

    /// Template
    #[arg(long, short, value_enum, default_value_t = Template::Mapek)]
    template: Template,

    /// A plugin in C++17, built with CMake
    #[arg(long, conflicts_with_all = ["template", "slate"])]
    cpp: bool,

    /// A plugin in C11, built with CMake
    #[arg(long, conflicts_with_all = ["template", "slate", "cpp"])]
    c: bool,

    /// Checkout of Slate [default: around this program or the working folder]
    #[arg(long, value_name = "PATH")]
    slate: Option<PathBuf>,

    /// Print the names of the created files as JSON
    #[arg(long)]
    json: bool,
}

/// Name and text of a file with placeholders.
/// They are `PROJECT_NAME`, `MODULE_KIND` for the name of its module or blocks, and `SLATE_FOLDER`; a file's name has
/// `NAME` and `KIND`.
type TemplateFile = (&'static str, &'static str);

impl Template {
    /// Returns the files of a template in C or C++; none for the others.
    fn native_files(self) -> Vec<TemplateFile> {
        match self {
            Self::Cpp => vec![
                ("CMakeLists.txt", include_str!("template/cpp/CMakeLists.txt")),
                ("src/KIND.hpp", include_str!("template/cpp/module.hpp")),
                ("src/KIND.cpp", include_str!("template/cpp/plugin.cpp")),
                ("tests/test_KIND.cpp", include_str!("template/cpp/test.cpp")),
            ],
            Self::C => vec![
                ("CMakeLists.txt", include_str!("template/c/CMakeLists.txt")),
                ("src/KIND.h", include_str!("template/c/module.h")),
                ("src/KIND.c", include_str!("template/c/module.c")),
                ("tests/test_KIND.c", include_str!("template/c/test.c")),
            ],
            Self::Mapek | Self::Module | Self::Plugin => Vec::new(),
        }
    }

    fn files(self) -> Vec<TemplateFile> {
        let [manifest, library, configuration] = match self {
            Self::Mapek => [
                include_str!("template/mapek/manifest.toml"),
                include_str!("template/mapek/library.rs"),
                include_str!("template/mapek/configuration.toml"),
            ],
            Self::Module => [
                include_str!("template/plugin/manifest.toml"),
                include_str!("template/module/library.rs"),
                include_str!("template/module/configuration.toml"),
            ],
            Self::Plugin => [
                include_str!("template/plugin/manifest.toml"),
                include_str!("template/plugin/library.rs"),
                PLUGIN_CONFIGURATION,
            ],
            Self::Cpp | Self::C => {
                let mut files = self.native_files();
                files.push(("NAME.toml", PLUGIN_CONFIGURATION));
                files.push((".gitignore", "/build\n/runs\n"));
                return files;
            }
        };
        vec![
            ("Cargo.toml", manifest),
            ("src/lib.rs", library),
            ("NAME.toml", configuration),
            (".gitignore", "/target\n/runs\n"),
        ]
    }

    /// Returns the language of a template in C or C++.
    fn native(self) -> Option<HeaderLanguage> {
        match self {
            Self::Cpp => Some(HeaderLanguage::Cpp),
            Self::C => Some(HeaderLanguage::C),
            Self::Mapek | Self::Module | Self::Plugin => None,
        }
    }

    /// Returns the noun for a project of this template.
    fn noun(self) -> &'static str {
        match self {
            Self::Mapek => "robot",
            Self::Module => "module",
            Self::Plugin | Self::Cpp | Self::C => "plugin",
        }
    }

    /// Describes the project and its next steps.
    fn description(self) -> (&'static str, &'static str) {
        match self {
            Self::Mapek => (
                "is a robot in MAPE-K, with blocks of its own",
                "To see how the blocks are linked, and what it does while it drives:

  slate graph NAME.toml --out NAME.svg
  slate run NAME.toml --rate 1 & slate watch /pioneer/execute/status",
            ),
            Self::Module => (
                "is a module `KIND` beside the blocks of a robot",
                "To see its output while the robot drives:

  slate run NAME.toml --rate 1 & slate watch /KIND/nearest",
            ),
            Self::Plugin => (
                "is a plugin with a module `KIND`",
                "To exchange the code under the robot, let it go slowly, and change src/lib.rs meanwhile:

  slate run NAME.toml --set modules.KIND.params.max_linear_velocity=0.05
  cargo build && slate plugin reload NAME",
            ),
            Self::Cpp | Self::C => (
                "is a plugin with a module `KIND`",
                "To exchange the code under the robot, let it go slowly, and change the files in src meanwhile:

  slate run NAME.toml --set modules.KIND.params.max_linear_velocity=0.05
  cmake --build build && slate plugin reload KIND",
            ),
        }
    }
}

/// Configuration of a robot that a plugin's module drives.
const PLUGIN_CONFIGURATION: &str = include_str!("template/plugin/configuration.toml");

/// Interfaces of the module in C or C++.
const NATIVE_INTERFACES: [&str; 4] = ["Position", "Orientation", "Point2", "WheelSpeeds"];

/// Names that the templates' configurations use.
const TEMPLATE_NAMES: [&str; 4] = ["simulator", "referee", "wheels", "pioneer"];

/// No package can be called so.
const RESERVED_NAMES: [&str; 56] = [
    "abstract",
    "alloc",
    "as",
    "async",
    "await",
    "become",
    "box",
    "break",
    "build",
    "const",
    "continue",
    "core",
    "crate",
    "deps",
    "do",
    "dyn",
    "else",
    "enum",
    "examples",
    "extern",
    "false",
    "final",
    "fn",
    "for",
    "gen",
    "if",
    "impl",
    "in",
    "incremental",
    "let",
    "loop",
    "macro",
    "match",
    "mod",
    "move",
    "mut",
    "override",
    "priv",
    "pub",
    "ref",
    "return",
    "self",
    "std",
    "static",
    "struct",
    "super",
    "test",
    "trait",
    "true",
    "try",
    "type",
    "unsafe",
    "use",
    "where",
    "while",
    "yield",
];

/// Targets that CMake has by itself.
const CMAKE_TARGETS: [&str; 6] = ["all", "clean", "help", "install", "package", "rebuild_cache"];

/// Writes a project.
pub fn new(options: &NewOptions) -> Result<bool, Failure> {
    let template = match (options.cpp, options.c) {
        (true, _) => Template::Cpp,
        (_, true) => Template::C,
        _ => options.template,
    };
    let files = write(&options.name, template, options.slate.as_deref())?;
    match options.json {
        true => output::json(&json!({"schema": "slate.new/1", "name": options.name, "files": files})),
        false => print_next_steps(&options.name, template),
    }
    Ok(true)
}

/// Prints the next steps.
pub fn print_next_steps(name: &str, template: Template) {
    let (what, further) = template.description();
    let kind = name.replace('-', "_");
    let (build, folder) = match template.native() {
        None => ("cargo test\n  cargo build", "target/debug"),
        Some(_) => {
            ("cmake -B build && cmake --build build\n  ctest --test-dir build --output-on-failure", "build")
        }
    };
    let text = format!(
        "NAME/ {what}. What to do next:

  cd NAME
  {build}
  slate check NAME.toml
  slate plugin info {folder}/libKIND.so
  slate run NAME.toml

{further}"
    );
    output::line(text.replace("NAME", name).replace("KIND", &kind));
}

/// Writes the files of a project, and returns which.
pub fn write(name: &str, template: Template, slate: Option<&Path>) -> Result<Vec<PathBuf>, Failure> {
    if let Some(reason) = name_error(name) {
        return Err(Failure::ProjectName { name: name.into(), what: template.noun(), reason });
    }
    // Two kinds of modules of one name are ambiguous.
    let kind = name.replace('-', "_");
    if template.native().is_some() && CMAKE_TARGETS.contains(&kind.as_str()) {
        let reason = "it is reserved by CMake";
        return Err(Failure::ProjectName { name: name.into(), what: template.noun(), reason });
    }
    let is_taken =
        |own: &str| own.strip_prefix(&kind).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'));
    let linked = examples::plugins();
    if linked.iter().flat_map(|plugin| plugin.kinds()).any(|own| is_taken(own.name())) {
        let reason = "a module of Slate has this name";
        return Err(Failure::ProjectName { name: name.into(), what: template.noun(), reason });
    }
    let slate = if template.native().is_some() { None } else { Some(checkout(slate)?) };
    let folder = Path::new(name);
    let failed = |path: &Path| {
        let path = path.to_owned();
        |source| Failure::File { path, source }
    };
    // An existing file may be the user's work.
    std::fs::create_dir(folder).map_err(|source| match source.kind() {
        ErrorKind::AlreadyExists => Failure::Taken { path: folder.into() },
        _ => failed(folder)(source),
    })?;
    let slate_path = slate.as_ref().map(|slate| format!("{:?}", slate.join("crates/plugin")));
    let fill = || -> Result<Vec<PathBuf>, Failure> {
        let mut written = Vec::new();
        for (file, text) in contents(template)? {
            let path = folder.join(file.replace("NAME", name).replace("KIND", &kind));
            let text = text.replace("PROJECT_NAME", name).replace("MODULE_KIND", &kind);
            let text = text.replace("\"SLATE_FOLDER\"", slate_path.as_deref().unwrap_or_default());
            if let Some(parent) = path.parent() {
                std::fs::create_dir_all(parent).map_err(failed(parent))?;
            }
            std::fs::write(&path, text).map_err(failed(&path))?;
            written.push(path);
        }
        Ok(written)
    };
    let written = fill().inspect_err(|_| {
        // Half a project builds nothing, and the next try would be refused because of it.
        let _ = std::fs::remove_dir_all(folder);
    })?;
    if let Some(slate) = slate {
        // The versions that Slate is tested with; without them, cargo takes the newest.
        let _ = std::fs::copy(slate.join("Cargo.lock"), folder.join("Cargo.lock"));
    }
    Ok(written)
}

/// Returns the files of a template; one in C or C++ has copies of Slate's headers.
fn contents(template: Template) -> Result<Vec<(String, String)>, Failure> {
    let own = template.files().into_iter();
    let Some(language) = template.native() else {
        return Ok(own.map(|(file, text)| (file.to_owned(), text.to_owned())).collect());
    };
    // A library of C has the name of its symbols.
    let adapted = |text: &str| {
        text.replace("target/debug/", "build/").replace("[plugins.PROJECT_NAME]", "[plugins.MODULE_KIND]")
    };
    let mut files: Vec<_> = own.map(|(file, text)| (file.to_owned(), adapted(text))).collect();
    let extension = if language == HeaderLanguage::C { "h" } else { "hpp" };
    files.push((format!("src/interfaces.{extension}"), export::well_known(language, &NATIVE_INTERFACES)?));
    let is_for_it = |file: &str| language == HeaderLanguage::Cpp || file.ends_with(".h");
    let headers = HEADERS.iter().filter(|(file, _)| is_for_it(file));
    files.extend(headers.map(|(file, text)| (format!("include/{file}"), (*text).to_owned())));
    Ok(files)
}

/// Returns the reason why a plugin can't have that name, if any.
fn name_error(name: &str) -> Option<&'static str> {
    let small = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    if !(name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(small)) {
        Some("expected lower-case letters, digits, - and _, with a letter first")
    } else if RESERVED_NAMES.contains(&name) {
        Some("it is reserved by Rust or Cargo")
    } else if name == "slate" || name.starts_with("slate-") {
        // The new package depends on some of them.
        Some("Slate's own packages have this name")
    } else if TEMPLATE_NAMES.contains(&name) {
        Some("the template's configuration uses this name")
    } else {
        None
    }
}

/// Finds Slate's sources at a given place.
/// Without one, around this program or the working folder.
fn checkout(given: Option<&Path>) -> Result<PathBuf, Failure> {
    let is_checkout = |folder: &Path| folder.join("crates/plugin/Cargo.toml").is_file();
    let above = |path: Option<PathBuf>| {
        path.and_then(|path| path.ancestors().find(|folder| is_checkout(folder)).map(Path::to_owned))
    };
    let found = match given {
        Some(given) => std::path::absolute(given).ok().filter(|folder| is_checkout(folder)),
        None => above(std::env::current_exe().ok()).or_else(|| above(std::env::current_dir().ok())),
    };
    found.ok_or_else(|| Failure::NoCheckout { given: given.map(Into::into) })
}
