//! Whatever happens, in whatever order: 1 000 lives of up to 200 random events each.

use firmware_display::pace::{per_tick, quarters};
use firmware_display::{Display, Readback, Senses, Transfer, ZERO_VOLT};
use proptest::prelude::*;
use protocol::{
    Actuator, Contact, DEFAULT_ACTUATORS, DisplayConfiguration, DisplayState, Estimate, Friction,
    GAUGES, GaugeHealth, Hold, Mode, Partial, Range, Rendering, StopReason, Texture, Trip,
    UpdateRate,
};

use crate::rig::{SILENCE, settings};

const LIVES: u32 = 1_000;
const EVENTS: std::ops::Range<usize> = 20..200;
/// In which a lower amplitude is reached whatever estimates come meanwhile.
const AMPLITUDE_REACHED_MS: u32 = 250;
/// From a hold to 0 V, in ms, but for an estimate that is too old.
const QUICK_MS: u32 = 8;

#[derive(Clone, Debug)]
enum Event {
    /// The hand moves by so many counts a tick.
    Ticks {
        counts: i16,
        times: u8,
    },
    /// The hand's encoder is somewhere else.
    Jump(u16),
    Estimate(Estimate),
    Texture(Texture),
    Configure(DisplayConfiguration, Models),
    Stop(StopReason),
    Senses(Senses),
    Started,
}

/// Resonance and damping of the actuators with even and with odd numbers.
type Models = [(u16, u16); 2];

fn models() -> impl Strategy<Value = Models> {
    let model = || {
        prop_oneof![
            2 => Just((0, 100)),
            1 => (200..=20_000_u16, 20..=1_000_u16),
        ]
    };
    [model(), model()]
}

fn modelled(models: &Models) -> [Actuator; 50] {
    let mut actuators = DEFAULT_ACTUATORS;
    for (index, actuator) in actuators.iter_mut().enumerate() {
        (actuator.resonance_dhz, actuator.damping_percent) = models[index % 2];
    }
    actuators
}

/// Numbers in their range, or any.
fn thousandths() -> impl Strategy<Value = u16> {
    prop_oneof![10 => 0..=1_500_u16, 5 => 0..=10_000_u16, 1 => any::<u16>()]
}

prop_compose! {
    fn texture()(
        sequence in prop_oneof![0..400_u32, any::<u32>()],
        instant_us in any::<u64>(),
        valid in prop::bool::weighted(0.8),
        ratios in [thousandths(), thousandths()],
        phases in any::<[u16; 2]>(),
        repeating_percent in prop_oneof![9 => 0..=100_u8, 1 => any::<u8>()],
        bands in [thousandths(), thousandths(), thousandths(), thousandths()],
        friction in any::<Option<(u16, u16)>>(),
    ) -> Texture {
        Texture {
            sequence,
            instant_us,
            valid,
            partials: std::array::from_fn(|n| Partial { ratio: ratios[n], phase: phases[n] }),
            repeating_percent,
            bands,
            friction: friction.map(|(mean_mn, fluctuation_mn)| Friction { mean_mn, fluctuation_mn }),
        }
    }
}

fn wavelength() -> impl Strategy<Value = Option<f32>> {
    prop_oneof![
        6 => Just(Some(2.0)),
        3 => (0.1_f32..50.0).prop_map(Some),
        1 => any::<f32>().prop_map(Some),
        1 => Just(None),
    ]
}

prop_compose! {
    fn estimate()(
        sequence in prop_oneof![0..2_000_u32, any::<u32>()],
        wavelength_mm in wavelength(),
        valid in prop::bool::weighted(0.8),
        instant_us in any::<u64>(),
        amplitude_lsb in prop_oneof![9 => 0.0..2_000.0_f32, 1 => any::<f32>()],
        confidence in prop_oneof![9 => 0.0..=1.0_f32, 1 => any::<f32>()],
        counted_mm in any::<Option<f32>>(),
        velocity_um_s in prop_oneof![9 => -100_000..100_000, 1 => any::<i32>()],
        lag_um in any::<Option<i32>>(),
        gauges_used in prop_oneof![9 => 1..32_u8, 1 => any::<u8>()],
    ) -> Estimate {
        Estimate {
            sequence,
            instant_us,
            wavelength_mm,
            valid,
            confidence,
            amplitude_lsb,
            counted_mm,
            range: Range::T2,
            contact: Contact::Stick,
            velocity_um_s,
            lag_um,
            gauges_used,
            health: [GaugeHealth::Noisy; GAUGES],
        }
    }
}

