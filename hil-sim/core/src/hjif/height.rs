//! What a texture's channel says over place.

use std::f64::consts::TAU;

use super::{
    Band, BandType, BaseSignal, Channel, CurveType, Effect, EffectType, Experience, HjifError,
    Keyframe, Perception, TEXTURE, UNIT_EXPONENT,
};

/// Spacing at which sums of bands, cubic curves and waves are sampled, in mm: a tenth of the standard's shortest
/// wave.
pub const SAMPLED_MM: f64 = 0.01;
/// The longest texture that is sampled, in mm.
pub const MOST_SAMPLED_MM: f64 = 10_000.0;
/// The farthest place of any texture, in mm.
const FARTHEST_MM: f64 = 100_000.0;
/// Units of place that are taken, as powers of ten of a m.
const EXPONENTS: std::ops::RangeInclusive<i32> = -12..=3;
/// What amplitudes may be.
const AMPLITUDES: std::ops::RangeInclusive<f64> = -1.0..=1.0;
/// What frequencies may be, in cycles per m.
const FREQUENCIES: std::ops::RangeInclusive<f64> = 0.0..=10_000.0;
/// A sample so close to an effect's end, in samples, is on it.
const ON: f64 = 1e-6;

/// The texture of an experience.
#[derive(Clone, Copy, Debug)]
pub struct Texture<'e> {
    perception: &'e Perception,
    /// Its path in the file.
    at: usize,
}

/// A shape between points: place in the perception's units from the effect's beginning, and value.
type Points = Vec<(f64, f64)>;

/// An effect with its keyframes, and where it lies, in the perception's units.
struct Piece {
    start: u64,
    end: u64,
    shape: Shape,
}

enum Shape {
    /// Straight from point to point.
    Linear(Points),
    /// Level at each point.
    Cubic(Points),
    /// Cycles are the integral of frequency over place, in m.
    Wave {
        base: BaseSignal,
        /// In cycles.
        ahead: f64,
        amplitudes: Points,
        frequencies: Points,
    },
}

impl Experience {
    /// Its texture.
    ///
    /// # Errors
    /// If it has none or several.
    pub fn texture(&self) -> Result<Texture<'_>, HjifError> {
        let mut found = self
            .perceptions
            .iter()
            .enumerate()
            .filter(|(_, perception)| perception.perception_modality == TEXTURE);
        match (found.next(), found.next()) {
            (Some((at, perception)), None) => Ok(Texture { perception, at }),
            (None, _) => {
                let kinds: Vec<&str> = self
                    .perceptions
                    .iter()
                    .map(|perception| perception.perception_modality.as_str())
                    .collect();
                let message =
                    format!("none of {kinds:?} is a \"{TEXTURE}\": give a file with a texture");
                Err(HjifError::at("perceptions", message))
            }
            (_, Some((at, _))) => Err(HjifError::at(
                format!("perceptions[{at}]"),
                "is a second texture: leave one in the file",
            )),
        }
    }
}

