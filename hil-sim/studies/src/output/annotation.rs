//! Annotations: lines on standard output that GitHub's runners show beside the line of a file.

use std::fmt;

/// An error beside a line of a file, as a workflow command of GitHub Actions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Annotation<'a> {
    /// The file, as it is named from the repository's root.
    pub file: &'a str,
    /// Its line, from 1 on; none if the file as a whole is at fault.
    pub line: Option<usize>,
    /// A few words.
    pub title: &'a str,
    /// What is wrong.
    pub message: &'a str,
}

impl fmt::Display for Annotation<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "::error file={}", property(self.file))?;
        if let Some(line) = self.line {
            write!(formatter, ",line={line}")?;
        }
        let (title, message) = (property(self.title), data(self.message));
        write!(formatter, ",title={title}::{message}")
    }
}

/// Text of a command: a line break would end it.
fn data(text: &str) -> String {
    text.replace('%', "%25")
        .replace('\r', "%0D")
        .replace('\n', "%0A")
}

/// Text of a property: a comma or a colon would end it.
fn property(text: &str) -> String {
    data(text).replace(':', "%3A").replace(',', "%2C")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_annotation_is_one_line_whatever_it_says() {
        let annotation = Annotation {
            file: "a,b:c.toml",
            line: Some(7),
            title: "100 %: no, yes",
            message: "mean_mm: 3 % off,\r\nand more::",
        };
        assert_eq!(
            annotation.to_string(),
            "::error file=a%2Cb%3Ac.toml,line=7,title=100 %25%3A no%2C yes::mean_mm: 3 %25 off,%0D%0Aand more::"
        );
        let whole = Annotation {
            line: None,
            file: "x.toml",
            title: "x",
            message: "y",
        };
        assert_eq!(whole.to_string(), "::error file=x.toml,title=x::y");
    }
}
