//! What becomes of hum and of textures, one by one.

use super::*;

const ALL: u8 = 0b11111;
const TAU: f64 = 2.0 * core::f64::consts::PI;
/// A texture's amplitude at unit gain, in ADC steps.
const TEXTURE: f64 = 370.0;
/// Gains of the amplifiers for hum, of the gauges for texture, their places in mm and phases.
const HUM_GAINS: [f64; GAUGES] = [0.3, 1.5, 0.7, 1.2, 0.9];
const GAINS: [f64; GAUGES] = [1.0, 0.8, 1.1, 0.6, 0.9];
const PLACES_MM: [f64; GAUGES] = [-3.0, -1.5, 0.0, 1.5, 3.0];
const PHASES: [f64; GAUGES] = [0.0, 0.4, -0.7, 1.1, -0.3];
/// Every corner of both mains.
const MAINS: [f64; 6] = [49.5, 50.0, 50.5, 59.5, 60.0, 60.5];

/// Where the gauges are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Lie {
    /// Spread over 6 mm.
    Apart,
    /// All at one place: the texture comes to all of them at once.
    Together,
}

/// A fingertip on a texture, and what the mains do to it.
struct Rub {
    hum: Hum,
    lie: Lie,
    wavelength_mm: f64,
    /// Whether v/λ is told.
    told: bool,
    usable: u8,
    x_um: [f64; 17],
    ms: u32,
}

/// One millisecond.
struct Step {
    texture: [f64; GAUGES],
    /// Hum and texture, and what is left of that.
    felt: [f32; GAUGES],
    left: [f32; GAUGES],
}

impl Rub {
    fn new(lie: Lie, wavelength_mm: f64, told: bool) -> Self {
        Self {
            hum: Hum::default(),
            lie,
            wavelength_mm,
            told,
            usable: ALL,
            x_um: [0.0; 17],
            ms: 0,
        }
    }

    /// Goes on for `ms` at a speed of s since the start, with hum of gauge and s since the start.
    fn on(
        &mut self,
        ms: u32,
        speed_mm_s: impl Fn(f64) -> f64,
        hum: impl Fn(usize, f64) -> f64,
        mut see: impl FnMut(&Step),
    ) {
        for _ in 0..ms {
            let t_s = f64::from(self.ms) * 1e-3;
            self.x_um.rotate_right(1);
            self.x_um[0] = self.x_um[1] + speed_mm_s(t_s);
            let texture: [f64; GAUGES] = core::array::from_fn(|gauge| {
                let ahead = match self.lie {
                    Lie::Apart => TAU * PLACES_MM[gauge] / self.wavelength_mm + PHASES[gauge],
                    Lie::Together => 0.0,
                };
                let theta = TAU * 1e-3 * self.x_um[0] / self.wavelength_mm + ahead;
                TEXTURE * GAINS[gauge] * (libm::sin(theta) + 0.2 * libm::sin(3.0 * theta))
            });
            let felt = core::array::from_fn(|gauge| (texture[gauge] + hum(gauge, t_s)) as f32);
            let mut left = felt;
            self.hum.remove(&mut left);
            self.ms += 1;
            if self.ms.is_multiple_of(10) {
                // As the board has it: counts of 5 µm over 16 ms.
                let count = |um: f64| libm::floor(um / 5.0) * 5.0;
                let speed = (count(self.x_um[0]) - count(self.x_um[16])).abs() / 16.0;
                let texture_hz = speed / self.wavelength_mm;
                let told = self.told && self.ms > 400 && speed > 2.0;
                self.hum
                    .renew(self.usable, speed as f32, told.then_some(texture_hz as f32));
            }
            see(&Step {
                texture,
                felt,
                left,
            });
        }
    }

    /// The largest RMS amplitude among the gauges of hum that is left over so many ms.
    fn hum_left(
        &mut self,
        ms: u32,
        speed_mm_s: impl Fn(f64) -> f64,
        hum: impl Fn(usize, f64) -> f64,
    ) -> f64 {
        let mut squares = [0.0; GAUGES];
        self.on(ms, speed_mm_s, hum, |step| {
            for (gauge, square) in squares.iter_mut().enumerate() {
                let left = f64::from(step.left[gauge]) - step.texture[gauge];
                *square += left * left;
            }
        });
        let most = squares.into_iter().fold(0.0, f64::max);
        libm::sqrt(2.0 * most / f64::from(ms))
    }

