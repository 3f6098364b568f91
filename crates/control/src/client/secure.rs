//! TLS, and whose certificates are trusted.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use rustls::client::WebPkiServerVerifier;
use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::crypto::CryptoProvider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::{CertificateError, ClientConfig, DigitallySignedStruct, RootCertStore, SignatureScheme};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;

use super::address::Address;
use super::trouble::Trouble;

/// Makes the handshake.
pub async fn begin(
    stream: TcpStream,
    address: &Address,
    certificate: Option<&Path>,
) -> Result<TlsStream<TcpStream>, Trouble> {
    let settings = settings(certificate)?;
    let of_name =
        |_| Trouble::NoAddress { text: address.to_string(), reason: "no certificate has such a name" };
    let name = ServerName::try_from(address.host().to_owned()).map_err(of_name)?;
    let connected = TlsConnector::from(Arc::new(settings)).connect(name, stream);
    match tokio::time::timeout(HANDSHAKE, connected).await {
        Ok(connected) => connected.map_err(|error| trouble(address, &error)),
        Err(_) => Err(Trouble::Unreached {
            address: address.to_string(),
            reason: "no answer to the handshake".into(),
        }),
    }
}

/// How long a handshake may take.
const HANDSHAKE: Duration = Duration::from_secs(60);

/// Why a handshake has failed.
fn trouble(address: &Address, error: &std::io::Error) -> Trouble {
    use rustls::Error;
    let address = address.to_string();
    match error.get_ref().and_then(|error| error.downcast_ref::<Error>()) {
        Some(Error::InvalidMessage(_)) => Trouble::NoTls { address },
        Some(Error::InvalidCertificate(reason)) => {
            let reason = match reason {
                CertificateError::UnknownIssuer | CertificateError::BadSignature => {
                    "nobody who is trusted has signed it".into()
                }
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
            Trouble::Untrusted { address, reason }
        }
        _ => Trouble::Unreached { address, reason: error.to_string() },
    }
}

fn settings(certificate: Option<&Path>) -> Result<ClientConfig, Trouble> {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let (path, named) = match certificate {
        Some(path) => (path.to_owned(), read(path)?),
        None => system()?,
    };
    let unusable = |error: &dyn std::fmt::Display| Trouble::Certificate {
        path: path.clone(),
        reason: error.to_string(),
    };
    let mut roots = RootCertStore::empty();
    // Of many, one that is of no use is no reason against the others.
    let (good, _) = roots.add_parsable_certificates(named.iter().cloned());
    if good == 0 {
        return Err(unusable(&"it has no certificate that could be trusted"));
    }
    let web = WebPkiServerVerifier::builder_with_provider(Arc::new(roots), Arc::clone(&provider)).build();
    let web = web.map_err(|error| unusable(&error))?;
    let known = if certificate.is_some() { named } else { Vec::new() };
    let settings = ClientConfig::builder_with_provider(provider as Arc<CryptoProvider>)
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| unusable(&error))?
        .dangerous()
        .with_custom_certificate_verifier(Arc::new(Known { known, web }))
        .with_no_client_auth();
    Ok(settings)
}

fn read(path: &Path) -> Result<Vec<CertificateDer<'static>>, Trouble> {
    let found = CertificateDer::pem_file_iter(path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    found.map_err(|error| Trouble::Certificate { path: path.into(), reason: error.to_string() })
}

/// Where systems have the certificates of those whom they trust.
const SYSTEM: [&str; 4] = [
    "/etc/ssl/certs/ca-certificates.crt",
    "/etc/pki/tls/certs/ca-bundle.crt",
    "/etc/ssl/ca-bundle.pem",
    "/etc/ssl/cert.pem",
];

/// Whom the system trusts.
fn system() -> Result<(PathBuf, Vec<CertificateDer<'static>>), Trouble> {
    let said = std::env::var_os("SSL_CERT_FILE").map(PathBuf::from);
    let usual = || SYSTEM.iter().map(PathBuf::from).find(|path| path.is_file());
    let Some(path) = said.or_else(usual) else {
        let reason =
            "this computer has no list of whom it trusts; let SLATE_CERTIFICATE be the agent's certificate";
        return Err(Trouble::Certificate { path: SYSTEM[0].into(), reason: reason.into() });
    };
    read(&path).map(|found| (path, found))
}

/// Trusts what authorities have signed, and certificates that somebody has given by themselves: one that signs itself is
/// nobody's authority, and whoever shows it has its key.
#[derive(Debug)]
struct Known {
    known: Vec<CertificateDer<'static>>,
    web: Arc<WebPkiServerVerifier>,
}

impl ServerCertVerifier for Known {
    fn verify_server_cert(
        &self,
        certificate: &CertificateDer<'_>,
        between: &[CertificateDer<'_>],
        name: &ServerName<'_>,
        stapled: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, rustls::Error> {
        use CertificateError::{
            InvalidPurpose, InvalidPurposeContext, NotValidForName, NotValidForNameContext, Other,
            UnknownIssuer,
        };
        match self.web.verify_server_cert(certificate, between, name, stapled, now) {
            // Dates hold for it too.
            Err(rustls::Error::InvalidCertificate(
                UnknownIssuer
                | NotValidForName
                | NotValidForNameContext { .. }
                | InvalidPurpose
                | InvalidPurposeContext { .. }
                | Other(_),
            )) if self.known.iter().any(|known| known == certificate) => Ok(ServerCertVerified::assertion()),
            verified => verified,
        }
    }

    fn verify_tls12_signature(
        &self,
        _: &[u8],
        _: &CertificateDer<'_>,
        _: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        Err(rustls::PeerIncompatible::Tls12NotOffered.into())
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        self.web.verify_tls13_signature(message, certificate, signed)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.web.supported_verify_schemes()
    }
}
