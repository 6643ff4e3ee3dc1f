use std::f64::consts::TAU;

use super::super::BaseSignal;
use super::*;

/// A file with one channel of these bands, places in µm.
fn experience(bands: &str, library: &str) -> Experience {
    let text = format!(
        r#"{{"version":"2023","profile":"Main","level":1,"date":"2024-01-01T00:00:00Z","description":"",
        "avatars":[],"perceptions":[{{"id":0,"perception_modality":"Vibrotactile Texture","description":"",
        "avatar_id":0,"effect_library":[{library}],"unit_exponent":-6,"channels":[{{"id":0,"description":"",
        "gain":2.0,"mixing_coefficient":1,"bands":[{bands}]}}]}}]}}"#
    );
    Experience::parse(text.as_bytes()).unwrap()
}

fn band(kind: &str, effects: &str) -> String {
    format!(
        r#"{{{kind},"lower_frequency_limit":0,"upper_frequency_limit":10000,"effects":[{effects}]}}"#
    )
}

fn heights(bands: &str) -> Vec<(f64, f64)> {
    experience(bands, "").texture().unwrap().heights(0).unwrap()
}

fn refusal(bands: &str) -> String {
    let experience = experience(bands, "");
    experience
        .texture()
        .unwrap()
        .heights(0)
        .unwrap_err()
        .to_string()
}

const LINEAR: &str = r#""band_type":"Curve","curve_type":"Linear""#;
const CUBIC: &str = r#""band_type":"Curve","curve_type":"Cubic""#;
const WAVE: &str = r#""band_type":"VectorialWave""#;

fn curve(position: u64, points: &[(u64, f64)]) -> String {
    let keyframes: Vec<String> = points
        .iter()
        .map(|(at, a)| format!(r#"{{"relative_position":{at},"amplitude_modulation":{a}}}"#))
        .collect();
    format!(
        r#"{{"effect_type":"Basis","position":{position},"keyframes":[{}]}}"#,
        keyframes.join(",")
    )
}

#[test]
fn a_linear_curve_is_its_keyframes_in_mm_times_the_gain() {
    let points = heights(&band(
        LINEAR,
        &curve(1_000, &[(0, 0.0), (30, 0.5), (2_000, -1.0)]),
    ));
    let wanted = [(1.0, 0.0), (1.03, 1.0), (3.0, -2.0)];
    assert_eq!(points.len(), 3);
    for ((x_mm, height), (wanted_mm, wanted)) in points.into_iter().zip(wanted) {
        assert!((x_mm - wanted_mm).abs() < 1e-12 && (height - wanted).abs() < 1e-12);
    }
}

#[test]
fn a_cubic_curve_is_level_at_its_keyframes_and_bands_add_up() {
    let cubic = band(CUBIC, &curve(0, &[(0, 0.0), (1_000, 0.5)]));
    let linear = band(LINEAR, &curve(500, &[(0, 0.0), (500, 0.25)]));
    let points = heights(&format!("{cubic},{linear}"));
    assert_eq!(points.len(), 101);
    for (x_mm, height) in points {
        // 3 s² − 2 s³ of the way; from 0.5 mm on a line of 0.5 a mm on top. The gain is 2.
        let wanted = x_mm * x_mm * (3.0 - 2.0 * x_mm) + (x_mm - 0.5).max(0.0);
        assert!(
            (height - wanted).abs() < 1e-9,
            "{height} for {wanted} at {x_mm}"
        );
    }
}

#[test]
fn a_wave_of_500_cycles_a_metre_repeats_each_two_millimetres() {
    let effect = r#"{"effect_type":"Basis","phase":1.5707963267948966,"keyframes":[
        {"frequency_modulation":500,"amplitude_modulation":0.5},{"relative_position":10000}]}"#;
    let points = heights(&band(WAVE, effect));
    assert_eq!(points.len(), 1_001);
    for (x_mm, height) in points {
        let wanted = (TAU * (x_mm / 2.0 + 0.25)).sin();
        assert!(
            (height - wanted).abs() < 1e-9,
            "{height} for {wanted} at {x_mm}"
        );
    }
}

#[test]
fn a_chirp_turns_by_the_integral_of_its_frequency() {
    let effect = r#"{"effect_type":"Basis","base_signal":"SawToothUp","keyframes":[
        {"relative_position":0,"frequency_modulation":100,"amplitude_modulation":1},
        {"relative_position":4000,"frequency_modulation":300},
        {"relative_position":6000,"amplitude_modulation":0.5}]}"#;
    for (x_mm, height) in heights(&band(WAVE, effect)) {
        let x_m = x_mm * 1e-3;
        let cycles = if x_m < 4e-3 {
            100.0 * x_m + 0.5 * 200.0 / 4e-3 * x_m * x_m
        } else {
            0.8 + 300.0 * (x_m - 4e-3)
        };
        let amplitude = 1.0 - 0.5 * x_mm / 6.0;
        let wanted = 2.0 * amplitude * BaseSignal::SawToothUp.value(cycles);
        // Beside the tooth's edge rounding decides.
        let edge = (cycles - 0.5 - (cycles - 0.5).round()).abs() < 1e-6;
        assert!(
            edge || (height - wanted).abs() < 1e-6,
            "{height} for {wanted} at {x_mm}"
        );
    }
}

