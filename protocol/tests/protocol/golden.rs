//! The wire's bytes, literally.
//!
//! Boards in the field speak these bytes. Whoever changes one of them, or [`protocol::SCHEMA_HASH`],
//! raises [`protocol::PROTOCOL_VERSION`].

use crate::messages::{
    CONTACTS, HEALTHS, METHODS, RENDERINGS, SETTINGS, events, greeted_receiver, hello, samples,
};
use protocol::{
    Event, HELLO_LENGTH, Hello, Hold, MAX_FRAME, Message, PROTOCOL_VERSION, Peer, Receiver, Stop,
    StopReason, Stopped, Trip,
};
use protocol::{SCHEMA_HASH, frame};

/// The number of every frame below.
const SEQUENCE: u16 = 0x0102;

/// Name of a message in [`samples`], and its whole frame in hexadecimal: COBS over the sequence
/// (02 01), the payload (first byte: the variant) and the CRC-32, then 00.
const GOLDEN: &[(&str, &str)] = &[
    (
        "hello",
        "030201065244474c0715b9c9410febd844997353544d3332463432395a4901010101010201060107\
         e819e200",
    ),
    (
        "estimate",
        "0b020101ac02c08db7010101010340010103403f0220034401010d20400103e0c50801ab02020108\
         0203054fa43c1d00",
    ),
    (
        "estimate without a wavelength",
        "0402010103904e0101010101010101010101010101021f01010101058d096e7c00",
    ),
    ("motion", "14020102dc0bc08db701f1c001e0c5084a1aa3f300"),
    (
        "gauges",
        "6b020103a01f8092f401c0b80280800281800282800283800284800285800207e48002e58002e680\
         02e78002e88002e9800205c88102c98102ca8102cb8102cc8102cd810203ac8202ad8202ae8202af\
         8202b08202b18202019083029183029283029383029483029583023ef48302f58302f68302f78302\
         f88302f9830202d88402d98402da8402db8402dc8402dd840204bc8502bd8502be8502bf8502c085\
         02c1850206b2e562c800",
    ),
    (
        "sensor's status",
        "31020104c096b10202010102030405060708090a0b0c0de807e907ea07eb07ec07ed07ee07ef07f0\
         07f107f207f307f4070b8827010203f403c413010890bf05ee34057a00",
    ),
    (
        "display's status",
        "4c020104c096b10202010102030405060708090a0b0c0de807e907ea07eb07ec07ed07ee07ef07f0\
         07f107f207f307f40701904ea84601f40302030405060708090a0b040290bf055b87194e00",
    ),
    (
        "configure a sensor",
        "04020105011301500217055f01dc0b9003c09a0ca9e0fb1b00",
    ),
    (
        "configure a display",
        "23020105018486880801010201f4031432148827ac02fa01d804f8acd191018297359900",
    ),
    (
        "configuration taken",
        "0402010606bdeda1cb071301500217055f01dc0b9003c09a0cfe06296f00",
    ),
    (
        "configuration refused",
        "2b020106011325bfb802c0b8028486880801010201f4031432148827ac02fa01d804f8acd19101e9\
         ee262a00",
    ),
    ("ping", "0a020107e807da39d20900"),
    ("pong", "0e020108e807d00f82102723874600"),
    ("stop by the operator", "0302010553544f5005e769d17b00"),
    ("stop by the host", "0302010a53544f50017159d60c00"),
    (
        "actuators",
        "0502010a1409f80a8080028080011c840746b717f80a80800280800101840746ef2ef80a80800280\
         80011c840746a746f80a80800280800101840746df5df80a8080028080011d8407469775f80a8080\
         0280800101840746cf8c01f80a8080028080011e84074687a401f80a80800280800101840746bfbb\
         01f80a80800280800117840746f7d201f80a80800280800101840746600ca0c100",
    ),
    ("safety: driving", "0d02010bc08db70102a61d952a00"),
    ("safety: stopped", "0e02010bc08db7010404d21faabc00"),
    (
        "stopped by the emergency stop",
        "0302010a48414c5402a872028300",
    ),
    ("ask for the configuration", "0402010d05ed03213f00"),
    ("ask for the capabilities", "0902010d017b33264800"),
    (
        "a sensor's capabilities",
        "0402010e160506a01fe80764e41905d804c03e04904e010ac801020202040403011f040402080405\
         3263060601e0d4030d070ae0d4030108e80780897a05662643cb00",
    ),
    (
        "a display's capabilities",
        "1f02010e0132dc0ba09c010203d00fa01ff403058827904e14ac1b09148827050a01e807050b01e8\
         07020c03f403020d038827020e03d00f020f04e0d40305100a901c05cd55ed6b00",
    ),
    ("stream the gauges", "0a02010fe8076268c10700"),
    (
        "arm: stopped by the operator",
        "09020110c08db701020579b4448800",
    ),
    (
        "texture",
        "220201113cc08db701019003808001fa01808003570c1e84025f01f40347e23f75de00",
    ),
];

fn bytes(hexadecimal: &str) -> Vec<u8> {
    assert_eq!(hexadecimal.len() % 2, 0);
    (0..hexadecimal.len())
        .step_by(2)
        .map(|at| u8::from_str_radix(&hexadecimal[at..at + 2], 16).expect("hexadecimal digits"))
        .collect()
}

