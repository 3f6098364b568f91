//! Tokens: a secret for each role.

use std::fs::{DirBuilder, OpenOptions};
use std::io::{self, Error, ErrorKind, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use serde_json::json;
use slate_runtime::directory::folder;
use slate_sorted::SortedMap;

use slate_control::Role;

/// Bytes of a secret that is made here.
const SECRET_SIZE: usize = 32;

/// Minimum length of a given secret, letters.
const MIN_SECRET_LENGTH: usize = 32;

/// Secrets of the roles.
#[derive(Clone)]
pub(crate) struct Tokens(SortedMap<Role, String>);

impl Tokens {
    /// Generates new secrets.
    pub fn generate() -> io::Result<Self> {
        let mut source = std::fs::File::open("/dev/urandom")?;
        let mut token = || {
            let mut bytes = [0; SECRET_SIZE];
            source.read_exact(&mut bytes)?;
            Ok::<_, Error>(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
        };
        Role::ALL.into_iter().map(|role| Ok((role, token()?))).collect::<io::Result<_>>().map(Self)
    }

    /// Reads the secrets in files, which only their owner may read.
    pub fn read(files: &SortedMap<Role, PathBuf>) -> Result<Self, (PathBuf, String)> {
        let read = |(role, path): (&Role, &PathBuf)| {
            let wrong = |reason: String| (path.clone(), reason);
            let text = std::fs::read_to_string(path).map_err(|error| wrong(error.to_string()))?;
            check_secret(path).map_err(wrong)?;
            let token = text.trim();
            if token.len() < MIN_SECRET_LENGTH || !token.bytes().all(|byte| byte.is_ascii_alphanumeric()) {
                let how = "openssl rand -hex 32";
                return Err(wrong(format!(
                    "a token is at least {MIN_SECRET_LENGTH} letters and digits: {how}"
                )));
            }
            Ok((*role, token.to_owned()))
        };
        let tokens: SortedMap<Role, String> = files.iter().map(read).collect::<Result<_, _>>()?;
        for (role, token) in &tokens {
            // A secret that stands for two roles would give the lower one what the higher one may do.
            let lower = tokens.range(..role).find(|(_, other)| *other == token);
            if let (Some((lower, _)), Some(path)) = (lower, files.get(role)) {
                let reason = format!(
                    "it has the same token as that of {}: give each role its own",
                    lower.with_article()
                );
                return Err((path.clone(), reason));
            }
        }
        Ok(Self(tokens))
    }

    /// Returns the role of a secret, in a time that reveals nothing about the secrets.
    pub fn role(&self, given: &str) -> Option<Role> {
        let mut found = None;
        for (role, token) in &self.0 {
            if is_same(token, given) {
                found = Some(*role);
            }
        }
        found
    }

    /// Returns the secret of the highest role.
    pub fn highest(&self) -> &str {
        self.0.values().next_back().map_or("", String::as_str)
    }

    /// Writes the tokens to where tools of this user find them.
    /// The file also has the address for programs and that for browsers.
    ///
    /// The port is part of the name, as there may be several agents of one name.
    pub fn write(
        &self,
        agent: &str,
        port: u16,
        [address, browser]: [&str; 2],
        certificate: Option<&Path>,
    ) -> io::Result<TokenFile> {
        let folder = folder();
        match DirBuilder::new().recursive(true).mode(0o700).create(&folder) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
            _ => check_folder(&folder)?,
        }
        let path = folder.join(format!("{agent}-{port}.console"));
        let content = json!({
            "agent": agent,
            "process": std::process::id(),
            "address": address,
            "browser": browser,
            "certificate": certificate.map(std::path::absolute).transpose()?,
            "tokens": self.0.iter().map(|(role, token)| (role.name(), token)).collect::<SortedMap<_, _>>(),
        });
        // A file of a killed agent.
        let _ = std::fs::remove_file(&path);
        let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(&path)?;
        writeln!(file, "{content}")?;
        Ok(TokenFile(path))
    }
}

/// Checks a folder like that of the local sockets.
/// No other user may have made it or be able to read it.
fn check_folder(folder: &Path) -> io::Result<()> {
    let metadata = std::fs::symlink_metadata(folder)?;
    let user = rustix::process::geteuid().as_raw();
    if metadata.is_dir() && metadata.uid() == user && metadata.mode() & 0o077 == 0 {
        return Ok(());
    }
    let folder = slate_runtime::printable(folder);
    let message = format!("{folder} is not a folder that only its owner {user} may enter");
    Err(Error::new(ErrorKind::PermissionDenied, message))
}

/// Checks that only its owner may read a file with a secret.
pub(crate) fn check_secret(path: &Path) -> Result<(), String> {
    let mode = path.metadata().map_err(|error| error.to_string())?.mode();
    match mode & 0o077 {
        0 => Ok(()),
        _ => Err(format!("others may read it (mode {:o}): chmod 600", mode & 0o777)),
    }
}

fn is_same(token: &str, given: &str) -> bool {
    let (token, given) = (token.as_bytes(), given.as_bytes());
    let difference = (0..token.len()).fold(token.len() ^ given.len(), |difference, place| {
        difference | usize::from(token[place] ^ given.get(place).copied().unwrap_or(!token[place]))
    });
    difference == 0
}

/// File with the secrets, removed when this value is dropped.
#[derive(Debug)]
pub(crate) struct TokenFile(PathBuf);

impl TokenFile {
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for TokenFile {
    fn drop(&mut self) {
        // Another process may have removed it.
        let _ = std::fs::remove_file(&self.0);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use super::*;

    #[test]
    fn each_token_is_of_its_role_and_no_part_of_it_is_of_any() {
        let tokens = Tokens::generate().unwrap();
        for (role, token) in &tokens.0 {
            assert_eq!(token.len(), 2 * SECRET_SIZE);
            assert_eq!(tokens.role(token), Some(*role));
            assert_eq!(tokens.role(&token[1..]), None);
            assert_eq!(tokens.role(&format!("{token}0")), None);
        }
        assert_eq!(tokens.role(""), None);
        assert_eq!(tokens.highest(), tokens.0[&Role::Developer]);
    }
}
