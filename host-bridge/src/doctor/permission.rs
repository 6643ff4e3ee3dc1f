//! Who may open a port, and the rules that let a user at an ST-LINK.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use nix::unistd::{Gid, Group, Uid, User, getegid, getgroups};

/// Where the rules of one's own go.
pub const RULES: &str = "/etc/udev/rules.d/70-st-link.rules";
/// Where Linux has its pseudo-terminals.
const PSEUDO_TERMINALS: &str = "/dev/pts";
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
    /// Whose pseudo-terminal it is, by name if the user has one; none if it is another device.
    pub pseudo_terminal_of: Option<String>,
}

impl Permission {
    /// Who may open `path`; `None` if the system does not tell.
    pub fn of(path: &Path) -> Option<Self> {
        let facts = fs::metadata(path).ok()?;
        let gid = Gid::from_raw(facts.gid());
        let group = Group::from_gid(gid).ok().flatten();
        let own = getgroups().unwrap_or_default();
        let user = std::env::var("USER").unwrap_or_default();
        let is_pseudo = fs::canonicalize(path).is_ok_and(|port| port.starts_with(PSEUDO_TERMINALS));
        Some(Self {
            pseudo_terminal_of: is_pseudo.then(|| name_of(facts.uid())),
            is_member: gid == getegid() || own.contains(&gid),
            is_listed: group
                .as_ref()
                .is_some_and(|group| group.mem.contains(&user)),
            group: group.map_or_else(|| gid.to_string(), |group| group.name),
            mode: facts.mode() & 0o777,
        })
    }

    /// What lets this user open the port.
    pub fn advice(&self) -> String {
        let Self { group, .. } = self;
        // No rule and no group opens it: it is its owner's.
        if let Some(owner) = &self.pseudo_terminal_of {
            format!(
                "it is a pseudo-terminal of {owner}'s: run this as {owner}, or start the program behind it \
                 (`hil-sim serve`, `host-bridge relay`) as yourself"
            )
        } else if self.mode & 0o060 != 0o060 || group == "root" {
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

/// A user's name; the number if there is none.
fn name_of(uid: u32) -> String {
    let user = User::from_uid(Uid::from_raw(uid)).ok().flatten();
    user.map_or_else(|| uid.to_string(), |user| user.name)
}

/// Whether the system has the group that many distributions have for plugged-in devices.
pub fn has_plugdev() -> bool {
    Group::from_name("plugdev").is_ok_and(|group| group.is_some())
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

    #[test]
    fn a_file_of_one_s_own_is_of_a_group_that_one_is_in() {
        let program = std::env::current_exe().expect("a test is a file");
        let gid = fs::metadata(&program).expect("it is there").gid();
        let found = Permission::of(&program).expect("the system tells");
        let own = getgroups().unwrap_or_default();
        let is_member = own.contains(&Gid::from_raw(gid)) || getegid().as_raw() == gid;
        assert_eq!(found.is_member, is_member);
        assert_eq!(Permission::of(Path::new("/no/such/file")), None);
        // The one group that every system has.
        let root = Permission::of(Path::new("/")).expect("the system tells");
        assert_eq!(root.group, "root");
    }

    #[test]
    fn a_pseudo_terminal_is_no_matter_of_groups_or_udev() {
        let (_host, port) = serialport::TTYPort::pair().expect("a pseudo-terminal");
        let name = serialport::SerialPort::name(&port).expect("it has a name");
        let advice = Permission::of(Path::new(&name))
            .expect("the system tells")
            .advice();
        let owner = name_of(nix::unistd::geteuid().as_raw());
        let want = format!("it is a pseudo-terminal of {owner}'s: run this as {owner}, or start");
        assert!(advice.starts_with(&want), "{advice}");
        assert!(
            !advice.contains("udev") && !advice.contains("usermod"),
            "{advice}"
        );
    }

    #[test]
    fn advice_fits_the_permission() {
        let advice = |group: &str, mode, is_listed| {
            let permission = Permission {
                group: group.to_owned(),
                mode,
                is_member: false,
                is_listed,
                pseudo_terminal_of: None,
            };
            permission.advice()
        };
        assert_eq!(
            advice("dialout", 0o660, false),
            "join the group that owns it: `sudo usermod -aG dialout $USER`, then log in again"
        );
        assert_eq!(
            advice("dialout", 0o660, true),
            "log out and in again: you are in the group dialout from the next login on"
        );
        let rule = "put this line into /etc/udev/rules.d/70-st-link.rules, then \
            `sudo udevadm control --reload && sudo udevadm trigger`: \
            SUBSYSTEM==\"tty\", ATTRS{idVendor}==\"0483\", MODE=\"0660\", GROUP=\"dialout\", TAG+=\"uaccess\"";
        assert_eq!(advice("root", 0o660, true), rule);
        assert_eq!(advice("dialout", 0o600, true), rule);
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
