//! The hand turns back, and the surface changes under it: no jolt, and the wave is played back.

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use firmware_display::balance::{TIME_CONSTANT_S, WORKING_S};
use hil_sim_boards::display_alone;
use hil_sim_boards::display_alone::DisplayBench;
use hil_sim_core::run::recording::{ACTUATORS, Recording, WORD_V, volts};
use hil_sim_core::scene::Scene;
use tests::elves;
use tests::run::{Run, scene, scene_in};

/// Okamoto et al. 2009, Fig. 7, over the boundary of Fig. 8.
static TO_AND_FRO: LazyLock<Run> = LazyLock::new(|| {
    Run::of(scene(
        r#"
        duration_s = 3.0

        [surface]
        specimens = [
          { wavelength_mm = 1.0, length_mm = 13.0 },
          { wavelength_mm = 4.0 },
        ]

        [motion]
        kind = "sinusoid"
        amplitude_mm_s = 70.0
        frequency_hz = 0.83
        "#,
    ))
});

/// When the hand turns that both boards are under, in ns.
const TURN_NS: u64 = 1_000_000_000;

/// A hand that goes out at 50 mm/s and turns at `turn_s`, over 2 mm. It comes back at 35 mm/s until `end_s`,
/// so that the ticks of the way back meet all of the five counts between two of the way out.
fn back_and_slower(turn_s: f64, end_s: f64) -> Scene {
    let name = format!("reversal-{turn_s}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    let out_mm = 50.0 * turn_s;
    let back_mm = out_mm - 35.0 * (end_s - turn_s);
    fs::write(
        folder.join("motion.csv"),
        format!("t_s,x_mm\n0,0\n{turn_s},{out_mm}\n{end_s},{back_mm}\n"),
    )
    .unwrap();
    scene_in(
        &folder,
        &format!(
            r#"
            duration_s = {end_s}

            [surface]
            specimens = [{{ wavelength_mm = 2.0 }}]

            [motion]
            kind = "recorded"
            file = "motion.csv"

            [estimator]
            method = "counting"
            "#
        ),
    )
}

/// When the hand turns that goes [`far_and_back`], in s and ns.
const FAR_S: f64 = 2.8;
const FAR_NS: u64 = (FAR_S * 1e9) as u64;

/// The display's ELF under a hand that goes far enough either way for all charge to be worked off, while
/// it is told one and the same λ.
fn far_and_back() -> &'static Recording {
    static RUN: LazyLock<Recording> = LazyLock::new(|| {
        let scene = back_and_slower(FAR_S, 4.5);
        let alone = DisplayBench::new(scene.motion, 2.0, scene.duration_s);
        display_alone::run(alone, &elves::both().display)
            .unwrap()
            .recording
    });
    &RUN
}

/// How long after a reversal, or a start, the balance lets the wave alone again. Room is given and taken
/// with 16 ms, by a speed that is averaged over 4 ms: after five times both a hundredth is left of either.
const WORKED_OFF_S: f64 = WORKING_S as f64 + SOFTLY_S;
const SOFTLY_S: f64 = 0.1;

/// The words of the way out of [`far_and_back`] by the hand's counter, from when on the balance lets the
/// wave alone: by the second look, 0.2 s each, it has got on.
fn words_of_the_way_out(words: &[(u64, u16, [u16; ACTUATORS])]) -> HashMap<u16, [u16; ACTUATORS]> {
    let from_ns = after(words[0].0, 0.4 + WORKED_OFF_S);
    words
        .iter()
        .filter(|(at_ns, ..)| (from_ns..FAR_NS).contains(at_ns))
        .map(|&(_, encoder, words)| (encoder, words))
        .collect()
}

fn after(from_ns: u64, s: f64) -> u64 {
    from_ns + (s * 1e9) as u64
}

/// For each tick its instant, the hand's counter, and the words that came of it.
fn words_at_ticks(recording: &Recording) -> Vec<(u64, u16, [u16; ACTUATORS])> {
    let ends_ns = recording.ticks.iter().skip(1).map(|next| next.at_ns);
    let outputs = &recording.outputs;
    recording
        .ticks
        .iter()
        .zip(ends_ns)
        .filter_map(|(tick, end_ns)| {
            let last = outputs.partition_point(|output| output.at_ns < end_ns);
            let output = outputs.get(last.checked_sub(1)?)?;
            Some((tick.at_ns, tick.encoder, output.words))
        })
        .collect()
}

