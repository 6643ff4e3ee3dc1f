//! Whether text stays within its picture: with `SPARE` more room than it takes in DejaVu Sans.

use roxmltree::{Document, Node};

use super::font::Font;

/// The nearest value of an attribute, of the element or what it lies in.
fn inherited<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    node.ancestors().find_map(|node| node.attribute(name))
}

fn number(node: Node, name: &str) -> f64 {
    let text = inherited(node, name).unwrap_or("0");
    text.parse().unwrap_or_else(|_| panic!("{name}=\"{text}\""))
}

/// Every text of a picture that leaves it, and by how much.
pub fn leaving(svg: &str) -> Vec<String> {
    let document = Document::parse(svg).expect("well-formed SVG");
    let root = document.root_element();
    let size: Vec<f64> = root
        .attribute("viewBox")
        .expect("a viewBox")
        .split(' ')
        .map(|part| part.parse().unwrap())
        .collect();
    let texts = root.descendants().filter(|node| node.has_tag_name("text"));
    texts
        .filter_map(|node| beyond(node, size[2], size[3]))
        .collect()
}

fn beyond(node: Node, wide: f64, high: f64) -> Option<String> {
    let words = node.text().unwrap_or_default();
    let size = number(node, "font-size");
    let bold = matches!(inherited(node, "font-weight"), Some("bold" | "600"));
    let font = if bold {
        Font::new(size).bold()
    } else {
        Font::new(size)
    };
    let width = font.width(words);
    let before = match inherited(node, "text-anchor") {
        Some("middle") => 0.5 * width,
        Some("end") => width,
        _ => 0.0,
    };
    // Along the line of text, and across it from its highest letter to its lowest.
    let (along, across) = (-before..width - before, -size..0.3 * size);
    let turned = node.attribute("transform").map(|transform| {
        let place = transform.trim_start_matches("translate(");
        let (place, turn) = place.split_once(')').expect("a place");
        assert_eq!(turn.trim(), "rotate(-90)");
        let (x, y) = place.split_once(' ').expect("two numbers");
        (x.parse::<f64>().unwrap(), y.parse::<f64>().unwrap())
    });
    let [left, right, top, bottom] = match turned {
        // Upwards: along the line is up, across it is to the right.
        Some((x, y)) => [
            x + across.start,
            x + across.end,
            y - along.end,
            y - along.start,
        ],
        None => {
            let (x, y) = (number(node, "x"), number(node, "y"));
            [
                x + along.start,
                x + along.end,
                y + across.start,
                y + across.end,
            ]
        }
    };
    let outside = [-left, right - wide, -top, bottom - high]
        .into_iter()
        .fold(0.0, f64::max);
    (outside > 0.0).then(|| format!("{outside:.0} beyond the edge: {words}"))
}

/// Fails if a text leaves its picture.
pub fn assert_fits(name: &str, svg: &str) {
    let leaving = leaving(svg);
    assert!(leaving.is_empty(), "{name}:\n{}", leaving.join("\n"));
}

#[test]
fn the_texts_of_every_committed_picture_stay_within_it() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../doc");
    let mut pictures = 0;
    let mut outside = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "svg") {
            let svg = std::fs::read_to_string(&path).unwrap();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            outside.extend(
                leaving(&svg)
                    .into_iter()
                    .map(|text| format!("{name}: {text}")),
            );
            pictures += 1;
        }
    }
    assert!(pictures >= 9, "{pictures} pictures in {folder}");
    assert!(outside.is_empty(), "\n{}", outside.join("\n"));
}

#[test]
fn a_text_that_leaves_is_found_on_every_side() {
    let picture = |text: &str| {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 100 50\" font-size=\"10\">{text}</svg>"
        )
    };
    for (attributes, leaves) in [
        ("x=\"10\" y=\"20\"", false),
        ("x=\"80\" y=\"20\"", true),
        ("x=\"98\" y=\"20\" text-anchor=\"end\"", false),
        ("x=\"10\" y=\"20\" text-anchor=\"middle\"", true),
        ("x=\"10\" y=\"9\"", true),
        ("x=\"10\" y=\"48\"", true),
        (
            "transform=\"translate(20 25) rotate(-90)\" text-anchor=\"middle\"",
            false,
        ),
        ("transform=\"translate(20 25) rotate(-90)\"", true),
    ] {
        let svg = picture(&format!("<text {attributes}>velocity</text>"));
        assert_eq!(!leaving(&svg).is_empty(), leaves, "{attributes}");
    }
}
