//! What the sensor says of its contact and of its gauges, over time: a strip for each.

use std::ops::Range;

use protocol::{Contact, GAUGES, GaugeHealth};

use crate::output::plot::palette::{Colour, FIRST, QUIET, REFUSED, SECOND, SHADE};
use crate::output::plot::{Axis, Mark};
use crate::output::report::thin::{DOTS, stride};
use crate::output::report::{Chapter, Figure, draw};
use hil_sim_core::judge::JudgedEstimate;

/// From one estimate to the next, in s.
const ESTIMATE_S: f64 = 1.0 / firmware_sensor::ESTIMATE_RATE_HZ as f64;
/// Half the height of a strip; two neighbours are 1 apart.
const HALF: f64 = 0.36;

/// How a strip is filled, from the usual to what must not be overlooked, with its colour and meaning.
const OF_CONTACT: [(Colour, &str); 3] = [
    (SECOND, "slips"),
    (SHADE, "sticks"),
    (REFUSED, "sticks and slips in turn"),
];
const OF_GAUGES: [(Colour, &str); 3] = [
    (FIRST, "gauge takes part"),
    (QUIET, "sound but unused"),
    (REFUSED, "left out: dead, stuck, saturated, noisy or hum"),
];

/// The strips: the contact above, the gauges below.
pub fn figure(chapter: &Chapter) -> Figure {
    let estimates = &chapter.verdict.estimates;
    let top = GAUGES as f64;
    let gauges = (0..GAUGES).map(|gauge| (lane(gauge), format!("gauge {gauge}")));
    let labels = [(top, "contact".to_owned())].into_iter().chain(gauges);
    let y = Axis::named("", -0.5..top + 0.5, labels.collect());
    let contact = stretches(estimates, |e| of_contact(e.contact));
    let of_contact = |(kind, look)| (look, bars(&contact, kind, top));
    let of_gauges = |(kind, look)| {
        let bars = (0..GAUGES).flat_map(|gauge| {
            let stretches = stretches(estimates, |e| Some(of_gauge(e, gauge)));
            bars(&stretches, kind, lane(gauge))
        });
        (look, bars.collect())
    };
    let contact = OF_CONTACT.into_iter().enumerate().map(of_contact);
    let gauges = OF_GAUGES.into_iter().enumerate().map(of_gauges);
    let (legend, marks) = contact
        .chain(gauges)
        .filter(|(_, bars)| !bars.is_empty())
        .map(|(look, bars)| (look, Mark::Bars(look.0, bars)))
        .unzip();
    let mut note = String::from("Where there is no strip, the sensor cannot tell.");
    let nth = stride(estimates.len(), DOTS);
    if nth > 1 {
        note += &format!(" Of {nth} estimates the one that says most is drawn.");
    }
    let x = Axis::round("time in s", 0.0..chapter.recording.duration_s);
    Figure {
        title: "Contact and gauges, by the sensor's word".into(),
        legend,
        svg: draw(210.0, &x, &y, marks),
        note,
    }
}

fn lane(gauge: usize) -> f64 {
    (GAUGES - 1 - gauge) as f64
}

fn of_contact(contact: Contact) -> Option<usize> {
    match contact {
        Contact::Unknown => None,
        Contact::Slip => Some(0),
        Contact::Stick => Some(1),
        Contact::StickSlip => Some(2),
    }
}

fn of_gauge(estimate: &JudgedEstimate, gauge: usize) -> usize {
    let takes_part = estimate.gauges_used >> gauge & 1 == 1;
    match estimate.health[gauge] {
        GaugeHealth::Good if takes_part => 0,
        GaugeHealth::Good => 1,
        _ => 2,
    }
}

fn bars(
    stretches: &[(Range<f64>, usize)],
    kind: usize,
    height: f64,
) -> Vec<(Range<f64>, Range<f64>)> {
    let of_kind = stretches.iter().filter(|stretch| stretch.1 == kind);
    of_kind
        .map(|(stretch, _)| (stretch.clone(), height - HALF..height + HALF))
        .collect()
}

/// Stretches of time in s in which estimates say the same, as far as they say anything. Of more than
/// can be seen, the one that says most speaks for its neighbours.
pub fn stretches<T: Copy + Ord>(
    estimates: &[JudgedEstimate],
    say: impl Fn(&JudgedEstimate) -> Option<T>,
) -> Vec<(Range<f64>, T)> {
    let mut stretches: Vec<(Range<f64>, T)> = Vec::new();
    for group in estimates.chunks(stride(estimates.len(), DOTS)) {
        let (Some(first), Some(last)) = (group.first(), group.last()) else {
            continue;
        };
        let Some(said) = group.iter().filter_map(&say).max() else {
            continue;
        };
        // An estimate speaks for the time that led to it.
        let (from_s, to_s) = (first.t_s - ESTIMATE_S, last.t_s);
        match stretches.last_mut() {
            Some((stretch, before))
                if *before == said && from_s - stretch.end < 0.5 * ESTIMATE_S =>
            {
                stretch.end = to_s;
            }
            _ => stretches.push((from_s.max(0.0)..to_s, said)),
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim_core::judge::judge;
    use hil_sim_core::judge::synthetic::Run;
    use hil_sim_core::judge::truth::Truth;

    fn estimates(duration_s: f64) -> Vec<JudgedEstimate> {
        let run = Run {
            duration_s,
            ..Run::steady(50.0, 2.0)
        };
        judge(&Truth::new("", "", &*run.surface_mm), &run.record()).estimates
    }

    #[test]
    fn neighbours_that_say_the_same_are_one_stretch() {
        // 199 estimates from 0.01 s on, the first 50 silent, then 100 sticking, then slipping.
        let mut estimates = estimates(2.0);
        for (index, estimate) in estimates.iter_mut().enumerate() {
            estimate.contact = match index {
                ..50 => Contact::Unknown,
                50..150 => Contact::Stick,
                _ => Contact::Slip,
            };
        }
        let stretches = stretches(&estimates, |e| of_contact(e.contact));
        let said: Vec<_> = stretches.iter().map(|stretch| stretch.1).collect();
        assert_eq!(said, [1, 0]);
        for ((stretch, _), (from_s, to_s)) in stretches.iter().zip([(0.5, 1.5), (1.5, 1.99)]) {
            assert!((stretch.start - from_s).abs() < 1e-9, "{stretch:?}");
            assert!((stretch.end - to_s).abs() < 1e-9, "{stretch:?}");
        }
    }

    #[test]
    fn a_single_bad_estimate_is_seen_in_a_minute() {
        let mut estimates = estimates(60.0);
        estimates[3_001].health[4] = GaugeHealth::Noisy;
        let stretches = stretches(&estimates, |e| Some(of_gauge(e, 4)));
        assert_eq!(stretches.iter().filter(|stretch| stretch.1 == 2).count(), 1);
        assert_eq!(stretches.len(), 3);
    }

    #[test]
    fn a_gauge_that_is_sound_and_takes_no_part_is_told_from_one_that_is_left_out() {
        // Of the made-up run gauge 1 is dead and the others take part.
        let mut estimate = estimates(0.1)[0];
        assert_eq!(of_gauge(&estimate, 0), 0);
        assert_eq!(of_gauge(&estimate, 1), 2);
        estimate.gauges_used = 0;
        assert_eq!(of_gauge(&estimate, 0), 1);
    }
}
