//! A minute of both boards' logic and the wire between, with a made-up hand, surface, gauges and line: what
//! it computes is named by hashes, one of each stage for each second, so that two processors that disagree
//! show where they do.
//!
//! ```text
//! hand ─> display ── Motion ──> line ─> sensor ─> arm ─> surface ─> gauges ─> sensor
//!            ^ └─> fifty words                                                  │
//!            └───────────────── line <─────────────────────── Estimate, Gauges ─┘
//! ```

use core::fmt::{self, Debug, Display as Text, Formatter, Write};

use firmware_display::{
    Display, MICROMETRES_PER_COUNT, Readback, Senses, Settings, TICK_RATE_HZ, Transfer,
};
use firmware_sensor::{
    Drive, MID_RAIL_CODE, SAMPLE_RATE_HZ, SCANS_PER_SAMPLE, Scan, Sensor, float,
};
use protocol::{
    CHANNELS, Configuration, Configure, DisplayConfiguration, DisplayState, GAUGES, Hello,
    MAX_FRAME, Message, Method, Mode, Port, PortCounters, Role, SensorConfiguration, StopReason,
    StreamGauges, Trip,
};

/// How long it is, in s.
pub const SECONDS: u32 = SCENE_S * SCENES.len() as u32;
const SCENE_S: u32 = 4;
const SAMPLES_PER_SCENE: u32 = SCENE_S * SAMPLE_RATE_HZ;
/// Output ticks while the gauges give one sample.
const TICKS_PER_SAMPLE: u32 = TICK_RATE_HZ / SAMPLE_RATE_HZ;
const MICROSECONDS_PER_SAMPLE: u32 = 1_000_000 / SAMPLE_RATE_HZ;

/// What is rubbed, how, and what goes wrong meanwhile.
struct Scene {
    /// λ of the two specimens that take turns, in mm.
    wavelengths_mm: [f32; 2],
    /// The hand's speed in mm/s: the most, and how often a second it turns round, 0 for a steady one.
    speed_mm_s: f32,
    turns_hz: f32,
    noise_lsb: f32,
    hum_lsb: f32,
    method: Method,
    mode: Mode,
    trouble: Trouble,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Trouble {
    None,
    /// Gauges 1 and 3 without a signal, and 0 at its limit.
    Gauges,
    /// The force channel slips.
    Slip,
    /// Flipped bits, lost bytes, bytes from nowhere.
    Line,
    /// Nothing comes through for a second and a half.
    Silence,
    /// Every message to the display three times.
    Echo,
    /// Ticks are missed, transfers fail, CLR falls.
    Ticks,
    /// A converter does not hold what it was given.
    Converter,
    /// The hand's encoder jumps.
    HandJump,
    /// The operator stops both boards.
    Stop,
}

/// Length of a specimen, in mm.
const SPECIMEN_MM: f32 = 14.0;

const fn scene(wavelengths_mm: [f32; 2], speed_mm_s: f32, turns_hz: f32) -> Scene {
    Scene {
        wavelengths_mm,
        speed_mm_s,
        turns_hz,
        noise_lsb: 30.0,
        hum_lsb: 0.0,
        method: Method::Spectrum,
        mode: Mode::Uniform,
        trouble: Trouble::None,
    }
}

#[rustfmt::skip]
const SCENES: [Scene; 16] = [
    Scene { noise_lsb: 0.0, ..scene([2.0, 2.0], 70.0, 0.0) },
    scene([2.0, 3.0], 70.0, 0.83),
    Scene { mode: Mode::Travelling, ..scene([1.0, 4.0], 60.0, 0.5) },
    Scene { method: Method::Counting, ..scene([2.0, 1.0], 50.0, 0.0) },
    Scene { method: Method::AdaptedCounting, hum_lsb: 40.0, ..scene([3.0, 1.5], 40.0, 0.4) },
    Scene { method: Method::Crossings, noise_lsb: 60.0, ..scene([2.5, 5.0], 80.0, 0.6) },
    Scene { trouble: Trouble::Gauges, mode: Mode::Travelling, ..scene([2.0, 1.2], 70.0, 0.83) },
    Scene { trouble: Trouble::Slip, ..scene([2.0, 0.8], 45.0, 0.7) },
    Scene { trouble: Trouble::Line, ..scene([1.4, 2.2], 60.0, 0.83) },
    Scene { trouble: Trouble::Silence, mode: Mode::Travelling, ..scene([2.0, 6.0], 70.0, 0.0) },
    Scene { trouble: Trouble::Echo, hum_lsb: 120.0, ..scene([1.0, 2.0], 70.0, 1.2) },
    Scene { trouble: Trouble::Ticks, ..scene([2.0, 3.3], 90.0, 0.3) },
    Scene { noise_lsb: 250.0, mode: Mode::Travelling, ..scene([1.7, 4.4], 25.0, 0.2) },
    Scene { trouble: Trouble::Converter, ..scene([0.7, 7.0], 70.0, 0.5) },
    Scene { trouble: Trouble::HandJump, ..scene([2.0, 2.6], 55.0, 0.0) },
    Scene { trouble: Trouble::Stop, ..scene([2.0, 2.0], 70.0, 0.83) },
];

/// The gauges' amplitudes in ADC steps, and their places behind the first one in mm.
const AMPLITUDES_LSB: [f32; GAUGES] = [370.0, 300.0, 410.0, 220.0, 330.0];
const PLACES_MM: [f32; GAUGES] = [0.0, 1.3, 2.9, 4.2, 6.0];
/// The time constant of the arm's drive, in samples.
const ARM_SAMPLES: f32 = 12.0;
/// Most bytes of a wire in a sample, and what may come from nowhere.
const WIRE_BYTES: usize = MAX_FRAME * 4;

/// What was computed in a second: the hash of all that came out of each stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Second {
    /// Which, from 0 on.
    pub number: u32,
    /// Codes of the gauges and counts of both encoders.
    pub input: u64,
    /// Estimates, samples, the arm's drive, and the root of a number drawn.
    pub sensor: u64,
    /// Bytes on the line, and what both ports counted.
    pub wire: u64,
    /// Fifty words a tick, motions, states and counters.
    pub display: u64,
}

