//! What a recording has to export: the gauges' samples, over time and over the arm's way.

use std::ops::Range;
use std::path::Path;

use firmware_sensor::SAMPLE_RATE_HZ;
use protocol::GAUGES;

use super::of_scene::{GAUGE_KEYS, GAUGE_SCALE, PLACE_KEYS, PLACE_SCALE};
use super::texture::{Made, Trace};
use super::{Along, ExportError, Group, Samples, Settings};
use crate::recording::row::GaugeRow;
use crate::replay::scene::SceneError as ExcerptError;
use crate::replay::scene::excerpt::Excerpt;

const MID_CODE: i32 = 32_768;
const AT_SAMPLES: Along = Along::Time {
    rate_hz: SAMPLE_RATE_HZ,
};

/// The gauges, the force if there is one, and the arm's place, over time. Fails if the arm is too far from its
/// start.
pub fn groups(excerpt: &Excerpt, path: &Path) -> Result<Vec<Group>, ExportError> {
    let samples = &excerpt.samples;
    let code = |code: u16| (i32::from(code) - MID_CODE) as i16;
    let mut gauges = Vec::with_capacity(samples.len() * GAUGES);
    let mut forces = Vec::with_capacity(samples.len());
    let mut places = Vec::with_capacity(samples.len());
    for sample in samples {
        let [all @ .., force] = sample.codes();
        gauges.extend(all.map(code));
        forces.push(code(force));
        let far = |_| ExportError::Far {
            path: path.to_owned(),
            position_um: sample.position_um,
        };
        places.push(i32::try_from(sample.position_um).map_err(far)?);
    }
    let mut groups = vec![Group {
        name: "gauges",
        along: AT_SAMPLES,
        channels: GAUGES as u16,
        full_scale: GAUGE_SCALE.to_owned(),
        // They come from behind the sensor's filter.
        keys: Some(("gauges", format!("{GAUGE_KEYS}filtered = true\n"))),
        samples: Samples::Bits16(gauges),
    }];
    if excerpt.sensor.is_some_and(|sensor| sensor.force_channel) {
        groups.push(Group {
            name: "force",
            along: AT_SAMPLES,
            channels: 1,
            full_scale: GAUGE_SCALE.to_owned(),
            keys: None,
            samples: Samples::Bits16(forces),
        });
    }
    groups.push(Group {
        name: "arm",
        along: AT_SAMPLES,
        channels: 1,
        full_scale: PLACE_SCALE.to_owned(),
        keys: Some(("motion", PLACE_KEYS.to_owned())),
        samples: Samples::Bits32(places),
    });
    Ok(groups)
}

/// The five gauges over the longest way that the arm goes in one direction. Fails if it rests.
pub fn texture(excerpt: &Excerpt, settings: &Settings) -> Result<Made, ExportError> {
    let samples = &excerpt.samples[longest_way(&excerpt.samples)];
    let places = samples.iter().map(|sample| sample.position_um);
    let (Some(low_um), Some(high_um)) = (places.clone().min(), places.max()) else {
        return Err(ExportError::Excerpt(ExcerptError::NoSamples {
            path: settings.from.clone(),
            count: 0,
        }));
    };
    if low_um == high_um {
        return Err(ExportError::AtRest(settings.from.clone()));
    }
    let traces = (0..GAUGES).map(|gauge| Trace {
        description: format!("gauge {gauge}"),
        gain: 1.0,
        per_metre: None,
        points: over_place(samples, low_um, gauge),
    });
    let begin_s = samples.first().map_or(0.0, |first| {
        let start = excerpt.samples.first().unwrap_or(first);
        excerpt.first_s + first.instant_us.saturating_sub(start.instant_us) as f64 * 1e-6
    });
    let description = format!(
        "gauges over the arm's way of {:.3} mm from {} mm on, {begin_s:.3} s after the recording's start by the board's clock, 1 is 1.65 V at the pin",
        high_um.abs_diff(low_um) as f64 * 1e-3,
        low_um as f64 * 1e-3,
    );
    let keys = format!(
        "channels = [{}]\nshift_mm = {:?}\n",
        GAUGES / 2,
        low_um as f64 * 1e-3
    );
    Ok(Made::new(
        &settings.date,
        description,
        traces.collect(),
        keys,
    ))
}

