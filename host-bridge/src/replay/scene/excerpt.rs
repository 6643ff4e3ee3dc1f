//! What a scene is made of, taken out of a recording.

use protocol::{DisplayConfiguration, Estimate, Gauges, Role, SensorConfiguration};

use super::{LONGEST_S, SceneError};
use crate::recording::reader::{ReadError, Reader};
use crate::recording::row::{GaugeRow, Row};

/// More samples than any scene has.
const MOST: usize = (LONGEST_S as usize + 1) * 1_000;
/// How much later than its time something is heard at most, in s.
const LATE_S: f64 = 10.0;

/// A piece of a recording.
#[derive(Default)]
pub struct Excerpt {
    pub samples: Vec<GaugeRow>,
    /// The time of the first of them, in s since the recording's start.
    pub first_s: f64,
    pub estimates: Vec<Estimate>,
    /// The sensor's configuration, if it was reported.
    pub sensor: Option<SensorConfiguration>,
    /// The display's.
    pub display: Option<DisplayConfiguration>,
    /// Whether the recording was cut off.
    pub cut: bool,
    /// Rows of an older protocol that say nothing in this version's.
    pub passed_over: u64,
}

/// A run of samples without a gap, by time in s.
#[derive(Clone, Copy)]
struct Run {
    from_s: f64,
    to_s: f64,
}

impl Run {
    const fn length_s(&self) -> f64 {
        self.to_s - self.from_s
    }
}

impl Excerpt {
    /// Takes what lies between two times, in s since the recording's start. Fails if the recording can't be read,
    /// has no samples there, more than a scene holds or a gap there, or if the sensor was configured otherwise
    /// meanwhile.
    pub fn take(mut recording: Reader, from_s: f64, to_s: f64) -> Result<Self, SceneError> {
        let path = recording.path().to_owned();
        let mut excerpt = Self::default();
        let mut runs: Vec<Run> = Vec::new();
        let mut gap_s = None;
        let mut has_all = false;
        loop {
            let entry = match recording.next_entry() {
                Ok(Some(entry)) => entry,
                Ok(None) => break,
                // What is damaged lies behind the piece.
                Err(ReadError::Damaged { .. }) if has_all => break,
                Err(error) => return Err(error.into()),
            };
            let at_s = recording.since_start_s(entry.log_ns);
            // In the order in which they were heard, not taken.
            if at_s > to_s + LATE_S {
                break;
            }
            if at_s > to_s {
                has_all |= matches!(entry.row, Row::Gauges(_));
                continue;
            }
            for (role, row) in recording.take_told() {
                excerpt.configured(role, &row);
            }
            let within = at_s >= from_s;
            match entry.row {
                Row::Gauges(row) if within => {
                    let follows = excerpt
                        .samples
                        .last()
                        .is_some_and(|last| row.first_sample == last.sample.wrapping_add(1));
                    match runs.last_mut() {
                        Some(run) if follows => run.to_s = at_s,
                        last => {
                            if last.is_some() {
                                gap_s = gap_s.or(Some(at_s));
                                excerpt.samples.clear();
                            }
                            runs.push(Run {
                                from_s: at_s,
                                to_s: at_s,
                            });
                            excerpt.first_s = at_s;
                        }
                    }
                    excerpt.samples.extend(GaugeRow::all(&Gauges::from(&row)));
                    if excerpt.samples.len() > MOST {
                        return Err(SceneError::TooLong { path });
                    }
                }
                Row::Estimate(row) if within => excerpt.estimates.push(row.into()),
                row => {
                    let is_changed = excerpt.configured(entry.role, &row);
                    if is_changed && within && !excerpt.samples.is_empty() {
                        return Err(SceneError::Reconfigured { path, at_s });
                    }
                }
            }
        }
        excerpt.cut = recording.is_cut() && !has_all;
        excerpt.passed_over = recording.passed_over();
        if let Some(at_s) = gap_s {
            let longest = runs
                .into_iter()
                .max_by(|one, other| one.length_s().total_cmp(&other.length_s()));
            let (from_s, to_s) = longest.map_or((0.0, 0.0), |run| (run.from_s, run.to_s));
            return Err(SceneError::Gap {
                path,
                at_s,
                from_s,
                to_s,
            });
        }
        Ok(excerpt)
    }

    /// Takes a reported configuration; whether it is another one of the sensor's than before.
    fn configured(&mut self, role: Role, row: &Row) -> bool {
        match (role, row) {
            (Role::Sensor, Row::SensorConfiguration(row)) => {
                let before = self.sensor.replace(row.in_force);
                return before.is_some_and(|before| before != row.in_force);
            }
            (Role::Display, Row::DisplayConfiguration(row)) => self.display = Some(row.in_force),
            _ => {}
        }
        false
    }
}
