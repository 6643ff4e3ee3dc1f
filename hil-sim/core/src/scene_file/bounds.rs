//! What the numbers of a scene may be: `bounds.toml`.

use std::sync::LazyLock;

use serde::Deserialize;

/// What a number may be, and the words for saying so.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Bounds {
    keys: Vec<String>,
    /// "is not {what}"
    pub what: String,
    /// "give {give}"
    pub give: String,
    low: Option<f64>,
    high: Option<f64>,
    above: Option<f64>,
    multiple_of: Option<f64>,
    #[serde(default)]
    is_not_zero: bool,
}

/// The file.
#[derive(Deserialize)]
struct All {
    bounds: Vec<Bounds>,
}

impl Bounds {
    /// Those of a key.
    pub fn of(key: &str) -> &'static Self {
        static ALL: LazyLock<All> =
            LazyLock::new(|| toml::from_str(include_str!("bounds.toml")).expect("tests read it"));
        let is_of = |bounds: &&Self| bounds.keys.iter().any(|known| known == key);
        ALL.bounds
            .iter()
            .find(is_of)
            .expect("tests ask for every key")
    }

    /// Whether they let a number pass, which has to be finite.
    pub fn allow(&self, number: f64) -> bool {
        self.low.is_none_or(|low| number >= low)
            && self.high.is_none_or(|high| number <= high)
            && self.above.is_none_or(|above| number > above)
            && self.multiple_of.is_none_or(|step| number % step == 0.0)
            && !(self.is_not_zero && number == 0.0)
    }
}
