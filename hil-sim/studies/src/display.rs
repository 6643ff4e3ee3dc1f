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
//! | [`texture`] | what partials and a random part carry besides λ |

pub mod delay;
pub mod purity;
pub mod stop;
pub mod texture;
pub mod timing;

use protocol::texture::{BANDS, PARTIALS};
use protocol::{Partial, Rendering, Texture};

/// Every rendering, by its name in tables, files and commands.
pub const RENDERINGS: [(&str, Rendering); 3] = [
    ("fundamental", Rendering::Fundamental),
    ("shape", Rendering::Shape),
    ("texture", Rendering::Texture),
];

/// The name of a rendering.
pub fn word_of_rendering(rendering: Rendering) -> &'static str {
    RENDERINGS
        .iter()
        .find(|(_, of)| *of == rendering)
        .map_or("", |(word, _)| word)
}

/// The rendering of a name.
///
/// # Errors
/// If it is none's, with those that there are.
pub fn rendering_of_word(word: &str) -> Result<Rendering, String> {
    let found = RENDERINGS.iter().find(|(name, _)| *name == word);
    found.map(|(_, rendering)| *rendering).ok_or_else(|| {
        format!("no rendering is called {word:?}: give fundamental, shape or texture")
    })
}

/// A surface that has everything: both partials, all that does not repeat.
pub const RICH_TEXTURE: Texture = Texture {
    sequence: 0,
    instant_us: 0,
    valid: true,
    partials: [Partial {
        ratio: 400,
        phase: 12_345,
    }; PARTIALS],
    repeating_percent: 90,
    bands: [100; BANDS],
    friction: None,
};

/// A surface that is a sine and nothing else.
pub const PLAIN_TEXTURE: Texture = Texture {
    partials: [Partial { ratio: 0, phase: 0 }; PARTIALS],
    repeating_percent: 100,
    bands: [0; BANDS],
    ..RICH_TEXTURE
};

/// The name of a mode in tables and files.
pub const fn word_of_mode(mode: protocol::Mode) -> &'static str {
    match mode {
        protocol::Mode::Uniform => "uniform",
        protocol::Mode::Travelling => "travelling",
    }
}