impl<'e> Texture<'e> {
    /// Its channels.
    pub fn channels(&self) -> &'e [Channel] {
        &self.perception.channels
    }

    /// What a channel, by its index, says: places in mm, rising, and what is felt there, with straight lines in
    /// between. A single linear curve gives its own keyframes; all else is sampled [`SAMPLED_MM`] apart.
    ///
    /// # Errors
    /// If there is no such channel, it holds what is not evaluated here, or what the standard does not allow.
    pub fn heights(&self, channel: usize) -> Result<Vec<(f64, f64)>, HjifError> {
        let path = format!("perceptions[{}].channels[{channel}]", self.at);
        let Some(channel) = self.channels().get(channel) else {
            return Err(HjifError::at(path, "there is no such channel"));
        };
        let exponent = self.perception.unit_exponent.unwrap_or(UNIT_EXPONENT);
        if !EXPONENTS.contains(&exponent) {
            let message = format!("{exponent} is no unit of a fingertip's way: give −12 to 3");
            let place = format!("perceptions[{}].unit_exponent", self.at);
            return Err(HjifError::at(place, message));
        }
        if channel.gain < 0.0 {
            let message = format!("{} is negative: give 0 or more", channel.gain);
            return Err(HjifError::at(format!("{path}.gain"), message));
        }
        let metre = 10f64.powi(exponent);
        let mut pieces = Vec::new();
        for (at, band) in channel.bands.iter().enumerate() {
            pieces.extend(self.pieces(band, &format!("{path}.bands[{at}]"), metre)?);
        }
        let mm = metre * 1e3;
        let start = pieces.iter().map(|piece| piece.start).min();
        let end = pieces.iter().map(|piece| piece.end).max();
        let (Some(start), Some(end)) = (start, end) else {
            return Err(HjifError::at(path, "has no keyframes: nothing is felt"));
        };
        let (start_mm, end_mm) = (start as f64 * mm, end as f64 * mm);
        if end_mm > FARTHEST_MM {
            let message = format!(
                "ends at {end_mm} mm: give {FARTHEST_MM} mm at most, or another unit_exponent"
            );
            return Err(HjifError::at(path, message));
        }
        if let [piece] = &pieces[..]
            && let Shape::Linear(points) = &piece.shape
        {
            let height =
                |&(at, value): &(f64, f64)| ((start as f64 + at) * mm, value * channel.gain);
            return Ok(points.iter().map(height).collect());
        }
        let length_mm = end_mm - start_mm;
        if length_mm > MOST_SAMPLED_MM {
            let message = format!(
                "is {length_mm} mm long: give {MOST_SAMPLED_MM} mm at most, or a single linear curve"
            );
            return Err(HjifError::at(path, message));
        }
        let samples = (length_mm / SAMPLED_MM + ON).floor() as usize;
        let mut heights = vec![0.0; samples + 1];
        for piece in &pieces {
            let sample = |place: u64| (place as f64 * mm - start_mm) / SAMPLED_MM;
            let first = (sample(piece.start) - ON).ceil() as usize;
            let last = ((sample(piece.end) + ON).floor() as usize).min(samples);
            let mut shape = Tracer::new(&piece.shape, metre);
            for (sample, height) in heights.iter_mut().enumerate().take(last + 1).skip(first) {
                let place = (start_mm + sample as f64 * SAMPLED_MM) / mm;
                *height += shape.value(place - piece.start as f64);
            }
        }
        let height = |(sample, height): (usize, f64)| {
            let x_mm = start_mm + sample as f64 * SAMPLED_MM;
            (x_mm, height.clamp(-1.0, 1.0) * channel.gain)
        };
        Ok(heights.into_iter().enumerate().map(height).collect())
    }

    /// The effects of a band that have keyframes, one behind the other. A unit of place is `metre` m.
    fn pieces(&self, band: &Band, path: &str, metre: f64) -> Result<Vec<Piece>, HjifError> {
        let refused = match (band.band_type, band.curve_type) {
            (BandType::VectorialWave, _)
            | (BandType::Curve, Some(CurveType::Linear | CurveType::Cubic)) => None,
            (BandType::Curve, Some(curve)) => Some(("curve_type", format!("{curve:?}"))),
            (BandType::Curve, None) => Some(("curve_type", "nothing".to_owned())),
            (kind, _) => Some(("band_type", format!("{kind:?}"))),
        };
        if let Some((field, value)) = refused {
            let message = format!(
                "{value} is not read here: give linear or cubic curves, or vectorial waves"
            );
            return Err(HjifError::at(format!("{path}.{field}"), message));
        }
        let mut pieces: Vec<(usize, Piece)> = Vec::with_capacity(band.effects.len());
        for (at, effect) in band.effects.iter().enumerate() {
            let path = format!("{path}.effects[{at}]");
            let (basis, place) = self.basis(effect, &path)?;
            if !basis.keyframes.is_empty() {
                let start = effect.position.unwrap_or(0);
                pieces.push((at, Piece::of(band, basis, start, &place, metre)?));
            }
        }
        pieces.sort_by_key(|(_, piece)| piece.start);
        for pair in pieces.windows(2) {
            if let [(_, before), (at, after)] = pair
                && after.start < before.end
            {
                let message = format!(
                    "begins at {}, before the one before it ends, at {}: give them one after the other, or another band",
                    after.start, before.end
                );
                return Err(HjifError::at(format!("{path}.effects[{at}]"), message));
            }
        }
        Ok(pieces.into_iter().map(|(_, piece)| piece).collect())
    }

    /// The effect with the keyframes, and its path: the effect itself, or the library's that it refers to.
    fn basis(&self, effect: &'e Effect, path: &str) -> Result<(&'e Effect, String), HjifError> {
        let composite = |path: &str| {
            let message = "Composite is not read here: give basis effects or references";
            HjifError::at(format!("{path}.effect_type"), message)
        };
        match effect.effect_type {
            EffectType::Basis => Ok((effect, path.to_owned())),
            EffectType::Composite => Err(composite(path)),
            EffectType::Reference => {
                let mut library = self.perception.effect_library.iter().enumerate();
                let wanted =
                    library.find(|(_, found)| effect.id.is_some() && found.id == effect.id);
                let Some((at, found)) = wanted else {
                    let message = "is not in effect_library: give the id of one that is";
                    return Err(HjifError::at(format!("{path}.id"), message));
                };
                let path = format!("perceptions[{}].effect_library[{at}]", self.at);
                match found.effect_type {
                    EffectType::Basis => Ok((found, path)),
                    EffectType::Composite | EffectType::Reference => Err(composite(&path)),
                }
            }
        }
    }
}

