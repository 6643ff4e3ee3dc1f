//! What every estimator gives and what it costs, what the display does, and what the contact models are
//! worth: `hil-sim chart`.
//!
//! | file | what |
//! | --- | --- |
//! | [`family`] | the committed scenes, by family |
//! | [`settings`] | the firmware's estimators, knobs swept |
//! | [`rivals`], [`pitch`], [`fourier`] | the field's methods, by crates where there are good ones |
//! | [`contest`] | all of them on the same samples, [`score`] |
//! | [`costs`], [`tally`], [`parts`] | instructions on the Cortex-M4F |
//! | [`bank`] | the former default's last rows |
//! | [`bound`] | the Cramér–Rao bound |
//! | [`efficiency`] | how near the default estimator comes to it |
//! | [`confidence`] | whether it is a probability, on strangers' surfaces |
//! | [`result`], [`picture`] | CSV and SVG |
//! | [`models`] | speed and error of the contact models |
//! | [`stability`] | where integrators fail |
//! | [`purity`], [`stop`], [`timing`], [`delay`] | the display's ELF, measured |

pub mod delay;
pub mod purity;
pub mod stop;
pub mod timing;

/// The name of a mode in tables and files.
pub const fn word_of_mode(mode: protocol::Mode) -> &'static str {
    match mode {
        protocol::Mode::Uniform => "uniform",
        protocol::Mode::Travelling => "travelling",
    }
}
