//! A row of a map's CSV: a cell, a method, and what came of them.

use super::METHODS;
use super::Map;
use super::measurement::Measurement;

#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    pub cell: usize,
    pub method: String,
    pub measurement: Measurement,
}

const BEFORE: [&str; 2] = ["cell", "method"];
const AFTER: [&str; 8] = [
    "rms_percent",
    "bias_percent",
    "valid_share",
    "estimates",
    "valid",
    "wrong",
    "wrong_share",
    "key",
];

pub fn header(map: &Map) -> String {
    let mut names = BEFORE.to_vec();
    names.extend(map.columns());
    names.extend(AFTER);
    names.join(",") + "\n"
}

/// Where a method stands among others: those that maps compare by default first.
pub fn rank(method: &str) -> (usize, &str) {
    let known = METHODS.iter().position(|known| *known == method);
    (known.unwrap_or(METHODS.len()), method)
}

impl Row {
    pub fn line(&self, map: &Map, key: u64) -> String {
        let number =
            |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.4}"));
        let measured = &self.measurement;
        let mut fields = vec![self.cell.to_string(), self.method.clone()];
        fields.extend(map.parameters(self.cell).into_iter().map(str::to_owned));
        fields.extend([
            number(measured.rms_percent),
            number(measured.bias_percent),
            number(measured.valid_share),
            measured.estimates.to_string(),
            measured.valid.to_string(),
            measured.wrong.to_string(),
            number(measured.wrong_share()),
            format!("{key:016x}"),
        ]);
        fields.join(",") + "\n"
    }

    /// The row of a line, and its key. The error says what is wrong with it.
    pub fn parse(map: &Map, line: &str) -> Result<(Self, u64), String> {
        let fields: Vec<&str> = line.split(',').collect();
        let parameters = map.columns().len();
        let all = BEFORE.len() + parameters + AFTER.len();
        if fields.len() != all {
            return Err(format!("{} columns, not {all}", fields.len()));
        }
        let bad = |name: &str, field: &str| format!("{name} is {field:?}");
        let cell = fields[0].parse().ok().filter(|cell| *cell < map.len());
        let cell = cell.ok_or_else(|| bad(BEFORE[0], fields[0]))?;
        let method = fields[1].to_owned();
        let (given, measured) = fields[BEFORE.len()..].split_at(parameters);
        if given != map.parameters(cell) {
            return Err(format!("cell {cell} of this map is another"));
        }
        let number = |place: usize| match measured[place] {
            "" => Ok(None),
            field => match field.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(Some(number)),
                _ => Err(bad(AFTER[place], field)),
            },
        };
        let count = |place: usize| {
            let field = measured[place];
            field.parse().map_err(|_| bad(AFTER[place], field))
        };
        let measurement = Measurement {
            rms_percent: number(0)?,
            bias_percent: number(1)?,
            valid_share: number(2)?,
            estimates: count(3)?,
            valid: count(4)?,
            wrong: count(5)?,
        };
        let key = u64::from_str_radix(measured[7], 16).map_err(|_| bad(AFTER[7], measured[7]))?;
        let row = Self {
            cell,
            method,
            measurement,
        };
        Ok((row, key))
    }
}
