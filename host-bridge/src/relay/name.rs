//! What a bench is called on the network, and who may say what there: by the name in a certificate, which only the CA
//! gives.
//!
//! The certificate of a program at the bench `NAME` has the common name `NAME.sensor`, `NAME.display`,
//! `NAME.operator` or `NAME.router`. Whatever it says that is not its own to say is thrown away by the engine, and
//! nobody learns of it but the one who refuses.
//!
//! | name | may say |
//! | --- | --- |
//! | `NAME.sensor`, `NAME.display` | what the bridge of that board says |
//! | `NAME.operator` | Stop |
//! | `NAME.router` | what it carries of that bench |
//!
//! Whoever connects hears the others by way of the program that listens: a sensor's or a display's bridge that
//! listens carries like a router.

use std::fmt;
use std::str::FromStr;

use protocol::Role;
use serde_json::{Value, json};

/// Longest name, in bytes.
const LONGEST: usize = 64;

/// The name that the bridges of one bench share: two benches may use one router.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name(String);

/// Why a word is no name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{given:?} is no name: take 1 to {LONGEST} of a-z A-Z 0-9 . _ -")]
pub struct NameError {
    /// The word.
    pub given: String,
}

impl FromStr for Name {
    type Err = NameError;

    fn from_str(given: &str) -> Result<Self, NameError> {
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
        if (1..=LONGEST).contains(&given.len()) && given.bytes().all(is_plain) {
            Ok(Self(given.to_owned()))
        } else {
            Err(NameError {
                given: given.to_owned(),
            })
        }
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// What is said on a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// What the board says: only the newest counts.
    Board,
    /// Pings and pongs.
    Clock,
    /// What has to come: Stops, that they were heard, who leaves and who hands the bench over.
    Stop,
    /// All that the board says, for who watches.
    Shown,
}

impl Channel {
    /// All.
    pub const ALL: [Self; 4] = [Self::Board, Self::Clock, Self::Stop, Self::Shown];

    /// Whether only the newest on it matters: what the network loses of it is not sent again, and holds up nothing.
    pub const fn is_fleeting(self) -> bool {
        matches!(self, Self::Board | Self::Clock)
    }
}

impl Name {
    /// The key under which the bridge of `role` speaks on `channel`. A host's is an operator who has no
    /// board.
    pub fn key(&self, role: Role, channel: Channel) -> String {
        let channel = match channel {
            Channel::Board => "board",
            Channel::Clock => "clock",
            Channel::Stop => "stop",
            Channel::Shown => "shown",
        };
        format!("ridgelink/{self}/{}/{channel}", role.name())
    }

    /// All that is said at the bench.
    pub fn all_keys(&self) -> String {
        format!("ridgelink/{self}/**")
    }

    /// All that the bridge of `role` says.
    pub fn keys(&self, role: Role) -> String {
        format!("ridgelink/{self}/{}/*", role.name())
    }
}

/// What the certificates of routers end with.
const ROUTER: &str = "router";
/// What the certificates of operators without a board end with.
const OPERATOR: &str = "operator";
const MESSAGES: [&str; 3] = ["put", "delete", "declare_subscriber"];

/// The common name of the certificate of `role` at the bench called `name`; a host is an operator.
pub fn common_name(name: &Name, role: Role) -> String {
    let role = match role {
        Role::Host => OPERATOR,
        board => board.name(),
    };
    format!("{name}.{role}")
}

/// The common name of the certificate of a router for the bench called `name`.
pub fn common_name_of_router(name: &Name) -> String {
    format!("{name}.{ROUTER}")
}

/// The keys on which the owner of a certificate with this common name may send datagrams: what is fleeting of the board,
/// or the operator, of one of the benches `names`. Empty if it is none of theirs.
pub fn keys_of_datagrams(names: &[Name], common: &str) -> Vec<String> {
    let of = |name: &Name| {
        let roles = [Role::Sensor, Role::Display, Role::Host];
        let role = roles
            .into_iter()
            .find(|&role| common_name(name, role) == common)?;
        let fleeting = Channel::ALL
            .into_iter()
            .filter(|channel| channel.is_fleeting());
        Some(fleeting.map(|channel| name.key(role, channel)).collect())
    };
    names.iter().find_map(of).unwrap_or_default()
}

/// The engine's rules for a program that takes part in the benches `names`, by connecting to another one or
/// being connected to.
pub fn rules(names: &[Name], is_connecting: bool) -> Value {
    let mut rules = Vec::new();
    let mut subjects = Vec::new();
    let mut policies = Vec::new();
    for name in names {
        let of_board = |role: Role| {
            if is_connecting {
                name.all_keys()
            } else {
                name.keys(role)
            }
        };
        let speakers = [
            (common_name(name, Role::Sensor), of_board(Role::Sensor)),
            (common_name(name, Role::Display), of_board(Role::Display)),
            (common_name(name, Role::Host), name.keys(Role::Host)),
            (common_name_of_router(name), name.all_keys()),
        ];
        for (speaker, keys) in speakers {
            // What it says.
            rules.push(json!({
                "id": format!("{speaker} says"),
                "permission": "allow",
                "flows": ["ingress"],
                "messages": MESSAGES,
                "key_exprs": [keys],
            }));
            // What it hears, and that it wants to.
            rules.push(json!({
                "id": format!("{speaker} hears"),
                "permission": "allow",
                "flows": ["egress"],
                "messages": MESSAGES,
                "key_exprs": [name.all_keys()],
            }));
            rules.push(json!({
                "id": format!("{speaker} listens"),
                "permission": "allow",
                "flows": ["ingress"],
                "messages": ["declare_subscriber"],
                "key_exprs": [name.all_keys()],
            }));
            subjects.push(json!({ "id": speaker, "cert_common_names": [speaker] }));
            policies.push(json!({
                "rules": [format!("{speaker} says"), format!("{speaker} hears"), format!("{speaker} listens")],
                "subjects": [speaker],
            }));
        }
    }
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_one_plain_word() {
        for good in ["bench", "lab-2.left_hand", "x"] {
            assert!(good.parse::<Name>().is_ok(), "{good}");
        }
        for bad in ["", "a/b", "*", "a b", "$x", "ä", &"x".repeat(65)] {
            assert!(bad.parse::<Name>().is_err(), "{bad}");
        }
    }

    #[test]
    fn keys_tell_bench_site_and_channel() {
        let name: Name = "bench".parse().expect("a name");
        let key = name.key(Role::Display, Channel::Board);
        assert_eq!(key, "ridgelink/bench/display/board");
        assert_eq!(name.keys(Role::Sensor), "ridgelink/bench/sensor/*");
    }

    #[test]
    fn a_certificate_lets_datagrams_through_on_its_own_fleeting_keys_only() {
        let names = ["left", "right"].map(|name| name.parse().expect("a name"));
        let keys = |common| keys_of_datagrams(&names, common);
        let of_right = [
            "ridgelink/right/display/board",
            "ridgelink/right/display/clock",
        ];
        assert_eq!(keys("right.display"), of_right);
        let operators = ["ridgelink/left/host/board", "ridgelink/left/host/clock"];
        assert_eq!(keys("left.operator"), operators);
        for stranger in ["other.display", "right.router", "right.host", "right", ""] {
            assert!(keys(stranger).is_empty(), "{stranger}");
        }
    }
}