/// The samples of the longest way without a turn. A sample without travel turns nothing.
fn longest_way(samples: &[GaugeRow]) -> Range<usize> {
    let mut longest = 0..samples.len().min(1);
    let mut way = longest.clone();
    let mut forwards = None;
    let length = |way: &Range<usize>| match &samples[way.clone()] {
        [first, .., last] => last.position_um.abs_diff(first.position_um),
        _ => 0,
    };
    for (at, pair) in samples.windows(2).enumerate() {
        let travel_um = pair[1].position_um.saturating_sub(pair[0].position_um);
        let turned = travel_um != 0 && forwards.is_some_and(|forwards| forwards != (travel_um > 0));
        if turned {
            way.start = at;
        }
        if travel_um != 0 {
            forwards = Some(travel_um > 0);
        }
        way.end = at + 2;
        if length(&way) > length(&longest) {
            longest = way.clone();
        }
    }
    longest
}

/// What a gauge felt at each place of the encoder, in µm from `low_um` on: the mean where there are several samples.
fn over_place(samples: &[GaugeRow], low_um: i64, gauge: usize) -> Vec<(u64, f64)> {
    let mut points: Vec<(u64, f64, u32)> = Vec::with_capacity(samples.len());
    for sample in samples {
        let place_um = sample.position_um.abs_diff(low_um);
        let felt = f64::from(i32::from(sample.codes()[gauge]) - MID_CODE) / f64::from(MID_CODE);
        match points.last_mut() {
            Some((at, sum, count)) if *at == place_um => {
                *sum += felt;
                *count += 1;
            }
            _ => points.push((place_um, felt, 1)),
        }
    }
    // Backwards the places fall.
    if points.first() > points.last() {
        points.reverse();
    }
    points
        .into_iter()
        .map(|(at, sum, count)| (at, sum / f64::from(count)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples at these places, gauge 0 at a code of its index.
    fn samples(places_um: &[i64]) -> Vec<GaugeRow> {
        let mut rows = Vec::new();
        for (place_um, index) in places_um.iter().zip(0_u32..) {
            rows.push(GaugeRow {
                sample: index,
                block: 0,
                instant_us: 1_000 * u64::from(index),
                position_um: *place_um,
                travel_um: 0,
                g0_v: (32_768.0 + f64::from(index)) * 3.3 / 65_536.0,
                g1_v: 1.65,
                g2_v: 1.65,
                g3_v: 1.65,
                g4_v: 1.65,
                tangential_v: 1.65,
            });
        }
        rows
    }

    #[test]
    fn the_longest_way_ends_where_the_arm_turns() {
        let rows = samples(&[0, 10, 20, 15, 5, 5, -20, -10, 0]);
        // From the crest at 20 to the trough at −20, the rest at 5 included.
        assert_eq!(longest_way(&rows), 2..7);
        assert_eq!(longest_way(&samples(&[0, 0, 0])), 0..1);
        assert_eq!(longest_way(&[]), 0..0);
    }

    #[test]
    fn places_at_both_ends_of_their_numbers_are_no_trouble() {
        let rows = samples(&[i64::MIN, i64::MAX, i64::MIN]);
        assert_eq!(longest_way(&rows), 0..2);
        let points = over_place(&rows[..2], i64::MIN, 0);
        assert_eq!(points.last().map(|(at, _)| *at), Some(u64::MAX));
    }

    #[test]
    fn places_rise_and_samples_of_one_place_are_their_mean() {
        let step = 1.0 / 32_768.0;
        let rows = samples(&[20, 15, 5, 5, -20]);
        let points = over_place(&rows, -20, 0);
        let wanted = [(0, 4.0), (25, 2.5), (35, 1.0), (40, 0.0)];
        assert_eq!(points, wanted.map(|(at, codes)| (at, codes * step)));
    }
}