    /// Goes on without hum, and nothing may be taken out.
    fn is_left_alone(&mut self, ms: u32, speed_mm_s: impl Fn(f64) -> f64) {
        let mut at = 0;
        let what = (self.lie, self.wavelength_mm, self.told);
        self.on(
            ms,
            speed_mm_s,
            |_, _| 0.0,
            |step| {
                assert_eq!(step.left, step.felt, "{what:?} after {at} ms");
                at += 1;
            },
        );
    }
}

/// Hum of a frequency and an amplitude relative to the texture's, at unequal gains.
fn mains(hz: f64, amplitude: f64) -> impl Fn(usize, f64) -> f64 {
    move |gauge, t_s| TEXTURE * amplitude * HUM_GAINS[gauge] * libm::cos(TAU * hz * t_s + 0.4)
}

fn none(_: usize, _: f64) -> f64 {
    0.0
}

/// To and fro, f times a second.
fn strokes(peak_mm_s: f64, f_hz: f64) -> impl Fn(f64) -> f64 {
    move |t_s| peak_mm_s * libm::sin(TAU * f_hz * t_s)
}

/// The same after some rest.
fn after(rest_s: f64, speed_mm_s: impl Fn(f64) -> f64) -> impl Fn(f64) -> f64 {
    move |t_s| {
        if t_s < rest_s {
            0.0
        } else {
            speed_mm_s(t_s - rest_s)
        }
    }
}

#[test]
fn mains_of_50_and_60_hz_half_a_hertz_off_are_gone_after_a_second_and_a_half_of_motion() {
    for hz in MAINS {
        for lie in [Lie::Apart, Lie::Together] {
            for told in [false, true] {
                // 31 Hz: 19 Hz away or more, the third harmonic more than that.
                let mut rub = Rub::new(lie, 1.3, told);
                let speed = |_: f64| 40.0;
                rub.on(1_500, speed, mains(hz, 2.0), |_| {});
                let left = rub.hum_left(200, speed, mains(hz, 2.0));
                // n has grown from 40 by half of 90 blocks. Half as much texture leaks by
                // 4/85 · 100 Hz / (2π · 19 Hz), 0.02 of the hum, into a gauge's gain.
                assert!(
                    left < 0.03 * 2.0 * TEXTURE,
                    "{hz} Hz, {lie:?}, {told}: {left}"
                );
            }
        }
    }
}

#[test]
fn after_a_rest_they_are_gone_from_the_first_move_on() {
    for hz in MAINS {
        for amplitude in [0.1, 0.5, 2.0] {
            let mut rub = Rub::new(Lie::Apart, 1.3, false);
            let speed = after(0.4, |_| 40.0);
            rub.on(400, &speed, mains(hz, amplitude), |_| {});
            for part in 0..8 {
                let left = rub.hum_left(250, &speed, mains(hz, amplitude));
                // Texture leaks by 4/200 · 100 Hz / (2π · 19 Hz) = 0.017 into phase and scale each, 0.024
                // in all; of the hum by Σ|gain · texture| / Σ gain² = 0.8 of that at most, which the
                // strongest gauge has 1.5 times. And 1 % of the hum, for the plain mean at first, in which
                // half a Hz turned by 0.1 rad.
                let bound = 0.029 * TEXTURE + 0.015 * amplitude * TEXTURE;
                assert!(left < bound, "{hz} Hz × {amplitude}, {part}: {left}");
            }
        }
    }
}

#[test]
fn what_a_gauge_at_fault_hums_by_itself_at_rest_is_not_taken_out_once_it_is_well() {
    let faulty = |gauge, t_s| {
        let own = if gauge == 3 {
            8.0 * TEXTURE * libm::cos(TAU * 50.0 * t_s)
        } else {
            0.0
        };
        mains(50.0, 0.5)(gauge, t_s) + own
    };
    let mut rub = Rub::new(Lie::Apart, 1.3, false);
    rub.usable = ALL & !(1 << 3);
    let speed = after(0.4, |_| 40.0);
    rub.on(400, &speed, faulty, |_| {});
    rub.usable = ALL;
    let left = rub.hum_left(500, &speed, mains(50.0, 0.5));
    // Of its part of the common hum, 0.6 of the texture, the others' mean is 0.7 of that; and what leaks.
    assert!(left < (0.3 * 0.6 + 0.04) * TEXTURE, "{left}");
}

