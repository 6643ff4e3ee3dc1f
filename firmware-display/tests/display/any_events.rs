//! Whatever happens, in whatever order.

use firmware_display::{Display, ZERO_VOLT};
use proptest::prelude::*;
use protocol::{Contact, DisplayConfiguration, Estimate, GAUGES, GaugeHealth, Mode, Range};

/// Ticks in which a new amplitude is reached: 20 ms.
const AMPLITUDE_REACHED: u32 = 40;

#[derive(Clone, Debug)]
enum Event {
    Tick { counter: u16, times: u8 },
    Estimate(Estimate),
    Configure(DisplayConfiguration),
    Stop,
    Resend,
}

fn wavelength() -> impl Strategy<Value = Option<f32>> {
    prop_oneof![
        4 => (0.1_f32..50.0).prop_map(Some),
        1 => any::<f32>().prop_map(Some),
        1 => Just(None),
    ]
}

prop_compose! {
    fn estimate()(
        sequence in prop_oneof![0..2_000_u32, any::<u32>()],
        wavelength_mm in wavelength(),
        valid in any::<bool>(),
        instant_us in any::<u64>(),
        amplitude_lsb in any::<f32>(),
        confidence in any::<f32>(),
        counted_mm in any::<Option<f32>>(),
        velocity_um_s in any::<i32>(),
        lag_um in any::<Option<i32>>(),
        gauges_used in any::<u8>(),
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
        max_age_ms in 20..=5_000_u16,
        fade_in_ms in 1..=1_000_u16,
        fade_out_ms in 1..=1_000_u16,
        glide_ms in 0..=500_u16,
        amplitude_mv in 0..=5_000_u16,
        reference_lsb in 0..=2_000_u16,
    ) -> DisplayConfiguration {
        let mode = if travelling { Mode::Travelling } else { Mode::Uniform };
        DisplayConfiguration {
            mode,
            max_age_ms,
            fade_in_ms,
            fade_out_ms,
            glide_ms,
            amplitude_mv,
            reference_lsb,
            ..DisplayConfiguration::DEFAULT
        }
    }
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        40 => (any::<u16>(), 1..60_u8).prop_map(|(counter, times)| Event::Tick { counter, times }),
        30 => estimate().prop_map(Event::Estimate),
        5 => configuration().prop_map(Event::Configure),
        1 => Just(Event::Stop),
        2 => Just(Event::Resend),
    ]
}

/// The largest offset from 0 V that an amplitude allows, in DAC steps.
fn allowed(amplitude_mv: u16) -> u16 {
    (f64::from(amplitude_mv) * 65_536.0 / 10_000.0)
        .round()
        .min(32_767.0) as u16
}

proptest! {
    #[test]
    fn words_never_leave_the_amplitude(
        start in configuration(),
        events in prop::collection::vec(event(), 1..150),
    ) {
        let mut display = Display::new(start);
        let mut stopped = false;
        let mut before_mv = start.amplitude_mv;
        let mut ticks_since_change = u32::MAX;
        let mut last = *display.words();
        for event in events {
            match event {
                Event::Estimate(estimate) => display.on_estimate(&estimate),
                Event::Resend => display.resend(),
                Event::Stop => {
                    display.stop();
                    stopped = true;
                }
                Event::Configure(configuration) => {
                    // Until a change is through, the largest of those under way counts.
                    let under_way = ticks_since_change < AMPLITUDE_REACHED;
                    let now_mv = display.configuration().amplitude_mv;
                    before_mv = if under_way { before_mv.max(now_mv) } else { now_mv };
                    ticks_since_change = 0;
                    display.configure(configuration);
                }
                Event::Tick { counter, times } => {
                    for time in 0..u16::from(times) {
                        let sent = display.tick(counter.wrapping_add(time.wrapping_mul(counter % 13)));
                        ticks_since_change = ticks_since_change.saturating_add(1);
                        let now_mv = display.configuration().amplitude_mv;
                        let under_way = ticks_since_change < AMPLITUDE_REACHED;
                        let most = allowed(if under_way { now_mv.max(before_mv) } else { now_mv });
                        let most = if stopped { 0 } else { most };
                        for word in display.words() {
                            prop_assert!(word.abs_diff(ZERO_VOLT) <= most, "{word:#x}, allowed {most}");
                        }
                        prop_assert!(sent || *display.words() == last, "changed but not sent");
                        last = *display.words();
                    }
                }
            }
        }
    }

    #[test]
    fn the_same_calls_give_the_same_words(
        start in configuration(),
        events in prop::collection::vec(event(), 1..60),
    ) {
        let mut displays = [Display::new(start), Display::new(start)];
        for event in events {
            for display in &mut displays {
                match event.clone() {
                    Event::Estimate(estimate) => display.on_estimate(&estimate),
                    Event::Resend => display.resend(),
                    Event::Stop => display.stop(),
                    Event::Configure(configuration) => display.configure(configuration),
                    Event::Tick { counter, .. } => {
                        display.tick(counter);
                    }
                }
            }
            prop_assert_eq!(displays[0].words(), displays[1].words());
        }
    }
}