impl Piece {
    fn of(
        band: &Band,
        effect: &Effect,
        start: u64,
        path: &str,
        metre: f64,
    ) -> Result<Self, HjifError> {
        let is_wave = band.band_type == BandType::VectorialWave;
        let (mut amplitudes, mut frequencies) = (Points::new(), Points::new());
        let mut last = None;
        for (at, keyframe) in effect.keyframes.iter().enumerate() {
            let refuse = |field: &str, message: String| {
                Err(HjifError::at(
                    format!("{path}.keyframes[{at}].{field}"),
                    message,
                ))
            };
            let place = match keyframe.relative_position {
                Some(place) => place,
                None if is_wave => 0,
                None => {
                    let message = "is missing: a curve's keyframes have places".to_owned();
                    return refuse("relative_position", message);
                }
            };
            if let Some(before) = last
                && (place < before || place == before && !is_wave)
            {
                let message = format!("{place} does not increase, after {before}");
                return refuse("relative_position", message);
            }
            last = Some(place);
            let Keyframe {
                amplitude_modulation,
                frequency_modulation,
                ..
            } = *keyframe;
            match amplitude_modulation {
                Some(amplitude) if !AMPLITUDES.contains(&amplitude) => {
                    return refuse("amplitude_modulation", format!("{amplitude}: give −1 to 1"));
                }
                Some(amplitude) => amplitudes.push((place as f64, amplitude)),
                None if is_wave => {}
                None => {
                    let message = "is missing: a curve's keyframes have amplitudes".to_owned();
                    return refuse("amplitude_modulation", message);
                }
            }
            match frequency_modulation {
                Some(frequency) if !FREQUENCIES.contains(&frequency) => {
                    return refuse(
                        "frequency_modulation",
                        format!("{frequency}: give 0 to 10 000"),
                    );
                }
                Some(frequency) => frequencies.push((place as f64, frequency)),
                None => {}
            }
        }
        let shape = if is_wave {
            if frequencies.is_empty() {
                let message = "a wave has no frequency_modulation: give one at least";
                return Err(HjifError::at(format!("{path}.keyframes"), message));
            }
            if amplitudes.is_empty() {
                amplitudes.push((0.0, 1.0));
            }
            Shape::Wave {
                base: effect.base_signal.unwrap_or(BaseSignal::Sine),
                ahead: effect.phase.unwrap_or(0.0) / TAU,
                amplitudes,
                frequencies,
            }
        } else if band.curve_type == Some(CurveType::Cubic) {
            Shape::Cubic(amplitudes)
        } else {
            Shape::Linear(amplitudes)
        };
        let Some(end) = start.checked_add(last.unwrap_or(0)) else {
            return Err(HjifError::at(
                path,
                "its end is beyond all numbers: give a nearer one",
            ));
        };
        // So that an end can be told from the place beside it.
        if end as f64 * metre * 1e3 > FARTHEST_MM {
            let message = format!("ends beyond {FARTHEST_MM} mm: give another unit_exponent");
            return Err(HjifError::at(path, message));
        }
        Ok(Self { start, end, shape })
    }
}

