//! The stability map as text, linear theory and the paper's own table beside it.

use super::{Config, READABLE_AREA, Record, square};
use crate::table::{table, text};
use std::fmt::Write;

impl Record {
    /// log₁₀ of the largest ratio up to which all are stable; in brackets the largest stable one where it is another.
    pub(super) fn cell(&self) -> String {
        let cap = self.ratios.last().copied();
        let exponent = |r: f64| {
            let log = format!("{:.2}", r.log10());
            if Some(r) == cap {
                format!("≥{log}")
            } else {
                log
            }
        };
        match (self.stable_to, self.highest) {
            (None, None) => "<0".to_owned(),
            (None, Some(high)) => format!("<0({})", exponent(high)),
            (Some(low), Some(high)) if high > low => {
                format!("{}({})", exponent(low), exponent(high))
            }
            (Some(low), _) => exponent(low),
        }
    }

    /// What stands in one table of the map.
    fn map(&self) -> (&str, usize) {
        (&self.cable, self.segments)
    }
}

/// The map, a table for each cable and number of segments, then the guard's, then the paper's.
#[must_use]
pub fn text_tables(records: &[Record], config: &Config) -> String {
    let mut out = format!(
        "Stability map: log₁₀ of the largest load/segment mass ratio up to which every ratio of the grid is stable for\n\
         {} s at Δt = 1/{:.0} s; in brackets the largest stable one where some below it are not. Guard off.\n",
        config.time,
        1.0 / config.dt
    );
    let map: Vec<&Record> = records
        .iter()
        .filter(|r| !r.guarded && !r.planar && !readable(r))
        .collect();
    let mut sections: Vec<(&str, usize)> = Vec::new();
    for r in &map {
        if !sections.contains(&r.map()) {
            sections.push(r.map());
        }
    }
    for section in sections {
        let _ = writeln!(out, "\n{}; {} segments", section.0, section.1);
        let cells: Vec<&Record> = map.iter().copied().filter(|r| r.map() == section).collect();
        out.push_str(&map_table(&cells));
    }
    let guarded: Vec<&Record> = records.iter().filter(|r| r.guarded).collect();
    if !guarded.is_empty() {
        let _ = writeln!(out, "\nThe default options with the guard on, hoist");
        let mut t = table(&["joint", "segments", "scheme", "stiffness", "largest"]);
        for r in guarded {
            t.add_row([
                r.joint.clone(),
                r.segments.to_string(),
                r.scheme.clone(),
                r.stiffness.clone(),
                r.cell(),
            ]);
        }
        out.push_str(&text(&t));
    }
    out.push_str(&without_stiffness(records));
    out.push_str(&paper_table());
    out
}

/// Whether the record is of the cable of the paper's readable entry.
fn readable(r: &Record) -> bool {
    r.cable == square("steel", READABLE_AREA).name()
}

fn map_table(cells: &[&Record]) -> String {
    let mut columns: Vec<&str> = Vec::new();
    let mut rows: Vec<(&str, &str)> = Vec::new();
    for r in cells {
        let row = (r.joint.as_str(), r.scheme.as_str());
        if !columns.contains(&r.stiffness.as_str()) {
            columns.push(&r.stiffness);
        }
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    let headers: Vec<String> = columns
        .iter()
        .map(|c| match *c {
            "off" => "no K".to_owned(),
            c => c.replace("relative:", "rel. "),
        })
        .collect();
    let mut header = vec!["joint", "scheme"];
    header.extend(headers.iter().map(String::as_str));
    let mut t = table(&header);
    for (joint, scheme) in rows {
        let mut row = vec![joint.to_owned(), scheme.to_owned()];
        row.extend(columns.iter().map(|column| {
            let at = |r: &&&Record| {
                (r.joint.as_str(), r.scheme.as_str(), r.stiffness.as_str())
                    == (joint, scheme, *column)
            };
            cells
                .iter()
                .find(at)
                .map_or_else(|| "-".to_owned(), |r| r.cell())
        }));
        t.add_row(row);
    }
    text(&t)
}

/// The paper's step: linear theory beside what was measured.
fn without_stiffness(records: &[Record]) -> String {
    let mut t = table(&[
        "cable",
        "segments",
        "joint",
        "motion",
        "predicted",
        "measured to",
        "highest",
    ]);
    let plain = |r: Option<f64>| r.map_or_else(|| "< 1".to_owned(), |r| format!("{r:.0}"));
    let explicit = records.iter().filter(|r| r.predicted.is_some());
    for r in explicit {
        let motion = if r.planar { "planar" } else { "seeded" };
        t.add_row([
            r.cable.clone(),
            r.segments.to_string(),
            r.joint.clone(),
            motion.to_owned(),
            plain(r.predicted),
            plain(r.stable_to),
            plain(r.highest),
        ]);
    }
    format!(
        "\nThe paper's step (linearly implicit, no K): largest stable ratio by linear theory and measured\n{}",
        text(&t)
    )
}

/// A row of the paper's Table II: Y \[GPa], ζ = A/I_a \[1/m²], segments, largest stable ratio; `None` where the exponent
/// is lost in the text at hand. Made with 20 Gauss–Seidel iterations and the alternative twist.
struct Printed {
    young: f64,
    zeta: Option<f64>,
    segments: usize,
    ratio: Option<f64>,
}

const fn printed(young: f64, zeta: Option<f64>, segments: usize, ratio: Option<f64>) -> Printed {
    Printed {
        young,
        zeta,
        segments,
        ratio,
    }
}

const TABLE_II: [Printed; 10] = [
    printed(200.0, None, 24, None),
    printed(200.0, None, 24, None),
    printed(200.0, None, 24, None),
    printed(200.0, None, 24, None),
    printed(2000.0, None, 24, None),
    printed(200.0, None, 6, None),
    printed(200.0, None, 6, Some(1e2)),
    printed(200.0, Some(1e3), 6, Some(1e3)),
    printed(200.0, None, 6, None),
    printed(2000.0, None, 6, None),
];

fn paper_table() -> String {
    let mut t = table(&["Y GPa", "ζ 1/m²", "segments", "(M/m) max"]);
    let shown =
        |x: Option<f64>| x.map_or_else(|| "not readable".to_owned(), |x| format!("{x:.0e}"));
    for row in &TABLE_II {
        t.add_row([
            row.young.to_string(),
            shown(row.zeta),
            row.segments.to_string(),
            shown(row.ratio),
        ]);
    }
    format!(
        "\nThe paper's Table II (20 Gauss–Seidel iterations, alternative twist); its figure for a direct solver is not\n\
         readable. ζ = 12/A: 1.2e5 for 1e-4 m², 1e3 for 1.2e-2 m².\n{}",
        text(&t)
    )
}
