//! What a texture's channel says over place.

use super::piece::{Piece, Shape};
use super::tracer::Tracer;
use super::{
    Band, BandType, Channel, CurveType, Effect, EffectType, Experience, FARTHEST_MM, HjifError,
    Perception, TEXTURE, UNIT_EXPONENT,
};

#[cfg(test)]
mod tests;

/// Spacing at which sums of bands, cubic curves and waves are sampled, in mm: a tenth of the standard's shortest
/// wave.
pub const SAMPLED_MM: f64 = 0.01;
/// The longest texture that is sampled, in mm.
pub const MOST_SAMPLED_MM: f64 = 10_000.0;
/// Units of place that are taken, as powers of ten of a m.
const EXPONENTS: std::ops::RangeInclusive<i32> = -12..=3;
/// A sample so close to an effect's end, in samples, is on it.
const ON: f64 = 1e-6;

/// The texture of an experience.
#[derive(Clone, Copy, Debug)]
pub struct Texture<'e> {
    perception: &'e Perception,
    /// Its path in the file.
    at: usize,
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