impl Text for Second {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "second {:2}  input {:016x}  sensor {:016x}  wire {:016x}  display {:016x}",
            self.number, self.input, self.sensor, self.wire, self.display
        )
    }
}

/// What has been met so far, so that a test can tell that there was something to compute.
#[derive(Clone, Copy, Debug, Default)]
pub struct Met {
    /// Valid estimates, by method.
    pub valid: [u32; 4],
    /// Ticks with the display driving, fading and stopped.
    pub driving: u32,
    /// See [`Met::driving`].
    pub fading: u32,
    /// See [`Met::driving`].
    pub stopped: u32,
    /// What has stopped the display, each reason once.
    pub trips: [Option<Trip>; 4],
    /// What the display's end of the line counted.
    pub display_end: PortCounters,
    /// Estimates in which not every gauge was good.
    pub unwell: u32,
}

/// The minute, as far as it has gone.
pub struct Rehearsal {
    sensor: Sensor,
    display: Display,
    settings: Settings,
    sensors_end: Port,
    displays_end: Port,
    /// Samples since the start.
    sample: u32,
    hand_um: f32,
    arm_um: f32,
    arm_mm_s: f32,
    drive: Drive,
    dice: u32,
    /// What has been met so far.
    pub met: Met,
    hashes: Hashes,
}

#[derive(Clone, Copy, Default)]
struct Hashes {
    input: Hash,
    sensor: Hash,
    wire: Hash,
    display: Hash,
}

impl Rehearsal {
    /// Before its first second.
    pub fn new() -> Self {
        let mut display = Display::new(&Settings::DEFAULT, None);
        display.started(Ok(()));
        Self {
            sensor: Sensor::new(SensorConfiguration::DEFAULT),
            display,
            settings: Settings::DEFAULT,
            sensors_end: Port::new(Hello::new(Role::Sensor, "any", [0; 3])),
            displays_end: Port::new(Hello::new(Role::Display, "any", [0; 3])),
            sample: 0,
            hand_um: 0.0,
            arm_um: 0.0,
            arm_mm_s: 0.0,
            drive: Drive::default(),
            dice: 0x2545_F491,
            met: Met::default(),
            hashes: Hashes::default(),
        }
    }

