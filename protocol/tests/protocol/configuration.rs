//! What a board takes as its configuration, and which setting it names if it does not.

use protocol::actuators::{self, grid};
use protocol::{
    Configuration, Configure, DEFAULT_ACTUATORS, DisplayConfiguration, Refusal,
    SensorConfiguration, Setting, UpdateRate,
};

/// The answer to the sensor's default configuration with one change.
fn sensor(change: impl FnOnce(&mut SensorConfiguration)) -> Result<(), Refusal> {
    let mut configuration = SensorConfiguration::DEFAULT;
    change(&mut configuration);
    configuration.check()
}

/// The answer to the display's default configuration with one change.
fn display(change: impl FnOnce(&mut DisplayConfiguration)) -> Result<(), Refusal> {
    let mut configuration = DisplayConfiguration::DEFAULT;
    change(&mut configuration);
    configuration.check()
}

/// That `check` takes both ends of `low..=high` and refuses their neighbours by the name of `setting`.
fn assert_range(setting: Setting, low: u32, high: u32, check: impl Fn(u32) -> Result<(), Refusal>) {
    let refusal = Refusal {
        setting,
        index: 0,
        low: low.into(),
        high: high.into(),
    };
    assert_eq!(check(low), Ok(()), "{setting:?} {low}");
    assert_eq!(check(high), Ok(()), "{setting:?} {high}");
    if let Some(below) = low.checked_sub(1) {
        assert_eq!(check(below), Err(refusal), "{below}");
    }
    assert_eq!(check(high + 1), Err(refusal), "{}", high + 1);
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
    assert_range(Setting::Waves, 2, 8, |n| sensor(|c| c.waves = n as u8));
    assert_range(Setting::ValidPercent, 50, 99, |n| {
        sensor(|c| c.valid_percent = n as u8)
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
    assert_range(Setting::GlideMs, 0, 500, |n| {
        display(|c| c.glide_ms = n as u16)
    });
    assert_range(Setting::ReferenceLsb, 0, 2_000, |n| {
        display(|c| c.reference_lsb = n as u16)
    });
    assert_range(Setting::ReferenceMn, 0, 60_000, |n| {
        display(|c| c.reference_mn = n as u16)
    });
    assert_range(Setting::FullDriveS, 10, 3_600, |n| {
        display(|c| c.full_drive_s = n as u16)
    });
    assert_range(Setting::AmplitudeMv, 0, 5_000, |n| {
        display(|c| c.amplitude_mv = n as u16)
    });
}

#[test]
fn a_rate_is_so_many_updates_a_second() {
    let rates = [UpdateRate::Hz2000, UpdateRate::Hz4000].map(UpdateRate::hz);
    assert_eq!(rates, [2_000, 4_000]);
}

#[test]
fn the_first_setting_out_of_its_range_is_named() {
    let refused = sensor(|c| {
        c.gauges = 0;
        c.waves = 0;
        c.arm_full_scale_um_s = 0;
    });
    assert_eq!(
        refused.map_err(|refusal| refusal.setting),
        Err(Setting::Gauges)
    );
}

#[test]
fn every_change_of_a_configuration_gives_it_another_hash() {
    let default = Configuration::Display(DisplayConfiguration::DEFAULT);
    let of = |change: fn(&mut DisplayConfiguration)| {
        let mut configuration = DisplayConfiguration::DEFAULT;
        change(&mut configuration);
        Configuration::Display(configuration).hash()
    };
    let hashes = [
        default.hash(),
        Configuration::Sensor(SensorConfiguration::DEFAULT).hash(),
        of(|c| c.amplitude_mv -= 1),
        of(|c| c.glide_ms += 1),
        of(|c| c.actuators ^= 1),
        of(|c| c.mode = protocol::Mode::Travelling),
        of(|c| c.rendering = protocol::Rendering::Shape),
        of(|c| c.reference_mn += 1),
    ];
    for (at, hash) in hashes.iter().enumerate() {
        assert!(!hashes[..at].contains(hash), "{at}");
    }
}

#[test]
fn a_configuration_replaces_what_it_names_or_anything_and_nothing_else() {
    let configuration = Configuration::Sensor(SensorConfiguration::DEFAULT);
    let in_force = configuration.hash();
    let asking = |replaces| Configure {
        replaces,
        configuration,
    };
    assert_eq!(Configure::anyway(configuration), asking(None));
    assert_eq!(asking(None).check_replaces(in_force), Ok(()));
    assert_eq!(asking(Some(in_force)).check_replaces(in_force), Ok(()));
    let refusal = Refusal {
        setting: Setting::Replaces,
        index: 0,
        low: in_force.into(),
        high: in_force.into(),
    };
    let asked = asking(Some(in_force ^ 1)).check_replaces(in_force);
    assert_eq!(asked, Err(refusal));
}

#[test]
fn the_default_grid_is_centred_and_its_neighbours_are_a_pitch_apart() {
    let actuators = grid(1_500);
    assert_eq!(actuators, DEFAULT_ACTUATORS);
    let sums = actuators.iter().fold((0, 0), |(x, y), a| {
        (x + i32::from(a.x_um), y + i32::from(a.y_um))
    });
    assert_eq!(sums, (0, 0));
    assert_eq!((actuators[0].x_um, actuators[0].y_um), (-6_750, -3_000));
    assert_eq!(actuators[1].x_um - actuators[0].x_um, 1_500);
    assert_eq!(actuators[10].y_um - actuators[0].y_um, 1_500);
    assert_eq!(actuators::check(&actuators), Ok(()));
    assert_eq!(actuators::check(&grid(4_000)), Ok(()));
}

#[test]
fn every_property_of_every_actuator_shows_in_the_hash() {
    let before = actuators::hash(&DEFAULT_ACTUATORS);
    for index in 0..DEFAULT_ACTUATORS.len() {
        let changes: [fn(&mut protocol::Actuator); 7] = [
            |a| a.x_um += 1,
            |a| a.y_um -= 1,
            |a| a.gain_q15 -= 1,
            |a| a.phase += 1,
            |a| a.inverted = true,
            |a| a.resonance_dhz += 200,
            |a| a.damping_percent += 1,
        ];
        for change in changes {
            let mut actuators = DEFAULT_ACTUATORS;
            change(&mut actuators[index]);
            assert_ne!(actuators::hash(&actuators), before, "{index}");
        }
    }
}
