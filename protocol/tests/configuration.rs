//! What a board takes as its configuration, and which setting it names if it does not.

use protocol::{DisplayConfiguration, SensorConfiguration, Setting};

/// The answer to the sensor's default configuration with one change.
fn sensor(change: impl FnOnce(&mut SensorConfiguration)) -> Result<(), Setting> {
    let mut configuration = SensorConfiguration::DEFAULT;
    change(&mut configuration);
    configuration.check()
}

/// The answer to the display's default configuration with one change.
fn display(change: impl FnOnce(&mut DisplayConfiguration)) -> Result<(), Setting> {
    let mut configuration = DisplayConfiguration::DEFAULT;
    change(&mut configuration);
    configuration.check()
}

/// That `check` takes both ends of `low..=high` and refuses their neighbours by the name of `setting`.
fn assert_range(setting: Setting, low: u32, high: u32, check: impl Fn(u32) -> Result<(), Setting>) {
    assert_eq!(check(low), Ok(()), "{setting:?} {low}");
    assert_eq!(check(high), Ok(()), "{setting:?} {high}");
    if let Some(below) = low.checked_sub(1) {
        assert_eq!(check(below), Err(setting), "{below}");
    }
    assert_eq!(check(high + 1), Err(setting), "{}", high + 1);
}

#[test]
fn a_board_takes_its_own_default() {
    assert_eq!(SensorConfiguration::DEFAULT.check(), Ok(()));
    assert_eq!(DisplayConfiguration::DEFAULT.check(), Ok(()));
    assert_eq!(SensorConfiguration::default(), SensorConfiguration::DEFAULT);
    assert_eq!(
        DisplayConfiguration::default(),
        DisplayConfiguration::DEFAULT
    );
}

#[test]
fn each_of_the_sensors_settings_is_taken_in_its_range_and_refused_beside_it() {
    assert_range(Setting::WindowMs, 10, 200, |n| {
        sensor(|c| c.window_ms = n as u16)
    });
    assert_range(Setting::CountedGauge, 0, 4, |n| {
        sensor(|c| c.counted_gauge = n as u8)
    });
    assert_range(Setting::Gauges, 1, 31, |n| sensor(|c| c.gauges = n as u8));
    assert_range(Setting::BankTravel, 30, 300, |n| {
        sensor(|c| c.bank_travel_percent = n as u16)
    });
    assert_range(Setting::BankCandidates, 12, 24, |n| {
        sensor(|c| c.bank_candidates = n as u8)
    });
    assert_range(Setting::ForceScale, 1, 60_000, |n| {
        sensor(|c| c.force_mn_per_v = n as u16)
    });
    assert_range(Setting::Stiffness, 10, 60_000, |n| {
        sensor(|c| c.stiffness_n_per_m = n as u16)
    });
    assert_range(Setting::ArmFullScale, 1_000, 2_000_000, |n| {
        sensor(|c| c.arm_full_scale_um_s = n)
    });
}

#[test]
fn a_stiffness_of_nought_asks_for_an_estimate_of_it_and_is_taken() {
    assert_eq!(sensor(|c| c.stiffness_n_per_m = 0), Ok(()));
}

#[test]
fn each_of_the_displays_settings_is_taken_in_its_range_and_refused_beside_it() {
    assert_range(Setting::MaxAgeMs, 20, 5_000, |n| {
        display(|c| c.max_age_ms = n as u16)
    });
    assert_range(Setting::FadeInMs, 1, 1_000, |n| {
        display(|c| c.fade_in_ms = n as u16)
    });
    assert_range(Setting::FadeOutMs, 1, 1_000, |n| {
        display(|c| c.fade_out_ms = n as u16)
    });
    assert_range(Setting::PitchUm, 100, 10_000, |n| {
        display(|c| c.pitch_um = n as u16)
    });
    assert_range(Setting::AmplitudeMv, 0, 5_000, |n| {
        display(|c| c.amplitude_mv = n as u16)
    });
}

#[test]
fn the_first_setting_out_of_its_range_is_named() {
    let refused = sensor(|c| {
        c.gauges = 0;
        c.bank_candidates = 0;
        c.arm_full_scale_um_s = 0;
    });
    assert_eq!(refused, Err(Setting::Gauges));
}