    /// The next second.
    pub fn second(&mut self) -> Second {
        self.hashes = Hashes::default();
        let number = self.sample / SAMPLE_RATE_HZ;
        for _ in 0..SAMPLE_RATE_HZ {
            self.millisecond();
        }
        self.met.display_end = self.displays_end.counters();
        let ends = [self.sensors_end.counters(), self.displays_end.counters()];
        self.hashes.wire.text(&ends);
        self.hashes.display.text(&self.display.counters());
        Second {
            number,
            input: self.hashes.input.0,
            sensor: self.hashes.sensor.0,
            wire: self.hashes.wire.0,
            display: self.hashes.display.0,
        }
    }

    fn millisecond(&mut self) {
        let scene = &SCENES[(self.sample / SAMPLES_PER_SCENE) as usize % SCENES.len()];
        let within = self.sample % SAMPLES_PER_SCENE;
        if within == 0 {
            self.set_up(scene);
        }
        let now_us = u64::from(self.sample + 1) * u64::from(MICROSECONDS_PER_SAMPLE);
        self.sample += 1;

        let turn = within as f32 * (scene.turns_hz / SAMPLE_RATE_HZ as f32);
        let swing = if scene.turns_hz > 0.0 {
            sine(turn)
        } else {
            1.0
        };
        // mm/s are µm/ms.
        self.hand_um += scene.speed_mm_s * swing;
        let (scans, arm) = self.feel(scene, within);
        let mut hand = counts(self.hand_um);
        if scene.trouble == Trouble::HandJump && within >= SAMPLES_PER_SCENE / 2 {
            hand = hand.wrapping_add(9_000);
        }
        // Any number but a negative one: the instruction, where there is one, against its software.
        let root = float::sqrt(f32::from_bits(self.draw() >> 1));
        if !root.is_nan() {
            self.hashes.sensor.bytes(&root.to_bits().to_le_bytes());
        }
        for code in scans.iter().flatten().chain(&[arm, hand]) {
            self.hashes.input.bytes(&code.to_le_bytes());
        }
        self.sense(now_us, &scans, arm);
        self.show(scene, within, now_us, hand);
        self.exchange(scene, within, now_us);
    }

    /// Both boards are set as the scene asks; what was stopped has been reset.
    fn set_up(&mut self, scene: &Scene) {
        let asked = DisplayConfiguration {
            mode: scene.mode,
            ..DisplayConfiguration::DEFAULT
        };
        let answer = self
            .settings
            .on_configure(&Configure::anyway(Configuration::Display(asked)));
        self.hashes.display.text(&answer);
        if let DisplayState::Stopped(_) = self.display.state() {
            self.display = Display::new(&self.settings, None);
            self.display.started(Ok(()));
        } else {
            self.display.configure(&self.settings);
        }
        self.sensor.configure(SensorConfiguration {
            method: scene.method,
            force_channel: scene.trouble == Trouble::Slip,
            ..SensorConfiguration::DEFAULT
        });
        self.sensor.stream_gauges(&StreamGauges { for_ms: 2_000 });
    }

    /// The arm goes on by its drive; what its gauges and its encoder say then.
    fn feel(&mut self, scene: &Scene, within: u32) -> ([Scan; SCANS_PER_SAMPLE], u16) {
        let full_mm_s = self.sensor.configuration().arm_full_scale_um_s as f32 * 1e-3;
        let asked = full_mm_s * f32::from(self.drive.duty) / f32::from(Drive::FULL);
        let asked = if self.drive.forward { asked } else { -asked };
        self.arm_mm_s += (asked - self.arm_mm_s) / ARM_SAMPLES;
        let mut scans = [[MID_RAIL_CODE; CHANNELS]; SCANS_PER_SAMPLE];
        for (index, scan) in scans.iter_mut().enumerate() {
            self.arm_um += self.arm_mm_s / SCANS_PER_SAMPLE as f32;
            let hum_turn = (within as f32 + index as f32 / SCANS_PER_SAMPLE as f32) * 0.05;
            let hum = scene.hum_lsb * sine(hum_turn);
            for gauge in 0..GAUGES {
                let place_mm = self.arm_um * 1e-3 + PLACES_MM[gauge];
                let specimen = floor(place_mm / SPECIMEN_MM) as i32 & 1;
                let wavelength_mm = scene.wavelengths_mm[specimen as usize];
                let felt = AMPLITUDES_LSB[gauge] * sine(place_mm / wavelength_mm);
                scan[gauge] = code(felt + hum + self.noise(scene.noise_lsb));
            }
            let rubs = if self.arm_mm_s < 0.0 { -300.0 } else { 300.0 };
            let sticks = 80.0 * sine(self.arm_um * 2e-4);
            scan[GAUGES] = code(rubs + sticks + self.noise(10.0));
            if scene.trouble == Trouble::Gauges && within >= SAMPLES_PER_SCENE / 4 {
                scan[0] = 4_095;
                scan[1] = MID_RAIL_CODE;
                scan[3] = 0;
            }
        }
        (scans, counts(self.arm_um))
    }

