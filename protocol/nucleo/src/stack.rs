//! How much of the stack was never used: cortex-m-rt paints it before anything runs (`paint-stack`), and
//! what is still painted has not been reached.

use core::ptr::addr_of;

use cortex_m_rt::STACK_PAINT_VALUE;

/// Looked at at once.
type Group = [u32; 4];
/// Groups looked at in a turn: the 96 KiB of `memory.x` in four seconds of turns every 50 ms.
const GROUPS_PER_TURN: usize = 80;

/// Looks for the lowest place of the stack that was ever written, a little at a time, from its far end on. The
/// default is before its first round, in which it looks at all that may still be painted.
#[derive(Default)]
pub struct StackWatch {
    /// Groups from the stack's end that are known to be painted in this round.
    painted: usize,
    /// Those that were painted at the end of the last round.
    free: usize,
}

impl StackWatch {
    /// Takes a turn; to be called every 50 ms.
    pub fn look(&mut self) {
        let (end, groups) = stack();
        let next = groups.min(self.painted + GROUPS_PER_TURN);
        for index in self.painted..next {
            if !is_painted(end, index) {
                self.free = index;
                self.painted = 0;
                return;
            }
        }
        self.painted = if next < groups { next } else { 0 };
    }

    /// The least room that there ever was, in bytes, as of the last whole round; 0 before.
    pub fn free_bytes(&self) -> u32 {
        (self.free * size_of::<Group>()) as u32
    }
}

/// The stack's far end, and how many groups it has.
#[allow(unsafe_code, reason = "symbols of the linker's")]
fn stack() -> (*const Group, usize) {
    unsafe extern "C" {
        static _stack_end: Group;
        static _stack_start: Group;
    }
    let (end, start) = (addr_of!(_stack_end), addr_of!(_stack_start));
    (end, (start as usize - end as usize) / size_of::<Group>())
}

#[allow(unsafe_code, reason = "memory that belongs to no variable")]
fn is_painted(end: *const Group, index: usize) -> bool {
    // SAFETY: the group is within the stack's RAM. What lies below the stack pointer belongs to nobody; the
    // search ends at the first group that ever did.
    let [a, b, c, d] = unsafe { end.add(index).read_volatile() };
    let differs = |word: u32| word ^ STACK_PAINT_VALUE;
    differs(a) | differs(b) | differs(c) | differs(d) == 0
}
