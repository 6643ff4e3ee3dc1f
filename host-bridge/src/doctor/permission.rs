//! Who may open a port, and the rules that let a user at an ST-LINK.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Where the rules of one's own go.
pub const RULES: &str = "/etc/udev/rules.d/70-st-link.rules";
/// What makes them hold at once.
pub const RELOAD: &str = "sudo udevadm control --reload && sudo udevadm trigger";

/// Who may open a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Permission {
    /// The group that owns it, by name if it has one.
    pub group: String,
    /// Permission bits.
    pub mode: u32,
    /// Whether this process is of that group.
    pub is_member: bool,
    /// Whether this user is listed in that group, since when ever.
    pub is_listed: bool,
}

impl Permission {
    /// Who may open `path`; none if the system does not tell.
    pub fn of(path: &Path) -> Option<Self> {
        let facts = fs::metadata(path).ok()?;
        let groups = fs::read_to_string("/etc/group").unwrap_or_default();
        let process = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let user = std::env::var("USER").unwrap_or_default();
        Some(Self::new(
            facts.gid(),
            facts.mode() & 0o777,
            &groups,
            &process,
            &user,
        ))
    }

    /// The same from the texts of `/etc/group` and `/proc/self/status`.
    fn new(gid: u32, mode: u32, groups: &str, process: &str, user: &str) -> Self {
        let entry = groups
            .lines()
            .map(|line| line.split(':').collect::<Vec<_>>())
            .find(|fields| fields.get(2).is_some_and(|id| *id == gid.to_string()));
        let field = |at: usize| entry.as_ref().and_then(|fields| fields.get(at));
        let is_member = process
            .lines()
            .filter_map(|line| {
                line.strip_prefix("Groups:")
                    .or_else(|| line.strip_prefix("Gid:"))
            })
            .flat_map(str::split_whitespace)
            .any(|id| id == gid.to_string());
        Self {
            group: field(0).map_or_else(|| gid.to_string(), |name| (*name).to_owned()),
            mode,
            is_member,
            is_listed: field(3).is_some_and(|users| {
                users
                    .split(',')
                    .any(|listed| !user.is_empty() && listed == user)
            }),
        }
    }

    /// What lets this user open the port.
    pub fn advice(&self) -> String {
        let Self { group, .. } = self;
        if self.mode & 0o060 != 0o060 || group == "root" {
            format!(
                "put this line into {RULES}, then `{RELOAD}`: {}",
                port_rule()
            )
        } else if self.is_listed && !self.is_member {
            format!("log out and in again: you are in the group {group} from the next login on")
        } else {
            format!(
                "join the group that owns it: `sudo usermod -aG {group} $USER`, then log in again"
            )
        }
    }
}

/// Whether the system has the group that many distributions have for plugged-in devices.
pub fn has_plugdev() -> bool {
    fs::read_to_string("/etc/group")
        .is_ok_and(|groups| groups.lines().any(|line| line.starts_with("plugdev:")))
}

/// The udev rule that lets users at the probe of an ST-LINK.
pub fn probe_rule(vendor: u16, product: u16, has_plugdev: bool) -> String {
    let group = if has_plugdev {
        "GROUP=\"plugdev\", "
    } else {
        ""
    };
    format!(
        "SUBSYSTEM==\"usb\", ATTRS{{idVendor}}==\"{vendor:04x}\", ATTRS{{idProduct}}==\"{product:04x}\", \
         MODE=\"0660\", {group}TAG+=\"uaccess\""
    )
}

/// The udev rule that lets users at the serial ports of all ST-LINKs.
pub fn port_rule() -> String {
    "SUBSYSTEM==\"tty\", ATTRS{idVendor}==\"0483\", MODE=\"0660\", GROUP=\"dialout\", TAG+=\"uaccess\""
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUPS: &str = "root:x:0:\ndialout:x:20:ann,bob\nplugdev:x:46:bob\n";
    const PROCESS: &str = "Name:\tx\nGid:\t1000\t1000\t1000\t1000\nGroups:\t46 1000 \n";

    #[test]
    fn who_is_in_the_group_and_who_will_be() {
        let of = |gid, mode, user| Permission::new(gid, mode, GROUPS, PROCESS, user);
        assert_eq!(
            of(20, 0o660, "eve"),
            Permission {
                group: "dialout".to_owned(),
                mode: 0o660,
                is_member: false,
                is_listed: false
            }
        );
        assert!(of(20, 0o660, "bob").is_listed);
        assert!(!of(20, 0o660, "").is_listed);
        assert!(of(46, 0o660, "bob").is_member);
        assert_eq!(of(77, 0o660, "bob").group, "77");
    }

    #[test]
    fn advice_fits_the_permission() {
        let advice = |gid, mode, user| Permission::new(gid, mode, GROUPS, PROCESS, user).advice();
        assert_eq!(
            advice(20, 0o660, "eve"),
            "join the group that owns it: `sudo usermod -aG dialout $USER`, then log in again"
        );
        assert_eq!(
            advice(20, 0o660, "ann"),
            "log out and in again: you are in the group dialout from the next login on"
        );
        let rule = "put this line into /etc/udev/rules.d/70-st-link.rules, then \
            `sudo udevadm control --reload && sudo udevadm trigger`: \
            SUBSYSTEM==\"tty\", ATTRS{idVendor}==\"0483\", MODE=\"0660\", GROUP=\"dialout\", TAG+=\"uaccess\"";
        assert_eq!(advice(0, 0o660, "ann"), rule);
        assert_eq!(advice(20, 0o600, "ann"), rule);
    }

    #[test]
    fn the_rule_for_a_probe_names_its_product() {
        assert_eq!(
            probe_rule(0x0483, 0x374b, true),
            "SUBSYSTEM==\"usb\", ATTRS{idVendor}==\"0483\", ATTRS{idProduct}==\"374b\", MODE=\"0660\", \
             GROUP=\"plugdev\", TAG+=\"uaccess\""
        );
        assert_eq!(
            probe_rule(0x0483, 0x374e, false),
            "SUBSYSTEM==\"usb\", ATTRS{idVendor}==\"0483\", ATTRS{idProduct}==\"374e\", MODE=\"0660\", \
             TAG+=\"uaccess\""
        );
    }
}
