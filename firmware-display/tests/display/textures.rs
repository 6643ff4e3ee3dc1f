//! What the display does with what it is told of the surface besides λ.

use firmware_display::{ACTUATORS, ZERO_VOLT};
use protocol::{DisplayConfiguration, DisplayState, Friction, Partial, Rendering, Texture};

use crate::rig::Rig;

const SHAPE: DisplayConfiguration = DisplayConfiguration {
    rendering: Rendering::Shape,
    ..DisplayConfiguration::DEFAULT
};

/// A sine with a strong third partial, which flattens it.
fn texture(sequence: u32) -> Texture {
    Texture {
        sequence,
        valid: true,
        partials: [
            Partial::default(),
            Partial {
                ratio: 333,
                phase: 0,
            },
        ],
        ..Texture::default()
    }
}

fn weak(sequence: u32) -> Texture {
    Texture {
        sequence,
        friction: Some(Friction {
            mean_mn: 900,
            fluctuation_mn: 50,
        }),
        ..Texture::default()
    }
}

/// The largest offset from 0 V in 200 ms of rubbing, in steps.
fn peak(rig: &mut Rig, wavelength_mm: f32) -> u16 {
    let mut peak = 0;
    rig.rub_while(200, wavelength_mm, |rig| {
        let words: &[u16; ACTUATORS] = rig.display.words();
        peak = peak.max(words[0].abs_diff(ZERO_VOLT));
        true
    });
    peak
}

/// The peak of the sine, 5 V, and of the flattened one: 0.84 of sin 45° · 4/3, and up to 2 % less for what may be between
/// the places at which its peak was looked for.
fn is_sine(rig: &mut Rig, wavelength_mm: f32) -> bool {
    match peak(rig, wavelength_mm) {
        32_700..=32_767 => true,
        25_400..=25_960 => false,
        other => panic!("neither: {other}"),
    }
}

fn settle(rig: &mut Rig, wavelength_mm: f32) {
    rig.rub(60, wavelength_mm);
}

#[test]
fn a_valid_texture_is_played_until_it_is_too_old() {
    let mut rig = Rig::driving(&SHAPE);
    assert!(is_sine(&mut rig, 2.0));
    rig.display.on_texture(&texture(1));
    settle(&mut rig, 2.0);
    assert!(!is_sine(&mut rig, 2.0));
    // 260 ms old; a second one keeps it.
    rig.display.on_texture(&texture(2));
    rig.rub(280, 2.0);
    assert!(!is_sine(&mut rig, 2.0));
    // 480 ms, then 500 and the glide.
    rig.rub(90, 2.0);
    assert!(is_sine(&mut rig, 2.0));
    assert_eq!(rig.state(), DisplayState::Driving);
}

#[test]
fn what_a_lower_age_makes_too_old_is_played_no_longer() {
    let mut rig = Rig::driving(&DisplayConfiguration {
        max_age_ms: 5_000,
        reference_mn: 200,
        ..SHAPE
    });
    rig.display.on_texture(&Texture {
        friction: weak(0).friction,
        ..texture(1)
    });
    settle(&mut rig, 2.0);
    tell_of_none(&mut rig, 2..11);
    assert!(peak(&mut rig, 2.0) < 8_192, "flattened and weak");
    // Neither the wave is as young as that, nor what was told of the force in the last 450 ms of textures.
    rig.configure(&DisplayConfiguration {
        max_age_ms: 400,
        reference_mn: 200,
        ..SHAPE
    });
    settle(&mut rig, 2.0);
    assert!(is_sine(&mut rig, 2.0));
}

#[test]
fn what_is_not_stood_by_late_unsound_or_one_too_many_changes_nothing() {
    let mut rig = Rig::driving(&SHAPE);
    rig.display.on_texture(&Texture {
        sequence: 10,
        ..Texture::default()
    });
    rig.display.on_texture(&texture(9));
    rig.display.on_texture(&Texture {
        bands: [0, 0, 0, 10_001],
        ..texture(11)
    });
    rig.display.on_texture(&Texture {
        valid: false,
        ..texture(12)
    });
    settle(&mut rig, 2.0);
    assert!(is_sine(&mut rig, 2.0));
    let counters = rig.display.counters();
    assert_eq!((counters.refused_estimates, counters.implausible), (1, 1));
    assert_eq!(counters.flooded, 0);
    for sequence in 20..40 {
        rig.display.on_texture(&Texture {
            valid: false,
            ..texture(sequence)
        });
    }
    rig.display.on_texture(&texture(40));
    settle(&mut rig, 2.0);
    assert!(is_sine(&mut rig, 2.0));
    assert!(rig.display.counters().flooded >= 12);
    // Textures are no reason to hold.
    assert_eq!(rig.state(), DisplayState::Driving);
}

