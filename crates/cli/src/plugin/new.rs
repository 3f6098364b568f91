//! Writes a crate that is a plugin.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::output;

/// The files, with `NAME` for the plugin's name, `KIND` for that of its module, and `SLATE` for Slate's folder.
const FILES: [(&str, &str); 4] = [
    ("Cargo.toml", include_str!("template/manifest.toml")),
    ("src/lib.rs", include_str!("template/library.rs")),
    ("NAME.toml", include_str!("template/configuration.toml")),
    (".gitignore", "/target\n/runs\n"),
];

/// What the configuration of the new crate names.
const NAMED: [&str; 3] = ["simulator", "referee", "wheels"];

/// No package can be called so.
const RESERVED: [&str; 56] = [
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

pub fn new(name: &str, slate: Option<&Path>) -> Result<(), Failure> {
    if let Some(reason) = objection(name) {
        return Err(Failure::PluginName { name: name.into(), reason });
    }
    let slate = checkout(slate)?;
    let folder = Path::new(name);
    let failed = |path: &Path| {
        let path = path.to_owned();
        |source| Failure::File { path, source }
    };
    // Whatever is there already is somebody's work.
    std::fs::create_dir(folder).map_err(|source| match source.kind() {
        ErrorKind::AlreadyExists => Failure::Taken { path: folder.into() },
        _ => failed(folder)(source),
    })?;
    let slate_path = format!("{:?}", slate.join("crates/plugin"));
    let kind = name.replace('-', "_");
    for (file, text) in FILES {
        let path = folder.join(file.replace("NAME", name));
        let text = text.replace("NAME", name).replace("KIND", &kind).replace("\"SLATE\"", &slate_path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(failed(parent))?;
        }
        std::fs::write(&path, text).map_err(failed(&path))?;
    }
    // The versions that Slate is tested with; without them, cargo takes the newest.
    let _ = std::fs::copy(slate.join("Cargo.lock"), folder.join("Cargo.lock"));
    output::line(format_args!(
        "{name}/ is a plugin with a module `{kind}`. What to do next:

  cd {name}
  cargo test
  cargo build
  slate plugin info target/debug/lib{kind}.so
  slate run {name}.toml

To exchange the code under the robot, let it go slowly, and change src/lib.rs meanwhile:

  slate run {name}.toml --set modules.{kind}.params.speed=0.05
  cargo build && slate plugin reload {name}"
    ));
    Ok(())
}

/// Why a plugin can't be called so.
fn objection(name: &str) -> Option<&'static str> {
    let small = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    if !(name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(small)) {
        Some("a name has small letters, digits, - and _, a letter first")
    } else if RESERVED.contains(&name) {
        Some("it is a word of Rust or Cargo")
    } else if name == "slate" || name.starts_with("slate-") {
        // The new package depends on some of them.
        Some("Slate's own packages are called so")
    } else if NAMED.contains(&name) {
        Some("the simulator's configuration, which comes with the plugin, has something of that name")
    } else {
        None
    }
}

/// Slate's sources: where they are said to be, or else where this program was built, or where it is called.
fn checkout(said: Option<&Path>) -> Result<PathBuf, Failure> {
    let is_checkout = |folder: &Path| folder.join("crates/plugin/Cargo.toml").is_file();
    let above = |path: Option<PathBuf>| {
        path.and_then(|path| path.ancestors().find(|folder| is_checkout(folder)).map(Path::to_owned))
    };
    let found = match said {
        Some(said) => std::path::absolute(said).ok().filter(|folder| is_checkout(folder)),
        None => above(std::env::current_exe().ok()).or_else(|| above(std::env::current_dir().ok())),
    };
    found.ok_or_else(|| Failure::NoCheckout { said: said.map(Into::into) })
}
