//! Certificates for bridges.

use std::fs;
use std::path::{Path, PathBuf};

use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa,
    Issuer, KeyPair, date_time_ymd,
};

/// A certificate authority that lasts for a test.
pub struct Authority {
    folder: PathBuf,
    issuer: Issuer<'static, KeyPair>,
}

/// Which certificate is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// One for `localhost` and for the bench called `bench`.
    Good,
    /// One that was valid in 2001.
    Expired,
    /// One for a host that is not this one.
    OfAnotherHost,
    /// One that is not meant for connecting.
    ForServersOnly,
    /// One for the bench called `other`.
    OfAnotherBench,
}

impl Authority {
    /// One whose files are in a folder of `folder`'s, called as the test.
    ///
    /// # Panics
    /// If they can't be written.
    pub fn new(folder: &Path, test: &str) -> Self {
        let folder = folder.join("certificates").join(test);
        fs::create_dir_all(&folder).expect("a folder can be made");
        let key = KeyPair::generate().expect("a key can be made");
        let mut params = CertificateParams::default();
        params.distinguished_name.push(DnType::CommonName, test);
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        let certificate = params.self_signed(&key).expect("it can be signed");
        fs::write(folder.join("ca.pem"), certificate.pem()).expect("it can be written");
        Self {
            folder,
            issuer: Issuer::new(params, key),
        }
    }

    /// The file of that name in its folder.
    pub fn file(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    /// The three options for a certificate of this authority's, which believes in `ca`. What follows the last `-` of
    /// `name` is the role that it is for.
    ///
    /// # Panics
    /// If it can't be written.
    pub fn proofs(&self, name: &str, kind: Kind, ca: &Self) -> Vec<String> {
        let host = if kind == Kind::OfAnotherHost {
            "elsewhere"
        } else {
            "localhost"
        };
        let mut params = CertificateParams::new([host.to_owned()]).expect("a name");
        let role = name.rsplit('-').next().unwrap_or(name);
        let bench = if kind == Kind::OfAnotherBench {
            "other"
        } else {
            "bench"
        };
        params.distinguished_name = DistinguishedName::new();
        params
            .distinguished_name
            .push(DnType::CommonName, format!("{bench}.{role}"));
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
        if kind != Kind::ForServersOnly {
            params
                .extended_key_usages
                .push(ExtendedKeyUsagePurpose::ClientAuth);
        }
        if kind == Kind::Expired {
            params.not_before = date_time_ymd(2001, 1, 1);
            params.not_after = date_time_ymd(2002, 1, 1);
        }
        let key = KeyPair::generate().expect("a key can be made");
        let certificate = params
            .signed_by(&key, &self.issuer)
            .expect("it can be signed");
        let (pem, key_pem) = (format!("{name}.pem"), format!("{name}.key"));
        fs::write(self.folder.join(&pem), certificate.pem()).expect("it can be written");
        fs::write(self.folder.join(&key_pem), key.serialize_pem()).expect("it can be written");
        [
            ("--ca", ca.file("ca.pem")),
            ("--certificate", self.file(&pem)),
            ("--key", self.file(&key_pem)),
        ]
        .into_iter()
        .flat_map(|(option, file)| [option.to_owned(), file])
        .collect()
    }
}
