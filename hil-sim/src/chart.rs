//! What every estimator gives and what it costs: `hil-sim chart`.
//!
//! | file | what |
//! | --- | --- |
//! | [`family`] | the committed scenes, by family |
//! | [`settings`] | the firmware's estimators, knobs swept |
//! | [`rivals`], [`pitch`], [`fourier`] | the field's methods, by crates where there are good ones |
//! | [`contest`] | all of them on the same samples, [`score`] |
//! | [`costs`], [`tally`], [`parts`] | instructions on the Cortex-M4F |
//! | [`bound`] | the Cramér–Rao bound |
//! | [`efficiency`] | how near the bank comes to it |
//! | [`result`], [`picture`] | CSV and SVG |

pub mod bound;
pub mod contest;
pub mod costs;
pub mod efficiency;
pub mod family;
pub mod fourier;
mod panel;
pub mod parts;
pub mod picture;
pub mod pitch;
pub mod result;
pub mod rivals;
pub mod score;
pub mod settings;
pub mod tally;
