//! The two lines by which the board is told to stop: the emergency-stop button and the chips' alarm.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::peripherals::{PE13, PF14};

/// The inputs, looked at in every tick.
pub struct Inputs {
    button: Input<'static>,
    alarm: Input<'static>,
}

impl Inputs {
    /// `button` is closed to ground until it is pressed or its wire breaks; `alarm` is pulled low by any
    /// chip.
    pub fn new(button: Peri<'static, PF14>, alarm: Peri<'static, PE13>) -> Self {
        Self {
            button: Input::new(button, Pull::Up),
            alarm: Input::new(alarm, Pull::Up),
        }
    }

    /// Whether the emergency stop is pressed, or its wire broken.
    pub fn stop_is_open(&self) -> bool {
        self.button.is_high()
    }

    /// Whether a chip raises its alarm.
    pub fn alarm(&self) -> bool {
        self.alarm.is_low()
    }
}