prop_compose! {
    fn configuration()(
        travelling in any::<bool>(),
        rendering in prop::sample::select(vec![
            Rendering::Fundamental, Rendering::Shape, Rendering::Texture,
        ]),
        fast in any::<bool>(),
        max_age_ms in 20..=5_000_u16,
        fade_in_ms in 1..=1_000_u16,
        fade_out_ms in 1..=1_000_u16,
        glide_ms in 0..=500_u16,
        amplitude_mv in 0..=5_000_u16,
        reference_lsb in 0..=2_000_u16,
        reference_mn in prop_oneof![Just(0), 0..=60_000_u16],
        full_drive_s in 10..=3_600_u16,
    ) -> DisplayConfiguration {
        DisplayConfiguration {
            mode: if travelling { Mode::Travelling } else { Mode::Uniform },
            rendering,
            update_rate: if fast { UpdateRate::Hz4000 } else { UpdateRate::Hz2000 },
            max_age_ms,
            fade_in_ms,
            fade_out_ms,
            glide_ms,
            amplitude_mv,
            reference_lsb,
            reference_mn,
            full_drive_s,
            ..DisplayConfiguration::DEFAULT
        }
    }
}

prop_compose! {
    /// Rare enough for other things to happen before they stop the display.
    fn senses()(
        stop_input_open in prop::bool::weighted(0.1),
        alarm in prop::bool::weighted(0.1),
        transfer in prop_oneof![
            8 => Just(Transfer::Done), 1 => Just(Transfer::Failed), 1 => Just(Transfer::Stalled)
        ],
        clear_fell in prop::bool::weighted(0.2),
        readback in prop_oneof![
            8 => Just(Readback::None), 8 => Just(Readback::Agrees), 1 => Just(Readback::Differs)
        ],
        unheard in prop::bool::weighted(0.1),
        missed_ticks in prop_oneof![8 => Just(0), 1 => 0..10_u32, 1 => any::<u32>()],
    ) -> Senses {
        Senses { stop_input_open, alarm, transfer, clear_fell, is_clear: clear_fell, readback, unheard, missed_ticks }
    }
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        // No faster than 2 m/s at 4 kHz.
        400 => (-100..=100_i16, 1..60_u8).prop_map(|(counts, times)| Event::Ticks { counts, times }),
        100 => (-8..=8_i16, 1..60_u8).prop_map(|(counts, times)| Event::Ticks { counts, times }),
        300 => estimate().prop_map(Event::Estimate),
        100 => texture().prop_map(Event::Texture),
        50 => (configuration(), models()).prop_map(|(configuration, models)| {
            Event::Configure(configuration, models)
        }),
        50 => senses().prop_map(Event::Senses),
        20 => Just(Event::Started),
        2 => any::<u16>().prop_map(Event::Jump),
        1 => Just(Event::Stop(StopReason::Operator)),
        1 => Just(Event::Stop(StopReason::Host)),
    ]
}

/// The largest offset from 0 V that an amplitude allows, in DAC steps.
fn allowed(amplitude_mv: u16) -> u16 {
    (f64::from(amplitude_mv) * 65_536.0 / 10_000.0)
        .round()
        .min(32_767.0) as u16
}

/// A display, and what it has promised.
struct Watched {
    display: Display,
    encoder: u16,
    stop_asked: bool,
    /// The amplitude before the last change, in force until it is reached.
    before_mv: u16,
    since_change: u32,
    /// The same, and since a quick hold began, in quarters of a millisecond.
    since_hold: u32,
    ticks: u32,
}

impl Watched {
    fn new(start: &DisplayConfiguration, models: &Models) -> Self {
        Self {
            display: Display::new(&settings(start, &modelled(models)), None),
            encoder: 0,
            stop_asked: false,
            before_mv: start.amplitude_mv,
            since_change: u32::MAX,
            since_hold: 0,
            ticks: 0,
        }
    }

