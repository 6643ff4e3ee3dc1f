//! The network's engine, as every program here wants it: nothing is looked for, nothing listens or connects but
//! what is named, and who is lost is tried again.

use serde_json::{Value, json};
use zenoh::{Config, Error, Session, Wait};

/// Messages of a stream that may wait to be sent, 1 to 16; one that finds no room within a millisecond is lost. As
/// many as are said while a busy computer does not get round to sending, 32 ms of motions: the engine's own two hold
/// out for 4 ms. When a network is stuck, as little that is old comes out of it later.
const STREAM_MESSAGES: usize = 16;

pub struct Setup<'a> {
    /// `peer`, `client` or `router`, as the engine calls them.
    pub mode: &'a str,
    /// Where it listens, in the engine's words: `PROTOCOL/ADDRESS`.
    pub listen: Vec<String>,
    /// Where it connects, in the same words.
    pub connect: Vec<String>,
    /// Whatever else is to be set, by the engine's names.
    pub more: Vec<(String, Value)>,
}

impl Setup<'_> {
    /// Takes part. Who connects is back when somebody has answered or all have been tried in vain. Fails if nobody
    /// is reached, or one can't listen.
    pub fn open(self) -> Result<Session, Error> {
        zenoh::open(self.configuration()?).wait()
    }

    fn configuration(self) -> Result<Config, Error> {
        let ends = self.listen.iter().chain(&self.connect);
        let protocols: Vec<&str> = ends
            .filter_map(|end| Some(end.split_once('/')?.0))
            .collect();
        let settings = [
            ("mode", json!(self.mode)),
            ("listen/endpoints", json!(self.listen)),
            ("listen/timeout_ms", json!(0)),
            ("listen/exit_on_failure", json!(true)),
            ("connect/endpoints", json!(self.connect)),
            ("connect/timeout_ms", json!(0)),
            ("connect/exit_on_failure", json!(true)),
            ("scouting/multicast/enabled", json!(false)),
            ("scouting/gossip/enabled", json!(false)),
            ("scouting/delay", json!(0)),
            ("timestamping/enabled", json!(false)),
            ("transport/shared_memory/enabled", json!(false)),
            ("transport/link/protocols", json!(protocols)),
            (
                "transport/link/tx/queue/size/interactive_high",
                json!(STREAM_MESSAGES),
            ),
        ];
        let mut configuration = Config::default();
        let settings = settings.map(|(key, value)| (key.to_owned(), value));
        for (key, value) in settings.into_iter().chain(self.more) {
            configuration.insert_json5(&key, &value.to_string())?;
        }
        Ok(configuration)
    }
}
