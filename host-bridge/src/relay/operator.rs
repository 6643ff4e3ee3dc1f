//! An operator without a board, who has one thing to say: Stop.

use std::sync::Arc;
use std::time::Duration;

use protocol::{Role, Stop, Trip};

use crate::clock::{Clock, channel, micros};
use crate::relay::envelope::{Content, Envelope};
use crate::relay::name::{Channel, Name};
use crate::relay::network::NetworkError;
use crate::relay::site::{bridge_hello, random_number};
use crate::relay::transport::{Subscription, Transport};

/// Between two times that Stop is said, and between two tries to connect.
const AGAIN: Duration = Duration::from_millis(100);

/// How far a Stop has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Progress {
    /// The display's bridge has said nothing.
    Unheard,
    /// The display's bridge has it, but its board takes nothing.
    Heard,
    /// The display's board was told, and has not said that it has stopped.
    Told,
    /// The display's board says that it has stopped.
    Stopped,
}

/// What has come of a Stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopping {
    /// How far it has come.
    pub progress: Progress,
    /// The reason for which the display's board says that it has stopped, if it does and this program knows it.
    pub trip: Option<Trip>,
}

/// Says Stop at the bench called `name` until the display's board says that it has stopped, for at most `within`:
/// how far that came. Fails if nobody was reached in that time.
pub fn stop(
    network: &dyn Transport,
    clock: &Arc<dyn Clock>,
    name: &Name,
    stop: Stop,
    within: Duration,
) -> Result<Stopping, NetworkError> {
    let end_us = clock.now_us().saturating_add(micros(within));
    let again_us = || clock.now_us().saturating_add(micros(AGAIN));
    let (sender, heard) = channel(clock);
    let subscription = || {
        let sender = sender.clone();
        Subscription {
            keys: name.key(Role::Display, Channel::Stop),
            on_bytes: Box::new(move |bytes| {
                if let Ok(envelope) = Envelope::from_bytes(bytes)
                    && envelope.role() == Some(Role::Display)
                {
                    sender.send(envelope.content);
                }
            }),
        }
    };
    let connection = loop {
        match network.connect(name, Role::Host, vec![subscription()]) {
            Ok(connection) => break connection,
            Err(error) if clock.now_us() >= end_us => return Err(error),
            Err(_) => clock.notify().wait_until(again_us()),
        }
    };
    let id = random_number();
    let mut stopping = Stopping {
        progress: Progress::Unheard,
        trip: None,
    };
    while stopping.progress < Progress::Stopped && clock.now_us() < end_us {
        let envelope = Envelope {
            hello: bridge_hello(Role::Host),
            session: id,
            counter: 0,
            sent_us: clock.now_us(),
            content: Content::Stop { id, stop },
        };
        connection.publish(Channel::Stop, &envelope);
        let again_us = again_us();
        while let Some(content) = heard.recv_until(again_us) {
            if let Some(now) = told(&content, id) {
                stopping = now;
            }
            if stopping.progress == Progress::Stopped {
                break;
            }
        }
    }
    connection.close();
    Ok(stopping)
}

/// What the display's bridge says of the Stop numbered `ours`.
fn told(content: &Content, ours: u64) -> Option<Stopping> {
    let (id, progress, trip) = match *content {
        Content::Stopped { id, trip } => (id, Progress::Stopped, trip),
        Content::Stopping { id, is_told: true } => (id, Progress::Told, None),
        Content::Stopping { id, is_told: false } => (id, Progress::Heard, None),
        _ => return None,
    };
    (id == ours).then_some(Stopping { progress, trip })
}
