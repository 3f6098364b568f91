//! TLS settings of both ends of a link.

use std::sync::Arc;

use rustls::{ClientConfig, ServerConfig};
use slate_tls::{ClientVerifier, ServerVerifier, ShownCertificate};

use super::credentials::LoadedCredentials;

/// Returns the settings of the end that dials.
pub(super) fn client(
    loaded: LoadedCredentials,
    shown: ShownCertificate,
) -> Result<Arc<ClientConfig>, rustls::Error> {
    let LoadedCredentials { chain, key, roots, provider } = loaded;
    let verifier = ServerVerifier::of_agent(roots, Arc::clone(&provider), shown);
    let mut settings = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .dangerous()
        .with_custom_certificate_verifier(Arc::new(verifier))
        .with_client_auth_cert(chain, key)?;
    // Each link authenticates both ends anew.
    settings.resumption = rustls::client::Resumption::disabled();
    Ok(Arc::new(settings))
}

/// Returns the settings of the end that is dialed.
pub(super) fn server(
    loaded: LoadedCredentials,
    shown: ShownCertificate,
) -> Result<Arc<ServerConfig>, rustls::Error> {
    let LoadedCredentials { chain, key, roots, provider } = loaded;
    let verifier = ClientVerifier::new(roots, Arc::clone(&provider), shown)?;
    let mut settings = ServerConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .with_client_cert_verifier(Arc::new(verifier))
        .with_single_cert(chain, key)?;
    settings.send_tls13_tickets = 0;
    Ok(Arc::new(settings))
}