    fn undergo(&mut self, event: &Event) -> Result<(), TestCaseError> {
        match event {
            Event::Estimate(estimate) => self.display.on_estimate(estimate),
            Event::Texture(texture) => self.display.on_texture(texture),
            Event::Started => self.display.started(Ok(())),
            Event::Stop(reason) => {
                self.display.stop(*reason);
                self.stop_asked = true;
            }
            Event::Configure(configuration, models) => {
                // Until a change is through, the largest of those under way counts.
                let now_mv = self.display.configuration().amplitude_mv;
                let under_way = self.since_change < quarters(AMPLITUDE_REACHED_MS);
                self.before_mv = if under_way {
                    self.before_mv.max(now_mv)
                } else {
                    now_mv
                };
                self.since_change = 0;
                self.display
                    .configure(&settings(configuration, &modelled(models)));
            }
            Event::Jump(counter) => {
                self.encoder = *counter;
                self.tick(&Senses::default())?;
            }
            Event::Senses(senses) => self.tick(senses)?,
            Event::Ticks { counts, times } => {
                for _ in 0..*times {
                    self.encoder = self.encoder.wrapping_add_signed(*counts);
                    self.tick(&Senses::default())?;
                }
            }
        }
        Ok(())
    }

    fn tick(&mut self, senses: &Senses) -> Result<(), TestCaseError> {
        let before = self.display.state();
        let words_before = *self.display.words();
        // Of the period that ends with this tick.
        let passed = per_tick(self.display.rate());
        let output = self.display.tick(self.encoder, senses);
        self.ticks += 1;
        let state = self.display.state();
        let words = *self.display.words();

        // Stopped is for good, for the first reason, and means 0 V in this very tick; a Stop is obeyed.
        let is_stopped = matches!(state, DisplayState::Stopped(_));
        if matches!(before, DisplayState::Stopped(_)) {
            prop_assert_eq!(state, before);
        } else if is_stopped {
            prop_assert!(output.send, "0 V is sent");
        }
        prop_assert!(is_stopped || !self.stop_asked);
        // The stimulus breaks no limit by itself, whatever it is told.
        prop_assert_ne!(state, DisplayState::Stopped(Trip::Limit));
        prop_assert_ne!(state, DisplayState::Stopped(Trip::Memory));
        // CLR is held off only where something may be driven.
        prop_assert_eq!(output.release, !is_stopped && state != DisplayState::Boot);
        if !matches!(state, DisplayState::Driving | DisplayState::Fading(_)) {
            prop_assert_eq!(words, SILENCE, "{:?}", state);
        }

        // A quick hold is through in time; it may begin anew only out of Driving.
        let quick = matches!(state, DisplayState::Fading(hold) if hold != Hold::Stale);
        self.since_hold = if quick { self.since_hold + passed } else { 0 };
        prop_assert!(self.since_hold < quarters(QUICK_MS));

        // No word is beyond the amplitude, and none changes without being sent.
        self.since_change = self.since_change.saturating_add(passed);
        let now_mv = self.display.configuration().amplitude_mv;
        let under_way = self.since_change < quarters(AMPLITUDE_REACHED_MS);
        let most = allowed(if under_way {
            now_mv.max(self.before_mv)
        } else {
            now_mv
        });
        for word in words {
            prop_assert!(
                word.abs_diff(ZERO_VOLT) <= most,
                "{word:#x}, allowed {most}"
            );
        }
        prop_assert!(output.send || words == words_before, "changed but not sent");
        prop_assert_eq!(self.display.counters().ticks, self.ticks);
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: LIVES, ..ProptestConfig::default() })]

    #[test]
    fn no_promise_is_broken(
        start in configuration(),
        models in models(),
        events in prop::collection::vec(event(), EVENTS),
    ) {
        let mut watched = Watched::new(&start, &models);
        watched.undergo(&Event::Started)?;
        for event in &events {
            watched.undergo(event)?;
        }
    }
}

proptest! {
    #[test]
    fn the_same_calls_give_the_same_words(
        start in configuration(),
        models in models(),
        events in prop::collection::vec(event(), EVENTS),
    ) {
        let mut watched = [Watched::new(&start, &models), Watched::new(&start, &models)];
        for event in &events {
            for watched in &mut watched {
                watched.undergo(event)?;
            }
            let [one, other] = &watched;
            prop_assert_eq!(one.display.words(), other.display.words());
            prop_assert_eq!(one.display.counters(), other.display.counters());
        }
    }
}
