//! Makes a list of the files in `web`, which the program holds in itself.

use std::env;
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=web");
    let variable =
        |name: &str| env::var_os(name).map(PathBuf::from).ok_or(format!("cargo does not say {name}"));
    let (root, out) = (variable("CARGO_MANIFEST_DIR")?.join("web"), variable("OUT_DIR")?);
    let mut files = Vec::new();
    collect(&root, &mut files)?;
    files.sort();
    let mut list = String::from("&[\n");
    for file in files {
        let path = file.strip_prefix(&root)?.to_str().ok_or("a name in `web` is no UTF-8")?;
        writeln!(list, "    ({:?}, include_bytes!({file:?})),", format!("/{path}"))?;
    }
    list.push_str("]\n");
    fs::write(out.join("pages.rs"), list)?;
    Ok(())
}

/// What a browser asks for; licences and notes stay in the repository.
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
