//! What the display does, measured on its ELF or its library.

pub mod delay;
pub mod purity;
pub mod stop;
pub mod texture;
pub mod timing;

use std::sync::Arc;

use hil_sim_core::scene::{Link, Motion, Series};
use protocol::texture::{BANDS, PARTIALS};
use protocol::{DisplayConfiguration, Mode, Partial, Rendering, Texture, UpdateRate};

/// The rendering of a name.
///
/// # Errors
/// If it is none's, with those that there are.
pub fn rendering_of_word(word: &str) -> Result<Rendering, String> {
    let mut all = Rendering::ALL.into_iter();
    all.find(|rendering| rendering.name() == word)
        .ok_or_else(|| {
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
const PLAIN_TEXTURE: Texture = Texture {
    partials: [Partial { ratio: 0, phase: 0 }; PARTIALS],
    repeating_percent: 100,
    bands: [0; BANDS],
    ..RICH_TEXTURE
};

/// What the board starts with, but for this.
fn configured(mode: Mode, update_rate: UpdateRate) -> DisplayConfiguration {
    DisplayConfiguration {
        mode,
        update_rate,
        ..DisplayConfiguration::DEFAULT
    }
}

/// A link that is late and nothing else.
fn late(delay_ms: f64) -> Link {
    Link {
        delay_ms,
        ..Link::default()
    }
}

/// A link that is late and loses a fifth, with 50 ms of jitter.
fn bad(delay_ms: f64) -> Link {
    Link {
        jitter_ms: 50.0,
        loss: 0.2,
        ..late(delay_ms)
    }
}

pub(crate) fn seconds(at_ns: u64) -> f64 {
    at_ns as f64 * 1e-9
}

/// A hand that goes through these places in mm at these instants in s.
pub(crate) fn through(at: Vec<f64>, values: Vec<f64>) -> Motion {
    Motion::Recorded(Arc::new(Series {
        at,
        values,
        width: 1,
    }))
}
