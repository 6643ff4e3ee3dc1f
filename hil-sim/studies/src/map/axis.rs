//! An axis of a map: steps of one scene setting, or of several at once.

use super::knob::{Knob, Setting};
use crate::output::plot::axis::round_step;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    Linear,
    Log,
    Named,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Its place on the axis, in the axis' unit; its number if the axis is named.
    pub at: f64,
    pub label: String,
    /// What it changes in the scene; the same knobs in every step of an axis.
    pub settings: Vec<Setting>,
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The quantity and its unit.
    pub label: &'static str,
    pub(super) scale: Scale,
    pub(super) steps: Vec<Step>,
    /// Steps that belong together, of a named axis: a name for every so many.
    pub(super) groups: Vec<(String, usize)>,
}

impl Axis {
    /// `count` steps from `first` to `last` by the same ratio, to three digits.
    pub fn log(label: &'static str, knob: Knob, first: f64, last: f64, count: usize) -> Self {
        let ratio = last / first;
        let along = (0..count).map(|step| step as f64 / (count - 1) as f64);
        let values = along.map(|share| three_digits(first * ratio.powf(share)));
        Self::numbers(label, Scale::Log, knob, 1.0, values)
    }

    /// These steps, in rising order and about the same ratio apart.
    pub fn listed(label: &'static str, knob: Knob, values: &[f64]) -> Self {
        Self::numbers(label, Scale::Log, knob, 1.0, values.iter().copied())
    }

    /// `count` steps from `first` to `last` by the same difference.
    pub fn linear(label: &'static str, knob: Knob, first: f64, last: f64, count: usize) -> Self {
        Self::linear_in(label, knob, 1.0, first..last, count)
    }

    /// As [`Axis::linear`], the axis in a unit that is so many of the setting's.
    pub fn linear_in(
        label: &'static str,
        knob: Knob,
        unit: f64,
        range: std::ops::Range<f64>,
        count: usize,
    ) -> Self {
        let values = (0..count).map(|step| {
            let wide = range.end - range.start;
            let exact = range.start + wide * step as f64 / (count - 1) as f64;
            (exact * 1e6).round() / 1e6
        });
        Self::numbers(label, Scale::Linear, knob, unit, values)
    }

    fn numbers(
        label: &'static str,
        scale: Scale,
        knob: Knob,
        unit: f64,
        values: impl Iterator<Item = f64>,
    ) -> Self {
        let step = |at: f64| Step {
            at,
            label: at.to_string(),
            settings: vec![knob.at(at * unit)],
        };
        Self {
            label,
            scale,
            steps: values.map(step).collect(),
            groups: Vec::new(),
        }
    }

    /// An axis without steps, for [`Axis::group`] to add to.
    pub fn named(label: &'static str) -> Self {
        Self {
            label,
            scale: Scale::Named,
            steps: Vec::new(),
            groups: Vec::new(),
        }
    }

    /// Adds named steps that belong together.
    pub fn group(
        &mut self,
        name: String,
        steps: impl IntoIterator<Item = (&'static str, Vec<Setting>)>,
    ) {
        let before = self.steps.len();
        for (label, settings) in steps {
            self.steps.push(Step {
                at: self.steps.len() as f64,
                label: label.to_owned(),
                settings,
            });
        }
        self.groups.push((name, self.steps.len() - before));
    }

    /// The CSV's columns for this axis.
    pub fn columns(&self) -> impl Iterator<Item = &'static str> {
        let first = self.steps.iter().take(1);
        first.flat_map(|step| step.settings.iter().map(|setting| setting.knob.column))
    }

    /// How many steps there are, and what [`Axis::nearest`] takes, in words.
    pub fn told(&self) -> String {
        format!("{} steps, {}", self.steps.len(), self.places())
    }

    /// The step's own name: of a named axis its values, of any other its number.
    pub(super) fn place(&self, step: &Step) -> String {
        if self.scale != Scale::Named {
            return step.label.clone();
        }
        let values: Vec<&str> = step.settings.iter().map(|s| s.value.as_str()).collect();
        values.join("-")
    }

    /// What [`Axis::nearest`] takes, for a message.
    pub(super) fn places(&self) -> String {
        match (self.scale, self.steps.first(), self.steps.last()) {
            (Scale::Named, ..) => {
                let places: Vec<String> = self.steps.iter().map(|step| self.place(step)).collect();
                places.join(", ")
            }
            (_, Some(first), Some(last)) => {
                format!("a number from {} to {}", first.label, last.label)
            }
            _ => String::new(),
        }
    }

