//! Who moves the arm, for the programs of this user to show: each relay here says it in a line, for as long as it runs.

use protocol::Role;

use crate::relay::name::Name;
use crate::relay::remote::{RemoteState, site};
use crate::relay::report::{Holding, Notice};
use crate::relay::site::opposite;
use crate::shared_port::claim::{Claim, Device, held};

/// What the names of these lines begin with.
const HAND: &str = "hand";

/// What a relay says of the hand. Dropping it takes it back.
pub struct Hand {
    device: Device,
    claim: Option<Claim>,
    name: Name,
    role: Role,
    far: RemoteState,
    /// Whether this bridge holds the bench.
    holding: Holding,
    /// That another bridge is there, in words: at the other site, and at this one.
    watcher: Option<String>,
    rival: Option<String>,
}

impl Hand {
    /// Of the relay at the board of `role` of the bench called `name`: nobody is heard yet.
    pub fn new(name: Name, role: Role) -> Self {
        let mut hand = Self {
            device: Device::named(&format!("{HAND} {name} {}", role.name())),
            claim: None,
            name,
            role,
            far: RemoteState::Unheard,
            holding: Holding::Unknown,
            watcher: None,
            rival: None,
        };
        hand.tell();
        hand
    }

    /// The relay has noticed something.
    pub fn on_notice(&mut self, notice: &Notice) {
        match notice {
            Notice::Remote(_, state) => {
                self.far = state.clone();
                self.watcher = None;
                if !matches!(state, RemoteState::Known { .. }) {
                    self.holding = Holding::Unknown;
                }
            }
            Notice::Hand(holding) => self.holding = *holding,
            Notice::WatcherGone(_) => self.watcher = None,
            Notice::RivalGone(_) => self.rival = None,
            Notice::Watcher(_) => self.watcher = Some(notice.to_string()),
            Notice::Rival(_) => self.rival = Some(notice.to_string()),
            _ => return,
        }
        self.tell();
    }

    fn tell(&mut self) {
        if self.claim.is_none() {
            // A second relay of this role, or a folder that can't be had, must not hold up a relay.
            self.claim = self.device.claim().ok().flatten();
        }
        if let Some(claim) = &self.claim {
            let _ = claim.tell(&self.words());
        }
    }

    fn words(&self) -> String {
        let who = match (self.role, self.holding, &self.far) {
            (_, Holding::Watched | Holding::Unknown, RemoteState::Known { .. }) => {
                Notice::Hand(self.holding).to_string()
            }
            (Role::Display, Holding::Held, RemoteState::Known { .. }) => {
                "the hand here moves the arm at the sensor's site".to_owned()
            }
            (_, Holding::Held, RemoteState::Known { .. }) => {
                "the hand at the display's site moves the arm here".to_owned()
            }
            (role, _, state) => {
                let far = opposite(role).map_or("the other site", site);
                format!("nobody moves the arm by it: {far}: {state}")
            }
        };
        let others: String = [&self.watcher, &self.rival]
            .into_iter()
            .flatten()
            .map(|other| format!("; {other}"))
            .collect();
        format!("relay of bench {}: {who}{others}", self.name)
    }
}

/// What the relays of this user say on this computer, in order of their benches.
pub fn hands() -> Vec<String> {
    held(HAND)
}

#[cfg(test)]
mod tests {
    use protocol::Hello;

    use super::*;

    #[test]
    fn a_relay_says_who_moves_the_arm_for_as_long_as_it_runs() {
        let bench = format!("of-{}", std::process::id());
        let name: Name = bench.parse().expect("a name");
        let said = || -> Vec<String> {
            let mut all = hands();
            all.retain(|line| line.contains(&bench));
            all
        };
        let mut hand = Hand::new(name.clone(), Role::Display);
        let line = format!("relay of bench {bench}: nobody moves the arm by it: ");
        assert!(said()[0].starts_with(&line), "{:?}", said());
        let known = RemoteState::Known {
            hello: Hello::new(Role::Sensor, "host-bridge", [0, 1, 0]),
            session: 7,
        };
        hand.on_notice(&Notice::Remote(Role::Sensor, known));
        assert!(
            said()[0].ends_with(": who holds the bench is not known"),
            "{:?}",
            said()
        );
        hand.on_notice(&Notice::Hand(Holding::Held));
        let line =
            format!("relay of bench {bench}: the hand here moves the arm at the sensor's site");
        assert_eq!(said(), std::slice::from_ref(&line));
        // A second one says nothing beside it.
        let second = Hand::new(name, Role::Display);
        assert_eq!(said(), std::slice::from_ref(&line));
        drop(second);
        hand.on_notice(&Notice::Rival(Role::Display));
        assert!(
            said()[0].starts_with(&format!("{line}; another bridge")),
            "{:?}",
            said()
        );
        hand.on_notice(&Notice::RivalGone(Role::Display));
        assert_eq!(said(), [line]);
        // It has given the bench away, or came second.
        hand.on_notice(&Notice::Hand(Holding::Watched));
        let watches = ": another bridge of this site holds the bench: this one watches";
        assert!(said()[0].ends_with(watches), "{:?}", said());
        drop(hand);
        assert_eq!(said(), [""; 0]);
    }
}
