//! Certificate files that identify this agent and authenticate others.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use rustls::RootCertStore;
use rustls::client::verify_server_cert_signed_by_trust_anchor;
use rustls::crypto::CryptoProvider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use rustls::server::{ParsedCertificate, WebPkiClientVerifier};
use rustls::sign::CertifiedKey;
use slate_runtime::printable_text;
use slate_runtime::sharing::{About, SharingError};
use x509_parser::prelude::{FromDer, X509Certificate};

/// Certificate and key of an agent, and the certificate authority of all agents.
/// They are checked to fit together. The files are read again for each link, so renewed ones apply from the next link
/// on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Credentials {
    agent: String,
    certificate: PathBuf,
    key: PathBuf,
    authority: PathBuf,
}

/// Time before expiry at which a certificate causes a warning, s.
const EXPIRY_WARNING: i64 = 7 * 24 * 3600;

/// Content of the files.
pub(super) struct LoadedCredentials {
    pub chain: Vec<CertificateDer<'static>>,
    pub key: PrivateKeyDer<'static>,
    pub roots: Arc<RootCertStore>,
    pub provider: Arc<CryptoProvider>,
}

/// Paths of the files, in PEM format.
#[derive(Clone, Copy, Debug)]
pub struct Files<'a> {
    /// Certificate of the agent, and the chain up to the authority's.
    pub certificate: &'a Path,
    /// Private key of the certificate.
    pub key: &'a Path,
    /// Certificates of the authorities that sign agents' certificates.
    pub authority: &'a Path,
}

fn refused(about: About, message: String, help: &str) -> SharingError {
    SharingError { message, help: Some(help.into()), about }
}

impl Credentials {
    /// Reads the files of the agent of that name.
    ///
    /// # Errors
    /// If a file can't be read or is malformed, if the files do not belong together, if other users may read the key,
    /// or if the certificate is another agent's or not valid now.
    pub fn load(files: Files<'_>, agent: &str) -> Result<Self, SharingError> {
        LoadedCredentials::new(files, agent)?;
        Ok(Self {
            agent: agent.into(),
            certificate: files.certificate.into(),
            key: files.key.into(),
            authority: files.authority.into(),
        })
    }

    /// Returns a warning if links will fail now or within a week.
    /// It reads the files in their current state.
    #[allow(clippy::disallowed_methods, reason = "certificates go by the calendar")]
    pub fn warning(&self) -> Option<String> {
        let loaded = match self.read() {
            Ok(loaded) => loaded,
            Err(error) => return Some(format!("no link can begin: {}", error.message)),
        };
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let left = expiry(&loaded.chain[0]).saturating_sub(i64::try_from(now.as_secs()).unwrap_or(i64::MAX));
        (left < EXPIRY_WARNING).then(|| {
            let path = self.certificate.display();
            let left = match left {
                ..3600 => format!("{} minutes", left / 60),
                _ => format!("{} hours", left / 3600),
            };
            format!(
                "the certificate {path} expires in {left}: renew it; links that begin then use the new one"
            )
        })
    }

    /// Reads the current content of the files.
    pub(super) fn read(&self) -> Result<LoadedCredentials, SharingError> {
        let files = Files { certificate: &self.certificate, key: &self.key, authority: &self.authority };
        LoadedCredentials::new(files, &self.agent)
    }
}

impl LoadedCredentials {
    fn new(files: Files<'_>, agent: &str) -> Result<Self, SharingError> {
        let chain = certificates(files.certificate, About::Certificate, "certificate")?;
        let authority = certificates(files.authority, About::Authority, "authority")?;
        let key = key(files.key)?;
        check_name(&chain[0], files.certificate, agent)?;
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        check_key(&chain, &key, files.key, &provider)?;
        let roots = Arc::new(roots(&authority, files.authority)?);
        check_chain(&chain, &roots, files, &provider)?;
        Ok(Self { chain, key, roots, provider })
    }
}

fn read(path: &Path, about: &About, what: &str) -> Result<Vec<u8>, SharingError> {
    fs::read(path).map_err(|error| {
        let message = format!("the {what} {} can't be read: {error}", path.display());
        refused(about.clone(), message, "a path is relative to the file that it is written in")
    })
}

fn certificates(path: &Path, about: About, what: &str) -> Result<Vec<CertificateDer<'static>>, SharingError> {
    let text = read(path, &about, what)?;
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&text).collect();
    let found = found.ok().filter(|found| !found.is_empty());
    found.ok_or_else(|| {
        let message = format!("{} holds no certificate in PEM", path.display());
        refused(about, message, "it begins with -----BEGIN CERTIFICATE-----")
    })
}

fn key(path: &Path) -> Result<PrivateKeyDer<'static>, SharingError> {
    let text = read(path, &About::Key, "key")?;
    let found = fs::metadata(path).map(|found| found.mode());
    if found.is_ok_and(|mode| mode & 0o077 != 0) {
        let message = format!("others than its owner may use the key {}", path.display());
        return Err(refused(About::Key, message, &format!("chmod 600 {}", path.display())));
    }
    PrivateKeyDer::from_pem_slice(&text).map_err(|_| {
        let message = format!("{} holds no private key in PEM", path.display());
        refused(About::Key, message, "it begins with -----BEGIN PRIVATE KEY-----, and has no password")
    })
}

