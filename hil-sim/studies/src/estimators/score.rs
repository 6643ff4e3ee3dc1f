//! What a contestant makes of a family of scenes.

use hil_sim_core::judge::{Summary, mean};
use hil_sim_core::scene::Scene;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Score {
    /// Root of the mean square, over the scenes with a valid estimate, of their RMS errors.
    pub rms_percent: Option<f64>,
    /// The largest of them, and its scene.
    pub worst: Option<(f64, String)>,
    /// Mean of the shares of valid estimates.
    pub valid_share: Option<f64>,
    /// Mean of the shares of estimates that are valid and more than 10 % off.
    pub wrong_share: Option<f64>,
    /// Mean time to settle after the boundary; none unless it settled in every scene.
    pub settling_ms: Option<f64>,
    /// The longest of them.
    pub longest_settling_ms: Option<f64>,
}

impl Score {
    pub fn new<'a>(scenes: &[Scene], summaries: impl Iterator<Item = &'a Summary> + Clone) -> Self {
        let errors = summaries.clone().zip(scenes);
        let errors = errors.filter_map(|(of, scene)| Some((of.rms_percent?, scene.name.clone())));
        let squares = errors.clone().map(|(rms, _)| rms * rms);
        let settling = summaries.clone().map(|summary| summary.settling_ms);
        let settling: Option<Vec<f64>> = settling.collect();
        Self {
            rms_percent: mean(squares).map(f64::sqrt),
            worst: errors.reduce(|one, other| if other.0 > one.0 { other } else { one }),
            valid_share: mean(summaries.clone().filter_map(|summary| summary.valid_share)),
            wrong_share: mean(summaries.filter_map(|summary| summary.wrong_share)),
            settling_ms: mean(settling.iter().flatten().copied()),
            longest_settling_ms: settling.and_then(|times| times.into_iter().reduce(f64::max)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(rms_percent: Option<f64>, settling_ms: Option<f64>) -> Summary {
        Summary {
            rms_percent,
            settling_ms,
            ..Summary::default()
        }
    }

    fn scenes(count: usize) -> Vec<Scene> {
        (1..=count)
            .map(|mm| Scene::constant(mm as f64, 50.0))
            .collect()
    }

    #[test]
    fn errors_add_up_as_squares_and_the_worst_has_its_scenes_name() {
        let summaries = [
            summary(Some(3.0), None),
            summary(None, None),
            summary(Some(4.0), None),
        ];
        let score = Score::new(&scenes(3), summaries.iter());
        assert_eq!(score.rms_percent, Some(12.5f64.sqrt()));
        assert_eq!(score.worst, Some((4.0, "constant-3mm-50mm-s".to_owned())));
    }

    #[test]
    fn one_scene_that_never_settles_leaves_no_time() {
        let all = [summary(None, Some(80.0)), summary(None, Some(100.0))];
        let score = Score::new(&scenes(2), all.iter());
        assert_eq!(score.settling_ms, Some(90.0));
        assert_eq!(score.longest_settling_ms, Some(100.0));
        let some = [summary(None, Some(80.0)), summary(None, None)];
        let score = Score::new(&scenes(2), some.iter());
        assert_eq!((score.settling_ms, score.longest_settling_ms), (None, None));
    }
}
