//! What a stranger's fingertip has for a tangential force channel, where it is given one.

use firmware_sensor::{MID_RAIL_CODE, SCANS_PER_SAMPLE, Scan};
use protocol::SensorConfiguration;

use super::dice::Dice;
use super::ground::Profile;
use super::hand::{Path, SCANS_PER_S, Slider};
use super::pickup::GAUGES;

/// The channel's scale, in N/V. The furthest slider pulls with 1.1 N, of the 1.65 V either way.
const N_PER_V: f64 = 1.0;
const N_PER_CODE: f64 = 3.3 / 4_096.0 * N_PER_V;

/// A channel that feels what spring and damper between arm and fingertip pull with.
///
/// | what | how often | range |
/// | --- | --- | --- |
/// | stiffness | always | the slider's, else 250–600 N/m |
/// | damping | always | the slider's, else none |
/// | what is said of it | 0.5 | 0.9–1.1 of it; else it is left to the sensor |
/// | gain | always | 0.95–1.05 of what is said |
/// | rest | always | ± 50 mN |
/// | noise | always | white, 0.5–10 mN, log-uniform |
/// | cross-talk of the surface | 0.5 | 0–20 mN for the RMS of its signal |
///
/// A fingertip without slider or hysteresis does not lag: there it reads rest, noise and cross-talk alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Force {
    /// In N/m.
    pub stiffness_n_per_m: f64,
    /// In N s/m.
    pub damping_n_s_per_m: f64,
    /// What is said of it, in N/m; 0 if nothing is.
    pub told_n_per_m: u16,
    /// Over what is said.
    pub gain: f64,
    /// What it reads at rest, in N.
    pub rest_n: f64,
    /// RMS, in N.
    pub noise_n: f64,
    /// What it reads of a height of the signal's RMS, in N.
    pub crosstalk_n: f64,
}

impl Force {
    /// Draws a channel for a fingertip.
    pub fn draw(slider: Option<&Slider>, dice: &mut Dice) -> Self {
        let drawn = dice.between(250.0, 600.0);
        let stiffness_n_per_m = slider.map_or(drawn, |slider| slider.stiffness_n_per_m);
        let told = stiffness_n_per_m * dice.between(0.9, 1.1);
        Self {
            stiffness_n_per_m,
            damping_n_s_per_m: slider.map_or(0.0, |slider| slider.damping_n_s_per_m),
            told_n_per_m: if dice.chance(0.5) { told as u16 } else { 0 },
            gain: dice.between(0.95, 1.05),
            rest_n: dice.between(-0.05, 0.05),
            noise_n: 1e-3 * dice.log_between(0.5, 10.0),
            crosstalk_n: dice.sometimes(0.5, 0.0, 0.02),
        }
    }

    /// Writes what it reads on the way into the scans.
    pub fn read(
        &self,
        scans: &mut [[Scan; SCANS_PER_SAMPLE]],
        path: &Path,
        profile: &Profile,
        dice: &mut Dice,
    ) {
        let feet = path.arm_mm.iter().zip(&path.foot_mm);
        let mut before_m = 0.0;
        for (scan, (arm_mm, foot_mm)) in scans.iter_mut().flatten().zip(feet) {
            let lag_m = 1e-3 * (arm_mm - foot_mm);
            let rate_m_s = (lag_m - before_m) * SCANS_PER_S as f64;
            before_m = lag_m;
            let pull_n = self.stiffness_n_per_m * lag_m + self.damping_n_s_per_m * rate_m_s;
            let felt_n = self.gain * pull_n
                + self.rest_n
                + self.crosstalk_n * f64::from(profile.height(0, *foot_mm))
                + self.noise_n * dice.gaussian();
            let code = f64::from(MID_RAIL_CODE) + felt_n / N_PER_CODE;
            scan[GAUGES] = (code.clamp(0.0, 4_095.0) + 0.5) as u16;
        }
    }

    /// `sensor` as it is told of the channel.
    pub const fn told(&self, sensor: SensorConfiguration) -> SensorConfiguration {
        SensorConfiguration {
            force_channel: true,
            force_mn_per_v: (N_PER_V * 1e3) as u16,
            stiffness_n_per_m: self.told_n_per_m,
            ..sensor
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jury::stranger::Trial;

    #[test]
    fn it_reads_what_spring_and_damper_pull_with() {
        let force = Force {
            stiffness_n_per_m: 400.0,
            damping_n_s_per_m: 0.2,
            told_n_per_m: 410,
            gain: 0.95,
            rest_n: 0.05,
            noise_n: 0.0,
            crosstalk_n: 0.0,
        };
        // At rest, then pulled 0.5 mm out at 20 mm/s, and held.
        let arm_mm: Vec<f64> = (0..200_i32)
            .map(|scan| (0.005 * f64::from(scan - 50)).clamp(0.0, 0.5))
            .collect();
        let path = Path {
            foot_mm: vec![0.0; arm_mm.len()],
            drag: vec![0.0; arm_mm.len()],
            arm_mm,
        };
        let trial = Trial::draw(1);
        let dice = &mut Dice::new(1, 1);
        let profile = trial.ground.lay(-1.0, 1.0, GAUGES, dice);
        let mut scans = [[[7; GAUGES + 1]; SCANS_PER_SAMPLE]; 50];
        force.read(&mut scans, &path, &profile, dice);
        let scans: Vec<Scan> = scans.into_iter().flatten().collect();
        let told = force.told(SensorConfiguration::DEFAULT);
        assert!(told.force_channel && told.stiffness_n_per_m == 410);
        let step_n = 3.3 / 4_096.0 * 1e-3 * f64::from(told.force_mn_per_v);
        let read_n = |scan: usize| (f64::from(scans[scan][GAUGES]) - 2_048.0) * step_n;
        // Half way out 0.1 N of the spring and 4 mN of the damper.
        for (scan, pulled_n) in [(10, 0.0), (100, 0.104), (190, 0.2)] {
            let off_n = read_n(scan) - 0.05 - 0.95 * pulled_n;
            assert!(off_n.abs() <= 0.5 * step_n + 1e-9, "{off_n} N at {scan}");
        }
        assert!(scans.iter().all(|scan| scan[..GAUGES] == [7; GAUGES]));
    }
}
