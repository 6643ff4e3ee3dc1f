//! The mean voltage of each channel over time: what works on a gel and on skin, whatever the speed was.
//!
//! Over a part of a stroke any wave has one. So it is taken over whole strokes to and fro, where the hand makes some;
//! else from the first to the last time that a channel's wave rises through 0 V, which are whole cycles.

use crate::judge::voltage::Edge;
use crate::run::recording::{ACTUATORS, volts};

/// So long after the first voltage a wave may still be on its way up, in s.
const BEGINS_S: f64 = 0.1;

/// An instant in s, and each channel's integral of the voltage until then, in V·s.
type Place = (f64, [f64; ACTUATORS]);

/// Integrates all channels' voltages, which hold from edge to edge.
#[derive(Clone, Debug)]
pub struct Standing {
    reference: usize,
    last: Option<Edge>,
    volt_s: [f64; ACTUATORS],
    crossings: Span,
    strokes: Span,
    /// When the first voltage came, in s.
    began_s: Option<f64>,
    /// Turns since the first, once there is one.
    turns: Option<u32>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Span {
    from: Option<Place>,
    to: Option<Place>,
}

impl Span {
    fn reach(&mut self, place: Place) {
        if self.from.is_none() {
            self.from = Some(place);
        } else {
            self.to = Some(place);
        }
    }

    /// The mean of the channel for which it is farthest from 0, in V.
    fn farthest_v(&self) -> Option<f64> {
        let ((from_s, before), (to_s, after)) = self.from.zip(self.to)?;
        let means = before.iter().zip(&after);
        means
            .map(|(before, after)| (after - before) / (to_s - from_s))
            .max_by(|one, other| one.abs().total_cmp(&other.abs()))
    }
}

impl Standing {
    /// Before the first edge; the wave of channel `reference` counts the cycles.
    pub fn new(reference: usize) -> Self {
        Self {
            reference,
            last: None,
            volt_s: [0.0; ACTUATORS],
            crossings: Span::default(),
            strokes: Span::default(),
            began_s: None,
            turns: None,
        }
    }

    /// The hand has turned back after the last edge.
    pub fn turn(&mut self) {
        let Some(last) = &self.last else { return };
        let turns = self.turns.map_or(0, |turns| turns + 1);
        self.turns = Some(turns);
        if turns.is_multiple_of(2) {
            self.strokes.reach((last.t_s, self.volt_s));
        }
    }

    /// The next edge.
    pub fn add(&mut self, edge: &Edge) {
        let Some(last) = self.last.replace(*edge) else {
            return;
        };
        let length_s = edge.t_s - last.t_s;
        for (volt_s, &word) in self.volt_s.iter_mut().zip(&last.words) {
            *volt_s += volts(word) * length_s;
        }
        let [before_v, after_v] = [&last, edge].map(|edge| volts(edge.words[self.reference]));
        let began_s = *self.began_s.get_or_insert(last.t_s);
        if before_v < 0.0 && after_v >= 0.0 && edge.t_s > began_s + BEGINS_S {
            self.crossings.reach((edge.t_s, self.volt_s));
        }
    }

    /// The mean of the channel for which it is farthest from 0, in V; none without a whole cycle or stroke.
    pub fn farthest_v(&self) -> Option<f64> {
        self.strokes.farthest_v().or(self.crossings.farthest_v())
    }
}
