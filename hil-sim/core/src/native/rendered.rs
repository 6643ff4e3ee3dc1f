//! What the display would play of a surface in each rendering: by its own wave, so with the factor that keeps the limits
//! and without what it leaves out.

use firmware_display::phase::{TURN, Wavelength};
use firmware_display::wave::{Played, Scale, Wave};
use firmware_display::{grain, skin};
use protocol::texture::LOWEST_BAND_PER_MM;
use protocol::{ACTUATORS, Actuator, Rendering, Texture, UpdateRate};

use crate::plant::motion::MM_PER_COUNT;

/// Ticks after which the display's average of the speed is there.
const TICKS: u32 = 400;

/// A part of what is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Its mean square, the amplitude being 1. Where actuators have a response of their own, that of their displacement.
    pub power: f64,
    /// Its frequency in Hz: of what does not repeat, the middle of its octave.
    pub hz: f64,
}

/// What these actuators play of a surface under a hand that goes steadily: the fundamental first. None if the display
/// refuses such a λ.
pub fn lines(
    actuators: &[Actuator; ACTUATORS],
    rendering: Rendering,
    texture: &Texture,
    wavelength_mm: f64,
    speed_mm_s: f64,
) -> Option<Vec<Line>> {
    const RATE: UpdateRate = UpdateRate::Hz2000;
    let scale = if skin::any_is_modelled(actuators) {
        Scale::Calm
    } else {
        Scale::Whole
    };
    let mut wave = Wave::new(rendering, scale);
    wave.follow(texture, Wavelength::new(wavelength_mm as f32)?, RATE);
    wave.settle();
    let mm_per_tick = speed_mm_s / f64::from(RATE.hz());
    let turn = (mm_per_tick / wavelength_mm * TURN) as i32;
    let counts = |tick: u32| (f64::from(tick) * mm_per_tick / MM_PER_COUNT).floor();
    for tick in 0..TICKS {
        let travel = counts(tick + 1) - counts(tick);
        wave.tick(travel as i16, turn, RATE);
    }
    let Played {
        fundamental,
        partials,
        bands,
        ..
    } = *wave.played();
    let gain = f64::from(skin::scale(rendering, actuators));
    let line = |level: f32, mean_square: f64, hz: f64| Line {
        power: mean_square * (gain * f64::from(level)).powi(2),
        hz,
    };
    let fundamental_hz = speed_mm_s / wavelength_mm;
    let mut lines = vec![line(fundamental, 0.5, fundamental_hz)];
    let numbers = (2..).map(f64::from).zip(partials);
    lines.extend(numbers.map(|(n, (re, im))| line(re.hypot(im), 0.5, n * fundamental_hz)));
    let mean_square = f64::from(grain::RMS).powi(2);
    let middles_per_mm =
        (0..).map(|band| f64::from(LOWEST_BAND_PER_MM) * 2_f64.powf(f64::from(band) + 0.5));
    lines.extend(
        bands
            .into_iter()
            .zip(middles_per_mm)
            .map(|(level, per_mm)| line(level, mean_square, per_mm * speed_mm_s)),
    );
    Some(lines)
}

#[cfg(test)]
mod tests {
    use protocol::{DEFAULT_ACTUATORS, Partial};

    use super::*;

    const TOLD: Texture = Texture {
        sequence: 0,
        instant_us: 0,
        valid: true,
        partials: [
            Partial {
                ratio: 300,
                phase: 0,
            },
            Partial { ratio: 0, phase: 0 },
        ],
        repeating_percent: 50,
        bands: [0, 0, 120, 120],
        friction: None,
    };

    fn played(rendering: Rendering) -> Vec<Line> {
        lines(&DEFAULT_ACTUATORS, rendering, &TOLD, 2.0, 50.0).expect("it has a wave of 2 mm")
    }

    #[test]
    fn a_richer_wave_has_a_smaller_fundamental() {
        let sine = played(Rendering::Fundamental);
        assert_eq!(sine[0].power, 0.5);
        assert!(sine[1..].iter().all(|line| line.power == 0.0));
        let [shape, texture] = [Rendering::Shape, Rendering::Texture].map(played);
        // 0.84 of the peak of 1.2 at most, and its square.
        assert!((0.2..0.4).contains(&shape[0].power), "{shape:?}");
        assert!(texture[0].power < 0.8 * shape[0].power, "{texture:?}");
        for (line, hz) in texture
            .iter()
            .zip([25.0, 50.0, 75.0, 8.8, 17.7, 35.4, 70.7])
        {
            assert!((line.hz - hz).abs() < 0.1, "{line:?}");
        }
        let ratio = (texture[1].power / texture[0].power).sqrt();
        assert!((ratio - 0.3).abs() < 1e-3, "{texture:?}");
        // Levels are mean squares over the fundamental's amplitude.
        let level = (texture[5].power / (2.0 * texture[0].power)).sqrt();
        assert!((level - 0.12).abs() < 1e-3, "{texture:?}");
    }

    #[test]
    fn what_the_display_refuses_or_leaves_out_is_not_played() {
        let mut long = TOLD;
        long.bands = [500, 600, 0, 0];
        let told = |rendering, mm| lines(&DEFAULT_ACTUATORS, rendering, &long, mm, 50.0);
        assert_eq!(
            told(Rendering::Texture, 1.0),
            told(Rendering::Shape, 1.0),
            "bands of 4 mm and more beside a wave of 1 mm"
        );
        assert!(told(Rendering::Texture, 0.01).is_none());
    }

    #[test]
    fn actuators_with_a_response_of_their_own_move_less() {
        let mut actuators = DEFAULT_ACTUATORS;
        actuators[7].resonance_dhz = 2_500;
        actuators[7].damping_percent = 70;
        let line = lines(&actuators, Rendering::Fundamental, &TOLD, 2.0, 50.0).expect("a wave")[0];
        // Twice at their resonance's own frequency, and 1.19 times for the peak.
        assert!(
            (line.power.sqrt() * 2_f64.sqrt() - 0.84 / 2.0).abs() < 0.01,
            "{line:?}"
        );
    }
}
