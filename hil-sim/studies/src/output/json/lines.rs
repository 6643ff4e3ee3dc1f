//! JSON that a person can read too: indented down to a depth, from there on a line for each value.

use std::io::{Result, Write};

use serde_json::ser::Formatter;

/// Lists and objects deeper than this stand on one line: an estimate within the estimates of a scene in
/// the list of scenes, and the counters of one end.
const DEEPEST: usize = 3;

#[derive(Debug, Default)]
pub struct Lines {
    depth: usize,
    /// Whether the innermost list or object holds anything so far.
    filled: bool,
}

impl Lines {
    /// Within a list that is not closed yet.
    pub fn in_a_list() -> Self {
        Self {
            depth: 1,
            ..Self::default()
        }
    }

    fn open<W: ?Sized + Write>(&mut self, out: &mut W, bracket: &[u8]) -> Result<()> {
        self.depth += 1;
        self.filled = false;
        out.write_all(bracket)
    }

    fn close<W: ?Sized + Write>(&mut self, out: &mut W, bracket: &[u8]) -> Result<()> {
        let indented = self.depth <= DEEPEST && self.filled;
        self.depth -= 1;
        if indented {
            self.new_line(out)?;
        }
        // What was closed is in the one around it.
        self.filled = true;
        out.write_all(bracket)
    }

    fn next<W: ?Sized + Write>(&mut self, out: &mut W, first: bool) -> Result<()> {
        self.filled = true;
        if !first {
            out.write_all(b",")?;
        }
        match (self.depth <= DEEPEST, first) {
            (true, _) => self.new_line(out),
            (false, true) => Ok(()),
            (false, false) => out.write_all(b" "),
        }
    }

    fn new_line<W: ?Sized + Write>(&self, out: &mut W) -> Result<()> {
        out.write_all(b"\n")?;
        (0..self.depth).try_for_each(|_| out.write_all(b"  "))
    }
}

impl Formatter for Lines {
    fn begin_array<W: ?Sized + Write>(&mut self, out: &mut W) -> Result<()> {
        self.open(out, b"[")
    }

    fn end_array<W: ?Sized + Write>(&mut self, out: &mut W) -> Result<()> {
        self.close(out, b"]")
    }

    fn begin_array_value<W: ?Sized + Write>(&mut self, out: &mut W, first: bool) -> Result<()> {
        self.next(out, first)
    }

    fn begin_object<W: ?Sized + Write>(&mut self, out: &mut W) -> Result<()> {
        self.open(out, b"{")
    }

    fn end_object<W: ?Sized + Write>(&mut self, out: &mut W) -> Result<()> {
        self.close(out, b"}")
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, out: &mut W, first: bool) -> Result<()> {
        self.next(out, first)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, out: &mut W) -> Result<()> {
        out.write_all(b": ")
    }
}

#[cfg(test)]
mod tests {
    use serde::Serialize;
    use serde_json::json;

    use super::*;

    #[test]
    fn what_is_deep_stands_on_one_line_and_all_of_it_is_the_same_value() {
        let value =
            json!([{ "a": [], "b": {}, "c": [{ "d": [1, 2], "e": null }, { "d": [] }] }, {}]);
        let mut bytes = Vec::new();
        let mut out = serde_json::Serializer::with_formatter(&mut bytes, Lines::default());
        value.serialize(&mut out).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert_eq!(
            text,
            "[\n  {\n    \"a\": [],\n    \"b\": {},\n    \"c\": [\n      {\"d\": [1, 2], \"e\": null},\n      \
             {\"d\": []}\n    ]\n  },\n  {}\n]"
        );
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&text).unwrap(),
            value
        );
    }
}