    fn sense(&mut self, now_us: u64, scans: &[Scan; SCANS_PER_SAMPLE], arm: u16) {
        let felt = self.sensor.step(now_us, scans, arm);
        self.drive = felt.drive;
        self.hashes.sensor.bytes(&felt.drive.duty.to_le_bytes());
        self.hashes.sensor.bytes(&[u8::from(felt.drive.forward)]);
        if let Some(estimate) = felt.estimate {
            let method = self.sensor.configuration().method as usize;
            self.met.valid[method] += u32::from(estimate.valid);
            let is_well = estimate.health == [protocol::GaugeHealth::Good; GAUGES];
            self.met.unwell += u32::from(!is_well);
            self.hashes.sensor.text(&estimate);
            self.sensors_end.post(&Message::Estimate(estimate));
        }
        if let Some(gauges) = felt.gauges {
            self.hashes.sensor.text(&gauges);
            self.sensors_end.post(&Message::Gauges(gauges));
        }
    }

    fn show(&mut self, scene: &Scene, within: u32, now_us: u64, hand: u16) {
        if scene.trouble == Trouble::Stop && within == SAMPLES_PER_SCENE / 2 {
            self.display.stop(StopReason::Operator);
            self.sensor.stop(Trip::Operator);
        }
        for tick in 0..TICKS_PER_SAMPLE {
            let mut senses = Senses::default();
            // Once in a while, at the first tick of a sample.
            if tick == 0 && within > 500 {
                match scene.trouble {
                    Trouble::Ticks => {
                        senses.missed_ticks = u32::from(within.is_multiple_of(97));
                        senses.clear_fell = within.is_multiple_of(1_501);
                        senses.is_clear = senses.clear_fell;
                        if within.is_multiple_of(61) {
                            senses.transfer = Transfer::Failed;
                        }
                    }
                    Trouble::Converter if within >= SAMPLES_PER_SCENE / 2 => {
                        senses.readback = Readback::Differs;
                    }
                    _ if within.is_multiple_of(10) => senses.readback = Readback::Agrees,
                    _ => {}
                }
            }
            let output = self.display.tick(hand, &senses);
            let hash = &mut self.hashes.display;
            hash.bytes(&[u8::from(output.send), u8::from(output.release)]);
            for word in self.display.words() {
                hash.bytes(&word.to_le_bytes());
            }
            match self.display.state() {
                DisplayState::Driving => self.met.driving += 1,
                DisplayState::Fading(_) => self.met.fading += 1,
                DisplayState::Stopped(trip) => {
                    self.met.stopped += 1;
                    let trips = &mut self.met.trips;
                    if !trips.contains(&Some(trip))
                        && let Some(free) = trips.iter_mut().find(|kept| kept.is_none())
                    {
                        *free = Some(trip);
                    }
                }
                _ => {}
            }
            if let Some(motion) = self.display.motion(now_us) {
                hash.text(&motion);
                self.displays_end.post(&Message::Motion(motion));
            }
        }
        if within.is_multiple_of(100) {
            self.hashes.display.text(&self.display.state());
        }
    }

