//! The wire's words in those of the field.

use protocol::{Configuration, Contact, Method, Mode, Range, Rendering, UpdateRate};

/// The paper's range.
pub const fn range(range: Range) -> &'static str {
    match range {
        Range::T1 => "T1",
        Range::T2 => "T2",
    }
}

/// What the fingertip does.
pub const fn contact(contact: Contact) -> &'static str {
    match contact {
        Contact::Unknown => "unknown",
        Contact::Slip => "slip",
        Contact::Stick => "stick",
        Contact::StickSlip => "stick-slip",
    }
}

/// Every method, by its word.
pub const METHODS: [(&str, Method); 4] = [
    ("spectrum", Method::Spectrum),
    ("counting", Method::Counting),
    ("counting-adapted", Method::AdaptedCounting),
    ("crossings", Method::Crossings),
];

/// Every mode, by its word.
pub const MODES: [(&str, Mode); 2] = [("uniform", Mode::Uniform), ("travelling", Mode::Travelling)];

/// Every rendering, by its word.
pub const RENDERINGS: [(&str, Rendering); 3] = [
    ("fundamental", Rendering::Fundamental),
    ("shape", Rendering::Shape),
    ("texture", Rendering::Texture),
];

/// Every rate of updates, by its word.
pub const RATES: [(&str, UpdateRate); 2] =
    [("2000", UpdateRate::Hz2000), ("4000", UpdateRate::Hz4000)];

/// Both answers to a question.
pub const SWITCH: [(&str, bool); 2] = [("off", false), ("on", true)];

/// The word of one of these.
pub fn word<T: PartialEq + Copy>(words: &[(&'static str, T)], value: T) -> &'static str {
    words
        .iter()
        .find(|(_, each)| *each == value)
        .map_or("?", |(word, _)| word)
}

/// Whose a configuration is.
pub const fn role_of(configuration: &Configuration) -> protocol::Role {
    match configuration {
        Configuration::Sensor(_) => protocol::Role::Sensor,
        Configuration::Display(_) => protocol::Role::Display,
    }
}