#[test]
fn base_signals_are_as_in_mpegs_reference_software() {
    for cycles in [-0.3, 0.1, 0.2, 0.4, 0.6, 0.9, 3.7] {
        let share: f64 = cycles - f64::floor(cycles);
        let square = 1.0 - 2.0 * share.round();
        assert_eq!(BaseSignal::Square.value(cycles), square, "{cycles}");
        let up = BaseSignal::SawToothUp.value(cycles);
        assert!((-1.0..=1.0).contains(&up));
        assert_eq!(up, -BaseSignal::SawToothDown.value(cycles));
    }
    assert_eq!(BaseSignal::Triangle.value(0.25), 1.0);
    assert_eq!(BaseSignal::Triangle.value(0.75), -1.0);
    assert_eq!(BaseSignal::Triangle.value(1.0), 0.0);
}

#[test]
fn a_reference_is_the_librarys_effect_at_its_place() {
    let library = curve(0, &[(0, 0.25), (1_000, 0.5)]).replacen('{', r#"{"id":7,"#, 1);
    let bands = band(
        LINEAR,
        r#"{"id":7,"effect_type":"Reference","position":2000}"#,
    );
    let experience = experience(&bands, &library);
    let points = experience.texture().unwrap().heights(0).unwrap();
    assert_eq!(points.len(), 2);
    assert!((points[0].0 - 2.0).abs() < 1e-12 && (points[1].0 - 3.0).abs() < 1e-12);
    assert_eq!((points[0].1, points[1].1), (0.5, 1.0));
}

#[test]
fn what_is_wrong_is_said_with_its_place_in_the_file() {
    let at = "perceptions[0].channels[0].bands[0]";
    for (bands, wanted) in [
        (
            band(r#""band_type":"WaveletWave""#, ""),
            format!("{at}.band_type: WaveletWave is not read here"),
        ),
        (
            band(r#""band_type":"Curve","curve_type":"Akima""#, ""),
            format!("{at}.curve_type: Akima is not read here"),
        ),
        (
            band(r#""band_type":"Curve""#, ""),
            format!("{at}.curve_type: nothing is not read here"),
        ),
        (
            band(LINEAR, r#"{"effect_type":"Composite"}"#),
            format!("{at}.effects[0].effect_type: Composite is not read here"),
        ),
        (
            band(LINEAR, r#"{"effect_type":"Reference","id":3}"#),
            format!("{at}.effects[0].id: is not in effect_library"),
        ),
        (
            band(LINEAR, &curve(0, &[(0, 0.0), (5, 1.5)])),
            format!("{at}.effects[0].keyframes[1].amplitude_modulation: 1.5: give −1 to 1"),
        ),
        (
            band(LINEAR, &curve(0, &[(5, 0.0), (5, 0.5)])),
            format!("{at}.effects[0].keyframes[1].relative_position: 5 does not increase"),
        ),
        (
            band(
                LINEAR,
                r#"{"effect_type":"Basis","keyframes":[{"relative_position":1}]}"#,
            ),
            format!("{at}.effects[0].keyframes[0].amplitude_modulation: is missing"),
        ),
        (
            band(WAVE, &curve(0, &[(0, 0.5)])),
            format!("{at}.effects[0].keyframes: a wave has no frequency_modulation"),
        ),
        (
            band(
                LINEAR,
                &[curve(0, &[(0, 0.0), (9, 0.5)]), curve(5, &[(0, 0.0)])].join(","),
            ),
            format!("{at}.effects[1]: begins at 5, before the one before it ends, at 9"),
        ),
        (
            band(LINEAR, &curve(u64::MAX, &[(9, 0.0)])),
            format!("{at}.effects[0]: its end is beyond all numbers"),
        ),
        (
            band(LINEAR, &curve(0, &[(0, 0.0), (1_000_000_000_000, 0.0)])),
            format!("{at}.effects[0]: ends beyond 100000 mm"),
        ),
        (
            band(CUBIC, &curve(0, &[(0, 0.0), (20_000_000, 0.0)])),
            "perceptions[0].channels[0]: is 20000 mm long: give 10000 mm at most".to_owned(),
        ),
        (
            band(LINEAR, ""),
            "perceptions[0].channels[0]: has no keyframes".to_owned(),
        ),
    ] {
        let refusal = refusal(&bands);
        assert!(refusal.starts_with(&wanted), "{refusal}\nwanted {wanted}");
    }
}

#[test]
fn a_file_that_is_broken_is_refused_with_line_and_field() {
    let whole = experience("", "").text().unwrap();
    let cut = Experience::parse(&whole.as_bytes()[..whole.len() / 2]).unwrap_err();
    assert_eq!(cut.line, Some(1));
    assert!(cut.message.contains("EOF"), "{cut}");
    let text = whole.replace("\"gain\":2.0", "\n\"gain\":\"loud\"");
    let wrong = Experience::parse(text.as_bytes()).unwrap_err();
    assert_eq!(wrong.line, Some(2));
    assert_eq!(wrong.place, "perceptions[0].channels[0].gain");
    let text = whole.replace("\"gain\":2.0,", "");
    let missing = Experience::parse(text.as_bytes()).unwrap_err();
    assert_eq!(missing.place, "perceptions[0].channels[0]");
    assert!(
        missing.message.starts_with("missing field `gain`"),
        "{missing}"
    );
    let behind = Experience::parse(format!("{whole}]").as_bytes()).unwrap_err();
    assert!(behind.message.contains("trailing"), "{behind}");
    let text = whole.replace(TEXTURE, "Force");
    let other = Experience::parse(text.as_bytes()).unwrap();
    let refusal = other.texture().unwrap_err().to_string();
    assert_eq!(
        refusal,
        "perceptions: none of [\"Force\"] is a \"Vibrotactile Texture\": give a file with a texture"
    );
}
