//! The surface besides λ, on both ELFs: what the sensor tells of it, and that the display plays it.

use std::f64::consts::TAU;
use std::sync::Arc;

use hil_sim_core::run::recording::{Recording, volts};
use hil_sim_core::scene::{Gauges, Kinematic, Profile, Scene, Series};
use protocol::texture::measured;
use protocol::{DisplayConfiguration, Message, Rendering, Texture};
use tests::run::{Run, runs_of};

const WAVELENGTH_MM: f64 = 2.0;
const SPEED_MM_S: f64 = 40.0;
const DURATION_S: f64 = 6.0;
/// The second and the third partial: ratio, and phase in turns.
const SHAPE: [(f64, f64); 2] = [(0.5, 0.25), (0.3, 0.6)];

/// What a fingertip feels of the wave, under noise so many dB below its fundamental.
fn scene(snr_db: f64) -> Scene {
    let rows = (DURATION_S * SPEED_MM_S / 0.02) as u32 + 2_000;
    let at: Vec<f64> = (0..rows).map(|row| 0.02 * f64::from(row) - 20.0).collect();
    let felt = |x_mm: &f64| {
        let theta = TAU * x_mm / WAVELENGTH_MM;
        let partials = (2..).map(f64::from).zip(SHAPE);
        let partials = partials.map(|(n, (ratio, turns))| ratio * (n * theta + TAU * turns).sin());
        theta.sin() + partials.sum::<f64>()
    };
    let values = at.iter().map(felt).collect();
    let mut scene = Scene {
        duration_s: DURATION_S,
        gauges: Gauges::Kinematic(Kinematic {
            snr_db: Some(snr_db),
            ..Kinematic::default()
        }),
        ..Scene::constant(WAVELENGTH_MM, SPEED_MM_S)
    };
    scene.surface.profile = Profile::Felt(Arc::new(Series {
        at,
        values,
        width: 1,
    }));
    scene.display.configuration = DisplayConfiguration {
        rendering: Rendering::Texture,
        ..DisplayConfiguration::DEFAULT
    };
    scene
}

fn last_texture(run: &Run) -> Texture {
    let said = run.recording.signs.sensor.iter().rev();
    let mut valid = said.filter_map(|said| match &said.message {
        Message::Texture(texture) if texture.valid => Some(*texture),
        _ => None,
    });
    valid.next().expect("a texture is stood by")
}

/// Real and imaginary part of what an actuator plays at n times the wave's frequency, in the last second.
fn played(recording: &Recording, n: f64) -> [f64; 2] {
    let hz = n * SPEED_MM_S / WAVELENGTH_MM;
    let mut sums = [0.0; 2];
    for output in &recording.outputs {
        let t_s = output.at_ns as f64 * 1e-9;
        if t_s > DURATION_S - 1.0 {
            let (s, c) = (TAU * hz * t_s).sin_cos();
            let v = volts(output.words[0]);
            sums = [sums[0] + v * c, sums[1] + v * s];
        }
    }
    sums
}

fn db(ratio: f64, due: f64) -> f64 {
    (20.0 * (ratio / due).log10()).abs()
}

#[test]
fn partials_are_told_within_a_db_and_five_degrees_at_20_db_and_three_db_at_0_and_are_played() {
    let limits = [(20.0, 1.0, 5.0), (0.0, 3.0, 180.0)];
    let runs = runs_of(&limits, |(snr_db, ..)| scene(*snr_db));
    for (run, (snr_db, most_db, most_degrees)) in runs.iter().zip(limits) {
        let told = last_texture(run);
        let fundamental = played(&run.recording, 1.0);
        for (n, (partial, (ratio, turns))) in
            (2..).map(f64::from).zip(told.partials.iter().zip(SHAPE))
        {
            let what = format!("{snr_db} dB, partial {n}: {told:?}");
            let is = f64::from(measured(partial.ratio).expect("it is slow enough"));
            assert!(db(is, ratio) <= most_db, "{what}");
            let off = f64::from(partial.phase) / 65_536.0 - turns;
            assert!(360.0 * (off - off.round()).abs() <= most_degrees, "{what}");
            let [partial, fundamental] =
                [played(&run.recording, n), fundamental].map(|[re, im]| re.hypot(im));
            assert!(
                db(partial / fundamental, is) <= 1.0,
                "{what}: {partial} V of {fundamental} V"
            );
        }
    }
}
