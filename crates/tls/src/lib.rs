//! TLS 1.3 verification of the other end, for agents and their clients.

use std::sync::{Arc, OnceLock};

use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::client::{verify_server_cert_signed_by_trust_anchor, verify_server_name};
use rustls::crypto::{CryptoProvider, verify_tls13_signature};
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::server::{ParsedCertificate, WebPkiClientVerifier};
use rustls::{
    CertificateError, DigitallySignedStruct, DistinguishedName, Error, RootCertStore, SignatureScheme,
};

/// Certificate that the other end presents.
/// It proves nothing until it is verified, and helps to find its owner if it is refused.
pub type ShownCertificate = Arc<OnceLock<CertificateDer<'static>>>;

/// Converts a bad signature to an unknown issuer.
/// Another authority may have the same name; the other end learns that it is another one.
fn of_authority(error: Error) -> Error {
    match error {
        Error::InvalidCertificate(CertificateError::BadSignature) => {
            Error::InvalidCertificate(CertificateError::UnknownIssuer)
        }
        error => error,
    }
}

/// Verification of signatures, whichever end shows them.
macro_rules! signatures {
    () => {
        // Agents speak TLS 1.3 and nothing else.
        fn verify_tls12_signature(
            &self,
            _: &[u8],
            _: &CertificateDer<'_>,
            _: &DigitallySignedStruct,
        ) -> Result<HandshakeSignatureValid, Error> {
            Err(rustls::PeerIncompatible::Tls12NotOffered.into())
        }

        fn verify_tls13_signature(
            &self,
            message: &[u8],
            certificate: &CertificateDer<'_>,
            signed: &DigitallySignedStruct,
        ) -> Result<HandshakeSignatureValid, Error> {
            let algorithms = &self.provider.signature_verification_algorithms;
            verify_tls13_signature(message, certificate, signed, algorithms)
        }

        fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
            self.provider.signature_verification_algorithms.supported_schemes()
        }
    };
}

/// Subject of a server's certificate.
#[derive(Debug)]
enum Subject {
    /// Dialled host, or any subject if the certificate itself is one of these.
    /// A self-signed certificate is no authority, and its presenter has its key.
    Host(Vec<CertificateDer<'static>>),
    /// Any agent.
    /// A caller that expects a certain one compares its name with that of the certificate.
    Agent(ShownCertificate),
}

/// Verifies servers: authorities of its own have signed their certificates.
#[derive(Debug)]
pub struct ServerVerifier {
    roots: Arc<RootCertStore>,
    provider: Arc<CryptoProvider>,
    subject: Subject,
}

impl ServerVerifier {
    /// Accepts the dialled host, and any end whose certificate itself is `known`.
    pub fn of_host(
        roots: Arc<RootCertStore>,
        provider: Arc<CryptoProvider>,
        known: Vec<CertificateDer<'static>>,
    ) -> Self {
        Self { roots, provider, subject: Subject::Host(known) }
    }

    /// Takes every agent of the authorities.
    pub fn of_agent(
        roots: Arc<RootCertStore>,
        provider: Arc<CryptoProvider>,
        shown: ShownCertificate,
    ) -> Self {
        Self { roots, provider, subject: Subject::Agent(shown) }
    }

    fn verify(
        &self,
        certificate: &CertificateDer<'_>,
        between: &[CertificateDer<'_>],
        name: &ServerName<'_>,
        now: UnixTime,
    ) -> Result<(), Error> {
        let parsed = ParsedCertificate::try_from(certificate)?;
        let algorithms = self.provider.signature_verification_algorithms.all;
        verify_server_cert_signed_by_trust_anchor(&parsed, &self.roots, between, now, algorithms)?;
        match self.subject {
            Subject::Host(_) => verify_server_name(&parsed, name),
            Subject::Agent(_) => Ok(()),
        }
    }
}

impl ServerCertVerifier for ServerVerifier {
    fn verify_server_cert(
        &self,
        certificate: &CertificateDer<'_>,
        between: &[CertificateDer<'_>],
        name: &ServerName<'_>,
        _: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        use CertificateError::{
            InvalidPurpose, InvalidPurposeContext, NotValidForName, NotValidForNameContext, Other,
            UnknownIssuer,
        };
        if let Subject::Agent(shown) = &self.subject {
            shown.get_or_init(|| certificate.clone().into_owned());
        }
        match (self.verify(certificate, between, name, now), &self.subject) {
            (Ok(()), _) => Ok(ServerCertVerified::assertion()),
            // Dates hold for it too.
            (
                Err(Error::InvalidCertificate(
                    UnknownIssuer
                    | NotValidForName
                    | NotValidForNameContext { .. }
                    | InvalidPurpose
                    | InvalidPurposeContext { .. }
                    | Other(_),
                )),
                Subject::Host(known),
            ) if known.iter().any(|known| known == certificate) => Ok(ServerCertVerified::assertion()),
            (Err(error), _) => Err(of_authority(error)),
        }
    }

    signatures!();
}

/// Verifier of dialing agents with certificates of dedicated authorities.
#[derive(Debug)]
pub struct ClientVerifier {
    verifier: Arc<dyn ClientCertVerifier>,
    provider: Arc<CryptoProvider>,
    shown: ShownCertificate,
}

impl ClientVerifier {
    /// Takes every agent of the authorities.
    ///
    /// # Errors
    /// Without any authority.
    pub fn new(
        roots: Arc<RootCertStore>,
        provider: Arc<CryptoProvider>,
        shown: ShownCertificate,
    ) -> Result<Self, Error> {
        let verifier = WebPkiClientVerifier::builder_with_provider(roots, Arc::clone(&provider)).build();
        let verifier = verifier.map_err(|error| Error::General(error.to_string()))?;
        Ok(Self { verifier, provider, shown })
    }
}

impl ClientCertVerifier for ClientVerifier {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        self.verifier.root_hint_subjects()
    }

    fn verify_client_cert(
        &self,
        certificate: &CertificateDer<'_>,
        between: &[CertificateDer<'_>],
        now: UnixTime,
    ) -> Result<ClientCertVerified, Error> {
        self.shown.get_or_init(|| certificate.clone().into_owned());
        self.verifier.verify_client_cert(certificate, between, now).map_err(of_authority)
    }

    signatures!();
}
