//! TLS, and the trusted certificates.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use rustls::crypto::CryptoProvider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{CertificateError, ClientConfig, RootCertStore};
use slate_tls::ServerVerifier;
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;

use super::access_failure::AccessFailure;
use super::address::Address;

/// Makes the handshake.
pub async fn connect(
    stream: TcpStream,
    address: &Address,
    certificate: Option<&Path>,
) -> Result<TlsStream<TcpStream>, AccessFailure> {
    let settings = settings(certificate)?;
    let of_name =
        |_| AccessFailure::NoAddress { text: address.to_string(), reason: "no certificate has such a name" };
    let name = ServerName::try_from(address.host().to_owned()).map_err(of_name)?;
    let connected = TlsConnector::from(Arc::new(settings)).connect(name, stream);
    match tokio::time::timeout(HANDSHAKE_TIMEOUT, connected).await {
        Ok(connected) => connected.map_err(|error| access_failure(address, &error)),
        Err(_) => Err(AccessFailure::Unreached {
            address: address.to_string(),
            reason: "no answer to the handshake".into(),
        }),
    }
}

/// Timeout for a handshake.
const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(60);

/// Returns the reason why a handshake has failed.
fn access_failure(address: &Address, error: &std::io::Error) -> AccessFailure {
    use rustls::Error;
    let address = address.to_string();
    match error.get_ref().and_then(|error| error.downcast_ref::<Error>()) {
        Some(Error::InvalidMessage(_)) => AccessFailure::NoTls { address },
        Some(Error::InvalidCertificate(reason)) => {
            let reason = match reason {
                CertificateError::UnknownIssuer => "no trusted authority has signed it".into(),
                CertificateError::Expired | CertificateError::ExpiredContext { .. } => {
                    "it has expired".into()
                }
                CertificateError::NotValidYet | CertificateError::NotValidYetContext { .. } => {
                    "it is not valid yet".into()
                }
                CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. } => {
                    "it is for another name".into()
                }
                other => other.to_string(),
            };
            AccessFailure::Untrusted { address, reason }
        }
        _ => AccessFailure::Unreached { address, reason: error.to_string() },
    }
}

fn settings(certificate: Option<&Path>) -> Result<ClientConfig, AccessFailure> {
    let provider: Arc<CryptoProvider> = Arc::new(rustls::crypto::ring::default_provider());
    let (path, named) = match certificate {
        Some(path) => (path.to_owned(), read(path)?),
        None => system()?,
    };
    let unusable = |error: &dyn std::fmt::Display| AccessFailure::Certificate {
        path: path.clone(),
        reason: error.to_string(),
    };
    let mut roots = RootCertStore::empty();
    // Of many, one that is of no use is no reason against the others.
    let (good, _) = roots.add_parsable_certificates(named.iter().cloned());
    if good == 0 {
        return Err(unusable(&"it has no certificate that could be trusted"));
    }
    let known = if certificate.is_some() { named } else { Vec::new() };
    let verifier = ServerVerifier::of_host(Arc::new(roots), Arc::clone(&provider), known);
    let settings = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| unusable(&error))?
        .dangerous()
        .with_custom_certificate_verifier(Arc::new(verifier))
        .with_no_client_auth();
    Ok(settings)
}

fn read(path: &Path) -> Result<Vec<CertificateDer<'static>>, AccessFailure> {
    let found = CertificateDer::pem_file_iter(path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    found.map_err(|error| AccessFailure::Certificate { path: path.into(), reason: error.to_string() })
}

/// Paths of the trusted root certificates on common systems.
const SYSTEM_AUTHORITIES: [&str; 4] = [
    "/etc/ssl/certs/ca-certificates.crt",
    "/etc/pki/tls/certs/ca-bundle.crt",
    "/etc/ssl/ca-bundle.pem",
    "/etc/ssl/cert.pem",
];

/// Returns the certificates that the system trusts, with their file.
fn system() -> Result<(PathBuf, Vec<CertificateDer<'static>>), AccessFailure> {
    let configured = std::env::var_os("SSL_CERT_FILE").map(PathBuf::from);
    let standard = || SYSTEM_AUTHORITIES.iter().map(PathBuf::from).find(|path| path.is_file());
    let Some(path) = configured.or_else(standard) else {
        let reason = "this machine has no list of trusted authorities; set SLATE_CERTIFICATE to the agent's certificate";
        return Err(AccessFailure::Certificate { path: SYSTEM_AUTHORITIES[0].into(), reason: reason.into() });
    };
    read(&path).map(|found| (path, found))
}
