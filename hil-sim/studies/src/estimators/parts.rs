//! Numbers of the parts of the example `estimator_cost`, shared with it.

/// The first of [`super::settings::SETTINGS`], the others after it.
pub const SETTINGS_FROM: u32 = 0;
/// The first of the rivals in the roster, the others after it.
pub const RIVALS_FROM: u32 = 40;
/// Anti-aliasing and travel, which every rival's part includes too: a rival that does nothing.
pub const FRONT: u32 = 60;
/// One real transform of [`super::baselines::spectrum::LENGTH`] samples a millisecond, and nothing else.
pub const TRANSFORM: u32 = 61;
/// Milliseconds that every part is counted over, each a piece of its own.
pub const MILLISECONDS: u32 = 1_000;
