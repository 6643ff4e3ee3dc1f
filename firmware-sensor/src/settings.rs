//! The board's configuration: taken as a whole or not at all.

use protocol::{
    Configuration, ConfigurationReport, Configure, Refusal, SensorConfiguration, Setting,
};

/// What is in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    configuration: SensorConfiguration,
}

impl Settings {
    /// What a board starts with.
    pub const DEFAULT: Self = Self {
        configuration: SensorConfiguration::DEFAULT,
    };

    /// What a board starts with that was restarted: what was in force before, if that is known and a sensor's.
    pub fn restarted(before: Option<Configuration>) -> Self {
        let mut settings = Self::DEFAULT;
        if let Some(configuration) = before {
            settings.on_configure(&Configure::anyway(configuration));
        }
        settings
    }

    /// The configuration in force.
    pub const fn configuration(&self) -> &SensorConfiguration {
        &self.configuration
    }

    /// Takes a configuration whose every value is in its range, if what it replaces is in force; any other
    /// changes nothing. The answer names what is in force then.
    pub fn on_configure(&mut self, asked: &Configure) -> ConfigurationReport {
        let taken = self.take(asked);
        ConfigurationReport {
            refused: taken.err(),
            ..self.report()
        }
    }

    /// What is in force.
    pub fn report(&self) -> ConfigurationReport {
        ConfigurationReport::of(Configuration::Sensor(self.configuration), None)
    }

    fn take(&mut self, asked: &Configure) -> Result<(), Refusal> {
        let Configuration::Sensor(configuration) = asked.configuration else {
            return Err(Refusal {
                setting: Setting::Role,
                index: 0,
                low: 0,
                high: 0,
            });
        };
        asked.check_replaces(self.report().hash)?;
        configuration.check()?;
        self.configuration = configuration;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use protocol::DisplayConfiguration;

    use super::*;

    fn asking(waves: u8) -> Configuration {
        Configuration::Sensor(SensorConfiguration {
            waves,
            ..SensorConfiguration::DEFAULT
        })
    }

    #[test]
    fn what_is_in_its_ranges_is_taken_and_told() {
        let mut settings = Settings::DEFAULT;
        let asked = asking(5);
        let report = settings.on_configure(&Configure::anyway(asked));
        assert_eq!(report, ConfigurationReport::of(asked, None));
        assert_eq!(settings.report(), report);
        assert_eq!(settings.configuration().waves, 5);
    }

    #[test]
    fn what_is_out_of_range_or_for_the_other_board_changes_nothing() {
        let other = Configuration::Display(DisplayConfiguration::DEFAULT);
        for (asked, setting) in [(asking(9), Setting::Waves), (other, Setting::Role)] {
            let mut settings = Settings::DEFAULT;
            let report = settings.on_configure(&Configure::anyway(asked));
            assert_eq!(report.refused.map(|refusal| refusal.setting), Some(setting));
            assert_eq!(settings, Settings::DEFAULT);
        }
    }

    #[test]
    fn a_restarted_board_goes_on_as_it_was_set() {
        let kept = Settings::restarted(Some(asking(5)));
        assert_eq!(kept.configuration().waves, 5);
        let other = Configuration::Display(DisplayConfiguration::DEFAULT);
        for before in [None, Some(asking(9)), Some(other)] {
            assert_eq!(Settings::restarted(before), Settings::DEFAULT);
        }
    }

    #[test]
    fn of_two_that_replace_the_same_only_the_first_is_taken() {
        let mut settings = Settings::DEFAULT;
        let before = settings.report().hash;
        let replacing = |waves| Configure {
            replaces: Some(before),
            configuration: asking(waves),
        };
        assert_eq!(settings.on_configure(&replacing(5)).refused, None);
        let report = settings.on_configure(&replacing(6));
        let refusal = report.refused.map(|refusal| refusal.setting);
        assert_eq!(refusal, Some(Setting::Replaces));
        assert_eq!(
            (report.configuration, report.hash),
            (asking(5), asking(5).hash())
        );
    }
}
