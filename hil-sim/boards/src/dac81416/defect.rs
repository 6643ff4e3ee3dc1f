//! What can be wrong with a chip.

/// A chip's defects; none by default. They come and go at any time; what they did to the chip's
/// registers stays. Loss of power is no defect but [`super::Dac81416::reset`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Defects {
    /// Its serial interface is dead: no frame is heard, and SDO says nothing.
    pub deaf: bool,
    /// LDAC does not reach it: the outputs stay as they are while the buffers follow.
    pub no_load: bool,
    /// It is too hot: STATUS and ALMOUT say so.
    pub overheated: bool,
    /// This channel puts out so many V, whatever it is told.
    pub stuck_output: Option<(usize, f64)>,
}