    /// What waits at either end goes over the line to the other one.
    fn exchange(&mut self, scene: &Scene, within: u32, now_us: u64) {
        let mut wire = [0; WIRE_BYTES];
        let count = self.carry(true, scene.trouble, within, now_us, &mut wire);
        let (display, hashes) = (&mut self.display, &mut self.hashes);
        let times = if scene.trouble == Trouble::Echo { 3 } else { 1 };
        self.displays_end
            .receive(now_us, &wire[..count], |message| {
                hashes.wire.text(&message);
                if let Message::Estimate(estimate) = message {
                    for _ in 0..times {
                        display.on_estimate(&estimate);
                    }
                }
            });
        let count = self.carry(false, scene.trouble, within, now_us, &mut wire);
        let (sensor, hashes) = (&mut self.sensor, &mut self.hashes);
        self.sensors_end.receive(now_us, &wire[..count], |message| {
            hashes.wire.text(&message);
            if let Message::Motion(motion) = message {
                sensor.on_motion(&motion);
            }
        });
    }

    /// The bytes from one end, as they come to the other; returns how many.
    fn carry(
        &mut self,
        to_display: bool,
        trouble: Trouble,
        within: u32,
        now_us: u64,
        wire: &mut [u8; WIRE_BYTES],
    ) -> usize {
        let from = if to_display {
            &mut self.sensors_end
        } else {
            &mut self.displays_end
        };
        from.poll(now_us);
        // As many as the line carries in a millisecond.
        let mut count = from.take(&mut wire[..92]);
        self.hashes.wire.bytes(&wire[..count]);
        let middle = SAMPLES_PER_SCENE / 4..SAMPLES_PER_SCENE * 5 / 8;
        match trouble {
            Trouble::Silence if middle.contains(&within) => count = 0,
            Trouble::Line => {
                let draw = self.draw();
                let place = (draw >> 8) as usize % count.max(1);
                match draw & 0x3F {
                    0 if count > 0 => wire[place] ^= 1 << (draw >> 29),
                    1 if count > 0 => {
                        wire.copy_within(place + 1..count, place);
                        count -= 1;
                    }
                    2 => {
                        wire.copy_within(place..count, place + 1);
                        wire[place] = draw.to_le_bytes()[3];
                        count += 1;
                    }
                    _ => {}
                }
            }
            _ => {}
        }
        count
    }

    /// Evenly spread, by `most` at most.
    fn noise(&mut self, most: f32) -> f32 {
        let draw = (self.draw() >> 16) as i32 - 32_768;
        most * draw as f32 / 32_768.0
    }

    /// Marsaglia's xorshift.
    fn draw(&mut self) -> u32 {
        self.dice ^= self.dice << 13;
        self.dice ^= self.dice >> 17;
        self.dice ^= self.dice << 5;
        self.dice
    }
}

impl Default for Rehearsal {
    fn default() -> Self {
        Self::new()
    }
}

/// An encoder's counter.
fn counts(place_um: f32) -> u16 {
    floor(place_um / MICROMETRES_PER_COUNT as f32) as i32 as u16
}

/// An ADC code, that far from mid-rail.
fn code(steps: f32) -> u16 {
    (f32::from(MID_RAIL_CODE) + steps).clamp(0.0, 4_095.0) as u16
}

/// To the next whole number below, of what an i32 holds.
fn floor(value: f32) -> f32 {
    let whole = value as i32 as f32;
    if whole > value { whole - 1.0 } else { whole }
}

/// Of an angle in turns, to a thousandth: two parabolas, and the better one of their sum with its square.
fn sine(turns: f32) -> f32 {
    let x = 2.0 * (turns - floor(turns)) - 1.0;
    let size = |x: f32| if x < 0.0 { -x } else { x };
    let rough = 4.0 * x * (size(x) - 1.0);
    0.225 * (rough * size(rough) - rough) + rough
}

/// FNV-1a of 64 bits.
#[derive(Clone, Copy)]
struct Hash(u64);

impl Default for Hash {
    fn default() -> Self {
        Self(0xCBF2_9CE4_8422_2325)
    }
}

impl Hash {
    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
        }
    }

    /// Every field of it: what `Debug` writes of an `f32` tells its bits.
    fn text(&mut self, what: &impl Debug) {
        // A hash takes any text.
        let _ = write!(self, "{what:?}");
    }
}

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.bytes(text.as_bytes());
        Ok(())
    }
}
