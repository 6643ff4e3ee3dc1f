//! The ELFs on emulated boards, by their pins, links, consoles and logs alone: no wall clock has a part in it,
//! so that as many may run at once as a machine likes.

use std::sync::LazyLock;

use tests::run::{Run, scene};

mod arm;
mod asking;
mod bit_for_bit;
mod clock;
mod configuration;
mod console;
mod cost;
mod determinism;
mod estimation;
mod faults;
mod link;
mod log;
mod on_target;
mod reversal;
mod second_processor;
mod silence;
mod stop;
mod table_1;
mod texture;
mod travelling;

/// Nothing out of the ordinary, for two statuses of either board.
static PLAIN: LazyLock<Run> = LazyLock::new(|| {
    Run::of(scene(
        r#"
        duration_s = 2.2

        [surface]
        specimens = [{ wavelength_mm = 2.0 }]
        "#,
    ))
});
