//! Two bridges in one process, by virtual time: with a board at each, and a network between them.

use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;

use host_bridge::place::Place;
use host_bridge::relay::name::Name;
use host_bridge::relay::report::Notice;
use host_bridge::relay::site::{Settings, Site};
use protocol::Role;

use crate::virtual_clock::wait_until;
use crate::virtual_network::VirtualNetwork;
use crate::virtual_ports::VirtualBench;

/// What both bridges call the bench.
///
/// # Panics
/// Never: it is a name.
pub fn name() -> Name {
    "bench".parse().expect("a name")
}

/// A bridge, and what it tells.
pub struct VirtualSite {
    /// The bridge.
    pub site: Site,
    notices: Receiver<Notice>,
    told: RefCell<Vec<String>>,
    bench: VirtualBench,
}

impl VirtualSite {
    /// The bridge of the board of `role`, whose console is `port`.
    ///
    /// # Panics
    /// If it can't be started.
    pub fn new(
        bench: &VirtualBench,
        network: &VirtualNetwork,
        role: Role,
        port: &Path,
        max_age: Duration,
    ) -> Self {
        let (site, notices) = Site::open(Settings {
            role,
            place: Place::Port(port.to_owned()),
            name: name(),
            network: Arc::new(network.clone()),
            max_age,
            shows_far_board: false,
            system: bench.system(),
        })
        .unwrap_or_else(|error| panic!("{error}"));
        Self {
            site,
            notices,
            told: RefCell::default(),
            bench: bench.clone(),
        }
    }

    /// Everything that it has told a person so far.
    pub fn words(&self) -> Vec<String> {
        let new = self.notices.try_iter().map(|notice| notice.to_string());
        self.told.borrow_mut().extend(new);
        self.told.borrow().clone()
    }

    /// Waits until it has told something with these words.
    ///
    /// # Panics
    /// If it does not within `limit` of its time.
    pub fn says(&self, part: &str, limit: Duration) {
        let says = || self.words().iter().any(|line| line.contains(part));
        assert!(
            wait_until(&self.bench.clock, limit, says),
            "{part:?} is not said: {:?}",
            self.words()
        );
    }
}

/// Two bridges.
pub struct VirtualPair {
    /// Their clock, and the boards' ports.
    pub bench: VirtualBench,
    /// The network between them.
    pub network: VirtualNetwork,
    /// The sensor's bridge.
    pub sensor: VirtualSite,
    /// The display's bridge.
    pub display: VirtualSite,
}

impl VirtualPair {
    /// Two bridges at these boards' ports.
    pub fn new(bench: &VirtualBench, sensor: &Path, display: &Path, max_age: Duration) -> Self {
        let network = VirtualNetwork::new(&bench.clock);
        let site = |role, port| VirtualSite::new(bench, &network, role, port, max_age);
        Self {
            bench: bench.clone(),
            sensor: site(Role::Sensor, sensor),
            display: site(Role::Display, display),
            network,
        }
    }
}

impl Drop for VirtualPair {
    fn drop(&mut self) {
        self.network.end();
    }
}
