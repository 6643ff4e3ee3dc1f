//! Axes and their ticks.

use std::ops::Range;

#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The quantity and its unit; nothing if the title says it.
    pub label: String,
    pub low: f64,
    pub high: f64,
    /// Whether equal ratios, and not equal differences, are equally long.
    pub logarithmic: bool,
    /// Values that are marked, each with what is written there.
    pub ticks: Vec<(f64, String)>,
    /// Names of several ticks in a row, beside them, each at their middle; of upright axes only.
    pub groups: Vec<(f64, String)>,
}

impl Axis {
    /// An axis of equal differences with a tick at every so many from its beginning on.
    pub fn even(low: f64, high: f64, step: f64, label: &str) -> Self {
        Self::named(label, low..high, steps(low, high, step))
    }

    /// An axis of equal differences with three to nine ticks at round values. A range that is none is drawn as
    /// 0 to 1, and a range of nothing is widened.
    pub fn round(label: &str, range: Range<f64>) -> Self {
        let (low, high) = match range {
            Range { start, end } if !(start.is_finite() && end.is_finite()) => (0.0, 1.0),
            Range { start, end } if end > start => (start, end),
            Range { start, .. } => (start - 0.5, start + 0.5),
        };
        let step = round_step((high - low) / 8.0);
        let first = (low / step - 1e-9).ceil() * step;
        Self::named(label, low..high, steps(first, high, step))
    }

    /// An axis of equal differences with these ticks. It runs the other way if its range does.
    pub fn named(label: &str, range: Range<f64>, ticks: Vec<(f64, String)>) -> Self {
        Self {
            label: label.to_owned(),
            low: range.start,
            high: range.end,
            logarithmic: false,
            ticks,
            groups: Vec::new(),
        }
    }

    /// An axis of equal ratios with a tick at every decade, and at 2 and 5 where there is room.
    pub fn decades(low: f64, high: f64, label: &str) -> Self {
        let steps = &[1.0, 2.0, 5.0][..if high / low < 1e3 { 3 } else { 1 }];
        let decades = low.log10().floor() as i32..=high.log10().floor() as i32;
        let ticks = decades
            .flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)))
            .filter(|tick| (low * 0.999..=high * 1.001).contains(tick))
            .map(|tick| (tick, short(tick)))
            .collect();
        Self {
            logarithmic: true,
            ..Self::named(label, low..high, ticks)
        }
    }

    /// An axis of equal ratios with a tick at every decade, written as a power of ten.
    pub fn powers(low: f64, high: f64, label: &str) -> Self {
        let axis = Self::decades(low, high, label);
        let decades = axis.ticks.iter().map(|tick| tick.0.log10());
        let whole = decades.filter(|power| (power - power.round()).abs() < 1e-9);
        let ticks = whole.map(|power| {
            let power = power.round() as i32;
            (10f64.powi(power), format!("10{}", superscript(power)))
        });
        Self {
            ticks: ticks.collect(),
            ..axis
        }
    }

    /// The same axis with its ticks and without a word: its neighbour has them.
    pub fn wordless(&self) -> Self {
        let ticks = self.ticks.iter().map(|tick| (tick.0, String::new()));
        Self {
            label: String::new(),
            ticks: ticks.collect(),
            groups: Vec::new(),
            ..*self
        }
    }

    /// Where a value is on it, 0 to 1; what lies beyond is put at the end.
    pub fn place(&self, value: f64) -> f64 {
        let share = if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        share.clamp(0.0, 1.0)
    }
}

/// The least of 1, 2 and 5 times a power of ten that is not below a number.
pub fn round_step(least: f64) -> f64 {
    let decade = 10f64.powf(least.log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].map(|round| round * decade);
    let step = round.into_iter().find(|step| *step >= least);
    step.unwrap_or(least)
}

/// Ticks from one value to another, with as many decimals as the step has.
fn steps(first: f64, last: f64, step: f64) -> Vec<(f64, String)> {
    let is_whole = |decimals: &usize| {
        let scaled = step * 10f64.powi(*decimals as i32);
        (scaled - scaled.round()).abs() < 1e-6 * scaled
    };
    let decimals = (0..9).find(is_whole).unwrap_or(9);
    let count = ((last - first) / step + 1e-9).floor().clamp(0.0, 20.0) as u32;
    (0..=count)
        .map(|index| first + f64::from(index) * step)
        .map(|value| {
            // What binary leaves of 0 is to have no sign.
            let is_zero = value.abs() < 1e-9 * step;
            let value = if is_zero { 0.0 } else { value };
            (value, with_minus(format!("{value:.decimals$}")))
        })
        .collect()
}

/// A number in few characters: thousands as "k".
pub fn short(value: f64) -> String {
    with_minus(if value >= 1_000.0 {
        format!("{}k", value / 1_000.0)
    } else {
        value.to_string()
    })
}

fn superscript(number: i32) -> String {
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |letter: char| match letter.to_digit(10) {
        Some(digit) => digits[digit as usize],
        None => '⁻',
    };
    number.to_string().chars().map(raised).collect()
}

/// A number's text with a minus sign for its hyphen.
fn with_minus(text: String) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|tick| &*tick.1).collect()
    }

    #[test]
    fn an_axis_puts_its_ends_and_what_lies_beyond_at_0_and_1() {
        let axis = Axis::decades(0.1, 1_000.0, "");
        assert_eq!(axis.place(0.1), 0.0);
        assert_eq!(axis.place(1e9), 1.0);
        assert!((axis.place(1.0) - 0.25).abs() < 1e-12);
        assert_eq!(texts(&axis), ["0.1", "1", "10", "100", "1k"]);
        let powers = Axis::powers(1e-2, 1e3, "");
        assert_eq!(texts(&powers), ["10⁻²", "10⁻¹", "10⁰", "10¹", "10²", "10³"]);
        let downwards = Axis::named("", 3.0..1.0, Vec::new());
        assert_eq!(
            [3.0, 2.0, 1.0].map(|value| downwards.place(value)),
            [0.0, 0.5, 1.0]
        );
    }

    #[test]
    fn ticks_are_round_and_within_the_range() {
        for (range, expected) in [
            (
                0.0..3.0,
                &["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"][..],
            ),
            (-70.0..70.0, &["−60", "−40", "−20", "0", "20", "40", "60"]),
            (1.40..1.60, &["1.40", "1.45", "1.50", "1.55", "1.60"]),
        ] {
            assert_eq!(texts(&Axis::round("", range)), expected);
        }
        let even = Axis::even(-0.5, 0.5, 0.25, "");
        assert_eq!(texts(&even), ["−0.50", "−0.25", "0.00", "0.25", "0.50"]);
    }

    #[test]
    fn a_range_of_nothing_has_places_all_the_same() {
        for range in [5.0..5.0, f64::NAN..1.0, 0.0..f64::INFINITY] {
            let axis = Axis::round("", range);
            assert!(axis.high > axis.low && !axis.ticks.is_empty());
        }
    }
}