#[test]
fn no_step_is_larger_than_the_largest_natural_one_across_reversals_and_boundaries() {
    let actuators = &TO_AND_FRO.verdict.actuators;
    let (step_v, natural_v) = (
        actuators.max_step_v.unwrap(),
        actuators.natural_step_v.unwrap(),
    );
    assert!(step_v <= natural_v, "{step_v} V of {natural_v} V");
    // Both specimens were felt, so both kinds of change are within.
    let felt = |low_mm: f32, high_mm: f32| {
        TO_AND_FRO.recording.estimates.iter().any(|record| {
            let estimate = &record.estimate;
            let in_range = |mm: f32| (low_mm..high_mm).contains(&mm);
            estimate.valid && estimate.wavelength_mm.is_some_and(in_range)
        })
    };
    assert!(felt(0.8, 1.25) && felt(3.2, 5.0));
}

#[test]
fn the_actuators_vibrate_at_full_amplitude_in_step_with_the_hand() {
    let actuators = &TO_AND_FRO.verdict.actuators;
    let (measured_hz, due_hz) = (actuators.frequency_hz.unwrap(), actuators.truth_hz.unwrap());
    // Within one stroke of at most 27 cycles an encoder count of 5 µm at either end is 0.04 %.
    assert!(
        (measured_hz / due_hz - 1.0).abs() <= 1e-3,
        "{measured_hz} Hz, due {due_hz} Hz"
    );
    let highest = TO_AND_FRO
        .recording
        .outputs
        .iter()
        .flat_map(|output| output.words)
        .max();
    // 5 V less the sine's fall half a tick beside its crest: cos(π · 70 Hz · 500 µs) at 1 mm.
    let crest = 32_768.0 * (std::f64::consts::PI * 70.0 * 500e-6).cos();
    assert!(
        f64::from(highest.unwrap()) - 32_768.0 >= crest,
        "{highest:?}"
    );
    // Every change of λ̂, and there are 80 a second, may leave half a count, of 0.005 cycles at 1 mm.
    let rms = actuators.phase_error_rms_cycles.unwrap();
    assert!(rms <= 0.0025 * 240f64.sqrt(), "{rms} cycles");
}

#[test]
fn hand_movement_is_at_the_outputs_within_a_millisecond() {
    let p99_ms = TO_AND_FRO.verdict.actuators.hand_to_output_p99_ms.unwrap();
    assert!(p99_ms <= 1.0, "{p99_ms} ms");
}

#[test]
fn all_channels_change_on_one_edge_to_one_voltage() {
    assert!(TO_AND_FRO.recording.outputs.len() > 4_000);
    for output in &TO_AND_FRO.recording.outputs {
        assert_eq!(output.skew_ns, 0, "{output:?}");
        assert!(
            output.words.iter().all(|word| *word == output.words[0]),
            "{output:?}"
        );
    }
}

