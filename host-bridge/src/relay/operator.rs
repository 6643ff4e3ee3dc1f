//! An operator without a board, who has one thing to say: Stop.

use std::sync::mpsc;
use std::time::{Duration, Instant};

use protocol::{Role, Stop};

use crate::host_clock::now_us;
use crate::relay::envelope::{Content, Envelope};
use crate::relay::name::{Channel, Name};
use crate::relay::network::{Network, NetworkError};
use crate::relay::site::{bridge_hello, random_number};
use crate::relay::wire::{Ear, Wire};

/// Between two times that Stop is said, and between two tries to connect.
const AGAIN: Duration = Duration::from_millis(100);

/// Says Stop at the bench called `name` until the display's bridge says that its board has it, for at most
/// `within`. Whether it did.
///
/// # Errors
/// If nobody was reached in that time.
pub fn stop(
    network: &Network,
    name: &Name,
    stop: Stop,
    within: Duration,
) -> Result<bool, NetworkError> {
    let end = Instant::now() + within;
    let session = loop {
        match network.open() {
            Ok(session) => break session,
            Err(error) if Instant::now() >= end => return Err(error),
            Err(_) => std::thread::sleep(AGAIN),
        }
    };
    let (heard, hears) = mpsc::channel();
    let ear = Ear {
        keys: name.key(Role::Display, Channel::Stop),
        hear: Box::new(move |bytes| {
            if let Ok(envelope) = Envelope::from_bytes(bytes)
                && let Content::Stopped { id } = envelope.content
            {
                let _ = heard.send(id);
            }
        }),
    };
    let wire = Wire::new(session, name, Role::Host, vec![ear])?;
    let id = random_number();
    let mut is_heard = false;
    while !is_heard && Instant::now() < end {
        let envelope = Envelope {
            hello: bridge_hello(Role::Host),
            session: id,
            counter: 0,
            sent_us: now_us(),
            content: Content::Stop { id, stop },
        };
        wire.say(Channel::Stop, &envelope);
        let again = Instant::now() + AGAIN;
        while let Ok(stopped) = hears.recv_timeout(again.saturating_duration_since(Instant::now()))
        {
            is_heard |= stopped == id;
            if is_heard {
                break;
            }
        }
    }
    wire.close();
    Ok(is_heard)
}
