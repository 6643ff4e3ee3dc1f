//! Who may say what: by the name in a certificate, which only the CA gives.
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

use protocol::Role;
use serde_json::{Value, json};

use crate::relay::name::Name;

/// What the certificates of routers end with.
const ROUTER: &str = "router";
/// What the certificates of operators without a board end with.
const OPERATOR: &str = "operator";
/// All messages that bridges exchange.
const MESSAGES: [&str; 3] = ["put", "delete", "declare_subscriber"];

/// The common name of the certificate of `role` at the bench called `name`; a host is an operator.
pub fn common_name(name: &Name, role: Role) -> String {
    let role = match role {
        Role::Host => OPERATOR,
        board => board.name(),
    };
    format!("{name}.{role}")
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
            (format!("{name}.{ROUTER}"), name.all_keys()),
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
