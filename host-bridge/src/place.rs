//! Where a board's console is looked for.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serialport::{SerialPortInfo, SerialPortType};

/// The vendor of every ST-LINK (STMicroelectronics).
pub const ST_VENDOR: u16 = 0x0483;
/// The products with a virtual COM port: ST-LINK/V2-1 and V3 in their variants (UM2448, and usb.ids).
pub const ST_LINK_PRODUCTS: [u16; 7] = [0x374b, 0x374e, 0x374f, 0x3752, 0x3753, 0x3754, 0x3757];

/// In front of the name of a board at another site, e.g. `relay:bench.sensor`.
pub const FAR: &str = "relay:";

/// Whether a port's name is that of a board at another site.
pub fn is_far(port: &Path) -> bool {
    port.to_str().is_some_and(|name| name.starts_with(FAR))
}

/// What the log of a board at another site is called.
pub fn log_of(far: &Path) -> String {
    format!("{}.log", far.display())
}

/// Where a board's console is looked for, each time that it is to be opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// A port by its name: a device, or a link to one; or, with [`FAR`] in front, a board at another site that a
    /// relay shows here.
    Port(PathBuf),
    /// The ST-LINK of this serial number, whatever its port is called at the moment.
    Usb(String),
    /// One of these ports: that behind which a board of the wanted role says Hello.
    Among(Vec<PathBuf>),
    /// Any ST-LINK behind which a board of the wanted role says Hello.
    #[default]
    Anywhere,
}

impl Place {
    /// The same by the port's own name, where a link leads to it.
    pub fn leads_to(&self) -> Self {
        match self {
            Self::Port(path) => Self::Port(path.canonicalize().unwrap_or_else(|_| path.clone())),
            other => other.clone(),
        }
    }

    /// The ports to try, in order; empty if there is none at the moment.
    pub fn candidates(&self) -> Vec<PathBuf> {
        match self {
            Self::Port(path) if path.exists() || is_far(path) => vec![path.clone()],
            Self::Port(_) => Vec::new(),
            Self::Among(ports) => ports.iter().filter(|path| path.exists()).cloned().collect(),
            Self::Usb(serial) => st_links()
                .into_iter()
                .filter(|found| found.serial.as_deref() == Some(serial.as_str()))
                .map(|found| found.port)
                .collect(),
            Self::Anywhere => st_links().into_iter().map(|found| found.port).collect(),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Port(path) => write!(f, "{}", path.display()),
            Self::Usb(serial) => write!(f, "the ST-LINK {serial}"),
            Self::Among(ports) => {
                let names: Vec<_> = ports
                    .iter()
                    .map(|port| port.display().to_string())
                    .collect();
                write!(f, "one of {}", names.join(", "))
            }
            Self::Anywhere => f.write_str("any ST-LINK"),
        }
    }
}

/// Words that name no place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("give a port, such as /dev/ttyACM0, or usb:SERIAL of an ST-LINK")]
pub struct NoPlace;

/// `usb:SERIAL`, or the name of a port.
impl FromStr for Place {
    type Err = NoPlace;

    fn from_str(text: &str) -> Result<Self, NoPlace> {
        match text.strip_prefix("usb:").unwrap_or(text) {
            "" => Err(NoPlace),
            serial if text.starts_with("usb:") => Ok(Self::Usb(serial.to_owned())),
            port => Ok(Self::Port(PathBuf::from(port))),
        }
    }
}

/// An ST-LINK with a virtual COM port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StLink {
    /// Its port.
    pub port: PathBuf,
    /// Its serial number.
    pub serial: Option<String>,
}

/// The ST-LINKs that are plugged in, by port name; none where ports can't be listed.
pub fn st_links() -> Vec<StLink> {
    let mut found: Vec<StLink> = serialport::available_ports()
        .unwrap_or_default()
        .into_iter()
        .filter_map(st_link)
        .collect();
    found.sort_by(|a, b| a.port.cmp(&b.port));
    found
}

fn st_link(info: SerialPortInfo) -> Option<StLink> {
    let SerialPortType::UsbPort(usb) = info.port_type else {
        return None;
    };
    let known = usb.vid == ST_VENDOR && ST_LINK_PRODUCTS.contains(&usb.pid);
    known.then(|| StLink {
        port: Path::new(&info.port_name).to_path_buf(),
        serial: usb.serial_number,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serialport::UsbPortInfo;

    fn usb(vid: u16, pid: u16) -> SerialPortInfo {
        SerialPortInfo {
            port_name: "/dev/ttyACM7".to_owned(),
            port_type: SerialPortType::UsbPort(UsbPortInfo {
                vid,
                pid,
                serial_number: Some("066C".to_owned()),
                manufacturer: None,
                product: None,
                interface: None,
            }),
        }
    }

    #[test]
    fn an_st_link_is_known_by_vendor_and_product() {
        let found = st_link(usb(0x0483, 0x374b)).expect("a Nucleo's");
        assert_eq!(found.port, Path::new("/dev/ttyACM7"));
        assert_eq!(found.serial.as_deref(), Some("066C"));
        assert_eq!(st_link(usb(0x0483, 0x5740)), None);
        assert_eq!(st_link(usb(0x0403, 0x374b)), None);
    }

    #[test]
    fn the_rules_for_udev_name_every_st_link() {
        let rules = include_str!("../doc/70-ridgelink.rules");
        let products: Vec<String> = ST_LINK_PRODUCTS
            .iter()
            .map(|product| format!("{product:04x}"))
            .collect();
        let named = format!("{{idProduct}}==\"{}\"", products.join("|"));
        assert_eq!(rules.matches(&named).count(), 2, "{named}");
        assert!(rules.contains(&format!("{{idVendor}}==\"{ST_VENDOR:04x}\"")));
    }

    #[test]
    fn places_are_read_from_words() {
        assert_eq!("usb:066C".parse(), Ok(Place::Usb("066C".to_owned())));
        assert_eq!(
            "/dev/ttyACM0".parse(),
            Ok(Place::Port("/dev/ttyACM0".into()))
        );
        for nothing in ["", "usb:"] {
            assert_eq!(nothing.parse::<Place>(), Err(NoPlace), "{nothing:?}");
        }
    }

    #[test]
    fn a_port_that_is_not_there_is_no_candidate() {
        assert!(
            Place::Port("/dev/no-such-port".into())
                .candidates()
                .is_empty()
        );
    }
}
