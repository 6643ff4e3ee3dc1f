//! The tables of `docs/src/reference/messages.md`, made of the types.

use std::fs;
use std::path::Path;

use postcard_schema::Schema;
use postcard_schema::schema::DataModelType;
use protocol::Message;

use crate::golden::hexadecimal;
use crate::messages::{longest_like, samples};

/// Where the page is, from this crate on.
const PAGE: &str = "../docs/src/reference/messages.md";
/// Around what is generated.
const BEGIN: &str = "<!-- made of the types: protocol/tests/protocol/table.rs -->\n";
const END: &str = "<!-- end -->\n";
/// Bytes of a frame besides its payload.
const AROUND: usize = 2 + 4 + 1 + 1;
/// Frames up to this length are shown whole, in bytes.
const SHOWN: usize = 64;

/// The name of a message's variant.
fn name(message: &Message) -> &'static str {
    let DataModelType::Enum(variants) = Message::SCHEMA.ty else {
        panic!("a message is an enum");
    };
    let variant = postcard::to_stdvec(message).expect("it encodes")[0];
    variants[usize::from(variant)].name
}

/// The first byte of a payload, and what stands for the kind of message behind it.
fn variant(message: &Message) -> String {
    match message {
        Message::Stop(_) => "0, `STOP`".to_owned(),
        Message::Stopped(_) => "0, `HALT`".to_owned(),
        message => postcard::to_stdvec(message).expect("it encodes")[0].to_string(),
    }
}

/// Bytes of a message's payload. No frame here is so long that COBS needs another byte for it.
fn payload(message: &Message) -> usize {
    hexadecimal(message).len() / 2 - AROUND
}

fn tables() -> String {
    let mut table = "| variant | message | sample | payload, bytes | longest | frame |\n\
                     | --- | --- | --- | ---: | ---: | --- |\n"
        .to_owned();
    for (sample, message) in samples() {
        let frame = hexadecimal(&message);
        let frame = if frame.len() / 2 <= SHOWN {
            format!("`{frame}`")
        } else {
            format!("{} bytes", frame.len() / 2)
        };
        table += &format!(
            "| {} | `{}` | {sample} | {} | {} | {frame} |\n",
            variant(&message),
            name(&message),
            payload(&message),
            payload(&longest_like(&message)),
        );
    }
    table
}

#[test]
fn the_page_of_the_messages_shows_every_message_as_it_is() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE);
    let page = fs::read_to_string(path).expect("the page is there");
    let (_, rest) = page.split_once(BEGIN).expect("the table begins");
    let (table, _) = rest.split_once(END).expect("the table ends");
    let tables = tables();
    assert_eq!(table, tables, "the table is to be:\n{tables}");
}
