//! What several programs say, on its way to one board: whole frames, numbered in one row.

use std::io::{self, Write};

use protocol::frame::{self, MAX_FRAME};

use crate::line::write_some;

/// The way to a board for frames of any number of programs.
pub struct Funnel {
    output: Box<dyn Write + Send>,
    sequence: u16,
    /// What is left of a frame of which the line has taken the beginning.
    rest: Vec<u8>,
}

impl Funnel {
    /// Frames go to `output`, which never blocks; the first is numbered 0.
    pub fn new(output: Box<dyn Write + Send>) -> Self {
        Self {
            output,
            sequence: 0,
            rest: Vec::new(),
        }
    }

    /// Says `frames`, each ended by a 0x00. What is no frame is left out: nobody would understand it. Fails with
    /// [`io::ErrorKind::WouldBlock`] if the line took none of a frame: that and those after it are not said. What
    /// it took a part of is said to its end as soon as it takes more.
    pub fn put(&mut self, frames: &[u8]) -> io::Result<()> {
        let mut content = [0; MAX_FRAME];
        let mut numbered = [0; MAX_FRAME];
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
            let Some(frame) = frame::encode_payload(self.sequence, payload, &mut numbered) else {
                continue;
            };
            self.write_rest()?;
            let (taken, result) = write_some(&mut self.output, frame);
            if taken == 0 {
                return result;
            }
            self.rest.extend_from_slice(&frame[taken..]);
            self.sequence = self.sequence.wrapping_add(1);
        }
        Ok(())
    }

    fn write_rest(&mut self) -> io::Result<()> {
        let (taken, result) = write_some(&mut self.output, &self.rest);
        self.rest.drain(..taken);
        result
    }
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind;
    use std::sync::{Arc, Mutex};

    use protocol::{Message, Ping, Stop, StopReason};

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
        let stop = Message::Stop(Stop {
            reason: StopReason::Operator,
        });
        let said = [framed(700, &ping(1)), framed(3, &stop), vec![1, 2, 3, 0, 0]].concat();
        funnel.put(&said).expect("there is room");
        funnel.put(&framed(701, &ping(2))).expect("there is room");
        let want = [framed(0, &ping(1)), framed(1, &stop), framed(2, &ping(2))].concat();
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
}