#[test]
fn a_texture_that_passes_the_mains_frequencies_is_left_alone() {
    for lie in [Lie::Apart, Lie::Together] {
        for told in [false, true] {
            for wavelength_mm in [0.8, 1.0, 1.2] {
                for rest_s in [0.0, 0.4] {
                    let rub = || Rub::new(lie, wavelength_mm, told);
                    rub().is_left_alone(4_000, after(rest_s, strokes(70.0, 0.83)));
                    rub().is_left_alone(4_000, after(rest_s, strokes(100.0, 2.0)));
                    // Turns at 50 Hz, and takes its time.
                    let peak = 50.0 * wavelength_mm;
                    rub().is_left_alone(6_000, after(rest_s, strokes(peak, 0.3)));
                    let ramp = |t_s: f64| wavelength_mm * (40.0 + (10.0 * t_s).min(30.0));
                    rub().is_left_alone(4_000, after(rest_s, ramp));
                }
            }
        }
    }
}

#[test]
fn a_texture_at_the_mains_frequency_that_was_not_there_at_rest_is_left_alone() {
    for lie in [Lie::Apart, Lie::Together] {
        for told in [false, true] {
            for hz in MAINS {
                Rub::new(lie, 1.0, told).is_left_alone(5_000, after(0.3, |_| hz));
                // Nor one that was not there at another speed.
                let speed = |t_s: f64| if t_s < 0.7 { 33.0 } else { hz };
                Rub::new(lie, 1.0, told).is_left_alone(5_000, speed);
            }
        }
    }
}

#[test]
fn a_texture_at_the_mains_frequency_from_the_start_on_is_hum_only_to_gauges_at_one_place() {
    Rub::new(Lie::Apart, 1.0, false).is_left_alone(5_000, |_| 50.0);
    // This is what cannot be told, as the module says.
    let mut rub = Rub::new(Lie::Together, 1.0, false);
    rub.on(2_000, |_| 50.0, none, |_| {});
    assert!(rub.hum.removed.is_some());
    // It is given up as the texture goes elsewhere: the memory is 1 s long.
    rub.on(2_500, |_| 65.0, none, |_| {});
    assert!(rub.hum.removed.is_none());
}

#[test]
fn textures_that_pass_take_hum_that_is_known_from_a_rest_off_its_course_but_little() {
    for hz in [49.8, 60.3] {
        // A texture that passes is in the memory, of 4/200 a block, for what is beyond 15 Hz on either side:
        // 2 · 1 / (2π · 15 Hz), 0.042 of it; two passes a stroke may add up. Half of it is in common to
        // gauges that lie apart.
        for (lie, most) in [(Lie::Apart, 0.042), (Lie::Together, 0.084)] {
            let mut rub = Rub::new(lie, 1.0, true);
            let speed = after(0.4, strokes(70.0, 0.83));
            rub.on(400, &speed, mains(hz, 0.5), |_| {});
            let (mut product, mut power) = (0.0, 0.0);
            rub.on(5_000, &speed, mains(hz, 0.5), |step| {
                for (left, texture) in step.left.iter().zip(step.texture) {
                    product += f64::from(*left) * texture;
                    power += texture * texture;
                }
            });
            // Of the texture's own amplitude, next to nothing is lost.
            let gain = product / power;
            assert!((gain - 1.0).abs() < 0.01, "{hz} Hz, {lie:?}: {gain}");
            let left = rub.hum_left(1_000, &speed, mains(hz, 0.5)) / TEXTURE;
            assert!(left < most, "{hz} Hz, {lie:?}: {left}");
        }
    }
}

#[test]
fn a_texture_at_the_very_frequency_does_not_pull_known_hum_along() {
    for (lie, told) in [(Lie::Apart, true), (Lie::Together, true)] {
        let mut rub = Rub::new(lie, 1.0, told);
        let speed = after(0.4, |_| 50.0);
        rub.on(400, &speed, mains(50.0, 1.0), |_| {});
        rub.on(2_000, &speed, mains(50.0, 1.0), |_| {});
        // The frequency is known to 1e-3 Hz from the rest; for the rest of it, 4/n is next to nothing.
        let left = rub.hum_left(500, &speed, mains(50.0, 1.0)) / TEXTURE;
        assert!(left < 0.03, "{lie:?}: {left}");
    }
}

