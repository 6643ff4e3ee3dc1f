//! Where a key stands in a TOML file.

use toml::de::{DeTable, DeValue};

/// The line, from 1 on, of what a path of keys leads to: `["expect", "mean_mm"]`, or `["fault", "0", "kind"]` for
/// the first of several. If the last keys are not there, the line of what is; none if the text is no TOML or
/// nothing of the path is there.
pub fn line_of(text: &str, path: &[&str]) -> Option<usize> {
    let document = DeTable::parse(text).ok()?.into_inner();
    let (first, rest) = path.split_first()?;
    let (key, mut value) = document.get_key_value(*first)?;
    let mut at = key.span().start;
    for key in rest {
        match value.get_ref() {
            DeValue::Table(table) => match table.get_key_value(*key) {
                Some((key, inner)) => (at, value) = (key.span().start, inner),
                None => break,
            },
            DeValue::Array(list) => {
                match key.parse::<usize>().ok().and_then(|index| list.get(index)) {
                    Some(inner) => (at, value) = (inner.span().start, inner),
                    None => break,
                }
            }
            _ => break,
        }
    }
    Some(line_at(text.as_bytes(), at))
}

/// The line, from 1 on, of a place in a text; of one behind its end the last.
pub fn line_at(text: &[u8], at: usize) -> usize {
    let before = &text[..at.min(text.len())];
    1 + before.iter().filter(|&&byte| byte == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "name = \"x\"\n\n[expect]\nmean_mm = 2\n\n[[fault]]\nat_s = 1\nkind = \"a\"\n[[fault]]\nat_s = 2\nkind = \"b\"\n[\"a.b\"]\nc = { d = 1 }\n";

    #[test]
    fn keys_are_found_where_they_stand_or_their_table_is() {
        for (path, line) in [
            (&["name"][..], Some(1)),
            (&["expect", "mean_mm"], Some(4)),
            (&["expect", "settling_ms"], Some(3)),
            (&["fault", "1", "kind"], Some(11)),
            (&["fault", "0", "kind"], Some(8)),
            (&["a.b", "c", "d"], Some(13)),
            (&["nothing"], None),
            (&[], None),
        ] {
            assert_eq!(line_of(TEXT, path), line, "{path:?}");
        }
        assert_eq!(line_of("[", &["a"]), None);
    }
}
