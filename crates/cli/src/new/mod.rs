//! Writes projects that are tested, built and run at once.

mod names;
mod template;

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::failure::Failure;
use crate::{examples, output};

pub use template::Template;

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

    /// A module in Python, which needs no compiler
    #[arg(long, conflicts_with_all = ["template", "slate", "cpp", "c"])]
    python: bool,

    /// Checkout of Slate to build with
    /// [default: around this program or the working folder, else its packages]
    #[arg(long, value_name = "PATH")]
    slate: Option<PathBuf>,

    /// Print the names of the created files as JSON
    #[arg(long)]
    json: bool,
}

/// Writes a project.
pub fn new(options: &NewOptions) -> Result<bool, Failure> {
    let flags = [(options.cpp, Template::Cpp), (options.c, Template::C), (options.python, Template::Python)];
    let template = flags.into_iter().find_map(|(given, template)| given.then_some(template));
    let template = template.unwrap_or(options.template);
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
    let (plugin, build) = template.plugin_and_build();
    let text = format!(
        "NAME/ {what}. What to do next:

  cd NAME
  {build}
  slate check NAME.toml
  slate plugin info {plugin}
  slate run NAME.toml

{further}"
    );
    output::line(text.replace("NAME", name).replace("KIND", &kind));
}

/// Writes the files of a project, and returns which.
pub fn write(name: &str, template: Template, slate: Option<&Path>) -> Result<Vec<PathBuf>, Failure> {
    if let Some(reason) = names::name_error(name, template) {
        return Err(Failure::ProjectName { name: name.into(), what: template.noun(), reason });
    }
    // Two kinds of modules of one name are ambiguous.
    let kind = name.replace('-', "_");
    let is_taken =
        |own: &str| own.strip_prefix(&kind).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'));
    let linked = examples::plugins();
    if linked.iter().flat_map(|plugin| plugin.kinds()).any(|own| is_taken(own.name())) {
        let reason = "a module of Slate has this name";
        return Err(Failure::ProjectName { name: name.into(), what: template.noun(), reason });
    }
    let checkout = if template.is_rust() { checkout(slate)? } else { None };
    if template.is_rust() && checkout.is_none() {
        let version = env!("CARGO_PKG_VERSION");
        eprintln!(
            "no checkout of Slate is here, so it needs the package slate-plugin {version}; else give --slate PATH"
        );
    }
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
    let dependency = dependency(checkout.as_deref());
    let fill = || -> Result<Vec<PathBuf>, Failure> {
        let mut written = Vec::new();
        for (file, text) in template::contents(template)? {
            let path = folder.join(file.replace("NAME", name).replace("KIND", &kind));
            let text = text.replace("PROJECT_NAME", name).replace("MODULE_KIND", &kind);
            let text = text.replace("\"SLATE_DEPENDENCY\"", &dependency);
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
    if let Some(checkout) = checkout {
        // The versions that Slate is tested with; without them, cargo takes the newest.
        let _ = std::fs::copy(checkout.join("Cargo.lock"), folder.join("Cargo.lock"));
    }
    Ok(written)
}

/// Returns the dependency on `slate-plugin` as in a manifest.
/// It is the folder in a checkout, or the package of this version.
fn dependency(checkout: Option<&Path>) -> String {
    match checkout {
        Some(checkout) => format!("{{ path = {:?} }}", checkout.join("crates/plugin")),
        None => format!("{:?}", env!("CARGO_PKG_VERSION")),
    }
}

/// Finds a checkout of Slate at a given place.
/// Without one, around this program or the working folder; `None` if neither is in one.
fn checkout(given: Option<&Path>) -> Result<Option<PathBuf>, Failure> {
    let is_checkout = |folder: &Path| folder.join("crates/plugin/Cargo.toml").is_file();
    if let Some(given) = given {
        let found = std::path::absolute(given).ok().filter(|folder| is_checkout(folder));
        return found.map(Some).ok_or_else(|| Failure::NoCheckout { given: given.into() });
    }
    let above = |path: Option<PathBuf>| {
        path.and_then(|path| path.ancestors().find(|folder| is_checkout(folder)).map(Path::to_owned))
    };
    Ok(above(std::env::current_exe().ok()).or_else(|| above(std::env::current_dir().ok())))
}
