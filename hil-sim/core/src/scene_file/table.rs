//! Takes a TOML table apart, key by key, so that every refusal can say its file, line and key.

use std::ops::Range;
use std::path::{Path, PathBuf};

use protocol::GAUGES;
use strum::VariantArray;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::bounds::Bounds;
use super::csv_rows::{cut_list, quoted, shortened};
use super::line::line_at;
use crate::scene::SceneError;

/// The section that a line begins: a line of a list over several is none.
fn header(line: &str) -> Option<&str> {
    let line = line.split('#').next()?.trim();
    let name = line.strip_prefix('[')?.strip_suffix(']')?;
    let name = name.trim_matches(['[', ']', ' ']);
    name.starts_with(|first: char| first.is_ascii_alphabetic())
        .then_some(name)
}

/// The scene's text and where it came from.
pub(super) struct Source<'t> {
    path: &'t Path,
    text: &'t str,
}

/// A table of the scene, or its absence; it remembers which keys it was asked for.
pub(super) struct Table<'t> {
    source: &'t Source<'t>,
    path: String,
    offset: usize,
    entries: Option<&'t DeTable<'t>>,
    asked: Vec<&'static str>,
    /// Keys that earlier versions asked for.
    retired: Vec<&'static str>,
}

type Value<'t> = Spanned<DeValue<'t>>;

/// A column of a file: by its name or by its number, from 0 on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column<'t> {
    Named(&'t str),
    Numbered(usize),
}

impl std::fmt::Display for Column<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Named(name) => formatter.write_str(&quoted(name)),
            Self::Numbered(number) => write!(formatter, "{number}"),
        }
    }
}

impl<'t> Source<'t> {
    pub fn new(path: &'t Path, text: &'t str) -> Self {
        Self { path, text }
    }

    pub fn parse(&self) -> Result<DeTable<'t>, SceneError> {
        match DeTable::parse(self.text) {
            Ok(table) => Ok(table.into_inner()),
            Err(error) => {
                let span = error.span().unwrap_or_default();
                // That it stands there twice does not say which.
                let key = match error.message() {
                    "duplicate key" => self.key_at(span.clone()),
                    _ => String::new(),
                };
                let message = format!("{}: mend the TOML", error.message());
                Err(self.error(span.start, &key, message))
            }
        }
    }

    /// The key that stands there, with its section.
    fn key_at(&self, span: Range<usize>) -> String {
        let key = self.text.get(span.clone()).unwrap_or_default();
        let before = self.text.get(..span.start).unwrap_or_default();
        match before.lines().rev().find_map(header) {
            Some(section) if !before.trim_end().ends_with('[') => format!("{section}.{key}"),
            _ => key.to_owned(),
        }
    }

    pub fn error(&self, offset: usize, key: &str, message: String) -> SceneError {
        SceneError {
            file: self.path.display().to_string(),
            line: Some(line_at(self.text.as_bytes(), offset)),
            key: shortened(key),
            message,
        }
    }

    /// The path of a file that the scene names: relative to the scene's own.
    pub fn beside(&self, name: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(name)
    }
}

impl<'t> Table<'t> {
    /// The document itself.
    pub fn root(source: &'t Source<'t>, entries: &'t DeTable<'t>) -> Self {
        Self {
            source,
            path: String::new(),
            offset: 0,
            entries: Some(entries),
            asked: Vec::new(),
            retired: Vec::new(),
        }
    }

    /// A refusal of `key`, at its own line or, if it is absent, at its table's.
    pub fn refuse(&self, key: &str, message: impl Into<String>) -> SceneError {
        let offset = match self.entries.and_then(|entries| entries.get(key)) {
            Some(value) => value.span().start,
            None => self.offset,
        };
        self.source
            .error(offset, &self.path_of(key), message.into())
    }

