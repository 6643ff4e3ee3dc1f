//! Annotations: lines on standard output that GitHub's runners show beside the line of a file.

/// An error beside a line of a file, as a workflow command of GitHub Actions: the file as it is named from the
/// repository's root, its line from 1 on, none if the file as a whole is at fault, a few words, and what is wrong.
pub fn annotation(file: &str, line: Option<usize>, title: &str, message: &str) -> String {
    let line = line.map_or(String::new(), |line| format!(",line={line}"));
    let (file, title, message) = (property(file), property(title), data(message));
    format!("::error file={file}{line},title={title}::{message}")
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
        let message = "mean_mm: 3 % off,\r\nand more::";
        assert_eq!(
            annotation("a,b:c.toml", Some(7), "100 %: no, yes", message),
            "::error file=a%2Cb%3Ac.toml,line=7,title=100 %25%3A no%2C yes::mean_mm: 3 %25 off,%0D%0Aand more::"
        );
        let whole = annotation("x.toml", None, "x", "y");
        assert_eq!(whole, "::error file=x.toml,title=x::y");
    }
}
