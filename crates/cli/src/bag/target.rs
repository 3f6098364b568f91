//! Destination of a verb's output.

use std::path::{Path, PathBuf};

use slate::bag::Error;

/// Refuses an output that exists, unless forced, and an output that is an input.
pub fn free(out: &Path, inputs: &[&Path], is_forced: bool) -> Result<(), Error> {
    let unfit = |what: &str| Err(Error::Unfit { path: out.into(), what: what.into() });
    if let Ok(place) = out.canonicalize()
        && inputs.iter().any(|input| input.canonicalize().is_ok_and(|input| input == place))
    {
        return unfit("it is an input and can't be the output: choose another `--out`");
    }
    let is_free = match std::fs::read_dir(out) {
        Ok(mut entries) => entries.next().is_none(),
        Err(_) => out.symlink_metadata().is_err(),
    };
    match is_free || is_forced {
        true => Ok(()),
        false => unfit("it exists already: choose another `--out`, or replace it with `--force`"),
    }
}

/// Pictures are of one kind.
pub fn image(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().is_some_and(|extension| extension == "svg") {
        true => Ok(path),
        false => Err("pictures are SVG: expected a name that ends with `.svg`".into()),
    }
}