    /// The path of the file that the section names; `give` says which there may be.
    pub fn file(&mut self, give: &str) -> Result<PathBuf, SceneError> {
        match self.text("file")? {
            Some("") => Err(self.refuse("file", format!("is empty: {give}"))),
            Some(name) => Ok(self.source.beside(name)),
            None => Err(self.refuse("file", format!("is missing: {give}"))),
        }
    }

    /// A refusal of the file that `file` names.
    pub fn unreadable(&self, path: &Path, error: &std::io::Error) -> SceneError {
        let path = cut_list(&path.display().to_string());
        let message =
            format!("{path} cannot be read: {error}: names are relative to the scene's own folder");
        self.refuse("file", message)
    }

    /// Whether there is `key`, which earlier versions asked for. Whatever it holds is let pass.
    pub fn retired(&mut self, key: &'static str) -> bool {
        self.retired.push(key);
        self.contains(key)
    }

    /// Lets keys pass that say what is so without them.
    pub fn let_pass(&mut self, keys: &[&'static str], is_nothing: impl Fn(&DeValue<'_>) -> bool) {
        for &key in keys {
            let value = self.entries.and_then(|entries| entries.get(key));
            if value.is_some_and(|value| is_nothing(value.get_ref())) {
                self.asked.push(key);
            }
        }
    }

    pub fn contains(&self, key: &str) -> bool {
        self.entries
            .is_some_and(|entries| entries.contains_key(key))
    }

    /// A section. If it is absent, all its keys are.
    pub fn table(&mut self, key: &'static str) -> Result<Table<'t>, SceneError> {
        match self.get(key) {
            None => Ok(self.inner(self.path_of(key), self.offset, None)),
            Some(value) => self.table_in(value, self.path_of(key)),
        }
    }

    /// The tables of an array; none if the key is absent.
    pub fn tables(&mut self, key: &'static str) -> Result<Vec<Table<'t>>, SceneError> {
        let items = self.of_type(key, "an array of tables", |value| value.as_array())?;
        let items = items.into_iter().flatten();
        let tables = items
            .enumerate()
            .map(|(index, item)| self.table_in(item, format!("{}[{index}]", self.path_of(key))));
        tables.collect()
    }

    /// A number within the key's [`Bounds`].
    pub fn number(&mut self, key: &'static str) -> Result<Option<f64>, SceneError> {
        self.bounded(key, Bounds::of(key))
    }

    /// A number that may not be absent.
    pub fn needed_number(&mut self, key: &'static str) -> Result<f64, SceneError> {
        let give = &Bounds::of(key).give;
        self.number(key)?
            .ok_or_else(|| self.refuse(key, format!("is missing: give {give}")))
    }

    /// A number from `low` to `high`; only a whole one if `whole`.
    pub fn between(
        &mut self,
        key: &'static str,
        low: f64,
        high: f64,
        whole: bool,
    ) -> Result<Option<f64>, SceneError> {
        let Some(number) = self.bounded(key, Bounds::of("any number"))? else {
            return Ok(None);
        };
        if (low..=high).contains(&number) && (!whole || number.fract() == 0.0) {
            return Ok(Some(number));
        }
        let kind = if whole { "whole number" } else { "number" };
        let message = format!("{number} is out of range: give a {kind} from {low} to {high}");
        Err(self.refuse(key, message))
    }

    fn bounded(&mut self, key: &'static str, bounds: &Bounds) -> Result<Option<f64>, SceneError> {
        let parsed = self.of_type(key, "a number", |value| match value {
            DeValue::Float(float) => Some(float.as_str().parse::<f64>().ok()),
            DeValue::Integer(integer) => {
                let whole = i64::from_str_radix(integer.as_str(), integer.radix());
                Some(whole.ok().map(|number| number as f64))
            }
            _ => None,
        })?;
        let Some(number) = parsed else {
            return Ok(None);
        };
        match number.filter(|number| number.is_finite() && bounds.allow(*number)) {
            Some(number) => Ok(Some(number)),
            None => {
                let span = self
                    .entries
                    .and_then(|entries| Some(entries.get(key)?.span()));
                let written = shortened(&self.source.text[span.unwrap_or_default()]);
                let Bounds { what, give, .. } = bounds;
                Err(self.refuse(key, format!("{written} is not {what}: give {give}")))
            }
        }
    }

    /// A whole number from `low` to `high`.
    pub fn whole(
        &mut self,
        key: &'static str,
        low: u64,
        high: u64,
    ) -> Result<Option<u64>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let give = format!("give a whole number from {low} to {high}");
        let DeValue::Integer(integer) = value.get_ref() else {
            return Err(self.wrong_type(value, key, "a whole number"));
        };
        match u64::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(number) if (low..=high).contains(&number) => Ok(Some(number)),
            _ => Err(self.refuse(
                key,
                format!(
                    "{} is out of range: {give}",
                    shortened(&integer.to_string())
                ),
            )),
        }
    }

