//! Reasons why an agent is unreachable over the network.

use std::path::{Path, PathBuf};

use slate_runtime::printable;

/// Failure to reach an agent.
#[derive(Debug, thiserror::Error)]
#[cfg_attr(not(feature = "tls"), allow(dead_code, reason = "some of it only TLS has"))]
pub enum AccessFailure {
    /// A text is not an address.
    #[error("`{text}` is not an address of an agent: {reason}")]
    NoAddress {
        /// Text.
        text: String,
        /// Reason.
        reason: &'static str,
    },
    /// The address does not respond.
    #[error("{address} is not reached: {reason}")]
    Unreached {
        /// Address.
        address: String,
        /// Reason.
        reason: String,
    },
    /// The secret would go over a network in the open.
    #[error("{address} is on another machine, and without TLS the token can be read on the network")]
    Open {
        /// Address.
        address: String,
    },
    /// Other side without HTTP.
    #[error("{address} does not answer in HTTP: {reason}")]
    NoHttp {
        /// Address.
        address: String,
        /// Reason.
        reason: String,
    },
    /// Other side without TLS.
    #[error("{address} does not speak TLS")]
    NoTls {
        /// Address.
        address: String,
    },
    /// Untrusted certificate.
    #[error("the certificate of {address} is not trusted: {reason}")]
    Untrusted {
        /// Address.
        address: String,
        /// Reason.
        reason: String,
    },
    /// The file of trusted certificates is of no use.
    #[error("{} can't be used as a certificate file: {reason}", printable(.path))]
    Certificate {
        /// File.
        path: PathBuf,
        /// Reason.
        reason: String,
    },
    /// Program without TLS.
    #[cfg(not(feature = "tls"))]
    #[error("{address} needs TLS, which this program is built without")]
    WithoutTls {
        /// Address.
        address: String,
    },
    /// No secret is known.
    #[error("no token for {address}")]
    NoToken {
        /// Address.
        address: String,
    },
    /// The secret is of no use.
    #[error("the token in {place} is invalid: {reason}")]
    Token {
        /// Place of the secret.
        place: String,
        /// Reason.
        reason: String,
    },
    /// A file of this machine is named for an agent elsewhere.
    #[error("{} would be a file of this machine, and the agent runs elsewhere", printable(.path))]
    FileHere {
        /// File.
        path: PathBuf,
    },
}

/// Hint on how to trust other certificates.
const AUTHORITY_HELP: &str =
    "set SLATE_CERTIFICATE to the file of its certificate, or of the authority that signed it, in PEM";

impl AccessFailure {
    /// Returns whether the error is the caller's, not an unreachable agent.
    pub fn is_callers(&self) -> bool {
        matches!(
            self,
            Self::NoAddress { .. } | Self::Certificate { .. } | Self::Token { .. } | Self::FileHere { .. }
        )
    }

    /// Returns help on the failure.
    pub fn help(&self) -> String {
        match self {
            Self::NoAddress { .. } => "such as http://127.0.0.1:7878 or https://robot.local:7878".into(),
            Self::Unreached { .. } => {
                "look whether the agent runs there, and which addresses and port its console has: `slate ps`, \
                 `console.addresses`, `console.port`"
                    .into()
            }
            Self::Open { address } => {
                let secure = address.replacen("http:", "https:", 1);
                format!("ask {secure}, or through a tunnel: ssh -L 7878:localhost:7878 HOST")
            }
            Self::NoHttp { address, .. } => {
                let secure = address.replacen("http:", "https:", 1);
                format!("if it speaks TLS, ask {secure}")
            }
            Self::NoTls { address } => {
                let open = address.replacen("https:", "http:", 1);
                format!("ask {open} if that is this machine; else give the agent a certificate: `console.certificate`")
            }
            Self::Untrusted { .. } => AUTHORITY_HELP.into(),
            Self::Certificate { .. } => "give a file in PEM: it begins with -----BEGIN CERTIFICATE-----".into(),
            #[cfg(not(feature = "tls"))]
            Self::WithoutTls { .. } => "build it with the feature `tls`: cargo build --release --features tls".into(),
            Self::NoToken { .. } => {
                "set SLATE_TOKEN to the token, which follows `#token=` in the link that the agent prints, or \
                 @FILE for a file that has it"
                    .into()
            }
            Self::Token { .. } => "a token consists of letters and digits, as of `openssl rand -hex 32`".into(),
            Self::FileHere { path } => match path.file_name().map(Path::new) {
                Some(name) => format!("name it without a folder, such as {}; it is made at the agent", printable(name)),
                None => "name a file without a folder; it is made at the agent".into(),
            },
        }
    }
}