#[test]
fn another_surface_is_a_sine_until_its_own_texture_comes() {
    let mut rig = Rig::driving(&SHAPE);
    rig.display.on_texture(&texture(1));
    settle(&mut rig, 2.0);
    assert!(!is_sine(&mut rig, 2.0));
    // A drift keeps it, a jump by more than 2.1 does not.
    rig.display.on_texture(&texture(2));
    settle(&mut rig, 3.0);
    assert!(!is_sine(&mut rig, 3.0));
    rig.display.on_texture(&texture(3));
    rig.rub(100, 1.2);
    assert!(is_sine(&mut rig, 1.2));
    rig.display.on_texture(&texture(4));
    settle(&mut rig, 1.2);
    assert!(!is_sine(&mut rig, 1.2));
}

#[test]
fn in_the_fundamental_no_texture_changes_a_word() {
    let mut told = Rig::driving(&DisplayConfiguration::DEFAULT);
    let mut untold = Rig::driving(&DisplayConfiguration::DEFAULT);
    for sequence in 1..40 {
        told.display.on_texture(&Texture {
            friction: weak(0).friction,
            ..texture(sequence)
        });
        for _ in 0..100 {
            told.move_on();
            untold.move_on();
            assert_eq!(told.display.words(), untold.display.words());
        }
    }
}

const WEIGHED: DisplayConfiguration = DisplayConfiguration {
    reference_mn: 200,
    ..DisplayConfiguration::DEFAULT
};

/// The sensor goes on, and tells of no friction for so long.
fn tell_of_none(rig: &mut Rig, sequences: std::ops::Range<u32>) {
    for sequence in sequences {
        rig.rub(50, 2.0);
        rig.display.on_texture(&Texture {
            sequence,
            ..Texture::default()
        });
    }
}

#[test]
fn what_rubs_little_is_played_weakly_until_the_sensor_has_told_of_none_for_long() {
    let mut rig = Rig::driving(&WEIGHED);
    assert!(is_sine(&mut rig, 2.0));
    // Friction counts though the wave is not stood by.
    rig.display.on_texture(&weak(1));
    settle(&mut rig, 2.0);
    let peak_then = peak(&mut rig, 2.0);
    assert!((8_170..=8_192).contains(&peak_then), "{peak_then}");
    // 500 ms, then one more.
    tell_of_none(&mut rig, 2..12);
    let peak_then = peak(&mut rig, 2.0);
    assert!((8_170..=8_192).contains(&peak_then), "{peak_then}");
    tell_of_none(&mut rig, 12..13);
    settle(&mut rig, 2.0);
    assert!(is_sine(&mut rig, 2.0));
}

#[test]
fn what_rubs_little_does_not_burst_out_where_a_link_fails_or_a_hand_has_rested() {
    let mut rig = Rig::driving(&WEIGHED);
    rig.display.on_texture(&weak(1));
    settle(&mut rig, 2.0);
    // Neither estimates nor textures, until all is at 0 V, and then estimates alone.
    let mut loudest = 0;
    for _ in 0..rig.ticks(1_500) {
        rig.move_on();
        loudest = loudest.max(rig.display.words()[0].abs_diff(ZERO_VOLT));
    }
    assert!(rig.is_silent());
    loudest = loudest.max(peak(&mut rig, 2.0));
    // A sensor tells of no texture while its arm rests.
    for _ in 0..rig.ticks(2_000) {
        rig.tick(0);
        loudest = loudest.max(rig.display.words()[0].abs_diff(ZERO_VOLT));
    }
    loudest = loudest.max(peak(&mut rig, 2.0));
    assert!((8_170..=8_192).contains(&loudest), "{loudest}");
}

#[test]
fn a_new_rendering_comes_into_force_through_silence() {
    let mut rig = Rig::driving(&DisplayConfiguration::DEFAULT);
    rig.configure(&SHAPE);
    rig.rub(5, 2.0);
    let mut silent = 0;
    rig.rub_while(20, 2.0, |rig| {
        silent += u32::from(rig.is_silent());
        true
    });
    assert!(silent > 0);
    rig.display.on_texture(&texture(1));
    settle(&mut rig, 2.0);
    assert!(!is_sine(&mut rig, 2.0));
}