    /// The same of a smaller type, `default` if the key is absent.
    pub fn whole_or<T: TryFrom<u64>>(
        &mut self,
        key: &'static str,
        (low, high): (u64, u64),
        default: T,
    ) -> Result<T, SceneError> {
        let given = self.whole(key, low, high)?;
        Ok(given
            .and_then(|whole| T::try_from(whole).ok())
            .unwrap_or(default))
    }

    pub fn text(&mut self, key: &'static str) -> Result<Option<&'t str>, SceneError> {
        self.of_type(key, "a text in quotes", |value| value.as_str())
    }

    pub fn boolean(&mut self, key: &'static str) -> Result<Option<bool>, SceneError> {
        self.of_type(key, "true or false", |value| value.as_bool())
    }

    /// What `parse` makes of a value, which has to be what is `wanted`.
    fn of_type<T>(
        &mut self,
        key: &'static str,
        wanted: &str,
        parse: impl Fn(&'t DeValue<'t>) -> Option<T>,
    ) -> Result<Option<T>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let parsed = parse(value.get_ref()).map(Some);
        parsed.ok_or_else(|| self.wrong_type(value, key, wanted))
    }

    /// One of the words in `built`, the first if the key is absent.
    pub fn choice<T: Copy>(
        &mut self,
        key: &'static str,
        built: &[(&str, T)],
    ) -> Result<T, SceneError> {
        let Some(word) = self.text(key)? else {
            return Ok(built[0].1);
        };
        if let Some((_, choice)) = built.iter().find(|(name, _)| *name == word) {
            return Ok(*choice);
        }
        let names: Vec<String> = built
            .iter()
            .map(|(name, _)| format!("\"{name}\""))
            .collect();
        let give = names.join(" or ");
        Err(self.refuse(key, format!("{} is unknown: give {give}", quoted(word))))
    }

