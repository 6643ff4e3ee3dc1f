//! The firmware's sensor on surfaces that strangers drew: what it said, and how sure it was.

use std::convert::Infallible;

use firmware_sensor::Sensor;
use protocol::SensorConfiguration;

use super::Tally;
use crate::jury::stranger::{Record, Trial};
use crate::study::Progress;

/// Slower than this, in mm/s, the arm rests.
const MOVING_MM_S: f32 = 5.0;

/// What came of each surface, in the seeds' order.
pub fn ask(seeds: &[u64], sensor: SensorConfiguration, progress: &impl Progress) -> Vec<Tally> {
    progress.begin(seeds.len());
    let Ok(tallies) = progress.each(seeds, |&seed| {
        let trial = Trial::draw(seed);
        Ok::<_, Infallible>(listen(&trial, &trial.record(), sensor))
    });
    tallies
}

fn listen(trial: &Trial, record: &Record, sensor: SensorConfiguration) -> Tally {
    let mut tally = Tally::new(trial.class.name(), trial.class.has_a_period());
    let mut sensor = Sensor::new(sensor);
    for (ms, (scans, &encoder)) in record.scans.iter().zip(&record.encoder).enumerate() {
        let output = sensor.step(1_000 * (ms as u64 + 1), scans, encoder);
        let Some(estimate) = output.estimate else {
            continue;
        };
        let (speed_mm_s, truth_mm) = (record.speed_mm_s[ms].abs(), record.truth_mm[ms]);
        let has_a_period = truth_mm > 0.0;
        // While a boundary is under the gauges, there are two truths.
        if speed_mm_s <= MOVING_MM_S || (has_a_period && record.travelled_mm[ms] == 0.0) {
            continue;
        }
        let error = |wavelength_mm: f32| match has_a_period {
            true => f64::from(wavelength_mm / truth_mm) - 1.0,
            false => f64::INFINITY,
        };
        let said = estimate
            .wavelength_mm
            .map(|mm| (estimate.confidence, error(mm)));
        if let Some((confidence, error)) = said {
            tally.heard(confidence, error);
        }
        if record.counts(ms) {
            tally.judged(said);
        }
    }
    tally
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_surface_is_asked_in_the_seeds_order_and_the_same_each_time() {
        let seeds = [1, 2, 3];
        let tallies = ask(&seeds, SensorConfiguration::DEFAULT, &());
        assert_eq!(tallies, ask(&seeds, SensorConfiguration::DEFAULT, &()));
        for (tally, &seed) in tallies.iter().zip(&seeds) {
            let class = Trial::draw(seed).class;
            assert_eq!(
                (tally.class, tally.has_a_period),
                (class.name(), class.has_a_period())
            );
            // What counts for the levels, with a λ, was heard while it moved, too.
            let said: u32 = tally.said.iter().sum();
            let heard: u32 = tally.bins.iter().map(|bin| bin.estimates).sum();
            assert!(said <= heard && said <= tally.counted);
        }
    }
}
