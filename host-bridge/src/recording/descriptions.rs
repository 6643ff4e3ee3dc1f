//! What the types of the rows say of themselves and of their fields, in their own doc comments: the
//! descriptions of a recording's schemas, so that there is no second text to keep.

use std::collections::BTreeMap;
use std::sync::OnceLock;

/// Every file with a type that a row is made of.
const SOURCES: [&str; 15] = [
    include_str!("row/estimate.rs"),
    include_str!("row/gauges.rs"),
    include_str!("row/link.rs"),
    include_str!("row/log.rs"),
    include_str!("row/status.rs"),
    include_str!("../../../protocol/src/actuators.rs"),
    include_str!("../../../protocol/src/configuration.rs"),
    include_str!("../../../protocol/src/hello.rs"),
    include_str!("../../../protocol/src/message.rs"),
    include_str!("../../../protocol/src/port.rs"),
    include_str!("../../../protocol/src/refusal.rs"),
    include_str!("../../../protocol/src/safety.rs"),
    include_str!("../../../protocol/src/status.rs"),
    include_str!("../../../protocol/src/stop.rs"),
    include_str!("../../../protocol/src/texture.rs"),
];
/// How many descriptions may refer to each other in a row.
const DEEPEST: usize = 4;

/// By type and field or variant; the type itself has an empty one.
type Texts = BTreeMap<(&'static str, &'static str), String>;

fn texts() -> &'static Texts {
    static TEXTS: OnceLock<Texts> = OnceLock::new();
    TEXTS.get_or_init(|| {
        let mut texts = Texts::new();
        SOURCES
            .into_iter()
            .for_each(|source| read(source, &mut texts));
        texts
    })
}

/// What is said of a type.
pub fn item(name: &str) -> Option<String> {
    field(name, "")
}

/// What is said of a type's field or variant.
pub fn field(name: &str, field: &str) -> Option<String> {
    told(name, field, 0)
}

fn told(name: &str, field: &str, depth: usize) -> Option<String> {
    let text = texts().get(&(name, field))?;
    // "[`Type::field`]" at the beginning stands for what is said there.
    let referred = text
        .strip_prefix("[`")
        .and_then(|text| text.split_once("`]"))
        .and_then(|(path, rest)| {
            let (name, field) = path.rsplit_once("::").unwrap_or((path, ""));
            let name = name.rsplit("::").next()?;
            let there = told(name, field, depth + 1).filter(|_| depth < DEEPEST)?;
            let end = if rest.is_empty() { "." } else { rest };
            Some(format!("{}{end}", there.trim_end_matches('.')))
        });
    Some(referred.unwrap_or_else(|| bare(text)))
}

fn bare(text: &str) -> String {
    text.replace("[`", "")
        .replace("`]", "")
        .replace("crate::", "")
        .replace("::", ".")
        .replace('`', "")
}

/// Takes the doc comments of a source's structs, enums, fields and variants.
fn read(source: &'static str, texts: &mut Texts) {
    let mut doc = String::new();
    let mut within = None;
    for line in source.lines() {
        let text = line.trim();
        if let Some(more) = text.strip_prefix("///") {
            if !doc.is_empty() {
                doc.push(' ');
            }
            doc += more.trim();
            continue;
        }
        let name = |rest: &'static str| {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_');
            &rest[..end.unwrap_or(rest.len())]
        };
        let opened = ["pub struct ", "pub enum "]
            .into_iter()
            .find_map(|start| line.strip_prefix(start));
        let of_field = match within {
            Some(_) => text
                .strip_prefix("pub ")
                .or_else(|| text.starts_with(char::is_uppercase).then_some(text)),
            None => None,
        };
        if let Some(opened) = opened {
            let opened = name(opened);
            within = line.ends_with('{').then_some(opened);
            // Its later paragraphs are for who reads the code.
            texts.insert((opened, ""), std::mem::take(&mut doc).trim().to_owned());
        } else if let (Some(within), Some(field)) = (within, of_field) {
            texts.insert((within, name(field)), std::mem::take(&mut doc));
        } else if line == "}" {
            within = None;
            doc.clear();
        } else if text.starts_with("pub ") || text.starts_with("impl") {
            doc.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_description_that_refers_to_another_is_that_one() {
        let there = field("Estimate", "wavelength_mm").expect("a description");
        assert!(there.starts_with("Surface wavelength λ in mm"), "{there}");
        assert_eq!(field("EstimateRow", "wavelength_mm"), Some(there));
        let with_more = field("EstimateRow", "gauges_used").expect("a description");
        assert!(
            with_more.ends_with(": bit g set if gauge g took part."),
            "{with_more}"
        );
        let twice = field("ClockRow", "sent_us").expect("a description");
        assert!(
            twice.starts_with("The sender's clock when it sent this, in µs"),
            "{twice}"
        );
    }

    #[test]
    fn variants_that_are_referred_to_are_described() {
        let asked_for = field("Trip", "Operator");
        assert_eq!(asked_for.as_deref(), Some("A person asked for it."));
        for (name, of) in texts().keys() {
            let words = field(name, of).unwrap_or_default();
            let mut names = words.trim_end_matches('.').split('.').skip(1);
            let is_path =
                !words.contains(' ') && names.any(|name| name.starts_with(char::is_uppercase));
            assert!(!is_path, "{name}.{of}: {words}");
        }
    }

    #[test]
    fn variants_and_types_are_described_too_and_marks_are_left_out() {
        let stick = field("Contact", "Stick").expect("a description");
        assert_eq!(
            stick,
            "The fingertip holds to the surface while the arm moves."
        );
        assert!(item("Motion").is_some_and(|text| text.starts_with("The operator's hand")));
        assert_eq!(item("NoSuchType"), None);
        for (name, of) in texts().keys() {
            let text = field(name, of).unwrap_or_default();
            assert!(
                !text.contains("[`") && !text.contains('`'),
                "{name}.{of}: {text}"
            );
        }
    }
}