/// The phase comes back to the bit (firmware-display's own tests); what differs is what is taken off against
/// a standing voltage after a reversal: charge over τ, of which a sine of ω goes through 2/ω on either way.
#[test]
fn a_reversed_stroke_plays_the_wave_back_with_what_the_sensor_says() {
    let run = Run::of(back_and_slower(1.0, 1.3));
    // At 50 mm/s 2 mm are counted without an error. λ̂ settles to 2 mm on the way out, and stays in force on the way back until the next valid
    // estimate, which T2 keeps away for the length of a window.
    let valid = |from_ns: u64, to_ns: u64| {
        run.recording.estimates.iter().filter(move |record| {
            let received_ns = record.received_ns.unwrap_or(u64::MAX);
            record.estimate.valid && (from_ns..to_ns).contains(&received_ns)
        })
    };
    let settled_ns = TURN_NS * 6 / 10;
    // A velocity is taken over 16 ms: at 50 mm/s out and 35 mm/s back it has the sign of the way out for
    // 16 · 50/85 ms more. An estimate of then arrives 1.5 ms later at most: a cable of 0.5 ms, and its
    // frame of half a millisecond behind what may be on the line.
    let still_out_ns = TURN_NS + 11_000_000;
    let in_force_mm = valid(0, settled_ns)
        .next_back()
        .unwrap()
        .estimate
        .wavelength_mm;
    assert!(
        in_force_mm.is_some_and(|mm| (mm - 2.0).abs() < 0.01),
        "{in_force_mm:?}"
    );
    let others: Vec<_> = valid(settled_ns, still_out_ns)
        .filter(|record| record.estimate.wavelength_mm != in_force_mm)
        .collect();
    assert!(others.is_empty(), "in force {in_force_mm:?}: {others:?}");
    let next = valid(still_out_ns, u64::MAX).next();
    let end_ns = next.map_or(u64::MAX, |record| record.received_ns.unwrap());
    assert!(end_ns >= TURN_NS + 80_000_000, "{next:?}");

    let words = words_at_ticks(&run.recording);
    let out: HashMap<u16, [u16; ACTUATORS]> = words
        .iter()
        .filter(|(at_ns, ..)| (settled_ns..TURN_NS).contains(at_ns))
        .map(|&(_, encoder, words)| (encoder, words))
        .collect();
    // 25 Hz on the way out, 17.5 Hz back.
    let swing_s = |hz: f64| 2.0 / (std::f64::consts::TAU * hz);
    let taken_v = 5.0 * (swing_s(25.0) + swing_s(17.5)) / TIME_CONSTANT_S;
    let mut played_back = 0;
    for (at_ns, encoder, back) in &words {
        if (TURN_NS..end_ns).contains(at_ns)
            && let Some(out) = out.get(encoder)
        {
            for (out, back) in out.iter().zip(back) {
                let apart_v = (volts(*out) - volts(*back)).abs();
                assert!(
                    apart_v <= taken_v,
                    "at {at_ns} ns, encoder {encoder}: {apart_v} V apart, {taken_v} V taken"
                );
            }
            played_back += 1;
        }
    }
    // 3.5 counts a tick, one of five of which was met on the way out: 160 ticks, some 32.
    assert!(played_back >= 25, "{played_back} ticks compared");
}

#[test]
fn a_reversed_stroke_plays_the_wave_back_word_for_word_once_its_charge_is_worked_off() {
    let words = words_at_ticks(far_and_back());
    let out = words_of_the_way_out(&words);
    let mut played_back = 0;
    for (at_ns, encoder, back) in &words {
        if *at_ns >= after(FAR_NS, WORKED_OFF_S)
            && let Some(out) = out.get(encoder)
        {
            assert_eq!(out, back, "at {at_ns} ns, encoder {encoder}");
            played_back += 1;
        }
    }
    // 575 ms of the way back, of which one tick in five meets a count of the way out.
    assert!(played_back >= 200, "{played_back} ticks compared");
}

/// Without any room y = s − q/τ (firmware-display's `balance`), where q is the integral of y so far, which
/// the words themselves tell; s is what is played back.
#[test]
fn meanwhile_it_does_but_for_the_charge_over_the_time_constant() {
    let words = words_at_ticks(far_and_back());
    let out = words_of_the_way_out(&words);
    let tick_s = 1.0 / f64::from(firmware_display::TICK_RATE_HZ);
    let (from_ns, to_ns) = (
        // The room is down to 4·10⁻⁶ of 0.4 V · τ.
        after(FAR_NS, 2.0 * SOFTLY_S),
        after(FAR_NS, WORKING_S.into()),
    );
    // Either word is rounded by half a step, and so is each of those that the charge is the sum of.
    let ticks = to_ns as f64 * 1e-9 / tick_s;
    let rounded_v = 0.5 * WORD_V * (2.0 + ticks * tick_s / TIME_CONSTANT_S);
    let highest_v = 5.0 - WORD_V;
    let mut charges_vs = [0.0; ACTUATORS];
    let (mut played_back, mut most_v) = (0, 0.0_f64);
    for (at_ns, encoder, back) in &words {
        let out = out
            .get(encoder)
            .filter(|_| (from_ns..to_ns).contains(at_ns));
        for (actuator, charge_vs) in charges_vs.iter_mut().enumerate() {
            let back_v = volts(back[actuator]);
            if let Some(out) = out {
                let taken_v = *charge_vs / TIME_CONSTANT_S;
                // There is no more than the range.
                let due_v = (volts(out[actuator]) - taken_v).clamp(-highest_v, highest_v);
                assert!(
                    (back_v - due_v).abs() <= rounded_v,
                    "at {at_ns} ns, encoder {encoder}: {back_v} V, {due_v} V due"
                );
                most_v = most_v.max(taken_v.abs());
            }
            *charge_vs += back_v * tick_s;
        }
        played_back += u32::from(out.is_some());
    }
    assert!(played_back >= 300, "{played_back} ticks compared");
    assert!(most_v >= 50.0 * rounded_v, "only {most_v} V were taken off");
}
