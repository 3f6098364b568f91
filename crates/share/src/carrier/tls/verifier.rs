//! Who may be at the other end of a link.

use std::sync::{Arc, OnceLock};

use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::client::verify_server_cert_signed_by_trust_anchor;
use rustls::crypto::{CryptoProvider, verify_tls13_signature};
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::server::{ParsedCertificate, WebPkiClientVerifier};
use rustls::{
    CertificateError, ClientConfig, DigitallySignedStruct, DistinguishedName, RootCertStore, ServerConfig,
    SignatureScheme,
};

use super::credentials::{Loaded, common_name};

/// Whom the certificate names that the other end shows. It proves nothing until the certificate is verified, and helps to
/// find whose it is if it is refused.
pub(super) type Shown = Arc<OnceLock<String>>;

fn note(shown: &Shown, certificate: &CertificateDer<'_>) {
    if let Some(name) = common_name(certificate) {
        shown.get_or_init(|| name);
    }
}

/// Another authority may have the same name; the other end is told that it is another one.
fn of_whom(error: rustls::Error) -> rustls::Error {
    match error {
        rustls::Error::InvalidCertificate(CertificateError::BadSignature) => {
            rustls::Error::InvalidCertificate(CertificateError::UnknownIssuer)
        }
        error => error,
    }
}

/// How signatures are verified, whichever end shows them.
macro_rules! signatures {
    () => {
        // Agents speak TLS 1.3 and nothing else.
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
            let algorithms = &self.provider.signature_verification_algorithms;
            verify_tls13_signature(message, certificate, signed, algorithms)
        }

        fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
            self.provider.signature_verification_algorithms.supported_schemes()
        }
    };
}

/// Takes every agent of the authority. Who it is its certificate says, wherever it is: so its name is compared with the
/// agent's, by whoever waits for that one, and not with the host's.
#[derive(Debug)]
struct AnyAgent {
    roots: Arc<RootCertStore>,
    provider: Arc<CryptoProvider>,
    shown: Shown,
}

impl ServerCertVerifier for AnyAgent {
    fn verify_server_cert(
        &self,
        certificate: &CertificateDer<'_>,
        between: &[CertificateDer<'_>],
        _: &ServerName<'_>,
        _: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, rustls::Error> {
        note(&self.shown, certificate);
        let parsed = ParsedCertificate::try_from(certificate)?;
        let algorithms = self.provider.signature_verification_algorithms.all;
        verify_server_cert_signed_by_trust_anchor(&parsed, &self.roots, between, now, algorithms)
            .map_err(of_whom)?;
        Ok(ServerCertVerified::assertion())
    }

    signatures!();
}

/// The same for those who dial.
#[derive(Debug)]
struct AnyCaller {
    verifier: Arc<dyn ClientCertVerifier>,
    provider: Arc<CryptoProvider>,
    shown: Shown,
}

impl ClientCertVerifier for AnyCaller {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        self.verifier.root_hint_subjects()
    }

    fn verify_client_cert(
        &self,
        certificate: &CertificateDer<'_>,
        between: &[CertificateDer<'_>],
        now: UnixTime,
    ) -> Result<ClientCertVerified, rustls::Error> {
        note(&self.shown, certificate);
        self.verifier.verify_client_cert(certificate, between, now).map_err(of_whom)
    }

    signatures!();
}

/// How the end that dials does it.
pub(super) fn client(loaded: Loaded, shown: Shown) -> Result<Arc<ClientConfig>, rustls::Error> {
    let Loaded { chain, key, roots, provider } = loaded;
    let verifier = Arc::new(AnyAgent { roots, provider: Arc::clone(&provider), shown });
    let mut settings = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .dangerous()
        .with_custom_certificate_verifier(verifier)
        .with_client_auth_cert(chain, key)?;
    // Each link proves anew who is there.
    settings.resumption = rustls::client::Resumption::disabled();
    Ok(Arc::new(settings))
}

/// How the end that is dialled does it.
pub(super) fn server(loaded: Loaded, shown: Shown) -> Result<Arc<ServerConfig>, rustls::Error> {
    let Loaded { chain, key, roots, provider } = loaded;
    let verifier = WebPkiClientVerifier::builder_with_provider(roots, Arc::clone(&provider))
        .build()
        .map_err(|error| rustls::Error::General(error.to_string()))?;
    let verifier = Arc::new(AnyCaller { verifier, provider: Arc::clone(&provider), shown });
    let mut settings = ServerConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .with_client_cert_verifier(verifier)
        .with_single_cert(chain, key)?;
    settings.send_tls13_tickets = 0;
    Ok(Arc::new(settings))
}
