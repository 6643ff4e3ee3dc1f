//! Answers a Stop where it came from, once the outputs are off, and passes it on to the other board.

use embassy_futures::select::{Either3, select3};
use embassy_time::{Duration, Timer};
use protocol::{Message, Stop, Stopped};

use crate::ports::Ports;
use crate::side::Side;
use crate::stop::{HEARD, Heard, OFF};

/// Between two times that the other board is told.
const AGAIN: Duration = Duration::from_millis(50);

/// Answers every Stop when the outputs are off, and tells the other board of those from the console until it
/// has answered. Those that come from the other board end here, so that none goes in a circle.
#[embassy_executor::task]
pub async fn answer(ports: &'static Ports) {
    let mut cause = None;
    let mut unanswered = [false; 2];
    let mut passed_on: Option<Stop> = None;
    loop {
        let again = async {
            match passed_on {
                Some(_) => Timer::after(AGAIN).await,
                None => core::future::pending().await,
            }
        };
        let tells = match select3(HEARD.receive(), OFF.wait(), again).await {
            Either3::First(Heard::Stop(side, stop)) => {
                unanswered[side as usize] = true;
                let is_own = side == Side::Console;
                if is_own {
                    passed_on = Some(stop);
                }
                is_own
            }
            Either3::First(Heard::Typed(stop)) => {
                passed_on = Some(stop);
                true
            }
            Either3::First(Heard::OtherStopped) => {
                passed_on = None;
                false
            }
            Either3::Second(trip) => {
                cause = Some(trip);
                false
            }
            Either3::Third(()) => true,
        };
        if let Some(stop) = passed_on.filter(|_| tells) {
            ports.post_on(Side::Peer, &Message::Stop(stop));
        }
        if let Some(trip) = cause {
            for side in [Side::Peer, Side::Console] {
                if core::mem::take(&mut unanswered[side as usize]) {
                    ports.post_on(side, &Message::Stopped(Stopped::by(trip)));
                }
            }
        }
    }
}