    /// The number of the step nearest to a number on the axis, or with this name. None if the text is
    /// neither, or a number beyond the axis' ends.
    pub fn nearest(&self, text: &str) -> Option<usize> {
        if self.scale == Scale::Named {
            return self.steps.iter().position(|step| self.place(step) == text);
        }
        let nearest = self.along(text.parse().ok()?)?.round();
        (0.0..self.steps.len() as f64)
            .contains(&nearest)
            .then_some(nearest as usize)
    }

    /// Where a value is, counted in steps from the first: on the axis' scale between the two steps around
    /// it, and beyond the ends as it goes on there. None if there is no such place.
    pub fn along(&self, value: f64) -> Option<f64> {
        let scaled = |value: f64| match self.scale {
            Scale::Log => value.ln(),
            Scale::Linear | Scale::Named => value,
        };
        let after = self.steps.partition_point(|step| step.at <= value);
        let from = after.max(1).min(self.steps.len().checked_sub(1)?) - 1;
        let (before, next) = (&self.steps[from], self.steps.get(from + 1)?);
        let (low, high) = (scaled(before.at), scaled(next.at));
        let along = from as f64 + (scaled(value) - low) / (high - low);
        along.is_finite().then_some(along)
    }

    /// Values to label and what to write there.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let (Some(first), Some(last)) = (self.steps.first(), self.steps.last()) else {
            return Vec::new();
        };
        let (first, last) = (first.at, last.at);
        let within = |value: &f64| *value >= first * 0.999 && *value <= last * 1.001;
        let values: Vec<f64> = match self.scale {
            Scale::Named => {
                let steps = self.steps.iter();
                return steps.map(|step| (step.at, step.label.clone())).collect();
            }
            Scale::Log => (-3..4)
                .flat_map(|decade| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(decade)))
                .map(three_digits)
                .filter(within)
                .collect(),
            Scale::Linear => {
                let step = round_step((last - first) / 6.0);
                let from = (first / step - 1e-9).ceil() as i64;
                let to = (last / step + 1e-9).floor() as i64;
                (from..=to).map(|n| three_digits(n as f64 * step)).collect()
            }
        };
        let label = |value: f64| (value, value.to_string().replace('-', "−"));
        values.into_iter().map(label).collect()
    }
}

fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_steps_have_one_ratio_and_three_digits() {
        let axis = Axis::log("", Knob::SPEED, 3.0, 200.0, 5);
        let labels: Vec<&str> = axis.steps.iter().map(|step| &*step.label).collect();
        // 3 · (200/3)^(n/4)
        assert_eq!(labels, ["3", "8.57", "24.5", "70", "200"]);
    }

    #[test]
    fn linear_steps_are_exact_in_either_unit() {
        let axis = Axis::linear_in("", Knob::SKEW, 1000.0, -5.0..5.0, 21);
        assert_eq!(axis.steps[11].at, 0.5);
        assert_eq!(axis.steps[11].settings[0].value, "500");
        assert_eq!(axis.steps[10].settings[0].value, "0");
    }

    #[test]
    fn the_nearest_step_is_found_on_the_axis_own_scale() {
        let log = Axis::log("", Knob::SPEED, 1.0, 100.0, 3);
        // The middle between 1 and 10 is √10.
        assert_eq!(log.nearest("3.1"), Some(0));
        assert_eq!(log.nearest("3.2"), Some(1));
        assert_eq!(log.nearest("300"), Some(2));
        assert_eq!(log.nearest("400"), None);
        assert_eq!(log.nearest("0.3"), None);
        assert_eq!(log.nearest("nan"), None);
        assert_eq!(log.nearest("-1"), None);
        assert_eq!(log.nearest("fast"), None);
        let listed = Axis::listed("", Knob::ENCODER, &[5.0, 10.0, 15.0, 200.0]);
        assert_eq!(listed.nearest("15"), Some(2));
        // √(5 · 10) is the middle of the first two.
        let along = listed.along(50f64.sqrt()).unwrap();
        assert!((along - 0.5).abs() < 1e-9, "{along}");
    }

    #[test]
    fn ticks_are_round_and_on_the_axis() {
        let texts = |axis: Axis| -> Vec<String> { axis.ticks().into_iter().map(|t| t.1).collect() };
        let log = Axis::log("", Knob::WAVELENGTH, 0.7, 6.0, 9);
        assert_eq!(texts(log), ["1", "2", "5"]);
        let linear = Axis::linear("", Knob::SNR, -10.0, 40.0, 11);
        assert_eq!(texts(linear), ["−10", "0", "10", "20", "30", "40"]);
        let hum = Axis::linear("", Knob::HUM, 0.0, 1.0, 11);
        assert_eq!(texts(hum), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
    }
}
