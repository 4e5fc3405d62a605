use crate::{folder, good, refused, text};
use std::fs;
use std::path::Path;
use std::process::Command;

const SECTIONS: [&str; 12] = [
    "work-precision",
    "motion",
    "profiles",
    "means",
    "sizes",
    "mass-ratios",
    "trace",
    "energy",
    "patterns",
    "claims",
    "rows",
    "limits",
];

/// Every section of a page, as (name, text); every picture and table in them holds data.
fn full_sections(page: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for section in page.split("<section ").skip(1) {
        let name = section.split('"').nth(1).expect("an id").to_owned();
        for figure in section.split("<figure").skip(1) {
            let figure = figure.split("</figure>").next().expect("an end");
            let lines = figure.matches("<polyline").count() + figure.matches("<circle").count();
            // Two axes have lines of their own.
            assert!(lines > 2, "an empty picture in {name}: {figure}");
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

/// A page that holds everything, from a small job.
fn made(name: &str) -> std::path::PathBuf {
    let at = folder(name);
    let stdout = good(
        &at,
        "bench --quick --segments 4 --ratios 10,100 --iterations 5,50 --backends banded,faer:ldlt/kkt,cg:jacobi",
    );
    assert!(!stdout.contains("written to"), "{stdout}");
    at
}

#[test]
fn the_main_job_writes_a_page_that_holds_data() {
    let at = made("report");
    let page = fs::read_to_string(at.join("target/taut/report.html")).expect("a page");
    let names: Vec<String> = full_sections(&page).into_iter().map(|s| s.0).collect();
    assert_eq!(names, SECTIONS);
    // Nothing is fetched from anywhere.
    for outside in ["http:", "https:", "<link", "@import", "<img"] {
        let used = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!used.contains(outside), "{outside}");
    }
    // The same page again from its data, and one of the rows alone.
    good(&at, "report target/taut/report.json --out again.html");
    assert!(fs::read_to_string(at.join("again.html")).expect("a page") == page);
    good(&at, "report target/taut/bench.json --out rows.html");
    let rows = fs::read_to_string(at.join("rows.html")).expect("a page");
    let names: Vec<String> = full_sections(&rows).into_iter().map(|s| s.0).collect();
    assert_eq!(
        names,
        [
            "work-precision",
            "profiles",
            "means",
            "claims",
            "rows",
            "limits"
        ]
    );
    fs::write(at.join("other.json"), "{\"rows\": 3}").expect("writable");
    refused(
        &at,
        "report other.json",
        &["other.json", "neither a report"],
    );
    refused(&at, "report absent.json", &["absent.json"]);
}

/// Headless Chromium, where it is.
fn chromium(page: &Path, profile: &Path) -> Option<String> {
    let program = ["chromium", "chromium-browser"]
        .into_iter()
        .find(|p| Command::new(p).arg("--version").output().is_ok())?;
    let output = Command::new(program)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
        ])
        .args([
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
        ])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("a browser that starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
    Some(text(&output.stdout).to_owned())
}

/// The page as a browser has it when its script has run: the script leaves a mark when a table has been sorted.
#[test]
fn a_browser_shows_the_page() {
    let at = made("browser");
    let page = fs::read_to_string(at.join("target/taut/report.html")).expect("a page");
    // What a reader does: a click on the fifth heading of the rows.
    let click = "<script>document.querySelectorAll('#rows th')[4].click();</script></body>";
    let clicked = at.join("clicked.html");
    fs::write(&clicked, page.replace("</body>", click)).expect("writable");
    let Some(dom) = chromium(&clicked, &at.join("profile")) else {
        eprintln!("no Chromium here: the page is not opened in a browser");
        return;
    };
    let sections = full_sections(&dom);
    assert_eq!(sections.len(), SECTIONS.len());
    let rows = &sections.iter().find(|s| s.0 == "rows").expect("rows").1;
    assert!(rows.contains("aria-sort=\"ascending\""));
    // The step times ascend.
    let body = rows.split("<tbody").nth(1).expect("a body");
    let times: Vec<f64> = body
        .split("<tr>")
        .skip(1)
        .filter_map(|row| row.split("<td").nth(5)?.split("data-sort=\"").nth(1))
        .filter_map(|cell| cell.split('"').next()?.parse().ok())
        .collect();
    assert!(times.len() > 4 && times.is_sorted(), "{times:?}");
}
