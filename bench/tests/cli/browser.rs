//! The pages in a browser: every section is there, and a click on a heading sorts.

#[path = "../shared/chromium.rs"]
mod shared;

use crate::report::{SECTIONS, full_sections, made, names};
use crate::*;

/// A page after its script, in headless Chromium with more options, where it is.
pub(crate) fn chromium(page: &Path, profile: &Path, options: &[&str]) -> Option<String> {
    let output = shared::chromium(profile)?
        .args(options)
        .arg("--dump-dom")
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("a browser that starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
    Some(text(&output.stdout).to_owned())
}

/// A page as a browser has it when its script has run and then `script`.
fn after(at: &At, script: &str) -> Option<String> {
    let page = at.read("target/taut/report.html");
    let path = at.join("after.html");
    let script = format!("<script>{script}</script></body>");
    fs::write(&path, page.replace("</body>", &script)).expect("writable");
    chromium(&path, &at.join("profile"), &[])
}

/// The sections of a page after a click on a heading of the table in one of them.
fn clicked(at: &At, section: &str, heading: usize) -> Option<Vec<(String, String)>> {
    let page = at.read("target/taut/report.html");
    let click = format!("document.querySelectorAll('#{section} th')[{heading}].click();");
    let dom = after(at, &click)?;
    let shown = full_sections(&dom);
    let written: Vec<String> = names(&page);
    assert!(shown.iter().map(|s| &s.0).eq(&written), "{written:?}");
    Some(shown)
}

/// The numbers by which a column of the section's table is sorted, in the order of its rows.
fn column(sections: &[(String, String)], section: &str, column: usize) -> Vec<f64> {
    let section = sections.iter().find(|s| s.0 == section);
    let text = &section.expect("the section").1;
    assert!(text.contains("aria-sort=\"ascending\"") && text.contains("aria-sort=\"none\""));
    let body = text.split("<tbody").nth(1).expect("a body");
    let rows = body.split("<tr>").skip(1);
    let cells = rows.filter_map(|row| {
        row.split("<td")
            .nth(column + 1)?
            .split("data-sort=\"")
            .nth(1)
    });
    cells
        .filter_map(|cell| cell.split('"').next()?.parse().ok())
        .collect()
}

/// The pages of the main job and of a sweep: every section is there, and a click on a heading sorts.
#[test]
fn a_browser_shows_the_pages() {
    let at = made("browser");
    let Some(sections) = clicked(&at, "rows", 4) else {
        return;
    };
    assert_eq!(sections.len(), SECTIONS.len());
    let times = column(&sections, "rows", 4);
    assert!(times.len() > 4 && times.is_sorted(), "{times:?}");
    choose_and_hide(&at);
    let at = folder("browser-kernels");
    at.good("study kernels --quick --segments 4,8 --backends banded,faer:ldlt/kkt");
    let sections = clicked(&at, "table-records", 5).expect("Chromium is here");
    let times = column(&sections, "table-records", 5);
    assert!(times.len() > 4 && times.is_sorted(), "{times:?}");
}

/// The large plot of work against precision shows the second scene, and of its solvers, two clicks later, the first alone.
fn choose_and_hide(at: &At) {
    let script = "
        const select = document.querySelector('.choice select');
        select.selectedIndex = 1;
        select.dispatchEvent(new Event('change'));
        const key = document.querySelector('.large [data-key]');
        key.dispatchEvent(new MouseEvent('dblclick', { bubbles: true }));";
    let dom = after(at, script).expect("Chromium is here");
    let large = dom.split("class=\"large\"").nth(1).expect("a large plot");
    let large = large.split("</figure>").next().expect("its end");
    let titles: Vec<&str> = dom.split("<option>").skip(1).collect();
    let title = titles[1].split('<').next().expect("a title");
    let says = large.starts_with(&format!(" aria-label=\"{title}\""));
    assert!(says, "{large}");
    let keys = large.split("<g data-key=").skip(1);
    let hidden: Vec<bool> = keys
        .map(|key| {
            key.split('>')
                .next()
                .is_some_and(|tag| tag.contains("class=\"off\""))
        })
        .collect();
    let holds = hidden.len() > 2 && !hidden[0] && hidden[1..].iter().all(|off| *off);
    assert!(holds, "{hidden:?}");
    let series = large.split("<g data-series=");
    let series = series.skip(1).map(|s| s.split('>').next());
    let hidden = series.filter(|tag| tag.is_some_and(|tag| tag.contains("class=\"off\"")));
    assert_eq!(hidden.count() + 1, large.matches("<g data-series=").count());
    assert!(large.contains("<title>banded, "), "{large}");
}
