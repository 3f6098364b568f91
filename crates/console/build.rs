//! Makes a list of the files in `web`, which the program holds in itself.

use std::env;
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=web");
    let variable =
        |name: &str| env::var_os(name).map(PathBuf::from).ok_or(format!("cargo does not set {name}"));
    let (root, out) = (variable("CARGO_MANIFEST_DIR")?.join("web"), variable("OUT_DIR")?);
    let mut files = Vec::new();
    collect(&root, &mut files)?;
    files.sort();
    let named = |file: &PathBuf| -> Result<String, Box<dyn Error>> {
        let path = file.strip_prefix(&root)?.to_str().ok_or("a name in `web` is no UTF-8")?;
        Ok(format!("/{path}"))
    };
    let paths = files.iter().map(named).collect::<Result<Vec<_>, _>>()?;
    let mut list = String::from("&[\n");
    for (path, mut file) in paths.iter().zip(files.iter().cloned()) {
        if path == "/index.html" {
            let page = announced(&fs::read_to_string(&file)?, &paths)?;
            file = out.join("index.html");
            fs::write(&file, page)?;
        }
        writeln!(list, "    ({path:?}, include_bytes!({file:?})),")?;
    }
    list.push_str("]\n");
    fs::write(out.join("pages.rs"), list)?;
    Ok(())
}

/// Returns the start page with all modules preloaded in its head.
/// A browser requests them at once, instead of each one after reading its importer.
fn announced(page: &str, paths: &[String]) -> Result<String, Box<dyn Error>> {
    let (head, rest) = page.split_once("</head>").ok_or("index.html has no head")?;
    let mut announced = head.to_owned();
    for path in paths.iter().filter(|path| is_preloaded(path) && !head.contains(path.as_str())) {
        writeln!(announced, "  <link rel=\"modulepreload\" href=\"{path}\">")?;
    }
    Ok(format!("{announced}</head>{rest}"))
}

/// Returns whether an agent's page imports a file.
/// `recorded` is for exported pages.
fn is_preloaded(path: &str) -> bool {
    path.ends_with(".js") && !path.starts_with("/recorded/")
}

/// Collects the files that a browser requests.
/// Licences and notes stay in the repository.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path
            .extension()
            .is_some_and(|kind| ["html", "js", "css", "svg"].iter().any(|known| kind == *known))
        {
            files.push(path);
        }
    }
    Ok(())
}