    /// A variant by its name; none of them with the word `none`, or if the key is absent.
    pub fn variant<T: VariantArray + Into<&'static str> + Copy>(
        &mut self,
        key: &'static str,
        none: &str,
    ) -> Result<Option<T>, SceneError> {
        let named = T::VARIANTS
            .iter()
            .map(|&variant| (variant.into(), Some(variant)));
        let words: Vec<_> = std::iter::once((none, None)).chain(named).collect();
        self.choice(key, &words)
    }

    /// A list of gauge numbers, none of them twice.
    pub fn gauges(&mut self, key: &'static str) -> Result<[bool; GAUGES], SceneError> {
        let mut chosen = [false; GAUGES];
        let wanted = "a list of gauge numbers, such as [0, 3]";
        let items = self.of_type(key, wanted, |value| value.as_array())?;
        for (index, item) in items.into_iter().flatten().enumerate() {
            let refuse = |what: &str| self.refuse_item(key, index, item, what);
            let DeValue::Integer(integer) = item.get_ref() else {
                return Err(refuse("is no gauge number: give whole numbers from 0 to 4"));
            };
            let gauge = usize::from_str_radix(integer.as_str(), integer.radix()).ok();
            match gauge.and_then(|gauge| chosen.get_mut(gauge)) {
                None => return Err(refuse("is not a gauge: the gauges are 0 to 4")),
                Some(true) => return Err(refuse("is named twice: name each gauge once")),
                Some(place) => *place = true,
            }
        }
        Ok(chosen)
    }

    fn refuse_item(&self, key: &str, index: usize, item: &Value<'_>, what: &str) -> SceneError {
        let written = shortened(&self.source.text[item.span()]);
        let path = format!("{}[{index}]", self.path_of(key));
        let message = format!("{written} {what}");
        self.source.error(item.span().start, &path, message)
    }

    /// A column's name or number.
    pub fn column(&mut self, key: &'static str) -> Result<Option<Column<'t>>, SceneError> {
        self.of_type(key, "a column's name in quotes, or its number", column_of)
    }

    /// A list of columns' names or numbers; the same may be there several times.
    pub fn columns(&mut self, key: &'static str) -> Result<Option<Vec<Column<'t>>>, SceneError> {
        let wanted = "a list of columns' names or numbers";
        let Some(items) = self.of_type(key, wanted, |value| value.as_array())? else {
            return Ok(None);
        };
        let columns = items.iter().enumerate().map(|(index, item)| {
            column_of(item.get_ref()).ok_or_else(|| {
                let what = "is no column: give its name in quotes, or its number, from 0 on";
                self.refuse_item(key, index, item, what)
            })
        });
        columns.collect::<Result<Vec<_>, _>>().map(Some)
    }

    /// Refuses every key that nobody asked for. `with` says what decided which keys there are, or is empty.
    pub fn finish(self, with: &str) -> Result<(), SceneError> {
        let unknown = self
            .entries
            .into_iter()
            .flatten()
            .filter(|(key, _)| {
                let key = key.get_ref().as_ref();
                !self.asked.contains(&key) && !self.retired.contains(&key)
            })
            .min_by_key(|(key, _)| key.span().start);
        let Some((key, _)) = unknown else {
            return Ok(());
        };
        let known = self.asked.join(", ");
        let message =
            format!("no such key here{with}: take it out, or mend its spelling; there are {known}");
        Err(self
            .source
            .error(key.span().start, &self.path_of(key.get_ref()), message))
    }

    fn get(&mut self, key: &'static str) -> Option<&'t Value<'t>> {
        self.asked.push(key);
        self.entries.and_then(|entries| entries.get(key))
    }

    fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.path)
        }
    }

    fn inner(&self, path: String, offset: usize, entries: Option<&'t DeTable<'t>>) -> Table<'t> {
        Table {
            source: self.source,
            path,
            offset,
            entries,
            asked: Vec::new(),
            retired: Vec::new(),
        }
    }

    fn table_in(&self, value: &'t Value<'t>, path: String) -> Result<Table<'t>, SceneError> {
        let offset = value.span().start;
        match value.get_ref() {
            DeValue::Table(entries) => Ok(self.inner(path, offset, Some(entries))),
            other => {
                let message = format!("holds {}: give a table", kind_of(other));
                Err(self.source.error(offset, &path, message))
            }
        }
    }

    fn wrong_type(&self, value: &Value<'_>, key: &str, wanted: &str) -> SceneError {
        self.refuse(
            key,
            format!("holds {}: give {wanted}", kind_of(value.get_ref())),
        )
    }
}

fn column_of<'t>(value: &'t DeValue<'t>) -> Option<Column<'t>> {
    match value {
        DeValue::String(name) => Some(Column::Named(name)),
        DeValue::Integer(integer) => usize::from_str_radix(integer.as_str(), integer.radix())
            .ok()
            .map(Column::Numbered),
        _ => None,
    }
}

fn kind_of(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}
