//! The judges of `examples/billion` can say no, and its tally is what the documents say.

#[path = "../../examples/billion/corrupted.rs"]
mod corrupted;
#[path = "../../examples/billion/draw.rs"]
mod draw;
#[path = "../../examples/billion/inputs.rs"]
mod inputs;
#[path = "../../examples/billion/receiver.rs"]
mod receiver;
#[path = "../../examples/billion/tally.rs"]
mod tally;

use std::fs;
use std::path::Path;

use protocol::frame::{self, FrameError};
use protocol::{Event, MAX_FRAME, Message, Peer, PortCounters, Receiver};

use crate::messages::samples;
use corrupted::{Corruptor, Spoiling};
use draw::Draw;
use inputs::Inputs;
use receiver::{Hears, Judge};
use tally::{Count, Tally};

/// Where the tables stand, from this crate on, and between what.
const PAGE: &str = "../docs/src/reference/messages.md";
const BEGIN: &str = "<!-- of the tally: protocol/tests/protocol/billion.rs -->\n";
const END: &str = "<!-- end of the tally -->\n";

fn messages() -> Vec<Message> {
    samples().into_iter().map(|(_, message)| message).collect()
}

/// What the judge says of `R`, in so many executions, if it says anything.
fn complaint<R: Hears>(executions: usize) -> Option<&'static str> {
    let mut draw = Draw::new(7);
    let mut inputs = Inputs::new(&messages());
    let mut judge = Judge::new();
    (0..executions).find_map(|_| judge.judge::<R>(inputs.next(&mut draw)).err())
}

/// A receiver with one thing wrong, which the constants choose.
#[derive(Default)]
struct Worse<const FORGETS_PORTIONS: bool, const COUNTS_TWICE: bool, const NEEDS_TWO_ZEROS: bool> {
    receiver: Receiver,
    corrupt_before: u32,
    extra: u32,
    zeros: u32,
}

impl<const FORGETS: bool, const TWICE: bool, const ZEROS: bool> Hears
    for Worse<FORGETS, TWICE, ZEROS>
{
    fn hear(&mut self, bytes: &[u8], mut handle: impl FnMut(Event)) {
        if FORGETS {
            self.receiver.forget_unended();
        }
        for byte in bytes {
            // Passes every eighth end of a frame over.
            self.zeros += u32::from(*byte == 0);
            if ZEROS && *byte == 0 && self.zeros % 8 == 7 {
                continue;
            }
            self.receiver.receive(&[*byte], &mut handle);
        }
        let corrupt = self.receiver.counters().corrupt;
        self.extra += u32::from(TWICE && corrupt > self.corrupt_before);
        self.corrupt_before = corrupt;
    }

    fn counters(&self) -> PortCounters {
        let counters = self.receiver.counters();
        PortCounters {
            corrupt: counters.corrupt + self.extra,
            ..counters
        }
    }

    fn peer(&self) -> Peer {
        self.receiver.peer()
    }
}

#[test]
fn the_receiver_holds_and_worse_ones_do_not() {
    assert_eq!(complaint::<Receiver>(20_000), None);
    assert_eq!(complaint::<Worse<false, false, false>>(2_000), None);
    for worse in [
        complaint::<Worse<true, false, false>>(2_000),
        complaint::<Worse<false, true, false>>(2_000),
        complaint::<Worse<false, false, true>>(2_000),
    ] {
        assert!(worse.is_some());
    }
}

/// A decoder whose CRC has `bits` bits.
fn with_crc_of(bits: u32) -> impl Fn(&mut [u8]) -> Result<(u16, &[u8]), FrameError> {
    move |frame| {
        let mut copy = [0; 2 * MAX_FRAME];
        let copy = &mut copy[..frame.len()];
        copy.copy_from_slice(frame);
        match frame::decode(copy) {
            Err(FrameError::Crc { carried, computed })
                if (carried ^ computed).trailing_zeros() >= bits =>
            {
                let length = cobs::decode_in_place(frame).expect("it did once");
                let sequence = u16::from_le_bytes([frame[0], frame[1]]);
                Ok((sequence, &frame[2..length - 4]))
            }
            _ => frame::decode(frame),
        }
    }
}

