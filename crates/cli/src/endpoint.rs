//! Endpoint of an agent over HTTP: its address and secrets.
//! The agent leaves both in a file that only its user can read.

use std::fs;
use std::path::PathBuf;

use rustix::process::{Pid, test_kill_process};
use serde::Deserialize;
use slate::control::Role;
use slate::control::client::{Access, AccessFailure, Address};
use slate::runtime::directory::{Lock, folder};
use slate_sorted::SortedMap;

use crate::failure::Failure;
use crate::token;

/// Suffix of these files' names.
const FILE_SUFFIX: &str = ".console";

/// Endpoint of an agent.
#[derive(Debug, Deserialize)]
struct Endpoint {
    /// Address, such as `http://127.0.0.1:7878`.
    address: String,
    /// Address for browsers, by a name that its certificate holds.
    browser: String,
    /// Secrets by the names of roles, from the lowest.
    tokens: SortedMap<String, String>,
    /// Process of the agent.
    process: u32,
    /// File of its certificate, if it speaks TLS.
    #[serde(default)]
    certificate: Option<PathBuf>,
}

impl Endpoint {
    /// Returns the endpoints of all agents of this user.
    fn all() -> impl Iterator<Item = Self> {
        let files = fs::read_dir(folder()).into_iter().flatten().flatten();
        let files = files.filter(|file| file.file_name().to_string_lossy().ends_with(FILE_SUFFIX));
        files.filter_map(|file| {
            let text = fs::read_to_string(file.path()).ok()?;
            serde_json::from_str(&text).ok()
        })
    }

    /// Returns the endpoint of a local agent at an address.
    /// Files of killed agents are ignored.
    fn at(address: &Address) -> Option<Self> {
        Self::all().find(|endpoint| {
            let process = i32::try_from(endpoint.process).ok().and_then(Pid::from_raw);
            process.is_some_and(|process| test_kill_process(process).is_ok())
                && [&endpoint.address, &endpoint.browser]
                    .into_iter()
                    .any(|own| own.parse::<Address>().is_ok_and(|own| own.is_same(address)))
        })
    }

    /// Returns the secret of a role, or of the highest one present.
    fn token(&self, role: Option<Role>) -> Option<&str> {
        let own = |role: Role| self.tokens.get(role.name()).map(String::as_str);
        match role {
            Some(role) => own(role),
            None => Role::ALL.into_iter().rev().find_map(own),
        }
    }

    fn access(self, address: Address, role: Option<Role>) -> Result<Access, Failure> {
        let token = self.token(role).ok_or_else(|| no_token(role))?.to_owned();
        let browser = address.to_string();
        Ok(Access { address, browser, token, certificate: self.certificate.or_else(certificate) })
    }
}

/// Returns access to a local agent by name; files of killed agents are ignored.
pub fn access_of(agent: &str, role: Option<Role>) -> Result<Access, Failure> {
    let process = Lock::holder(&folder().join(format!("{agent}.lock")));
    let found = Endpoint::all().find(|endpoint| Some(endpoint.process) == process);
    let endpoint = found.ok_or_else(|| Failure::NoConsole { agent: agent.into() })?;
    let (address, browser) = (parse(&endpoint.address)?, endpoint.browser.clone());
    Ok(Access { browser, ..endpoint.access(address, role)? })
}

/// Returns access to an agent at an address, without a token.
pub fn place_at(text: &str) -> Result<Access, Failure> {
    let address = parse(text)?;
    let known = Endpoint::at(&address).and_then(|endpoint| endpoint.certificate);
    let browser = address.to_string();
    Ok(Access { address, browser, token: String::new(), certificate: known.or_else(certificate) })
}

/// Returns access to an agent at an address.
/// Certificate and token of a local agent are known.
pub fn access_at(text: &str, role: Option<Role>) -> Result<Access, Failure> {
    let given = if role.is_none() { token::given()? } else { None };
    if let Some(token) = given {
        return Ok(Access { token, ..place_at(text)? });
    }
    let address = parse(text)?;
    match Endpoint::at(&address) {
        Some(endpoint) => endpoint.access(address, role),
        None if role.is_some() => Err(no_token(role)),
        None => Err(AccessFailure::NoToken { address: address.to_string() }.into()),
    }
}

fn parse(text: &str) -> Result<Address, Failure> {
    let wrong = |reason| AccessFailure::NoAddress { text: text.into(), reason };
    Ok(text.parse().map_err(wrong)?)
}

/// Returns the given file of trusted certificates.
fn certificate() -> Option<PathBuf> {
    std::env::var_os("SLATE_CERTIFICATE").filter(|said| !said.is_empty()).map(PathBuf::from)
}

/// Creates the failure of a missing secret.
fn no_token(role: Option<Role>) -> Failure {
    let detail = format!("no token of {} is known", role.map_or("any role", Role::with_article));
    let help = "`console.tokens` of the configuration lists the tokens; for an agent elsewhere, set SLATE_TOKEN and omit --role"
        .to_owned();
    Failure::Http { status: 401, detail, help, code: None }
}
