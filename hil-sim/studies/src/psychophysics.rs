//! The paper's experiments with people, simulated: `hil-sim people`.
//!
//! ```text
//! λ given ─────────> display ELF ─> voltages ─> felt waves ─> observer ─> method of limits ── Table II
//! specimen ─> sensor ELF ─> display ELF ─> voltages ─> felt waves ─> observer ─> pairs ───── Table III
//!                                                                       ─> Case V, Mosteller ── Table IV
//! ```
//!
//! The observer feels what the actuators' voltages really do under the moving hand: the travel of the hand
//! for each wave, with its errors over time, and not the number that an estimator gave (`presented`). His skin
//! is the paper's Table II (`thresholds`), his chance is seeded (`observer`).
//!
//! # What it shows, and what not
//!
//! It shows how far the errors of estimator and display can be felt by somebody whose skin is as good as
//! the paper's subjects', and what experiments of the paper's size can tell at all. It proves nothing on
//! people: an observer who was given Table II's limens has them, and one who integrates, tires, learns or
//! attends otherwise would answer otherwise. Whether the fingertip on the specimen sticks and slips, which the
//! paper holds responsible for part of its errors, is a choice ([`FRICTIONS`]), and how much it does a
//! guess.

mod given;
mod hand;
pub(crate) mod interval;
mod job;
mod limits;
mod mosteller;
pub(crate) mod normal;
mod observer;
mod pair;
mod pairs;
mod presented;
mod published;
mod record;
mod recount;
mod study;
mod tables;
mod thresholds;
mod thurstone;

pub use job::{Job, run};
pub use record::{csvs, json};
pub use study::{FRICTIONS, Plan, Silent, Study, jobs};
pub use tables::text;

pub(crate) use hand::{FREQUENCY_HZ, PEAK_MM_S};
pub(crate) use pairs::mean_share;
pub(crate) use published::{SAMPLES_MM, TABLE_3};
pub(crate) use study::SNR_DB;
pub(crate) use tables::{felt, glimpses, limens, mosteller_tests, scores, shares, span};

/// What every output says of itself.
pub(crate) const DISCLAIMER: &str = "A simulated observer proves nothing on people. It was given the paper's limens, so that Table II can \
only show what the display and the method of limits add to them; Tables III and IV show what the stimulus' \
errors cost somebody with that skin. Neither attention, learning nor fatigue is in it.";
