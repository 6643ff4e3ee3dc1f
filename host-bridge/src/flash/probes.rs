//! The probes that are plugged in, and which of them is meant.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use probe_rs::probe::list::{Accessibility, Lister, ProbeListItem};
use probe_rs::probe::{DebugProbeInfo, DebugProbeSelector, Probe};

use super::programmer::{Trouble, UDEV_HINT};
use crate::bench::Seat;
use crate::place::StLink;

/// A probe that is plugged in.
#[derive(Clone, Debug)]
pub struct Attached {
    info: DebugProbeInfo,
    /// Whether this user may open it.
    pub is_allowed: bool,
}

impl From<ProbeListItem> for Attached {
    fn from(item: ProbeListItem) -> Self {
        Self {
            info: item.info,
            is_allowed: item.accessibility == Accessibility::Accessible,
        }
    }
}

impl Attached {
    pub fn serial(&self) -> Option<&str> {
        self.info.serial_number.as_deref()
    }

    pub const fn info(&self) -> &DebugProbeInfo {
        &self.info
    }

    pub fn selector(&self) -> String {
        let (vendor, product) = (self.info.vendor_id, self.info.product_id);
        match self.serial() {
            Some(serial) => format!("{vendor:04x}:{product:04x}:{serial}"),
            None => format!("{vendor:04x}:{product:04x}"),
        }
    }

    /// Opens it. Fails if it is gone, another program's, or not for this user.
    pub fn open(&self) -> Result<Probe, Trouble> {
        if !self.is_allowed {
            return Err(Trouble::Denied(self.selector()));
        }
        self.info
            .open()
            .map_err(|error| Trouble::opening(&self.selector(), &error))
    }
}

/// `0483:374b:066C…  STLink V2-1`.
impl fmt::Display for Attached {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}  {}", self.selector(), self.info.identifier)?;
        if self.is_allowed {
            Ok(())
        } else {
            f.write_str("  (no permission)")
        }
    }
}

pub fn attached() -> Vec<Attached> {
    let found = Lister::new().list_all_with_access();
    found.into_iter().map(Attached::from).collect()
}

/// A probe by its USB identity, as `--probe` takes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selector(DebugProbeSelector);

impl FromStr for Selector {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.parse().map(Self).map_err(|_| {
            "a probe is VID:PID or VID:PID:SERIAL, in hexadecimal, as in 0483:374b:066CFF"
                .to_owned()
        })
    }
}

impl fmt::Display for Selector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// What is known of the probe that is meant.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProbeRequest {
    /// What the command line says.
    pub selector: Option<Selector>,
    /// The serial number that the bench has for this board.
    pub serial: Option<String>,
    /// The serial number that the bench has for the other board: not this one.
    pub other_serial: Option<String>,
}

impl ProbeRequest {
    /// What command line and bench say of the board of `seat`, whose neighbour has `other`.
    pub fn new(selector: Option<Selector>, seat: &Seat, other: &Seat, links: &[StLink]) -> Self {
        Self {
            selector,
            serial: serial_of(seat, links),
            other_serial: serial_of(other, links),
        }
    }
}

/// The serial number of a seat's ST-LINK, named or found by its port.
fn serial_of(seat: &Seat, links: &[StLink]) -> Option<String> {
    let by_port = |port: &Path| {
        let port = port.canonicalize().ok()?;
        links
            .iter()
            .find(|link| link.port == port)
            .and_then(|link| link.serial.clone())
    };
    seat.usb
        .clone()
        .or_else(|| seat.port.as_deref().and_then(by_port))
}

/// Why no probe was chosen.
#[derive(Debug, thiserror::Error)]
pub enum Undecided {
    #[error(
        "no probe is plugged in: connect the board by its ST-LINK's USB socket (CN1); if it is connected, {UDEV_HINT}"
    )]
    None,
    #[error("no probe is {wanted}; there {}:\n{}", if found.len() == 1 { "is" } else { "are" }, list(found))]
    NotThere {
        wanted: String,
        found: Vec<Attached>,
    },
    #[error(
        "several probes are plugged in: name the board's with --probe, or its serial number as `usb` in the bench file:\n{}",
        list(.0)
    )]
    Several(Vec<Attached>),
}

fn list(found: &[Attached]) -> String {
    let lines: Vec<String> = found.iter().map(|probe| format!("  {probe}")).collect();
    lines.join("\n")
}

