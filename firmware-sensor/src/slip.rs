//! Where the fingertip's contact is, and whether it slips: from the tangential force.
//!
//! The fingertip is a spring of stiffness k between the arm and its contact with the surface. The force
//! channel measures the spring, so the contact lags behind the arm by F/k, and *that* position is what
//! the texture is a function of. It repairs what stick and slip do to λ: see the README.
//!
//! If k is not known it is found where the contact sticks: there ΔF/Δx is k, elsewhere it is less.

use protocol::{Contact, SensorConfiguration};

use crate::estimator::{PLACES_PER_UM, Place};
use crate::travel::Travel;

/// Volts of an ADC step.
const VOLTS_PER_LSB: f32 = 3.3 / 4_096.0;
/// Places in a metre.
const PLACES_PER_M: f32 = 1e6 * PLACES_PER_UM as f32;
/// Travel of the arm over which ΔF/Δx is taken.
const STRETCH: Place = 300 * PLACES_PER_UM;
/// Slopes from this share of k on are taken for a sticking contact's.
const STICKING: f32 = 0.75;
/// A slope so much above k is a better k.
const STIFFER: f32 = 1.15;
/// How much of a sticking contact's slope goes into k.
const LEARNING: f32 = 0.2;
/// Stiffness in N/m that is believed: below, a stretch's change of force is not far above the channel's
/// noise; fingertips have a few hundred.
const BELIEVED_N_PER_M: core::ops::RangeInclusive<f32> = 100.0..=60_000.0;
/// Contact and arm are compared over this many ms.
const COMPARED_MS: usize = 8;
/// The contact sticks if it moves less than this share of the arm's movement.
const STUCK: f32 = 0.25;
/// The arm moves, in mm/s.
const MOVING_MM_S: f32 = 2.0;

/// The force channel's interpreter.
#[derive(Clone, Debug)]
pub struct Slip {
    newtons_per_lsb: f32,
    /// k in N/m; none until it is found.
    stiffness_n_per_m: Option<f32>,
    find_stiffness: bool,
    /// Arm and force where the stretch began.
    stretch: Option<(Place, f32)>,
    /// Lags of the last [`COMPARED_MS`], in places.
    lags: [Place; COMPARED_MS],
    next: usize,
    present: bool,
}

impl Slip {
    /// As `configuration` says; that must have passed its check.
    pub fn new(configuration: &SensorConfiguration) -> Self {
        let given = configuration.stiffness_n_per_m;
        Self {
            newtons_per_lsb: VOLTS_PER_LSB * f32::from(configuration.force_mn_per_v) * 1e-3,
            stiffness_n_per_m: (given > 0).then_some(f32::from(given)),
            find_stiffness: given == 0,
            stretch: None,
            lags: [0; COMPARED_MS],
            next: 0,
            present: configuration.force_channel,
        }
    }

    /// Takes the arm's place and the force channel's sample of the same instant, in ADC steps from
    /// mid-rail; returns how far the contact lags behind the arm, in places.
    pub fn push(&mut self, arm: Place, force_lsb: f32) -> Place {
        if !self.present {
            return 0;
        }
        let force_n = force_lsb * self.newtons_per_lsb;
        if self.find_stiffness {
            self.learn(arm, force_n);
        }
        let lag = self
            .stiffness_n_per_m
            .map_or(0, |k| (force_n / k * PLACES_PER_M) as Place);
        self.lags[self.next] = lag;
        self.next = (self.next + 1) % COMPARED_MS;
        lag
    }

    fn learn(&mut self, arm: Place, force_n: f32) {
        let (from, force_before) = *self.stretch.get_or_insert((arm, force_n));
        let travel = arm.wrapping_sub(from);
        if travel.unsigned_abs() < STRETCH.unsigned_abs() {
            return;
        }
        self.stretch = Some((arm, force_n));
        let slope = (force_n - force_before) / travel as f32 * PLACES_PER_M;
        if !BELIEVED_N_PER_M.contains(&slope) {
            return;
        }
        let known = *self.stiffness_n_per_m.get_or_insert(slope);
        let k = if slope > STIFFER * known {
            slope
        } else if slope > STICKING * known {
            known + LEARNING * (slope - known)
        } else {
            known
        };
        self.stiffness_n_per_m = Some(k);
    }

    /// The contact's lag behind the arm at the last sample, in µm; none without a force channel or as
    /// long as k is unknown.
    pub fn lag_um(&self) -> Option<i32> {
        self.stiffness_n_per_m
            .filter(|_| self.present)
            .map(|_| self.newest() / PLACES_PER_UM)
    }

    /// Stick or slip, from how contact and arm moved over the last 8 ms; unknown at rest and without a
    /// force channel. `arm_ms_ago` is the age of the last sample.
    pub fn contact(&self, travel: &Travel, arm_ms_ago: usize) -> Contact {
        let now = travel.place(arm_ms_ago);
        let before = travel.place(arm_ms_ago + COMPARED_MS - 1);
        let arm = now.wrapping_sub(before);
        let moving = MOVING_MM_S * (COMPARED_MS - 1) as f32 * PLACES_PER_UM as f32;
        if self.lag_um().is_none() || (arm.unsigned_abs() as f32) < moving {
            return Contact::Unknown;
        }
        let contact = arm - (self.newest() - self.lags[self.next]);
        if (contact.unsigned_abs() as f32) < STUCK * arm.unsigned_abs() as f32 {
            Contact::Stick
        } else {
            Contact::Slip
        }
    }

    fn newest(&self) -> Place {
        self.lags[(self.next + COMPARED_MS - 1) % COMPARED_MS]
    }
}
