//! Definitions as ROS 2 writes them, and bytes as its middleware does.

use ros2msg::{DecodeError, Definition, DefinitionError, EncodeError, decode, encode};
use serde_json::{Value, json};

fn definition(text: &str) -> Definition {
    Definition::parse("test_msgs/msg/Test", text).unwrap_or_else(|error| panic!("{error}"))
}

fn bytes(definition: &Definition, value: &Value) -> Vec<u8> {
    let mut out = Vec::new();
    encode(definition, value, &mut out).unwrap_or_else(|error| panic!("{error}"));
    out
}

/// `ShapeType` of OMG DDSI-RTPS 2.5, section 10.7, with its printed bytes.
#[test]
fn the_standards_own_example_has_its_printed_bytes() {
    let shape = definition("string color\nint32 x\nint32 y\nint32 shapesize\n");
    let value = json!({"color": "BLUE", "x": 34, "y": 100, "shapesize": 24});
    let want = [
        0, 1, 0, 0, // CDR_LE
        5, 0, 0, 0, b'B', b'L', b'U', b'E', 0, 0, 0,
        0, // five bytes, and three to the next multiple of 4
        34, 0, 0, 0, 100, 0, 0, 0, 24, 0, 0, 0,
    ];
    assert_eq!(bytes(&shape, &value), want);
    assert_eq!(decode(&shape, &want), Ok(value));
}

#[test]
fn both_byte_orders_are_read_and_numbers_lie_at_multiples_of_their_length() {
    let pair = definition("uint8 a\nfloat64 b\nint16 c\n");
    let value = json!({"a": 1, "b": 1.5, "c": -2});
    let mut little = vec![0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
    little.extend(1.5_f64.to_le_bytes());
    little.extend([0xfe, 0xff]);
    assert_eq!(bytes(&pair, &value), little);
    let mut big = vec![0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
    big.extend(1.5_f64.to_be_bytes());
    big.extend([0xff, 0xfe]);
    assert_eq!(decode(&pair, &big), Ok(value));
}

#[test]
fn definitions_are_read_as_ros_writes_them() {
    let text = "\
# A comment, then a constant, a default and a bound.
int32 LIMIT=5  # not a field
string<=10 name \"a # b\"  # one
Point[2] corners
geometry_msgs/msg/Vector3[] ways
float32[<=3] few
builtin_interfaces/Time stamp
================================================================================
MSG: test_msgs/Point
float64 x
float64 y 0.5
================================================================================
MSG: geometry_msgs/Vector3
float32 z
";
    let value = json!({
        "name": "é",
        "corners": [{"x": 1.0, "y": 2.0}, {"x": 3.0, "y": -4.0}],
        "ways": [{"z": 0.5}],
        "few": [],
        "stamp": {"sec": -1, "nanosec": 999_999_999},
    });
    let read = definition(text);
    assert_eq!(decode(&read, &bytes(&read, &value)), Ok(value));
}

#[test]
fn what_is_missing_is_zero_empty_or_no_number() {
    let read = definition("bool a\nfloat32 b\nstring c\nint16[2] d\nuint8[] e\n");
    let want = json!({"a": false, "b": null, "c": "", "d": [0, 0], "e": []});
    assert_eq!(decode(&read, &bytes(&read, &json!({}))), Ok(want));
}

#[test]
fn the_limits_of_every_number_come_back() {
    let text = "int8 a\nint16 b\nint32 c\nint64 d\nuint8 e\nuint16 f\nuint32 g\nuint64 h\nbyte i\nchar j\n";
    let read = definition(text);
    let least = json!({"a": i8::MIN, "b": i16::MIN, "c": i32::MIN, "d": i64::MIN,
        "e": 0, "f": 0, "g": 0, "h": 0, "i": 0, "j": 0});
    let most = json!({"a": i8::MAX, "b": i16::MAX, "c": i32::MAX, "d": i64::MAX,
        "e": u8::MAX, "f": u16::MAX, "g": u32::MAX, "h": u64::MAX, "i": u8::MAX, "j": u8::MAX});
    for value in [least, most] {
        assert_eq!(decode(&read, &bytes(&read, &value)), Ok(value));
    }
    let mut out = Vec::new();
    let beyond = encode(&read, &json!({"b": 40_000}), &mut out);
    let want = EncodeError {
        field: "b".to_owned(),
        value: "40000".to_owned(),
    };
    assert_eq!(beyond, Err(want));
}

#[test]
fn bytes_that_are_cut_off_or_something_else_are_refused_by_field() {
    let read = definition("uint8 a\nstring b\nuint32[] c\n");
    let whole = bytes(&read, &json!({"a": 1, "b": "two", "c": [3, 4]}));
    for length in 4..whole.len() {
        let error = decode(&read, &whole[..length]).expect_err("it is cut off");
        assert!(matches!(error, DecodeError::Short { .. }), "{error}");
    }
    let error = decode(&read, &whole[..whole.len() - 1]).expect_err("it is cut off");
    assert_eq!(error.to_string(), "ends within c, after 23 bytes");
    // A length that no message has must not ask for memory.
    let huge = [
        0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255,
    ];
    assert!(matches!(
        decode(&read, &huge),
        Err(DecodeError::Short { .. })
    ));
    let json = decode(&read, b"{\"a\":1}").expect_err("it is JSON");
    assert!(matches!(json, DecodeError::Encapsulation { .. }), "{json}");
    assert!(decode(&read, &[]).is_err());
}

#[test]
fn texts_that_are_no_definitions_are_refused_by_line_or_name() {
    let refusal = |text: &str| Definition::parse("a/msg/B", text).expect_err("it is none");
    assert_eq!(
        refusal("uint8 a\nnonsense\n").to_string(),
        "line 2: \"nonsense\" is neither a field nor a constant"
    );
    assert_eq!(
        refusal("Point p\n"),
        DefinitionError::Missing("a/Point".to_owned())
    );
    assert_eq!(
        refusal("B again\n"),
        DefinitionError::Endless("a/B".to_owned())
    );
    assert!(matches!(
        refusal("uint8[x] a\n"),
        DefinitionError::Line { line: 1, .. }
    ));
}
