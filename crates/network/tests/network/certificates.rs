//! Certificates of the tests' agents.
#![allow(clippy::disallowed_methods, reason = "certificates go by the calendar")]

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, SystemTime};

use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair};

/// Signs certificates in a folder of its own.
pub struct Authority {
    folder: PathBuf,
    pub certificate: PathBuf,
    issuer: Issuer<'static, KeyPair>,
}

/// The files of a certificate.
pub struct Certificate {
    pub certificate: PathBuf,
    pub key: PathBuf,
    pub authority: PathBuf,
}

impl Authority {
    pub fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let unique = format!("{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("certificates").join(unique);
        std::fs::create_dir_all(&folder).unwrap();
        let mut parameters = CertificateParams::new(Vec::new()).unwrap();
        parameters.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        parameters.distinguished_name.push(DnType::CommonName, "our robots");
        let key = KeyPair::generate().unwrap();
        let certificate = folder.join("authority.pem");
        std::fs::write(&certificate, parameters.self_signed(&key).unwrap().pem()).unwrap();
        Self { folder, certificate, issuer: Issuer::new(parameters, key) }
    }

    /// Signs the certificate of an agent.
    pub fn sign(&self, name: &str) -> Certificate {
        self.sign_with(name, |_| {})
    }

    /// Signs a certificate that ends after a while, or has ended.
    pub fn sign_until(&self, name: &str, end: SystemTime) -> Certificate {
        self.sign_with(name, |parameters| {
            parameters.not_before = (end - Duration::from_secs(3600)).into();
            parameters.not_after = end.into();
        })
    }

    fn sign_with(&self, name: &str, change: impl FnOnce(&mut CertificateParams)) -> Certificate {
        let mut parameters = CertificateParams::new(Vec::new()).unwrap();
        parameters.distinguished_name.push(DnType::CommonName, name);
        change(&mut parameters);
        let pair = KeyPair::generate().unwrap();
        let signed = parameters.signed_by(&pair, &self.issuer).unwrap();
        let [certificate, key] = ["pem", "key"].map(|kind| self.folder.join(format!("{name}.{kind}")));
        std::fs::write(&certificate, signed.pem()).unwrap();
        std::fs::write(&key, pair.serialize_pem()).unwrap();
        std::fs::set_permissions(&key, std::fs::Permissions::from_mode(0o600)).unwrap();
        Certificate { certificate, key, authority: self.certificate.clone() }
    }
}

impl Drop for Authority {
    fn drop(&mut self) {
        // What remains is removed with the build.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

impl Certificate {
    /// The lines of a configuration that name them.
    pub fn table(&self) -> String {
        let [certificate, key, authority] =
            [&self.certificate, &self.key, &self.authority].map(|path| path.display());
        format!(
            "[network.security]\ncertificate = \"{certificate}\"\nkey = \"{key}\"\nauthority = \"{authority}\"\n"
        )
    }
}
