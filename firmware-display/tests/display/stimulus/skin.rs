//! What the skin gets of a voltage, by a simulated actuator: second order, driven by the converter's held voltage.
//!
//! What is wanted is the wave at the place where the hand is. The converter holds a voltage for a tick, which is half a
//! tick late on average; without a model that is so too, and it is taken off here.

use std::f64::consts::TAU;

use protocol::actuators::{Actuator, DEFAULT_ACTUATORS};
use protocol::{DisplayConfiguration, Mode, Partial, Rendering, Texture};

use crate::stimulus::rig::{RATES, Rig, Volts, trimmed};

/// Steps of the simulation in a tick.
const FINE: usize = 10;

/// Displacement over static displacement of an actuator.
struct Simulated {
    omega: f64,
    zeta: f64,
    place: f64,
    speed: f64,
}

impl Simulated {
    fn new(f0_hz: f64, zeta: f64) -> Self {
        Self {
            omega: TAU * f0_hz,
            zeta,
            place: 0.0,
            speed: 0.0,
        }
    }

    /// `volts` for `seconds`, by the fourth order Runge-Kutta method.
    fn hold(&mut self, volts: f64, seconds: f64) {
        let slope = |(place, speed): (f64, f64)| {
            let pull = self.omega * self.omega * (volts - place);
            (speed, pull - 2.0 * self.zeta * self.omega * speed)
        };
        let after =
            |(place, speed): (f64, f64), (v, a): (f64, f64), t: f64| (place + v * t, speed + a * t);
        let here = (self.place, self.speed);
        let k1 = slope(here);
        let k2 = slope(after(here, k1, seconds / 2.0));
        let k3 = slope(after(here, k2, seconds / 2.0));
        let k4 = slope(after(here, k3, seconds));
        let mean =
            |of: fn(&(f64, f64)) -> f64| (of(&k1) + 2.0 * of(&k2) + 2.0 * of(&k3) + of(&k4)) / 6.0;
        let mean = (mean(|k| k.0), mean(|k| k.1));
        (self.place, self.speed) = after(here, mean, seconds);
    }
}

fn modelled(f0_hz: f64, zeta: f64) -> [Actuator; 50] {
    let mut actuators = DEFAULT_ACTUATORS;
    for actuator in &mut actuators {
        actuator.resonance_dhz = (10.0 * f0_hz) as u16;
        actuator.damping_percent = (100.0 * zeta) as u16;
    }
    actuators
}

/// Regression of what the skin of actuator 0 does on what it should do, `wanted` of the hand's place in mm: factor, and
/// what is left over, as a part of what is wanted (RMS), from `from_s` on.
fn felt(
    rig: &mut Rig,
    (f0_hz, zeta): (f64, f64),
    (from_s, to_s): (f64, f64),
    position_mm: impl Fn(f64) -> f64,
    wanted: impl Fn(f64) -> f64,
) -> (f64, f64) {
    let mut skin = Simulated::new(f0_hz, zeta);
    let tick_s = 1.0 / rig.hz();
    let fine_s = tick_s / FINE as f64;
    let mut pairs = Vec::new();
    for (tick, volts) in rig
        .stroke(rig.ticks(to_s), &position_mm)
        .into_iter()
        .enumerate()
    {
        for fine in 0..FINE {
            skin.hold(volts[0], fine_s);
            // A voltage is that of the end of its tick; half of what it is held for is taken off.
            let t_s = (tick + 1) as f64 * tick_s + (fine + 1) as f64 * fine_s - tick_s / 2.0;
            if t_s > from_s {
                pairs.push((skin.place, wanted(position_mm(t_s))));
            }
        }
    }
    let sum = |of: &dyn Fn(f64, f64) -> f64| {
        pairs
            .iter()
            .map(|&(is, should)| of(is, should))
            .sum::<f64>()
    };
    let squares = sum(&|_, should| should * should);
    let factor = sum(&|is, should| is * should) / squares;
    let rest = sum(&|is, should| (is - factor * should).powi(2)) / (factor * factor * squares);
    (factor, rest.sqrt())
}

const MODELS: [(f64, f64); 4] = [(30.0, 1.5), (60.0, 0.7), (150.0, 0.3), (800.0, 0.2)];

