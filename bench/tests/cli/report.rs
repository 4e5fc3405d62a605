use crate::*;
use taut_output::plot::{self, Axis, Chart, Mark, Series};

pub(crate) const SECTIONS: [&str; 9] = [
    "answer",
    "work-precision",
    "profiles",
    "means",
    "trace",
    "patterns",
    "claims",
    "rows",
    "limits",
];

/// Height of a picture above its legend, in its own units.
const PLOT_HEIGHT: f64 = 370.0;

/// First number in an attribute, for each element of that name.
fn numbers<'a>(
    picture: &'a str,
    element: &'a str,
    attribute: &'a str,
) -> impl Iterator<Item = f64> + 'a {
    let elements = picture.split(element).skip(1);
    elements.filter_map(move |text| {
        let value = text.split('>').next()?.split(attribute).nth(1)?;
        value.split('"').nth(1)?.parse().ok()
    })
}

/// True if the first corner of a polyline or polygon lies above the legend.
fn is_above(element: &str) -> bool {
    let mut corner = element.split(" points=\"");
    let corner = corner.nth(1).and_then(|p| p.split(' ').next());
    let y = corner.and_then(|corner| corner.split(',').nth(1)?.parse::<f64>().ok());
    y.is_some_and(|y| y < PLOT_HEIGHT)
}

/// Lines and marks of a picture that are neither its axes nor its legend.
fn marks(picture: &str) -> usize {
    let above = |element, attribute| {
        let places = numbers(picture, element, attribute);
        places.filter(|y| *y < PLOT_HEIGHT).count()
    };
    // Axes, ticks and lines that say what a slope is have the colour of the text; what is drawn in that has points as
    // well.
    let ink = ["stroke=\"currentColor\"", "stroke=\"#000000\""];
    let elements = |name| {
        let elements = picture.split(name).skip(1);
        elements.filter_map(|rest| rest.split('>').next())
    };
    let lines = elements("<polyline");
    let lines = lines.filter(|line| !ink.iter().any(|ink| line.contains(ink)) && is_above(line));
    let shapes = elements("<polygon").filter(|shape| is_above(shape));
    lines.count() + above("<circle", "cy=") + above("<rect", " y=") + shapes.count()
}

/// An empty picture is seen to be empty.
#[test]
fn axes_are_no_data() {
    let chart = |points| Chart {
        title: "errors".to_owned(),
        x: Axis::log("segments (1)"),
        y: Axis::log("error (m)"),
        series: vec![Series::new("ours", points, Mark::LineAndPoints)],
    };
    let drawn = |points| plot::svg_for_page(&chart(points)).expect("draws");
    assert_eq!(marks(&drawn(Vec::new())), 0, "{}", drawn(Vec::new()));
    assert!(marks(&drawn(vec![[1.0, 1e-3], [10.0, 1e-6]])) >= 3);
}

/// Every section of a page, as (name, text); every picture and table in them holds data.
pub(crate) fn full_sections(page: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for section in page.split("<section ").skip(1) {
        let name = section.split('"').nth(1).expect("an id").to_owned();
        for figure in section.split("<figure").skip(1) {
            let figure = figure.split("</figure>").next().expect("an end");
            assert!(marks(figure) > 0, "an empty picture in {name}: {figure}");
            assert!(!figure.contains("NaN"), "{name}");
        }
        for table in section.split("<tbody").skip(1) {
            let table = table.split("</tbody>").next().expect("an end");
            assert!(table.contains("<td"), "an empty table in {name}");
        }
        found.push((name, section.to_owned()));
    }
    found
}

/// The names of a page's sections, all of which hold data.
pub(crate) fn names(page: &str) -> Vec<String> {
    full_sections(page).into_iter().map(|s| s.0).collect()
}

/// A page that holds everything, from a small job.
pub(crate) fn made(name: &str) -> At {
    let at = folder(name);
    let stdout = at.good("bench --quick --segments 4 --ratios 10,100 --iterations 5,50 --backends banded,faer:ldlt/kkt,cg:jacobi");
    assert!(!stdout.contains("written to"), "{stdout}");
    at
}

