//! Templates of projects.

use clap::ValueEnum;
use slate_headers::HEADERS;

use crate::failure::Failure;
use crate::interface::export::{self, HeaderLanguage};

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
    /// A module in Python that drives a robot
    #[value(skip)]
    Python,
}

/// Name and text of a file with placeholders.
/// They are `PROJECT_NAME`, `MODULE_KIND` for the name of its module or blocks, and `SLATE_DEPENDENCY`; a file's name has
/// `NAME` and `KIND`.
type TemplateFile = (&'static str, &'static str);

impl Template {
    /// Returns the files of a template in C, C++ or Python, without configuration.
    /// A template in Rust has none.
    fn foreign_files(self) -> Vec<TemplateFile> {
        match self {
            Self::Cpp => vec![
                ("CMakeLists.txt", include_str!("template/cpp/CMakeLists.txt")),
                ("src/KIND.hpp", include_str!("template/cpp/module.hpp")),
                ("src/KIND.cpp", include_str!("template/cpp/plugin.cpp")),
                ("tests/test_KIND.cpp", include_str!("template/cpp/test.cpp")),
                (".gitignore", "/build\n/runs\n"),
            ],
            Self::C => vec![
                ("CMakeLists.txt", include_str!("template/c/CMakeLists.txt")),
                ("src/KIND.h", include_str!("template/c/module.h")),
                ("src/KIND.c", include_str!("template/c/module.c")),
                ("tests/test_KIND.c", include_str!("template/c/test.c")),
                (".gitignore", "/build\n/runs\n"),
            ],
            Self::Python => vec![
                ("KIND.py", include_str!("template/python/module.py")),
                ("test_KIND.py", include_str!("template/python/test.py")),
                (".gitignore", "/runs\n__pycache__/\n"),
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
            Self::Cpp | Self::C | Self::Python => {
                let mut files = self.foreign_files();
                files.push(("NAME.toml", PLUGIN_CONFIGURATION));
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
    pub fn native(self) -> Option<HeaderLanguage> {
        match self {
            Self::Cpp => Some(HeaderLanguage::Cpp),
            Self::C => Some(HeaderLanguage::C),
            Self::Mapek | Self::Module | Self::Plugin | Self::Python => None,
        }
    }

    /// Returns true for a crate in Rust, which is built with Slate's own crates.
    pub fn is_rust(self) -> bool {
        matches!(self, Self::Mapek | Self::Module | Self::Plugin)
    }

    /// Returns the plugin's file, and the commands that build and test the project.
    pub fn plugin_and_build(self) -> (&'static str, &'static str) {
        match self {
            Self::Mapek | Self::Module | Self::Plugin => {
                ("target/debug/libKIND.so", "cargo test\n  cargo build")
            }
            Self::Cpp | Self::C => (
                "build/libKIND.so",
                "cmake -B build && cmake --build build\n  ctest --test-dir build --output-on-failure",
            ),
            Self::Python => ("KIND.py", "python3 -m unittest"),
        }
    }

    /// Returns the noun for a project of this template.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Mapek => "robot",
            Self::Module | Self::Python => "module",
            Self::Plugin | Self::Cpp | Self::C => "plugin",
        }
    }

    /// Describes the project and its next steps.
    pub fn description(self) -> (&'static str, &'static str) {
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
            Self::Python => (
                "has a module `KIND` in Python that drives a robot",
                "To exchange the code under the robot, let it go slowly, and change KIND.py meanwhile:

  slate run NAME.toml --set modules.KIND.params.max_linear_velocity=0.05
  slate plugin reload KIND",
            ),
        }
    }
}

/// Configuration of a robot that a plugin's module drives.
const PLUGIN_CONFIGURATION: &str = include_str!("template/plugin/configuration.toml");

/// Interfaces of the module in C or C++.
const NATIVE_INTERFACES: [&str; 4] = ["Position", "Orientation", "Point2", "WheelSpeeds"];

/// Returns the files of a template; one in C or C++ has copies of Slate's headers.
pub fn contents(template: Template) -> Result<Vec<(String, String)>, Failure> {
    let own = template.files().into_iter();
    if template.is_rust() {
        return Ok(own.map(|(file, text)| (file.to_owned(), text.to_owned())).collect());
    }
    // A library of C has the name of its symbols, a module of Python that of its file.
    let plugin = template.plugin_and_build().0.replace("KIND", "MODULE_KIND");
    let adapted = |text: &str| {
        text.replace("target/debug/libMODULE_KIND.so", &plugin)
            .replace("[plugins.PROJECT_NAME]", "[plugins.MODULE_KIND]")
    };
    let mut files: Vec<_> = own.map(|(file, text)| (file.to_owned(), adapted(text))).collect();
    let Some(language) = template.native() else { return Ok(files) };
    let extension = if language == HeaderLanguage::C { "h" } else { "hpp" };
    files.push((format!("src/interfaces.{extension}"), export::well_known(language, &NATIVE_INTERFACES)?));
    let is_for_it = |file: &str| language == HeaderLanguage::Cpp || file.ends_with(".h");
    let headers = HEADERS.iter().filter(|(file, _)| is_for_it(file));
    files.extend(headers.map(|(file, text)| (format!("include/{file}"), (*text).to_owned())));
    Ok(files)
}
