//! The paper's experiments with people, simulated: `hil-sim people`.
//!
//! ```text
//! λ given ─────────> display ELF ─> voltages ─> felt waves ─> observer ─> method of limits ── Table II
//! specimen ─> sensor ELF ─> display ELF ─> voltages ─> felt waves ─> observer ─> pairs ───── Table III
//!                                                                       ─> Case V, Mosteller ── Table IV
//! ```
//!
//! The observer feels what the actuators' voltages really do under the moving hand: the travel of the hand
//! for each wave, with its errors over time, and not the number that an estimator gave ([`presented`]). His skin
//! is the paper's Table II ([`thresholds`]), his chance is seeded ([`observer`]).
//!
//! | file | what |
//! | --- | --- |
//! | [`published`] | the paper's Tables II to IV |
//! | [`hand`], [`given`], [`bench`] | what is run, and on what |
//! | [`presented`] | the waves of a run's voltages |
//! | [`thresholds`], [`observer`] | who feels them |
//! | [`limits`] | Table II, by the method of limits |
//! | [`pairs`] | Table III, by paired comparison |
//! | [`thurstone`], [`mosteller`] | Table IV and its test |
//! | [`interval`] | confidence intervals |
//! | [`study`] | all of it; [`recount`] does the same with the paper's own numbers |
//! | [`tables`], [`record`] | as text, CSV and JSON |
//!
//! # What it shows, and what not
//!
//! It shows how far the errors of estimator and display can be felt by somebody whose skin is as good as
//! the paper's subjects', and what experiments of the paper's size can tell at all. It proves nothing on
//! people: an observer who was given Table II's limens has them, and one who integrates, tires, learns or
//! attends otherwise would answer otherwise. Whether the fingertip on the specimen sticks and slips, which the
//! paper holds responsible for part of its errors, is a choice ([`study::Friction`]), and how much it does a
//! guess.

pub mod bench;
pub mod given;
pub mod hand;
pub mod interval;
pub mod limits;
pub mod mosteller;
pub mod normal;
pub mod observer;
pub mod pair;
pub mod pairs;
pub mod presented;
pub mod published;
pub mod record;
pub mod recount;
pub mod study;
pub mod tables;
pub mod thresholds;
pub mod thurstone;

/// What every output says of itself.
pub const DISCLAIMER: &str = "A simulated observer proves nothing on people. It was given the paper's limens, so that Table II can \
only show what the display and the method of limits add to them; Tables III and IV show what the stimulus' \
errors cost somebody with that skin. Neither attention, learning nor fatigue is in it.";