/// Checks that the certificate is this agent's.
fn check_name(certificate: &CertificateDer<'_>, path: &Path, agent: &str) -> Result<(), SharingError> {
    let name = common_name(certificate);
    if name.as_deref() == Some(agent) {
        return Ok(());
    }
    let path = path.display();
    let message = match name {
        Some(name) => {
            let name = printable_text(&name);
            format!("the certificate {path} is that of `{name}`, and this agent is `{agent}`")
        }
        None => format!("the certificate {path} has no common name"),
    };
    Err(refused(About::Certificate, message, &format!("make one with the common name (CN) `{agent}`")))
}

/// Returns the expiry of a certificate, s since 1970.
pub(super) fn expiry(certificate: &CertificateDer<'_>) -> i64 {
    X509Certificate::from_der(certificate)
        .map_or(i64::MIN, |(_, parsed)| parsed.validity().not_after.timestamp())
}

/// Returns the agent's name in a certificate.
pub(super) fn common_name(certificate: &CertificateDer<'_>) -> Option<String> {
    let (_, certificate) = X509Certificate::from_der(certificate).ok()?;
    certificate.subject().iter_common_name().next()?.as_str().ok().map(Into::into)
}

fn check_key(
    certificate: &[CertificateDer<'static>],
    key: &PrivateKeyDer<'static>,
    path: &Path,
    provider: &CryptoProvider,
) -> Result<(), SharingError> {
    let path = path.display();
    match CertifiedKey::from_der(certificate.to_vec(), key.clone_key(), provider) {
        Ok(_) => Ok(()),
        Err(rustls::Error::InconsistentKeys(_)) => {
            let message = format!("the key {path} does not belong to the certificate");
            Err(refused(About::Key, message, "give the key that the certificate was made with"))
        }
        Err(error) => {
            let message = format!("the key {path} is of no use: {error}");
            Err(refused(About::Key, message, "make a key of the kind RSA, ECDSA (P-256) or Ed25519"))
        }
    }
}

fn roots(authority: &[CertificateDer<'static>], path: &Path) -> Result<RootCertStore, SharingError> {
    let mut roots = RootCertStore::empty();
    for root in authority {
        roots.add(root.clone()).map_err(|error| {
            let message = format!("the authority {} is of no use: {error}", path.display());
            refused(
                About::Authority,
                message,
                "give the certificate of the authority that signed those of the agents",
            )
        })?;
    }
    Ok(roots)
}

/// Checks that other agents will accept the certificate.
/// It must be valid now, signed by the authority, and usable for both ends.
fn check_chain(
    certificate: &[CertificateDer<'static>],
    roots: &Arc<RootCertStore>,
    files: Files<'_>,
    provider: &Arc<CryptoProvider>,
) -> Result<(), SharingError> {
    let (own, between) = (&certificate[0], &certificate[1..]);
    let now = UnixTime::now();
    let as_client = || {
        let verifier = WebPkiClientVerifier::builder_with_provider(Arc::clone(roots), Arc::clone(provider))
            .build()
            .map_err(|error| rustls::Error::General(error.to_string()))?;
        verifier.verify_client_cert(own, between, now).map(drop)
    };
    let as_server = || {
        let parsed = ParsedCertificate::try_from(own)?;
        let algorithms = provider.signature_verification_algorithms.all;
        verify_server_cert_signed_by_trust_anchor(&parsed, roots, between, now, algorithms)
    };
    as_client().and_then(|()| as_server()).map_err(|error| {
        let (certificate, authority) = (files.certificate.display(), files.authority.display());
        let (reason, help) = explain(&error);
        let message = format!("the certificate {certificate} {reason} (authority: {authority})");
        refused(About::Certificate, message, help)
    })
}

/// Returns the error of a certificate and the help for the user.
pub(super) fn explain(error: &rustls::Error) -> (String, &'static str) {
    use rustls::CertificateError::{
        BadSignature, Expired, ExpiredContext, NotValidYet, NotValidYetContext, UnknownIssuer,
    };
    match error {
        rustls::Error::InvalidCertificate(Expired | ExpiredContext { .. }) => {
            ("has expired".into(), "make a new one, or see whether the clock of this machine is right")
        }
        rustls::Error::InvalidCertificate(NotValidYet | NotValidYetContext { .. }) => {
            ("is not valid yet".into(), "see whether the clock of this machine is right")
        }
        // Another authority may have the same name.
        rustls::Error::InvalidCertificate(UnknownIssuer | BadSignature) => {
            ("was not signed by the authority".into(), "let the authority sign it, or give the one that did")
        }
        error => (format!("is of no use: {error}"), "make a certificate as the book shows"),
    }
}