/// The frame of a sample, in hexadecimal.
pub fn hexadecimal(message: &Message) -> String {
    let mut out = [0; MAX_FRAME];
    let frame = frame::encode(SEQUENCE, message, &mut out).expect("it fits");
    frame.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn every_message_is_encoded_to_its_golden_bytes() {
    let frames: Vec<(&str, String)> = samples()
        .iter()
        .map(|(name, message)| (*name, hexadecimal(message)))
        .collect();
    let golden: Vec<(&str, String)> = GOLDEN
        .iter()
        .map(|&(name, golden)| (name, golden.to_owned()))
        .collect();
    let changed: Vec<_> = frames
        .iter()
        .filter(|frame| !golden.contains(frame))
        .collect();
    assert_eq!(frames, golden, "\nthese are others now: {changed:#?}");
}

#[test]
fn every_golden_frame_is_received_as_its_message() {
    for ((name, message), (_, golden)) in samples().iter().zip(GOLDEN) {
        let expected = match message {
            Message::Hello(hello) => Event::Greeted(*hello),
            message => Event::Message(message.clone()),
        };
        let received = events(&mut greeted_receiver(), &bytes(golden));
        assert_eq!(received, [expected], "{name}");
    }
}

#[test]
fn the_golden_frames_show_every_variant() {
    // Variant bytes 0 to 17, the largest of them the number of variants less one.
    let mut variants: Vec<u8> = samples()
        .iter()
        .map(|(_, message)| postcard::to_stdvec(message).expect("it encodes")[0])
        .collect();
    variants.dedup();
    assert_eq!(
        variants,
        [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17]
    );
}

#[test]
fn every_choice_within_a_message_has_its_byte() {
    fn bytes<T: serde::Serialize>(choices: &[T]) -> Vec<u8> {
        postcard::to_stdvec(choices).expect("they encode")[1..].to_vec()
    }
    assert_eq!(bytes(&METHODS), [0, 1, 2, 3]);
    assert_eq!(bytes(&CONTACTS), [0, 1, 2, 3]);
    assert_eq!(bytes(&RENDERINGS), [0, 1, 2]);
    assert_eq!(bytes(&HEALTHS), [0, 1, 2, 3, 4, 5]);
    assert_eq!(
        bytes(&SETTINGS),
        std::array::from_fn::<u8, 26, _>(|n| n as u8)
    );
    assert_eq!(bytes(&Hold::ALL), [0, 1, 2, 3, 4, 5]);
    assert_eq!(
        bytes(&Trip::ALL),
        [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13]
    );
}

#[test]
fn version_and_schema_are_those_of_the_golden_frames() {
    assert_eq!(PROTOCOL_VERSION, 7);
    assert_eq!(SCHEMA_HASH, 0x9944_d8eb_0f41_c9b9);
}

#[test]
fn a_hello_of_any_version_lies_as_this_one_does() {
    // Magic, protocol 0x0203, schema, role, chip, version 4.5.6, asks.
    let golden = bytes(
        "5244474c\
         0302\
         0807060504030201\
         64\
         53544d33324634323949000000000000\
         040506\
         01",
    );
    assert_eq!(golden.len(), HELLO_LENGTH);
    let later = Hello {
        protocol: 0x0203_u16.to_le_bytes(),
        schema: 0x0102_0304_0506_0708_u64.to_le_bytes(),
        role: b'd',
        chip: *b"STM32F429I\0\0\0\0\0\0",
        version: [4, 5, 6],
        ..hello()
    };
    assert_eq!(later.to_bytes(), *golden);
    assert_eq!(Hello::from_bytes(&golden), Some(later));
    assert_eq!(
        postcard::to_stdvec(&Message::Hello(later)).expect("it encodes")[1..],
        golden
    );

    let mut frame = [0; MAX_FRAME];
    let frame = frame::encode_payload(7, &[&[0], &golden[..]].concat(), &mut frame);
    let mut receiver = Receiver::new();
    let received = events(&mut receiver, frame.expect("it fits"));
    assert_eq!(received, [Event::Foreign(later)]);
    assert_eq!(receiver.peer(), Peer::Foreign(later));
}

#[test]
fn a_stop_and_its_answer_of_any_version_lie_as_these_do() {
    for (byte, reason) in [
        (0, StopReason::Operator),
        (1, StopReason::Host),
        (2, StopReason::Host),
        (255, StopReason::Host),
    ] {
        let stop = Stop { reason };
        let payload = [0, b'S', b'T', b'O', b'P', byte];
        assert_eq!(frame::frozen(&payload), Some(Message::Stop(stop)));
        assert_eq!(StopReason::from_byte(reason.byte()), reason);
        if byte < 2 {
            assert_eq!(stop.to_bytes(), payload);
            assert_eq!(Stopped::by(reason.trip()).cause, byte);
        }
    }
    for cause in 0..=255 {
        let stopped = Stopped { cause };
        let payload = [0, b'H', b'A', b'L', b'T', cause];
        assert_eq!(stopped.to_bytes(), payload);
        assert_eq!(frame::frozen(&payload), Some(Message::Stopped(stopped)));
        let trip = stopped.trip();
        assert_eq!(trip, Trip::ALL.get(usize::from(cause)).copied());
        assert!(trip.is_none_or(|trip| Stopped::by(trip) == stopped));
    }
    // The whole frame: what another version's must be too.
    let mut out = [0; MAX_FRAME];
    let stop = Message::Stop(Stop {
        reason: StopReason::Operator,
    });
    let frame = frame::encode(SEQUENCE, &stop, &mut out).expect("it fits");
    assert_eq!(frame, bytes("0302010553544f5005e769d17b00"));
}
