//! Token by which a remote agent identifies the caller.
//! A secret is no argument of a command, which all users of a machine see; it is in the variable `SLATE_TOKEN`, or in
//! a file that this names as `@FILE`.

use std::os::unix::fs::MetadataExt;

use slate::control::client::AccessFailure;

/// Name of the environment variable.
const TOKEN_VARIABLE: &str = "SLATE_TOKEN";

/// Returns the given secret, if any.
pub fn given() -> Result<Option<String>, AccessFailure> {
    let Some(value) = std::env::var_os(TOKEN_VARIABLE).filter(|value| !value.is_empty()) else {
        return Ok(None);
    };
    let (place, text) = match value.to_string_lossy().strip_prefix('@') {
        Some(file) => (file.to_owned(), read(file)?),
        None => (TOKEN_VARIABLE.to_owned(), value.to_string_lossy().into_owned()),
    };
    let token = text.trim();
    // Anything else could end the line of a request.
    match !token.is_empty() && token.bytes().all(|byte| byte.is_ascii_alphanumeric()) {
        true => Ok(Some(token.to_owned())),
        false => Err(AccessFailure::Token { place, reason: "expected letters and digits".into() }),
    }
}

fn read(file: &str) -> Result<String, AccessFailure> {
    let wrong = |reason: String| AccessFailure::Token { place: file.to_owned(), reason };
    let mode = std::fs::metadata(file).map_err(|error| wrong(error.to_string()))?.mode();
    if mode & 0o077 != 0 {
        return Err(wrong(format!("others may read it (mode {:o}): chmod 600", mode & 0o777)));
    }
    std::fs::read_to_string(file).map_err(|error| wrong(error.to_string()))
}
