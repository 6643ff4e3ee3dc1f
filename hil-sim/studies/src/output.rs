//! What is written of runs: JSON, JUnit, annotations, golden hashes, the HTML report, plots.

pub mod annotation;
pub mod escape;
pub mod golden;
pub mod json;
pub mod junit;
pub(crate) mod plot;
pub mod report;

use std::path::Path;
use std::{fs, io};

/// A number with so many decimals; what rounds to 0 has no sign.
pub fn rounded(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.bytes().all(|byte| matches!(byte, b'-' | b'0' | b'.'));
    match text.strip_prefix('-') {
        Some(plain) if is_zero => plain.to_owned(),
        _ => text,
    }
}

/// Puts a file with this content in the place of the one that may be there, which stays if the new one can't be written. Of
/// a link, in the place that it leads to.
pub(crate) fn replace(path: &Path, content: &str) -> io::Result<()> {
    let path = &fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let draft = path.with_file_name(format!(".{name}.new"));
    fs::write(&draft, content)
        .and_then(|()| fs::rename(&draft, path))
        .inspect_err(|_| {
            let _ = fs::remove_file(&draft);
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_replaced_stays_as_it_was() {
        let folder = std::env::temp_dir().join(format!("hil-sim-replace-{}", std::process::id()));
        // In the draft's way.
        fs::create_dir_all(folder.join(".a.toml.new")).unwrap();
        let path = folder.join("a.toml");
        fs::write(&path, "old").unwrap();
        assert!(replace(&path, "new").is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        fs::remove_dir(folder.join(".a.toml.new")).unwrap();
        replace(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(
            fs::read_dir(&folder).unwrap().count(),
            1,
            "no draft is left"
        );
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_link_stays_one() {
        let folder = std::env::temp_dir().join(format!("hil-sim-link-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (path, link) = (folder.join("a.toml"), folder.join("link.toml"));
        fs::write(&path, "old").unwrap();
        std::os::unix::fs::symlink("a.toml", &link).unwrap();
        replace(&link, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        fs::remove_dir_all(&folder).unwrap();
    }
}