#[test]
fn hum_that_comes_in_later_stays_at_constant_speed_and_goes_with_changes_and_rests() {
    let comes = |gauge: usize, t_s: f64| {
        if t_s < 1.0 {
            0.0
        } else {
            mains(50.3, 1.0)(gauge, t_s)
        }
    };
    let mut rub = Rub::new(Lie::Apart, 1.3, false);
    rub.on(4_000, |_| 40.0, comes, |_| {});
    assert!(rub.hum.removed.is_none());
    // Ringing and 0.2 s of rest, and an estimate.
    rub.on(240, |_| 0.0, comes, |_| {});
    let left = rub.hum_left(200, |_| 40.0, comes);
    assert!(left < 0.04 * TEXTURE, "{left}");

    let mut rub = Rub::new(Lie::Apart, 2.0, false);
    let speed = after(0.4, strokes(70.0, 0.83));
    rub.on(3_500, &speed, comes, |_| {});
    let left = rub.hum_left(500, &speed, comes);
    assert!(left < 0.06 * TEXTURE, "{left}");
}

#[test]
fn hum_that_goes_away_is_not_put_in() {
    let goes = |gauge: usize, t_s: f64| {
        if t_s < 1.0 {
            mains(50.3, 1.0)(gauge, t_s)
        } else {
            0.0
        }
    };
    let mut rub = Rub::new(Lie::Apart, 1.3, false);
    let speed = after(0.4, |_| 40.0);
    rub.on(1_000, &speed, goes, |_| {});
    // Its scale falls with a memory of 4/n, n from 200 to 300: to e^(−2) in 1.2 s, to e^(−5) in 3.4 s.
    rub.on(3_500, &speed, goes, |_| {});
    let left = rub.hum_left(500, &speed, goes);
    assert!(left < 0.02 * 1.5 * TEXTURE, "{left}");
    // With rest, at once.
    rub.on(300, |_| 0.0, goes, |_| {});
    assert!(rub.hum.removed.is_none());
}

#[test]
fn offset_drift_and_even_harmonics_pass_unchanged() {
    for twice_hz in [99.0, 100.0, 101.0, 119.0, 120.0, 121.0] {
        let mut hum = Hum::default();
        for n in 0..3_000_u32 {
            let t_s = f64::from(n) * 1e-3;
            let other = 100.0 * libm::sin(TAU * twice_hz * t_s) + 200.0 * libm::sin(t_s);
            let gauges: [f32; GAUGES] =
                core::array::from_fn(|gauge| 700.0 * gauge as f32 - 1_500.0 + other as f32);
            let mut out = gauges;
            hum.remove(&mut out);
            assert_eq!(out, gauges, "{twice_hz} Hz");
            if n % 10 == 9 {
                hum.renew(ALL, if n < 1_000 { 0.0 } else { 40.0 }, None);
            }
        }
    }
}

#[test]
fn one_gauges_own_hum_is_named_in_motion_and_removed_after_a_rest() {
    let want = TEXTURE * TEXTURE * 2.0;
    let own = |gauge: usize, t_s: f64| {
        if gauge == 3 {
            2.0 * TEXTURE * libm::cos(TAU * 50.2 * t_s + 1.0)
        } else {
            0.0
        }
    };
    let mut rub = Rub::new(Lie::Apart, 1.3, false);
    rub.on(500, |_| 40.0, none, |_| {});
    rub.on(500, |_| 40.0, own, |_| {});
    // It is not common and left in, but no texture is in one gauge alone.
    assert!(rub.hum.removed.is_none());
    let powers = rub.hum.own_powers().map(f64::from);
    assert!((powers[3] / want - 1.0).abs() < 0.15, "{powers:?}");
    assert_eq!([powers[0], powers[1], powers[2], powers[4]], [0.0; 4]);
    // The same while it is left out.
    rub.usable = 0b10111;
    rub.on(10, |_| 40.0, own, |_| {});
    let powers = rub.hum.own_powers().map(f64::from);
    assert!((powers[3] / want - 1.0).abs() < 0.15, "{powers:?}");
    rub.usable = ALL;

    rub.on(400, |_| 0.0, own, |_| {});
    let powers = rub.hum.own_powers().map(f64::from);
    assert!((powers[3] / want - 1.0).abs() < 0.02, "{powers:?}");
    for gauge in [0, 1, 2, 4] {
        assert!(powers[gauge] < 1e-3 * want, "{powers:?}");
    }
    let left = rub.hum_left(300, |_| 40.0, own);
    assert!(left < 0.03 * 2.0 * TEXTURE, "{left}");
}