#[test]
fn the_main_job_writes_a_page_that_holds_data() {
    let at = made("report");
    let page = at.read("target/taut/report.html");
    assert_eq!(names(&page), SECTIONS);
    // How to make it again, with what, and what is known to end.
    for part in [
        "cargo run",
        "--locked",
        "-- bench --quick",
        "<dt>measured</dt><dd>20",
        " UTC</dd>",
        "<dt>commit</dt><dd>",
        "<dt>compiler</dt><dd>rustc ",
        "<dt>load/segment</dt><dd>10, 100</dd>",
        "<dt>iterations</dt><dd>5, 50</dd>",
        "guide massless cables only",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Nothing is fetched from anywhere.
    for outside in ["http:", "https:", "<link", "@import", "<img"] {
        let used = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!used.contains(outside), "{outside}");
    }
    // The saved data give an identical page; the rows alone give one without the rest.
    at.good("report target/taut/bench.report.json --out again.html");
    assert!(at.read("again.html") == page);
    at.good("report target/taut/bench.json --out rows.html");
    let rows = at.read("rows.html");
    let sections = "answer work-precision profiles means claims rows limits";
    assert_eq!(names(&rows).join(" "), sections);
    at.write("other.json", "{\"rows\": 3}");
    let rows = r"
        report other.json → other.json … neither a report
        report absent.json → absent.json
    ";
    at.refuses(rows);
}

/// A page of each other benchmark, and what it shows: the sections of plots and tables.
#[test]
fn every_benchmark_writes_a_page() {
    for row in OTHERS.lines() {
        let [name, arguments, expected] =
            [0, 1, 2].map(|k| row.split(" | ").nth(k).expect("three"));
        let expected: Vec<&str> = expected.split(' ').collect();
        let at = folder(&format!("page-{name}"));
        if name == "matrix" {
            at.good("dump hoist --set segments=4 --step 3 --out . --name small");
        }
        let stdout = at.good(arguments);
        assert!(!stdout.contains("written to"), "{name}: {stdout}");
        let page = at.read("target/taut/report.html");
        let mut sections = expected.clone();
        sections.extend(["printed", "limits"]);
        assert_eq!(names(&page), sections, "{name}");
        for part in [
            format!("-- {arguments}</code>"),
            "<dt>commit</dt><dd>".to_owned(),
            " UTC</dd>".to_owned(),
        ] {
            assert!(page.contains(&part), "{name}: {part}");
        }
        let data = at.read(format!("target/taut/{name}.report.json"));
        let data: Value = serde_json::from_str(&data).expect("JSON");
        let settings = data["settings"].as_array().expect("settings");
        assert!(settings.len() >= 3, "{name}: {settings:?}");
        assert!(data["commit"].as_str().is_some_and(|c| !c.is_empty()));
        let report = format!("report target/taut/{name}.report.json");
        at.good(format!("{report} --out again.html"));
        let found = at.read("again.html");
        assert!(found == page, "{name}");
        // Rows alone do not hold the printed text.
        at.good(format!("report target/taut/{name}.json --out rows.html"));
        let rows = at.read("rows.html");
        sections.retain(|section| *section != "printed");
        assert_eq!(names(&rows), sections, "{name}");
        // The plot alone, where there is one of work against precision.
        let picture = format!("{report} --picture plot.svg");
        if expected.contains(&"work-precision") {
            assert_eq!(at.good(&picture), "");
            assert!(marks(&at.read("plot.svg")) > 0);
        } else {
            at.refused(&picture, &[name, "no plot of work against precision"]);
        }
    }
}

/// Benchmarks beside the main job, in their smallest forms: name, arguments, sections before the last ones.
const OTHERS: &str = "\
linear | study linear --segments 4 --ratios 1,1e3 --backends banded,cg:jacobi | mass-ratios table-records
kernels | study kernels --quick --segments 4,8 --backends banded,faer:ldlt/kkt | work-precision sizes table-records
iterative | study iterative --quick --segments 4 --ratios 10 --backends cg:jacobi,cg:group | work-precision table-records
accuracy | study accuracy --quick --segments 4 --ratios 10,1e4 --backends banded,cg:group --time 0.5 | work-precision orders solvers table-records
scenes | study scenes --scene ring --quick --segments 8,12 --backends banded,cg:group --iterations 5,50 | work-precision sizes table-records
matrix | study matrix small.mtx,small_kkt.mtx --quick | work-precision table-matrix table-records table-omissions
engines | study engines --quick --segments 4 --ratios 10 --time 0.5 | work-precision table-records table-ground
energy | study energy --quick | amplitude energy momentum table-swings table-bands table-spins
stability | study stability --quick | largest table-records
shocks | study shocks --quick --ratios 100 --time 1 | errors table-shocks table-outcomes";

