//! From a type's shape to its CSV columns, so that they cannot disagree with what is written.

use postcard_schema::schema::{DataModelType, NamedType};
use serde_json::Value;

/// The CSV columns of a type: fields within fields are joined by `_`, items are numbered from 0.
pub fn columns(named: &'static NamedType) -> Vec<String> {
    let mut names = Vec::new();
    add_columns(named, "", &mut names);
    names
}

fn add_columns(named: &'static NamedType, name: &str, names: &mut Vec<String>) {
    let within = |inner: &str| {
        if name.is_empty() {
            inner.to_owned()
        } else {
            format!("{name}_{inner}")
        }
    };
    match named.ty {
        DataModelType::Option(inner) | DataModelType::NewtypeStruct(inner) => {
            add_columns(inner, name, names);
        }
        DataModelType::Struct(fields) => {
            for field in *fields {
                add_columns(field.ty, &within(field.name), names);
            }
        }
        DataModelType::Tuple(items) => {
            for (index, item) in items.iter().enumerate() {
                add_columns(item, &within(&index.to_string()), names);
            }
        }
        _ => names.push(name.to_owned()),
    }
}

/// The cells under [`columns`] of a value of the type; those of a field that is missing are empty.
pub fn cells(named: &'static NamedType, value: Option<&Value>, cells: &mut Vec<String>) {
    match named.ty {
        DataModelType::Option(inner) | DataModelType::NewtypeStruct(inner) => {
            self::cells(inner, value, cells);
        }
        DataModelType::Struct(fields) => {
            for field in *fields {
                self::cells(
                    field.ty,
                    value.and_then(|value| value.get(field.name)),
                    cells,
                );
            }
        }
        DataModelType::Tuple(items) => {
            for (index, item) in items.iter().enumerate() {
                self::cells(item, value.and_then(|value| value.get(index)), cells);
            }
        }
        _ => cells.push(match value {
            None | Some(Value::Null) => String::new(),
            Some(Value::String(text)) => text.clone(),
            Some(value) => value.to_string(),
        }),
    }
}
