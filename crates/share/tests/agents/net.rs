//! Agents that are found at ports of this machine, with certificates.

use std::net::{TcpListener, UdpSocket};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU16, Ordering};
use std::sync::{Arc, Mutex};

use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair};
use slate_share::carrier::Carrier;
use slate_share::carrier::tls::{Credentials, Files, Tls};
use slate_sorted::SortedMap;

/// A free port that no connection gets by itself.
pub fn port() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let first = 10_000 + (std::process::id() % 200) as u16 * 100;
    loop {
        let port = first + NEXT.fetch_add(1, Ordering::Relaxed) % 2_000;
        let free =
            TcpListener::bind(("127.0.0.1", port)).is_ok() && UdpSocket::bind(("127.0.0.1", port)).is_ok();
        if free {
            return port;
        }
    }
}

/// The ports of a test's agents.
pub struct Net {
    ports: Mutex<SortedMap<String, u16>>,
    authority: Authority,
}

impl Net {
    pub fn new(folder: &Path) -> Self {
        Self { ports: Mutex::default(), authority: Authority::new(folder, "authority") }
    }

    pub fn endpoint(&self, name: &str) -> String {
        let port = *self.ports.lock().unwrap().entry(name.into()).or_insert_with(port);
        format!("tls:127.0.0.1:{port}")
    }

    pub fn carriers(&self, name: &str) -> SortedMap<String, Arc<dyn Carrier>> {
        let (certificate, authority) = self.files(name);
        carriers(name, &certificate, &authority)
    }

    /// A certificate of the agent and that of the authority.
    pub fn files(&self, name: &str) -> (Certificate, PathBuf) {
        (self.authority.sign(name), self.authority.certificate.clone())
    }
}

/// What an agent with that certificate uses.
pub fn carriers(
    name: &str,
    certificate: &Certificate,
    authority: &Path,
) -> SortedMap<String, Arc<dyn Carrier>> {
    let credentials = certificate.load(authority, name).unwrap();
    let tls: Arc<dyn Carrier> = Arc::new(Tls::new(credentials, false));
    SortedMap::from([("tls".into(), tls)])
}

/// Signs certificates.
pub struct Authority {
    folder: PathBuf,
    pub certificate: PathBuf,
    issuer: Issuer<'static, KeyPair>,
}

/// A certificate's files.
pub struct Certificate {
    pub certificate: PathBuf,
    pub key: PathBuf,
}

impl Certificate {
    pub fn load(
        &self,
        authority: &Path,
        agent: &str,
    ) -> Result<Credentials, slate_runtime::sharing::SharingError> {
        Credentials::load(Files { certificate: &self.certificate, key: &self.key, authority }, agent)
    }
}

impl Authority {
    pub fn new(folder: &Path, name: &str) -> Self {
        let mut parameters = CertificateParams::new(Vec::new()).unwrap();
        parameters.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        parameters.distinguished_name.push(DnType::CommonName, name);
        let key = KeyPair::generate().unwrap();
        let signed = parameters.self_signed(&key).unwrap();
        let certificate = folder.join(format!("{name}.pem"));
        std::fs::write(&certificate, signed.pem()).unwrap();
        Self { folder: folder.into(), certificate, issuer: Issuer::new(parameters, key) }
    }

    pub fn sign(&self, name: &str) -> Certificate {
        self.sign_with(name, |_| {})
    }

    /// Signs a certificate with other parameters.
    pub fn sign_with(&self, name: &str, change: impl FnOnce(&mut CertificateParams)) -> Certificate {
        let mut parameters = CertificateParams::new(Vec::new()).unwrap();
        parameters.distinguished_name.push(DnType::CommonName, name);
        change(&mut parameters);
        let key = KeyPair::generate().unwrap();
        let signed = parameters.signed_by(&key, &self.issuer).unwrap();
        let unique = super::instance();
        let files = Certificate {
            certificate: self.folder.join(format!("{name}-{unique}.pem")),
            key: self.folder.join(format!("{name}-{unique}.key")),
        };
        std::fs::write(&files.certificate, signed.pem()).unwrap();
        std::fs::write(&files.key, key.serialize_pem()).unwrap();
        std::fs::set_permissions(&files.key, std::fs::Permissions::from_mode(0o600)).unwrap();
        files
    }
}
