//! TLS.

use std::path::Path;

use tokio::net::TcpStream;

use super::StartError;
use crate::token::check_secret;

#[cfg(feature = "tls")]
mod with {
    use std::path::Path;
    use std::sync::Arc;

    use tokio::net::TcpStream;
    use tokio_rustls::TlsAcceptor;
    use tokio_rustls::rustls::ServerConfig;
    use tokio_rustls::rustls::crypto::ring;
    use tokio_rustls::rustls::pki_types::pem::PemObject;
    use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
    use tokio_rustls::server::TlsStream;
    use webpki::EndEntityCert;

    pub type Stream = TlsStream<TcpStream>;

    #[derive(Clone)]
    pub struct Acceptor {
        acceptor: TlsAcceptor,
        /// Certificate of the agent itself.
        own: CertificateDer<'static>,
    }

    impl Acceptor {
        pub fn load(certificate: &Path, key: &Path) -> Result<Self, (bool, String)> {
            let of_certificate = |error: &dyn std::fmt::Display| (true, error.to_string());
            let of_key = |error: &dyn std::fmt::Display| (false, error.to_string());
            let chain =
                CertificateDer::pem_file_iter(certificate).and_then(Iterator::collect::<Result<Vec<_>, _>>);
            let chain = chain.map_err(|error| of_certificate(&error))?;
            let own = chain.first().cloned().ok_or_else(|| of_certificate(&"it has no certificate"))?;
            let key = PrivateKeyDer::from_pem_file(key).map_err(|error| of_key(&error))?;
            let settings = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
                .with_safe_default_protocol_versions()
                .map_err(|error| of_certificate(&error))?
                .with_no_client_auth()
                .with_single_cert(chain, key)
                .map_err(|error| of_certificate(&error))?;
            Ok(Self { acceptor: TlsAcceptor::from(Arc::new(settings)), own })
        }

        pub fn names(&self) -> Vec<String> {
            let Ok(own) = EndEntityCert::try_from(&self.own) else { return Vec::new() };
            own.valid_dns_names().filter(|name| !name.starts_with('*')).map(str::to_owned).collect()
        }

        pub fn holds(&self, host: &str) -> bool {
            let name = ServerName::try_from(host);
            let own = EndEntityCert::try_from(&self.own);
            matches!((own, name), (Ok(own), Ok(name)) if own.verify_is_valid_for_subject_name(&name).is_ok())
        }

        pub async fn accept(&self, stream: TcpStream) -> Option<Stream> {
            self.acceptor.accept(stream).await.ok()
        }
    }
}

#[cfg(not(feature = "tls"))]
mod with {
    use std::path::Path;

    use tokio::net::TcpStream;

    pub type Stream = TcpStream;

    #[derive(Clone)]
    pub enum Acceptor {}

    impl Acceptor {
        pub fn load(_: &Path, _: &Path) -> Result<Self, (bool, String)> {
            Err((true, "this program is built without TLS: build it with the feature `tls` (cargo build --features tls)".into()))
        }

        pub fn names(&self) -> Vec<String> {
            match *self {}
        }

        pub fn holds(&self, _: &str) -> bool {
            match *self {}
        }

        pub async fn accept(&self, _: TcpStream) -> Option<Stream> {
            match *self {}
        }
    }
}

/// TLS acceptor with the agent's certificate.
#[derive(Clone)]
pub(super) struct Tls(with::Acceptor);

impl Tls {
    pub fn load(certificate: &Path, key: &Path) -> Result<Self, StartError> {
        check_secret(key).map_err(|reason| StartError::File { path: key.into(), reason })?;
        let acceptor = with::Acceptor::load(certificate, key).map_err(|(of_certificate, reason)| {
            let path = if of_certificate { certificate } else { key };
            StartError::File { path: path.into(), reason }
        });
        acceptor.map(Self)
    }

    /// Returns the host names in the certificate.
    /// Wildcard names are left out, as their hosts are unknown.
    pub fn names(&self) -> Vec<String> {
        self.0.names()
    }

    /// Returns whether the certificate is valid for a host, without a port.
    /// The host is a name or an address.
    pub fn holds(&self, host: &str) -> bool {
        self.0.holds(host)
    }

    /// Returns the stream after a handshake; `None` if that fails.
    pub async fn accept(&self, stream: TcpStream) -> Option<with::Stream> {
        self.0.accept(stream).await
    }
}