fn corrupted(judged: u64, decode: impl Fn(&mut [u8]) -> Result<(u16, &[u8]), FrameError>) -> Tally {
    let mut corruptor = Corruptor::new(&messages());
    let mut tally = Tally::default();
    for spoiling in Spoiling::ALL {
        let mut draw = Draw::new(spoiling as u64);
        let count = corruptor.run(spoiling, judged, &mut draw, &decode);
        assert_eq!(count.runs, judged);
        tally.add(spoiling.name(), &count);
    }
    tally
}

#[test]
fn corrupted_frames_that_pass_are_counted_and_objected_to() {
    let sound = corrupted(20_000, frame::decode);
    assert_eq!(sound.frames().bad, 0);
    assert_eq!(sound.objections(), [""; 0]);

    let worse = corrupted(20_000, with_crc_of(12));
    let any = worse.of("content");
    // 20 000 / 2¹² = 4.9, within six standard deviations.
    assert!((1..=18).contains(&any.bad), "{}", any.bad);
    assert!(worse.frames().bad > any.bad);
    let objections = worse.objections();
    assert!(objections[0].contains("were let through"), "{objections:?}");
}

#[test]
fn a_tally_objects_to_what_chance_does_not_do() {
    let billion = Count {
        seeds: 1_000,
        runs: 1_000_000_000,
        refused: 0,
        low_8: 3_906_250,
        low_16: 15_259,
        low_24: 60,
        bad: 0,
    };
    for (name, count, objections) in [
        ("content", billion, 0),
        // Expected are 0.23: two happen once in fifty times, six never.
        ("content", Count { bad: 2, ..billion }, 0),
        ("content", Count { bad: 6, ..billion }, 1),
        (
            "content",
            Count {
                low_8: 0,
                ..billion
            },
            1,
        ),
        (
            "content",
            Count {
                low_16: 16_500,
                ..billion
            },
            1,
        ),
        (
            "content",
            Count {
                low_24: 1_000,
                ..billion
            },
            1,
        ),
        // Few bits turned over are no chance, but what is let through counts.
        (
            "bits",
            Count {
                low_16: 0,
                ..billion
            },
            0,
        ),
        ("bits", Count { bad: 6, ..billion }, 1),
        ("decoder", Count { bad: 1, ..billion }, 1),
    ] {
        let mut tally = Tally::default();
        tally.add(name, &count);
        assert_eq!(tally.objections().len(), objections, "{name} {count:?}");
    }
}

#[test]
fn a_tally_is_read_as_it_was_written_and_what_is_none_is_refused_by_its_line() {
    let mut tally = Tally::default();
    let run = Count {
        seeds: 1,
        runs: 2,
        refused: 3,
        low_8: 4,
        low_16: 5,
        low_24: 6,
        bad: 7,
    };
    tally.add("bits", &run);
    tally.add("bits", &run);
    tally.add("decoder", &run);
    let path = std::env::temp_dir().join(format!("ridgelink-tally-{}.csv", std::process::id()));
    assert_eq!(Tally::read(&path), Ok(Tally::default()), "none yet");
    tally.write(&path).expect("the folder can be written to");
    assert_eq!(Tally::read(&path), Ok(tally.clone()));
    let text = fs::read_to_string(&path).expect("it was written");
    fs::remove_file(&path).expect("it was written");
    assert!(text.ends_with("bits,2,4,6,8,10,12,14\ndecoder,1,2,3,4,5,6,7\n"));

    for (spoiled, line) in [
        (text.replacen("runs", "run", 1), "line 1"),
        (text.replacen("14", "-1", 1), "line 2"),
        (text.replacen(",7", "", 1), "line 3"),
        (text.replacen("decoder", "bits", 1), "line 3"),
    ] {
        let error = Tally::parse(&spoiled).expect_err("it is spoiled");
        assert!(error.starts_with(line), "{error}");
    }
}

#[test]
fn the_page_shows_the_tally_and_nothing_speaks_against_it() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = folder.join("examples/billion/tally.csv");
    let tally = Tally::read(&path).expect("the tally can be read");
    assert_eq!(tally.objections(), [""; 0]);
    assert!(tally.frames().runs > 0 && tally.of("decoder").runs > 0);

    let page = fs::read_to_string(folder.join(PAGE)).expect("the page is there");
    let (_, rest) = page.split_once(BEGIN).expect("the tables begin");
    let (shown, _) = rest.split_once(END).expect("the tables end");
    let tables = tally.tables();
    assert_eq!(shown, tables, "the tables are to be:\n{tables}");
}
