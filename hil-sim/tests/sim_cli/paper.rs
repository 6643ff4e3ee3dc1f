//! `hil-sim paper` as a person or a script meets it: on the libraries, which take seconds.

use std::fs;
use std::path::Path;

use hil_sim_core::native;
use hil_sim_core::scene::Scene;

use crate::{folder, hil_sim, text};

/// A CSV's rows, each of as many cells as its header.
fn rows(path: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let columns = lines.next().unwrap().split(',').count();
    lines
        .map(|line| {
            let row: Vec<String> = line.split(',').map(str::to_owned).collect();
            // The one quoted cell is Mosteller's, "paper, cell of 1.00 …".
            assert!(
                row.len() == columns || line.contains('"'),
                "{path:?}: {line}"
            );
            row
        })
        .collect()
}

/// The mean of a cell's count over the two seconds that Table I is of, from a run of the test's own.
fn counted_mean_mm(wavelength_mm: f64, speed_mm_s: f64) -> f64 {
    let scene = Scene {
        duration_s: 2.3,
        ..Scene::constant(wavelength_mm, speed_mm_s)
    };
    let counted: Vec<f64> = native::run(&scene)
        .unwrap()
        .estimates
        .iter()
        .filter(|record| record.made_ns >= 300_000_000)
        .filter_map(|record| record.estimate.counted_mm.map(f64::from))
        .collect();
    counted.iter().sum::<f64>() / counted.len() as f64
}

#[test]
fn the_page_is_whole_and_its_numbers_are_the_run_s() {
    let folder = folder("paper");
    let output = hil_sim(
        &folder,
        &["paper", "--engine", "native", "--out", "page.html"],
    );
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{errors}");
    // Every run is told of.
    assert!(errors.contains("36 of 36"), "{errors}");
    let page = fs::read_to_string(folder.join("page.html")).unwrap();

    for id in [
        "fig-4",
        "fig-5",
        "fig-6",
        "fig-7",
        "fig-8",
        "equation-11",
        "table-1",
        "table-2",
        "table-3",
        "table-4",
    ] {
        assert!(page.contains(&format!("id={id}>")), "{id}");
        assert!(page.contains(&format!("href=\"#{id}\"")), "{id}");
    }
    for nothing in [
        "NaN", "inf<", "∞", "None", "<script", "<link", "<img", "@import",
    ] {
        assert!(!page.contains(nothing), "{nothing}");
    }
    let without_namespaces = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    assert!(!without_namespaces.contains("http"));

    // Fig. 4 is one chart, Fig. 5 three, equation (11) and Fig. 6 one, Figs 7 and 8 two: broad and narrow.
    let charts: Vec<&str> = page
        .split("<svg ")
        .skip(1)
        .map(|rest| rest.split_inclusive("</svg>").next().unwrap())
        .collect();
    assert_eq!(charts.len(), 2 * 10);
    for chart in charts {
        let svg = format!("<svg {chart}");
        let document = roxmltree::Document::parse(&svg).unwrap();
        let paths = document
            .descendants()
            .filter_map(|node| node.attribute("d"));
        let points: usize = paths.map(|path| path.matches(['M', 'L']).count()).sum();
        // Grid and axes have some thirty.
        assert!(points > 50, "{svg}");
        let texts = document
            .descendants()
            .filter(|node| node.tag_name().name() == "text");
        assert!(texts.count() > 6, "{svg}");
    }

    // Links lead to files, and the other way round.
    let linked: Vec<&str> = page
        .split("href=\"page/")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .collect();
    let mut files: Vec<String> = fs::read_dir(folder.join("page"))
        .unwrap()
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    for name in &linked {
        assert!(files.contains(&(*name).to_owned()), "{name}");
    }
    for name in &files {
        assert!(linked.contains(&name.as_str()), "{name} is not linked");
        assert!(rows(&folder.join("page").join(name)).len() >= 4, "{name}");
    }

    let table_1 = rows(&folder.join("page/table-1.csv"));
    assert_eq!(table_1.len(), 12);
    for row in [&table_1[0], &table_1[6], &table_1[11]] {
        let numbers: Vec<f64> = row.iter().map(|cell| cell.parse().unwrap()).collect();
        let mean_mm = counted_mean_mm(numbers[1], numbers[0]);
        assert!((numbers[4] - mean_mm).abs() < 1e-9, "{row:?} {mean_mm}");
        assert!(
            page.contains(&format!("<td>{mean_mm:.3}</td>")),
            "{mean_mm}"
        );
    }
    assert_eq!(rows(&folder.join("page/fig-6.csv")).len(), 19);
    assert_eq!(rows(&folder.join("page/table-3.csv")).len(), 24);
    assert_eq!(rows(&folder.join("page/table-4.csv")).len(), 16);
    // Fig. 4: a sample a millisecond for 0.4 s.
    assert_eq!(rows(&folder.join("page/fig-4.csv")).len(), 400);
}

#[test]
fn a_page_that_cannot_be_is_refused_before_anything_runs() {
    let folder = folder("paper-refused");
    fs::write(folder.join("file"), "").unwrap();
    for (out, say) in [
        ("page", "give a file that ends in .html"),
        ("file/page.html", "file"),
    ] {
        let output = hil_sim(&folder, &["paper", "--engine", "native", "--out", out]);
        assert_eq!(output.status.code(), Some(2), "{out}");
        let errors = text(&output.stderr);
        assert!(errors.contains(say), "{errors}");
        assert!(!errors.contains(" of 36"), "{errors}");
    }
}
