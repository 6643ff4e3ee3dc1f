//! What an actuator's voltage moves the skin by, where its response is described.

use std::f64::consts::TAU;

use protocol::Actuator;

/// The displacement of an actuator with H(s) = ω₀²/(s² + 2ζω₀s + ω₀²), over that at a standing voltage, under a voltage that
/// goes straight from point to point: solved exactly.
#[derive(Clone, Copy, Debug)]
pub struct Displacement {
    /// ω₀ in rad/s, and ζ.
    natural: f64,
    damping: f64,
    /// The last point: when in s, the voltage in V, the displacement in V and its slope in V/s.
    last: Option<(f64, f64, f64, f64)>,
    /// ∫ displacement² dt while it is driven, in V² s, and how long that is in s.
    square_v2_s: f64,
    driven_s: f64,
}

impl Displacement {
    /// At rest, of the actuator that is described so; none if it has no response of its own.
    pub fn of(actuator: &Actuator) -> Option<Self> {
        (actuator.resonance_dhz != 0).then(|| Self {
            natural: TAU * f64::from(actuator.resonance_dhz) / 10.0,
            damping: f64::from(actuator.damping_percent) / 100.0,
            last: None,
            square_v2_s: 0.0,
            driven_s: 0.0,
        })
    }

    /// The displacement at the next point, in V; none where the voltage stays at 0: then it swings out, which is no stimulus.
    pub fn at(&mut self, t_s: f64, volts: f64) -> Option<f64> {
        let (from_s, from_v, moved_v, slope) = self.last.unwrap_or((t_s, volts, volts, 0.0));
        let passed_s = t_s - from_s;
        let next = if passed_s > 0.0 {
            self.after(passed_s, from_v, volts, (moved_v, slope))
        } else {
            (moved_v, slope)
        };
        self.last = Some((t_s, volts, next.0, next.1));
        let is_driven = from_v != 0.0 || volts != 0.0;
        is_driven.then(|| {
            self.square_v2_s += next.0 * next.0 * passed_s;
            self.driven_s += passed_s;
            next.0
        })
    }

    /// The amplitude of a sine of as much power as it has had while it was driven, in V; 0 before that. What swings out for a
    /// moment hardly counts.
    pub fn amplitude_v(&self) -> f64 {
        let mean = self.square_v2_s / self.driven_s;
        if mean.is_finite() {
            (2.0 * mean).sqrt()
        } else {
            0.0
        }
    }

    /// Displacement and slope after so many s in which the voltage goes from one value to another.
    fn after(&self, t_s: f64, from_v: f64, to_v: f64, (moved_v, slope): (f64, f64)) -> (f64, f64) {
        let (omega, zeta) = (self.natural, self.damping);
        let rise = (to_v - from_v) / t_s;
        // Under a ramp it follows the voltage by 2ζ/ω₀ later; the rest swings out.
        let late_v = 2.0 * zeta / omega * rise;
        let (rest_v, rest_slope) = (moved_v - (from_v - late_v), slope - rise);
        let decay = omega * zeta;
        let square = omega * omega * (1.0 - zeta * zeta);
        let root = square.abs().sqrt();
        // cos and sin/ω of the damped swing, or what becomes of them without one.
        let (even, odd) = if root * t_s < 1e-6 {
            (1.0, t_s)
        } else if square > 0.0 {
            ((root * t_s).cos(), (root * t_s).sin() / root)
        } else {
            ((root * t_s).cosh(), (root * t_s).sinh() / root)
        };
        let left = (-decay * t_s).exp();
        let (even, odd) = (left * even, left * odd);
        (
            to_v - late_v + rest_v * (even + decay * odd) + rest_slope * odd,
            rise + rest_slope * (even - decay * odd) - rest_v * omega * omega * odd,
        )
    }
}

#[cfg(test)]
mod tests {
    use protocol::DEFAULT_ACTUATORS;

    use super::*;

    fn of(resonance_dhz: u16, damping_percent: u16) -> Displacement {
        let actuator = Actuator {
            resonance_dhz,
            damping_percent,
            ..DEFAULT_ACTUATORS[0]
        };
        Displacement::of(&actuator).expect("it is described")
    }

    #[test]
    fn a_sine_comes_with_the_gain_and_lag_of_a_second_order_system() {
        for (dhz, percent) in [(600, 20), (600, 70), (600, 100), (300, 150), (8_000, 20)] {
            for hz in [5.0, 35.0, 60.0, 150.0] {
                let mut moved = of(dhz, percent);
                let w = hz * 10.0 / f64::from(dhz);
                let (re, im) = (1.0 - w * w, 2.0 * f64::from(percent) / 100.0 * w);
                let (gain, lag) = (1.0 / re.hypot(im), im.atan2(re));
                for step in 0..8_000_u32 {
                    let t_s = f64::from(step) * 5e-4;
                    let angle = TAU * hz * t_s;
                    let v = moved.at(t_s, angle.sin());
                    if let Some(v) = v.filter(|_| step > 4_000) {
                        // Straight lines between points 0.5 ms apart are a little less than the sine.
                        let due = gain * (angle - lag).sin();
                        assert!(
                            (v - due).abs() < 0.025 * gain,
                            "{dhz} {percent} {hz}: {v} {due}"
                        );
                    }
                }
            }
        }
    }

    /// A wave of 100 Hz is hardly followed at a resonance of 30 Hz, and what its end sets off swings out more widely than it ever
    /// moved.
    #[test]
    fn what_swings_out_after_the_stimulus_does_not_count() {
        let mut moved = of(300, 20);
        let [mut driven_v, mut ring_v] = [0.0_f64; 2];
        for step in 0..4_000_u32 {
            let t_s = f64::from(step) * 5e-4;
            let volts = if step < 2_000 {
                (TAU * 100.0 * t_s).sin()
            } else {
                0.0
            };
            let v = moved.at(t_s, volts);
            if (1_000..1_990).contains(&step) {
                driven_v = driven_v.max(v.expect("it is driven").abs());
            }
            if step > 2_000 {
                ring_v = ring_v.max(moved.last.expect("it was driven").2.abs());
            }
            assert_eq!(v.is_none(), step >= 2_001 || step == 0, "{step}");
        }
        assert!((0.09..0.11).contains(&driven_v), "{driven_v}");
        assert!(ring_v > 2.0 * driven_v, "{ring_v} {driven_v}");
        let amplitude_v = moved.amplitude_v();
        assert!((0.09..0.12).contains(&amplitude_v), "{amplitude_v}");
    }

    #[test]
    fn a_standing_voltage_is_reached_whole_and_without_a_response_there_is_none() {
        let mut moved = of(600, 70);
        assert_eq!(moved.at(0.0, 0.0), None);
        moved.at(1e-3, 2.0);
        assert!((moved.at(1.0, 2.0).expect("it is driven") - 2.0).abs() < 1e-9);
        // As a sine of the same power has it.
        assert!((moved.amplitude_v() / 8.0_f64.sqrt() - 1.0).abs() < 0.01);
        assert!(Displacement::of(&DEFAULT_ACTUATORS[0]).is_none());
    }
}