#[test]
fn unequal_gains_for_common_hum_are_no_gauges_own() {
    let mut rub = Rub::new(Lie::Apart, 1.3, false);
    rub.on(500, |_| 0.0, mains(60.2, 2.0), |_| {});
    for power in rub.hum.own_powers() {
        assert!(f64::from(power) < 1e-3 * TEXTURE * TEXTURE, "{power}");
    }
}

#[test]
fn what_is_common_hides_textures_until_it_is_decided_on() {
    for hz in [50.4, 59.6] {
        let mut rub = Rub::new(Lie::Apart, 1.3, false);
        let mut hidden = 0;
        for _ in 0..150 {
            rub.on(10, |_| 40.0, mains(hz, 1.0), |_| {});
            let pickup = rub.hum.pickup();
            hidden += u32::from(pickup.hides(TEXTURE as f32, 30.8));
            // The hum itself, taken for a texture.
            hidden += u32::from(pickup.hides(TEXTURE as f32, hz as f32));
        }
        // From the first on to 0.5 s, when it is taken out, and for 0.15 s more; the texture later.
        assert!((90..=130).contains(&hidden), "{hz}: {hidden}");
        assert!(rub.hum.removed.is_some());
    }
    // After a rest there is nothing left to decide.
    let mut rub = Rub::new(Lie::Together, 1.0, false);
    rub.on(300, |_| 0.0, none, |_| {});
    for _ in 0..100 {
        rub.on(10, |_| 50.0, none, |_| {});
        assert!(!rub.hum.pickup().hides(1.0, 50.0));
    }
}

#[test]
fn goes_on_for_a_quarter_of_an_hour() {
    // Longer than the counts of estimates, and than any phase.
    let mut rub = Rub::new(Lie::Apart, 1.3, false);
    let speed = |t_s: f64| if t_s % 10.0 < 1.0 { 0.0 } else { 40.0 };
    rub.on(900_000, speed, mains(50.2, 1.0), |_| {});
    let left = rub.hum_left(500, speed, mains(50.2, 1.0));
    assert!(left < 0.03 * TEXTURE, "{left}");
}

#[test]
fn garbage_does_not_make_it_say_more_than_it_was_told() {
    let mut hum = Hum::default();
    let mut random = 1_u32;
    let mut next = || {
        random ^= random << 13;
        random ^= random >> 17;
        random ^= random << 5;
        random
    };
    for n in 0..200_000_u32 {
        let mut gauges = core::array::from_fn(|gauge| match (n / 20_000 + gauge as u32) % 5 {
            0 => 2_047.0,
            1 => -2_048.0,
            2 => [2_047.0, -2_048.0][n as usize / 10 % 2],
            3 => (next() >> 20) as f32 - 2_048.0,
            _ => 0.0,
        });
        hum.remove(&mut gauges);
        for x in gauges {
            // What is taken out is found in a range of ±4 096, by LS gains that overshoot by 1.5 at most.
            assert!(x.abs() < 16_384.0, "{x} at {n}");
        }
        if next() % 12 == 0 {
            let speed = [0.0, 1.0, 40.0, 1e6][next() as usize % 4];
            let texture_hz = [None, Some(0.0), Some(50.0), Some(1e9)][next() as usize % 4];
            hum.renew(next() as u8 & ALL, speed, texture_hz);
            for power in hum.own_powers() {
                assert!((0.0..1e9).contains(&power), "{power} at {n}");
            }
        }
    }
}

#[test]
fn takes_no_more_memory_than_it_may() {
    // Two followers of 3 · 5 complex amplitudes, and ten samples.
    assert!(size_of::<Hum>() <= 1_024, "{}", size_of::<Hum>());
}
