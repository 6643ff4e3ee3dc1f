//! The wire's words in those of the field.

use protocol::{Configuration, Contact, Range, Role};

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

/// Whose a configuration is.
pub const fn role_of(configuration: &Configuration) -> Role {
    match configuration {
        Configuration::Sensor(_) => Role::Sensor,
        Configuration::Display(_) => Role::Display,
    }
}
