//! The outputs over time, as points between which they go straight.

use std::collections::VecDeque;

use crate::judge::seconds;
use crate::run::recording::{ACTUATORS, OutputRecord};

/// A gap between two edges longer than this many ticks is a hold, not a slope.
const HOLD_TICKS: f64 = 1.5;

/// The outputs at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// When, in s.
    pub t_s: f64,
    /// The word of each actuator.
    pub words: [u16; ACTUATORS],
}

/// The LDAC edges that were not taken yet. Where the words did not change for a while (a hand at rest needs no
/// edge), a point a tick before the next edge keeps the last output.
#[derive(Clone, Debug)]
pub struct Edges {
    /// The time between two ticks as the display is set, in s.
    tick_s: f64,
    last: Option<Edge>,
    waiting: VecDeque<Edge>,
}

impl Edges {
    /// Before the first one, of a display of `tick_hz`.
    pub fn new(tick_hz: u32) -> Self {
        Self {
            tick_s: 1.0 / f64::from(tick_hz),
            last: None,
            waiting: VecDeque::new(),
        }
    }

    /// The outputs have changed.
    pub fn add(&mut self, output: &OutputRecord) {
        let edge = Edge {
            t_s: seconds(output.at_ns),
            words: output.words,
        };
        if let Some(last) = self.last.replace(edge)
            && edge.t_s - last.t_s > HOLD_TICKS * self.tick_s
        {
            self.waiting.push_back(Edge {
                t_s: edge.t_s - self.tick_s,
                ..last
            });
        }
        self.waiting.push_back(edge);
    }

    /// Takes the next point, if it is before `t_s`.
    pub fn take_before(&mut self, t_s: f64) -> Option<Edge> {
        self.waiting.pop_front_if(|edge| edge.t_s < t_s)
    }

    /// How many points wait.
    pub fn held(&self) -> usize {
        self.waiting.len()
    }
}