/// The probe that is meant. Fails if there is none, or if several may be meant.
pub fn choose(found: &[Attached], request: &ProbeRequest) -> Result<Attached, Undecided> {
    if found.is_empty() {
        return Err(Undecided::None);
    }
    let fits = |probe: &&Attached| match (&request.selector, &request.serial) {
        (Some(selector), _) => selector.0.matches_probe(&probe.info),
        (None, Some(serial)) => probe.serial() == Some(serial),
        (None, None) => {
            let other = request.other_serial.as_deref();
            other.is_none() || probe.serial() != other
        }
    };
    let fitting: Vec<&Attached> = found.iter().filter(fits).collect();
    let wanted = match (&request.selector, &request.serial, &request.other_serial) {
        (Some(selector), ..) => Some(selector.to_string()),
        (None, Some(serial), _) => Some(format!("the one of serial number {serial} in the bench")),
        (None, None, Some(other)) => Some(format!(
            "this board's: the bench has {other} for the other board"
        )),
        (None, None, None) => None,
    };
    match (fitting.as_slice(), wanted) {
        ([only], _) => Ok((*only).clone()),
        ([], Some(wanted)) => Err(Undecided::NotThere {
            wanted,
            found: found.to_vec(),
        }),
        ([], None) => Err(Undecided::None),
        (several, _) => Err(Undecided::Several(
            several.iter().map(|&probe| probe.clone()).collect(),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use probe_rs::probe::stlink::StLinkFactory;

    fn probe(serial: &str) -> Attached {
        Attached::from(ProbeListItem::accessible(DebugProbeInfo::new(
            "STLink V2-1",
            0x0483,
            0x374b,
            Some(serial.to_owned()),
            &StLinkFactory,
            None,
            false,
        )))
    }

    fn seat(port: Option<&str>, usb: Option<&str>) -> Seat {
        Seat {
            port: port.map(Into::into),
            usb: usb.map(str::to_owned),
            ..Seat::default()
        }
    }

    #[test]
    fn without_a_probe_the_rules_are_named() {
        let error = choose(&[], &ProbeRequest::default()).expect_err("none is there");
        assert!(error.to_string().contains("udev"), "{error}");
    }

    #[test]
    fn the_only_probe_is_meant() {
        let chosen = choose(&[probe("A")], &ProbeRequest::default()).expect("the only one");
        assert_eq!(chosen.serial(), Some("A"));
    }

    #[test]
    fn of_several_none_is_guessed_and_all_are_named() {
        let error =
            choose(&[probe("A"), probe("B")], &ProbeRequest::default()).expect_err("several");
        let text = error.to_string();
        assert!(
            text.contains("0483:374b:A") && text.contains("0483:374b:B"),
            "{text}"
        );
        assert!(text.contains("--probe"), "{text}");
    }

    #[test]
    fn the_command_line_goes_before_the_bench() {
        let request = ProbeRequest {
            selector: Some("0483:374b:B".parse().expect("a selector")),
            serial: Some("A".to_owned()),
            other_serial: None,
        };
        let chosen = choose(&[probe("A"), probe("B")], &request).expect("named");
        assert_eq!(chosen.serial(), Some("B"));
    }

    #[test]
    fn the_bench_knows_its_board_and_its_neighbour() {
        let found = [probe("A"), probe("B")];
        let nothing = seat(None, None);
        let own = ProbeRequest::new(None, &seat(None, Some("B")), &nothing, &[]);
        assert_eq!(choose(&found, &own).expect("named").serial(), Some("B"));
        let neighbour = ProbeRequest::new(None, &nothing, &seat(None, Some("B")), &[]);
        assert_eq!(
            choose(&found, &neighbour).expect("the other").serial(),
            Some("A")
        );
    }

    #[test]
    fn the_neighbours_probe_is_not_taken_though_it_is_the_only_one() {
        let request = ProbeRequest::new(None, &seat(None, None), &seat(None, Some("A")), &[]);
        let error = choose(&[probe("A")], &request).expect_err("the neighbour's");
        assert!(error.to_string().contains("other board"), "{error}");
    }

    #[test]
    fn a_port_leads_to_its_st_link() {
        let links = [StLink {
            port: "/dev/null".into(),
            serial: Some("B".to_owned()),
        }];
        let request = ProbeRequest::new(
            None,
            &seat(Some("/dev/null"), None),
            &seat(None, None),
            &links,
        );
        assert_eq!(request.serial.as_deref(), Some("B"));
    }

    #[test]
    fn a_probe_that_is_not_there_is_named_with_those_that_are() {
        let request = ProbeRequest {
            serial: Some("C".to_owned()),
            ..ProbeRequest::default()
        };
        let text = choose(&[probe("A")], &request)
            .expect_err("another")
            .to_string();
        assert!(
            text.contains("serial number C") && text.contains("0483:374b:A"),
            "{text}"
        );
    }

    #[test]
    fn what_is_no_probe_is_refused_with_an_example() {
        let error = "066CFF".parse::<Selector>().expect_err("no vendor");
        assert!(error.contains("0483:374b:066CFF"), "{error}");
    }
}