#[test]
fn a_picture_is_a_file_of_its_own() {
    let at = made("picture");
    let stdout = at.good("report target/taut/bench.json --picture deep/plot.svg");
    assert_eq!(stdout, "");
    let picture = at.read("deep/plot.svg");
    let holds = picture.starts_with("<svg") && picture.contains("xmlns=");
    assert!(holds, "{picture}");
    // On white paper, in a font that every reader has some of.
    for part in [
        "#FFFFFF",
        "sans-serif",
        "load/segment 10",
        "load/segment 100",
        "cg:jacobi",
        "(µs)",
    ] {
        assert!(picture.contains(part), "{part}");
    }
    assert!(marks(&picture) > 10);
    // Two panels share one legend.
    assert_eq!(picture.matches("\ncg:jacobi\n").count(), 1);
    assert_eq!(picture.matches("whole step (µs)").count(), 2);
    let stdout = at.good("report target/taut/bench.report.json --picture p.svg --out p.html");
    assert_eq!(stdout, "");
    assert_eq!(at.read("p.svg"), picture);
}

#[test]
fn reports_that_are_older_broken_or_absurd_are_read_or_refused() {
    let at = made("read");
    let text = at.read("target/taut/bench.report.json");
    let whole: Value = serde_json::from_str(&text).expect("JSON");
    // A file of an older version lacks these keys.
    let mut older = whole.clone();
    for key in "compiler commit other settings omissions extras".split(' ') {
        older.as_object_mut().expect("an object").remove(key);
    }
    for record in older["records"].as_array_mut().expect("rows") {
        record
            .as_object_mut()
            .expect("an object")
            .remove("verified_to_rounding");
    }
    // Numbers that no run has.
    let mut absurd = whole.clone();
    for (i, record) in absurd["records"]
        .as_array_mut()
        .expect("rows")
        .iter_mut()
        .enumerate()
    {
        for key in "segments iterations frames claimed_converged verified_converged".split(' ') {
            record[key] = u64::MAX.into();
        }
        record["step_ns"] = if i % 2 == 0 {
            1e308.into()
        } else {
            Value::Null
        };
        record["forward_error"] = (-1e308).into();
    }
    absurd["unix_time"] = u64::MAX.into();
    absurd["extras"]["patterns"][0]["blocks"] = u64::MAX.into();
    for (name, report) in [("older", older), ("absurd", absurd)] {
        at.write(format!("{name}.json"), report.to_string());
        at.good(format!(
            "report {name}.json --out {name}.html --picture {name}.svg"
        ));
    }
    let page = at.read("older.html");
    assert!(names(&page).contains(&"claims".to_owned()));
    // A file that ends too early, wherever that is.
    let characters: Vec<(usize, char)> = text.char_indices().collect();
    for share in 0..8 {
        let (end, _) = characters[share * (characters.len() - 3) / 7];
        at.write("cut.json", &text[..end]);
        at.refused("report cut.json", &["cut.json", "neither a report"]);
    }
    for nothing in [
        "[]",
        "{\"records\": []}",
        "{}",
        "3",
        "null",
        "[3]",
        "[{}]",
        "[{\"pose\": 3}, 4]",
    ] {
        at.write("nothing.json", nothing);
        let output = at.taut("report nothing.json --out nothing.html");
        // The last one is rows of a kind, be they ever so few.
        let good = nothing.contains("pose");
        let found = output.status.code();
        assert_eq!(found, Some(if good { 0 } else { 2 }), "{nothing}");
    }
    at.write("empty.json", "[]");
    at.refused("report empty.json", &["empty.json", "holds no rows"]);
}
