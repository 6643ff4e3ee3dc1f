//! Any bytes, in any portions: what `protocol/examples/billion/receiver.rs` promises, and nothing panics.
#![no_main]

#[path = "../../examples/billion/receiver.rs"]
mod judge;

use std::cell::RefCell;

use judge::Judge;
use libfuzzer_sys::fuzz_target;
use protocol::Receiver;

thread_local! {
    static JUDGE: RefCell<Judge> = RefCell::new(Judge::new());
}

fuzz_target!(|input: &[u8]| {
    let verdict = JUDGE.with_borrow_mut(|judge| judge.judge::<Receiver>(input));
    assert_eq!(verdict, Ok(()));
});
