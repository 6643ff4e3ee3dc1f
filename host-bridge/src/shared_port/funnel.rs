//! What several programs say, on its way to one board: whole frames, numbered in one row.

use std::io::{self, Write};

use protocol::Stop;
use protocol::frame::{self, MAX_FRAME};

use crate::line::write_some;

/// The way to a board for frames of any number of programs.
pub struct Funnel {
    output: Box<dyn Write + Send>,
    sequence: u16,
    /// What is left of a frame of which the line has taken the beginning.
    rest: Vec<u8>,
    /// Whether a Stop is in it.
    holds_stop: bool,
}

impl Funnel {
    /// Frames go to `output`, which never blocks; the first is numbered 0.
    pub fn new(output: Box<dyn Write + Send>) -> Self {
        Self {
            output,
            sequence: 0,
            rest: Vec::new(),
            holds_stop: false,
        }
    }

    /// Says `frames`, each ended by a 0x00. What is no frame is left out: nobody would understand it. Fails with
    /// [`io::ErrorKind::WouldBlock`] if the line took none of a frame: that and those after it are not said. What
    /// it took a part of is said to its end as soon as it takes more, and so is a Stop of which it took nothing, before
    /// whatever others say.
    pub fn put(&mut self, frames: &[u8]) -> io::Result<()> {
        let mut content = [0; MAX_FRAME];
        let mut numbered = [0; MAX_FRAME];
        let mut said = Ok(());
        for given in frames
            .split(|&byte| byte == 0)
            .filter(|frame| !frame.is_empty())
        {
            let Some(content) = content.get_mut(..given.len()) else {
                continue;
            };
            content.copy_from_slice(given);
            let Ok((_, payload)) = frame::decode(content) else {
                continue;
            };
            let is_stop = Stop::from_bytes(payload).is_some();
            let Some(frame) = frame::encode_payload(self.sequence, payload, &mut numbered) else {
                continue;
            };
            let mut taken = 0;
            if said.is_ok() {
                (taken, said) = self.write(frame);
            }
            if taken > 0 {
                // What comes after a part is refused in its turn.
                said = Ok(());
            } else if !is_stop || self.holds_stop {
                continue;
            }
            self.rest.extend_from_slice(&frame[taken..]);
            self.holds_stop |= is_stop && !self.rest.is_empty();
            self.sequence = self.sequence.wrapping_add(1);
        }
        said
    }

    /// Writes what is left, and then as much of `frame` as the line takes: how many bytes.
    fn write(&mut self, frame: &[u8]) -> (usize, io::Result<()>) {
        let (taken, result) = write_some(&mut self.output, &self.rest);
        self.rest.drain(..taken);
        if result.is_err() {
            return (0, result);
        }
        self.holds_stop = false;
        write_some(&mut self.output, frame)
    }
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind;
    use std::sync::{Arc, Mutex};

    use protocol::{Message, Ping, StopReason};

    use super::*;
    use crate::lock::locked;

    /// Takes bytes for as long as there is room.
    #[derive(Clone, Default)]
    struct Narrow(Arc<Mutex<(usize, Vec<u8>)>>);

    impl Write for Narrow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let mut held = locked(&self.0);
            let count = bytes.len().min(held.0);
            if count == 0 {
                return Err(ErrorKind::WouldBlock.into());
            }
            held.0 -= count;
            held.1.extend_from_slice(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    const STOP: Message = Message::Stop(Stop {
        reason: StopReason::Operator,
    });

    fn framed(sequence: u16, message: &Message) -> Vec<u8> {
        let mut bytes = [0; MAX_FRAME];
        let frame = frame::encode(sequence, message, &mut bytes);
        frame.expect("every message fits").to_vec()
    }

    fn ping(sent_us: u64) -> Message {
        Message::Ping(Ping { sent_us })
    }

    #[test]
    fn frames_of_several_programs_are_numbered_in_one_row_and_garbage_is_left_out() {
        let line = Narrow::default();
        locked(&line.0).0 = 1_000;
        let mut funnel = Funnel::new(Box::new(line.clone()));
        let said = [framed(700, &ping(1)), framed(3, &STOP), vec![1, 2, 3, 0, 0]].concat();
        funnel.put(&said).expect("there is room");
        funnel.put(&framed(701, &ping(2))).expect("there is room");
        let want = [framed(0, &ping(1)), framed(1, &STOP), framed(2, &ping(2))].concat();
        assert_eq!(locked(&line.0).1, want);
    }

    #[test]
    fn a_line_that_takes_a_part_of_a_frame_gets_the_rest_before_anything_else() {
        let line = Narrow::default();
        locked(&line.0).0 = 4;
        let mut funnel = Funnel::new(Box::new(line.clone()));
        funnel.put(&framed(9, &ping(1))).expect("it has been begun");
        let refused = funnel
            .put(&framed(9, &ping(2)))
            .map_err(|error| error.kind());
        assert_eq!(refused, Err(ErrorKind::WouldBlock));
        locked(&line.0).0 = 1_000;
        funnel.put(&framed(9, &ping(3))).expect("there is room");
        let want = [framed(0, &ping(1)), framed(1, &ping(3))].concat();
        assert_eq!(locked(&line.0).1, want);
    }

    #[test]
    fn a_program_that_floods_the_line_holds_up_nobodys_stop() {
        let line = Narrow::default();
        let mut funnel = Funnel::new(Box::new(line.clone()));
        let flood: Vec<u8> = (0..50)
            .flat_map(|number| framed(number, &ping(1)))
            .collect();
        let mut say = |frames: &[u8], room| {
            locked(&line.0).0 = room;
            funnel.put(frames).map_err(|error| error.kind())
        };
        let full = Err(ErrorKind::WouldBlock);
        assert_eq!(say(&flood, 0), full);
        // Also where it comes behind other words of its own program, and is said again before there is room.
        let stop = [framed(7, &ping(2)), framed(8, &STOP)].concat();
        assert_eq!(say(&stop, 0), full);
        assert_eq!(say(&stop, 0), full);
        // The flood finds the room, a byte at a time, and yet the Stop goes first.
        let want = framed(0, &STOP);
        for _ in &want {
            assert_eq!(say(&flood, 1), full);
        }
        assert_eq!(locked(&line.0).1, want);
        say(&framed(9, &ping(3)), 1_000).expect("there is room");
        assert_eq!(locked(&line.0).1, [want, framed(1, &ping(3))].concat());
    }
}