fn rig(rate: protocol::UpdateRate, rendering: Rendering, actuators: [Actuator; 50]) -> Rig {
    let configuration = DisplayConfiguration {
        mode: Mode::Uniform,
        rendering,
        update_rate: rate,
        ..DisplayConfiguration::DEFAULT
    };
    Rig::with(configuration, actuators)
}

/// The voltage's largest over the displacement's: 1 + w² + 2 max(ζ − 1, 0) w, w = 250 Hz/f₀.
fn most((f0_hz, zeta): (f64, f64)) -> f64 {
    let w = 250.0 / f0_hz;
    1.0 + w * w + 2.0 * f64::max(zeta - 1.0, 0.0) * w
}

/// Displacement of the actuator at f over that at rest.
fn response((f0_hz, zeta): (f64, f64), hz: f64) -> f64 {
    let w = hz / f0_hz;
    1.0 / f64::hypot(1.0 - w * w, 2.0 * zeta * w)
}

/// By whole counts a tick the encoder is right. Between them its steps turn the phase to and fro, by lines of 5 µm/λ, of
/// which those below the stimulus come through the actuator the better the weaker it is at the stimulus.
#[test]
fn at_a_steady_speed_the_skin_is_in_step_and_as_strong_at_every_frequency() {
    for rate in RATES {
        for model in MODELS {
            for hz in [5.0, 35.0, 80.0, 200.0] {
                for counts in [7.0, 7.037] {
                    let speed_mm_s = counts * 0.005 * f64::from(rate.hz());
                    let wavelength_mm = speed_mm_s / hz;
                    let mut rig = rig(rate, Rendering::Fundamental, modelled(model.0, model.1));
                    rig.follow(wavelength_mm);
                    let behind_mm = if counts == 7.0 { 0.0 } else { 0.0025 };
                    let (factor, rest) = felt(
                        &mut rig,
                        model,
                        (2.4, 2.8),
                        // Away from the border of a count.
                        |t| speed_mm_s * t + 0.001,
                        |mm| (TAU * (mm - 0.001 - behind_mm) / wavelength_mm).sin(),
                    );
                    // What a held voltage has of the sine that it follows.
                    let held = (TAU / 2.0 * hz / rig.hz()).sin() / (TAU / 2.0 * hz / rig.hz());
                    let expected = 5.0 * 0.84 / most(model) * held;
                    let lines = if counts == 7.0 {
                        0.0
                    } else {
                        let most = (0..500).map(|hz| response(model, hz.into()));
                        let most = most.fold(0.0, f64::max);
                        0.005 / wavelength_mm * (1.0 + most / response(model, hz))
                    };
                    assert!(
                        (factor / expected - 1.0).abs() <= 0.01,
                        "{model:?} {hz} Hz: {factor} {expected}"
                    );
                    // The steps of the held voltage are lines at the rate less and more than the stimulus.
                    let images = [rig.hz() - hz, rig.hz() + hz]
                        .map(|image| hz / image * response(model, image) / response(model, hz));
                    let lines = lines + images[0] + images[1];
                    assert!(
                        rest <= 0.012 + lines,
                        "{model:?} {counts} {hz} Hz: {rest} {lines}"
                    );
                }
            }
        }
    }
}

/// Where channels of different charges come to share a place the sine alone is played for a while, without models.
#[test]
fn an_actuator_without_its_model_for_a_while_moves_no_further_than_with_it() {
    for rate in RATES {
        for (f0_hz, zeta) in MODELS.into_iter().chain([(60.0, 0.1)]) {
            for (hz, part) in [(0.2, 0.01), (0.9, 0.19), (1.0, 0.19), (1.5, 0.01)] {
                let hz = f64::min(hz * f0_hz, 200.0);
                let mut rig = rig(rate, Rendering::Fundamental, trimmed());
                rig.configuration.mode = Mode::Travelling;
                rig = Rig::with(rig.configuration, rig.actuators);
                rig.follow(2.0);
                // A hand that trembles leaves charges.
                rig.stroke(rig.ticks(1.0), |t| 0.15 * (TAU * 5.0 * t).sin());
                rig.actuators = modelled(f0_hz, zeta);
                rig.configure(rig.configuration);
                rig.follow(7.0 * 0.005 * rig.hz() / hz);
                let (ticks, tick_s) = (rig.ticks(4.0), 1.0 / rig.hz());
                let mut skin = Simulated::new(f0_hz, zeta);
                let mut swing = |volts: Vec<Volts>| {
                    let places = volts.iter().map(|volts| {
                        skin.hold(volts[0], tick_s);
                        skin.place
                    });
                    let last = places.skip(ticks - ticks / 16).collect::<Vec<_>>();
                    (last.iter().copied().fold(f64::MIN, f64::max)
                        - last.iter().copied().fold(f64::MAX, f64::min))
                        / 2.0
                };
                let plain = swing(rig.rub(ticks, 7));
                // It is over when the hand rests again.
                rig.rub(rig.ticks(0.1), 0);
                let heeded = swing(rig.rub(ticks, 7));
                let case = format!("{rate:?} {f0_hz} Hz {zeta} at {hz} Hz: {plain} {heeded}");
                assert!(plain <= 1.01 * heeded, "{case}");
                assert!(plain >= part * heeded, "{case}");
            }
        }
    }
}

