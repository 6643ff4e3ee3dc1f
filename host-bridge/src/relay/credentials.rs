//! Who may take part: a certificate authority, one's own certificate and its key, looked at before they
//! are needed.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::server::danger::ClientCertVerifier;
use rustls::{CertificateError, ClientConfig, Error, RootCertStore, ServerConfig, version::TLS13};
use x509_parser::parse_x509_certificate;
use x509_parser::prelude::X509Certificate;

/// Three PEM files. With them, both ends of every connection have to prove who they are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Credentials {
    /// Whose certificates are believed.
    pub ca: PathBuf,
    /// One's own certificate, for connecting and for listening, and what leads from it to its CA.
    pub certificate: PathBuf,
    /// Its private key.
    pub key: PathBuf,
}

/// Why credentials can't be used.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum CredentialsError {
    #[error("{0}: can't be read: {1}")]
    Unreadable(PathBuf, io::Error),
    #[error("{0}: no certificate in it: a PEM file with BEGIN CERTIFICATE is wanted")]
    NoCertificate(PathBuf),
    #[error(
        "{0}: no private key in it: a PEM file with BEGIN PRIVATE KEY is wanted, without a password"
    )]
    NoKey(PathBuf),
    #[error("{key}: not the key of {certificate}: give the two that were made together")]
    Mismatch { key: PathBuf, certificate: PathBuf },
    #[error("{0}: the certificate has expired: have a new one made")]
    Expired(PathBuf),
    #[error("{0}: the certificate is not valid yet: see whether this computer's clock is right")]
    Early(PathBuf),
    #[error(
        "{0}: the certificate is not meant for connecting: it wants extendedKeyUsage = serverAuth, clientAuth"
    )]
    Purpose(PathBuf),
    #[error(
        "{certificate}: it is the certificate of {owner}, who may not speak here: give {wanted}'s, or another --name"
    )]
    Owner {
        certificate: PathBuf,
        owner: String,
        wanted: String,
    },
    #[error("{0}: can't be used: {1}")]
    Unusable(PathBuf, Error),
}

/// What connections are made with.
pub struct Loaded {
    /// Those that one makes.
    pub connecting: ClientConfig,
    /// Those that others make.
    pub listening: ServerConfig,
}

impl Credentials {
    /// Reads and checks all three: what connections will be made with. Fails if one of them can't be read, is
    /// none, doesn't fit, or is not valid today.
    pub fn load(&self) -> Result<Loaded, CredentialsError> {
        let provider = Arc::new(ring::default_provider());
        let roots = Arc::new(roots(&self.ca)?);
        let chain = certificates(&self.certificate)?;
        let verifier = self.verifier(&roots, &provider)?;
        self.check_validity(&verifier, &chain)?;
        let key = PrivateKeyDer::from_pem_slice(&read(&self.key)?)
            .map_err(|_| CredentialsError::NoKey(self.key.clone()))?;
        let refused = |reason| self.refusal(reason);
        Ok(Loaded {
            connecting: ClientConfig::builder_with_provider(Arc::clone(&provider))
                .with_protocol_versions(&[&TLS13])
                .map_err(refused)?
                .with_root_certificates(roots)
                .with_client_auth_cert(chain.clone(), key.clone_key())
                .map_err(refused)?,
            listening: ServerConfig::builder_with_provider(provider)
                .with_protocol_versions(&[&TLS13])
                .map_err(refused)?
                .with_client_cert_verifier(verifier)
                .with_single_cert(chain, key)
                .map_err(refused)?,
        })
    }

    /// Whether one's own certificate is that of `wanted`, a common name. Others throw away what its owner may not say,
    /// and only they would tell so.
    pub fn check_owner(&self, wanted: &str) -> Result<(), CredentialsError> {
        let chain = certificates(&self.certificate)?;
        let own = chain
            .first()
            .and_then(|own| parse_x509_certificate(own).ok());
        let owner = own.and_then(|(_, own)| common_name(&own));
        if owner.as_deref() == Some(wanted) {
            return Ok(());
        }
        Err(CredentialsError::Owner {
            certificate: self.certificate.clone(),
            owner: owner.unwrap_or_else(|| "nobody (it wants one common name)".to_owned()),
            wanted: wanted.to_owned(),
        })
    }

    fn refusal(&self, reason: Error) -> CredentialsError {
        match reason {
            Error::InconsistentKeys(_) => CredentialsError::Mismatch {
                key: self.key.clone(),
                certificate: self.certificate.clone(),
            },
            reason => CredentialsError::Unusable(self.key.clone(), reason),
        }
    }

    fn verifier(
        &self,
        roots: &Arc<RootCertStore>,
        provider: &Arc<CryptoProvider>,
    ) -> Result<Arc<dyn ClientCertVerifier>, CredentialsError> {
        WebPkiClientVerifier::builder_with_provider(Arc::clone(roots), Arc::clone(provider))
            .build()
            .map_err(|_| CredentialsError::NoCertificate(self.ca.clone()))
    }

    /// Whether one's own certificate is valid today, whoever made it: the other site may believe in
    /// another CA than this one.
    fn check_validity(
        &self,
        verifier: &Arc<dyn ClientCertVerifier>,
        chain: &[CertificateDer<'static>],
    ) -> Result<(), CredentialsError> {
        let Some((own, between)) = chain.split_first() else {
            return Err(CredentialsError::NoCertificate(self.certificate.clone()));
        };
        let path = self.certificate.clone();
        match verifier.verify_client_cert(own, between, UnixTime::now()) {
            Ok(_) | Err(Error::InvalidCertificate(CertificateError::UnknownIssuer)) => Ok(()),
            Err(Error::InvalidCertificate(
                CertificateError::Expired | CertificateError::ExpiredContext { .. },
            )) => Err(CredentialsError::Expired(path)),
            Err(Error::InvalidCertificate(
                CertificateError::NotValidYet | CertificateError::NotValidYetContext { .. },
            )) => Err(CredentialsError::Early(path)),
            Err(Error::InvalidCertificate(
                CertificateError::InvalidPurpose | CertificateError::InvalidPurposeContext { .. },
            )) => Err(CredentialsError::Purpose(path)),
            Err(reason) => Err(CredentialsError::Unusable(path, reason)),
        }
    }
}

/// Whose a certificate is. None if it has not exactly one common name.
pub fn common_name(certificate: &X509Certificate<'_>) -> Option<String> {
    let mut names = certificate.subject().iter_common_name();
    let (Some(name), None) = (names.next(), names.next()) else {
        return None;
    };
    name.as_str().ok().map(str::to_owned)
}

fn roots(path: &Path) -> Result<RootCertStore, CredentialsError> {
    let mut roots = RootCertStore::empty();
    for certificate in certificates(path)? {
        roots
            .add(certificate)
            .map_err(|reason| CredentialsError::Unusable(path.to_owned(), reason))?;
    }
    Ok(roots)
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, CredentialsError> {
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&read(path)?).collect();
    match found {
        Ok(found) if !found.is_empty() => Ok(found),
        _ => Err(CredentialsError::NoCertificate(path.to_owned())),
    }
}

fn read(path: &Path) -> Result<Vec<u8>, CredentialsError> {
    fs::read(path).map_err(|reason| CredentialsError::Unreadable(path.to_owned(), reason))
}
