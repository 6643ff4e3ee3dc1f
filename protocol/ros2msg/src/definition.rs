//! What a message is made of, from its `ros2msg` text.

use std::collections::BTreeMap;
use std::sync::Arc;

/// The deepest nesting that is followed: more is a definition that holds itself.
const DEEPEST: usize = 32;

/// Why a text is no definition.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum DefinitionError {
    #[error("line {line}: {text:?} is neither a field nor a constant")]
    Line {
        /// From 1 on.
        line: usize,
        text: String,
    },
    #[error("{0} is not defined")]
    Missing(String),
    #[error("{0} holds itself")]
    Endless(String),
}

/// A message's fields, in their order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Definition {
    /// What it is made of; constants are left out.
    pub fields: Vec<Field>,
}

/// A field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
}

/// What a field can hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `bool`
    Bool,
    /// `int8` to `int64`: so many bytes.
    Signed(usize),
    /// `uint8` to `uint64`, `byte`, `char`: so many bytes.
    Unsigned(usize),
    /// `float32`
    F32,
    /// `float64`
    F64,
    /// `string`, bounded or not
    Text,
    /// Another message.
    Message(Arc<Definition>),
    /// So many of a kind.
    Array(Box<Kind>, usize),
    /// Any number of a kind, bounded or not.
    Sequence(Box<Kind>),
}

impl Definition {
    /// The definition of a message of the type `name` (`package/msg/Name`). Fails if the text holds what is no
    /// definition, or lacks one.
    pub fn parse(name: &str, text: &str) -> Result<Self, DefinitionError> {
        let package = name.split('/').next().unwrap_or_default();
        let mut texts = Texts::default();
        let mut found = (short(name, package), Vec::new());
        let mut after_rule = false;
        for (at, line) in text.lines().enumerate() {
            let line = line.trim();
            let is_rule = line.len() >= 3 && line.bytes().all(|byte| byte == b'=');
            match line.strip_prefix("MSG:") {
                Some(next) if after_rule => {
                    let next = (short(next.trim(), package), Vec::new());
                    let (name, lines) = std::mem::replace(&mut found, next);
                    texts.0.insert(name, lines);
                }
                _ if is_rule => {}
                _ => found.1.push((at + 1, line)),
            }
            after_rule = is_rule;
        }
        texts.0.insert(found.0, found.1);
        texts.resolve(&short(name, package), 0)
    }
}

/// `package/Name`, whether or not `msg` stands between the two, or the package is left out.
fn short(name: &str, package: &str) -> String {
    let mut parts = name.split('/').filter(|part| *part != "msg");
    match (parts.next(), parts.next()) {
        (Some(package), Some(name)) => format!("{package}/{name}"),
        (Some(name), None) => format!("{package}/{name}"),
        (None, _) => String::new(),
    }
}

/// The lines of each definition, with their numbers.
#[derive(Default)]
struct Texts<'t>(BTreeMap<String, Vec<(usize, &'t str)>>);

impl Texts<'_> {
    fn resolve(&self, name: &str, depth: usize) -> Result<Definition, DefinitionError> {
        if depth > DEEPEST {
            let name = name.to_owned();
            return Err(DefinitionError::Endless(name));
        }
        let Some(lines) = self.0.get(name) else {
            return builtin(name).ok_or_else(|| DefinitionError::Missing(name.to_owned()));
        };
        let package = name.split('/').next().unwrap_or_default();
        let mut fields = Vec::new();
        for &(line, text) in lines {
            let bare = without_comment(text);
            if bare.is_empty() {
                continue;
            }
            let wrong = || DefinitionError::Line {
                line,
                text: text.to_owned(),
            };
            let (kind, rest) = bare.split_once(char::is_whitespace).ok_or_else(wrong)?;
            let rest = rest.trim_start();
            let end = rest
                .find(|c: char| !c.is_ascii_alphanumeric() && c != '_')
                .unwrap_or(rest.len());
            let (field, behind) = rest.split_at(end);
            if field.is_empty() {
                return Err(wrong());
            }
            // `NAME=value` is a constant; `name value` a field with a default.
            if behind.trim_start().starts_with('=') {
                continue;
            }
            fields.push(Field {
                name: field.to_owned(),
                kind: self
                    .kind(kind, package, depth)
                    .map_err(|error| match error {
                        None => wrong(),
                        Some(error) => error,
                    })?,
            });
        }
        Ok(Definition { fields })
    }

    /// The kind that a text names; no error if it is no name of a kind.
    fn kind(
        &self,
        text: &str,
        package: &str,
        depth: usize,
    ) -> Result<Kind, Option<DefinitionError>> {
        if let Some((item, length)) = text.strip_suffix(']').and_then(|text| text.split_once('[')) {
            let item = Box::new(self.kind(item, package, depth)?);
            return match length {
                "" => Ok(Kind::Sequence(item)),
                bounded if bounded.starts_with("<=") => Ok(Kind::Sequence(item)),
                count => Ok(Kind::Array(item, count.parse().map_err(|_| None)?)),
            };
        }
        let bare = text.split("<=").next().unwrap_or(text);
        Ok(match bare {
            "bool" => Kind::Bool,
            "int8" => Kind::Signed(1),
            "int16" => Kind::Signed(2),
            "int32" => Kind::Signed(4),
            "int64" => Kind::Signed(8),
            "uint8" | "byte" | "char" => Kind::Unsigned(1),
            "uint16" => Kind::Unsigned(2),
            "uint32" => Kind::Unsigned(4),
            "uint64" => Kind::Unsigned(8),
            "float32" => Kind::F32,
            "float64" => Kind::F64,
            "string" => Kind::Text,
            name => {
                let definition = self.resolve(&short(name, package), depth + 1)?;
                Kind::Message(Arc::new(definition))
            }
        })
    }
}

/// Everything before the comment; a `#` in a quoted default is none.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    for (at, c) in line.char_indices() {
        match quote {
            None if c == '#' => return line[..at].trim(),
            None if c == '"' || c == '\'' => quote = Some(c),
            Some(open) if c == open => quote = None,
            _ => {}
        }
    }
    line.trim()
}

/// What every ROS 2 has, and a text may leave out.
fn builtin(name: &str) -> Option<Definition> {
    matches!(
        name,
        "builtin_interfaces/Time" | "builtin_interfaces/Duration"
    )
    .then(|| Definition {
        fields: [("sec", Kind::Signed(4)), ("nanosec", Kind::Unsigned(4))]
            .map(|(name, kind)| Field {
                name: name.to_owned(),
                kind,
            })
            .into(),
    })
}