#[test]
fn without_its_model_the_same_actuator_is_out_of_step() {
    let model = (60.0, 0.7);
    let mut rig = rig(RATES[0], Rendering::Fundamental, DEFAULT_ACTUATORS);
    rig.follow(1.0);
    let (factor, rest) = felt(
        &mut rig,
        model,
        (2.5, 3.5),
        |t| 70.0 * t,
        |mm| (TAU * mm).sin(),
    );
    // Beyond its resonance it lags by more than a quarter of a turn.
    assert!(factor < 0.0 && rest > 1.0, "{factor} {rest}");
}

#[test]
fn a_shape_reaches_the_skin_as_a_shape() {
    let texture = Texture {
        valid: true,
        partials: [
            Partial {
                ratio: 500,
                phase: 10_000,
            },
            Partial {
                ratio: 400,
                phase: 50_000,
            },
        ],
        ..Texture::default()
    };
    let shape = |turns: f64| {
        let theta = TAU * turns;
        let partials = texture.partials.iter().zip(2..).map(|(partial, n)| {
            let phase = TAU * f64::from(partial.phase) / 65_536.0;
            f64::from(partial.ratio) / 1_000.0 * (f64::from(n) * theta + phase).sin()
        });
        theta.sin() + partials.sum::<f64>()
    };
    for rate in RATES {
        for model in MODELS {
            let wavelength_mm = f64::from(rate.hz()) / 1_000.0;
            let mut rig = rig(rate, Rendering::Shape, modelled(model.0, model.1));
            rig.follow(wavelength_mm);
            rig.stimulus.wear(&texture);
            // By whole counts a tick.
            let speed_mm_s = 0.035 * rig.hz();
            let (_, rest) = felt(
                &mut rig,
                model,
                (2.5, 3.5),
                |t| speed_mm_s * t + 0.001,
                |mm| shape((mm - 0.001) / wavelength_mm),
            );
            assert!(rest <= 0.03, "{model:?}: {rest}");
        }
    }
}

/// Under the paper's stroke the speed changes, by 365 mm/s² at most, and is averaged over 4 ms. An ideal actuator does
/// not get the exact wave either: the balance takes some of it after each turning point.
#[test]
fn under_the_papers_stroke_the_skin_gets_what_an_ideal_actuator_would_give_it() {
    let rest = |model, actuators| {
        let mut rig = rig(RATES[0], Rendering::Fundamental, actuators);
        rig.follow(2.0);
        let half_mm = 70.0 / (TAU * 0.83);
        let stroke = |t: f64| -half_mm * (TAU * 0.83 * t).cos();
        let begun_mm = stroke(0.0);
        let wanted = |mm: f64| (TAU * (mm - begun_mm - 0.0025) / 2.0).sin();
        felt(&mut rig, model, (2.5, 6.0), stroke, wanted).1
    };
    let ideal = rest((5_000.0, 1.0), DEFAULT_ACTUATORS);
    println!("ideal: {:.1} %", ideal * 100.0);
    for model in MODELS {
        let rest = rest(model, modelled(model.0, model.1));
        println!("{model:?}: {:.1} %", rest * 100.0);
        assert!(rest <= ideal + 0.02, "{model:?}: {rest} {ideal}");
    }
}