/// Follows a shape from place to place, forwards.
struct Tracer<'s> {
    shape: &'s Shape,
    /// m in a unit of place.
    metre: f64,
    /// The point after the last place.
    amplitude: usize,
    frequency: usize,
    /// Cycles up to the frequency's point before.
    cycles: f64,
}

impl<'s> Tracer<'s> {
    const fn new(shape: &'s Shape, metre: f64) -> Self {
        Self {
            shape,
            metre,
            amplitude: 0,
            frequency: 0,
            cycles: 0.0,
        }
    }

    /// The value at a place from the effect's beginning; places rise from call to call.
    fn value(&mut self, place: f64) -> f64 {
        match self.shape {
            Shape::Linear(points) => between(points, &mut self.amplitude, place, |share| share),
            Shape::Cubic(points) => between(points, &mut self.amplitude, place, |share| {
                share * share * (3.0 - 2.0 * share)
            }),
            Shape::Wave {
                base,
                ahead,
                amplitudes,
                frequencies,
            } => {
                let amplitude = between(amplitudes, &mut self.amplitude, place, |share| share);
                amplitude * base.value(ahead + self.turned(frequencies, place))
            }
        }
    }

    /// Cycles from the effect's beginning: the first frequency holds before its point, the last behind it.
    fn turned(&mut self, frequencies: &[(f64, f64)], place: f64) -> f64 {
        while let Some(&(next, after)) = frequencies.get(self.frequency)
            && next <= place
        {
            let (at, before) = match self.frequency.checked_sub(1) {
                Some(index) => frequencies[index],
                None => (0.0, after),
            };
            self.cycles += 0.5 * (before + after) * (next - at) * self.metre;
            self.frequency += 1;
        }
        let mut next = self.frequency;
        let here = between(frequencies, &mut next, place, |share| share);
        let (at, before) = match self.frequency.checked_sub(1) {
            Some(index) => frequencies[index],
            None => (0.0, here),
        };
        self.cycles + 0.5 * (before + here) * (place - at) * self.metre
    }
}

/// The value at a place: `ease` says which share of the way from point to point is gone. `next` is the point after the
/// last place that was asked for.
fn between(points: &[(f64, f64)], next: &mut usize, place: f64, ease: impl Fn(f64) -> f64) -> f64 {
    while points.get(*next).is_some_and(|&(at, _)| at <= place) {
        *next += 1;
    }
    match (
        next.checked_sub(1).map(|before| points[before]),
        points.get(*next),
    ) {
        (Some((from, before)), Some(&(to, after))) => {
            before + (after - before) * ease((place - from) / (to - from))
        }
        (Some((_, only)), None) | (None, Some(&(_, only))) => only,
        (None, None) => 0.0,
    }
}

impl BaseSignal {
    /// The wave after so many cycles.
    fn value(self, cycles: f64) -> f64 {
        let share = cycles - cycles.floor();
        match self {
            Self::Sine => (TAU * share).sin(),
            Self::Square => {
                if share < 0.5 {
                    1.0
                } else {
                    -1.0
                }
            }
            Self::Triangle => {
                let from_crest = cycles - 0.25;
                1.0 - 4.0 * (from_crest.round() - from_crest).abs()
            }
            Self::SawToothUp => 2.0 * (cycles - (cycles + 0.5).floor()),
            Self::SawToothDown => 2.0 * ((cycles + 0.5).floor() - cycles),
        }
    }
}

#[cfg(test)]
mod tests {
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
}
