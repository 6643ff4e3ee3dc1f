//! The steps, in the order in which a bench is best brought up: the table `steps.toml`.

use std::sync::LazyLock;

use serde::Deserialize;

use super::step::Step;

/// The amplitude that the first stroke is made with, in mV.
pub const FIRST_AMPLITUDE_MV: u16 = 1_000;

#[derive(Deserialize)]
struct Table {
    steps: Vec<Step>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    toml::from_str(include_str!("steps.toml")).expect("a table that the tests have read")
});

/// Every step, in its order.
pub fn all() -> impl Iterator<Item = &'static Step> {
    TABLE.steps.iter()
}

/// The step called `name`.
pub fn named(name: &str) -> Option<&'static Step> {
    all().find(|step| step.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bringup::sight::Sight;

    #[test]
    fn every_step_has_a_name_of_its_own_and_needs_only_what_comes_before_it() {
        let mut before = Vec::new();
        for step in all() {
            assert!(!before.contains(&step.name), "{} twice", step.name);
            for need in &step.needs {
                assert!(before.contains(need), "{} before {need}", step.name);
            }
            before.push(step.name.clone());
        }
    }

    #[test]
    fn where_nothing_is_seen_no_step_passes_and_each_says_what_to_try() {
        for step in all() {
            assert!(!step.measures.is_empty() && !step.to_do.is_empty());
            let figures = step.judge(&Sight::default(), |_| None);
            for figure in figures.iter().filter(|figure| !figure.passes) {
                assert!(
                    figure
                        .advice
                        .as_ref()
                        .is_some_and(|advice| advice.len() > 10)
                );
            }
            // What USB has attached is nothing, and so is what this user may not open.
            assert!(figures.iter().any(|figure| !figure.passes), "{}", step.name);
        }
    }
}
