//! The results as tables, a remark for each row beyond the bar.

use super::{Config, Record};
use serde_json::Value;
use std::fmt::Write;
use taut_output::row::is;
use taut_output::sheet::{self, Column, Sheet, Show, column};
use taut_output::table::{nanoseconds, ratio};

const fn percent_of(key: &'static str, heading: &'static str) -> Column {
    column(key, heading)
        .unit("%")
        .shown(Show::Digits(100.0))
        .least()
}

pub(super) const SHEETS: &[Sheet] = &[Sheet {
    shared: &[
        column("segments", "{} segments"),
        column("mass_ratio", "load/segment mass ratio {}").shown(Show::Ratio),
        column("reference_error", "reference to {} of the length").shown(Show::Error(0)),
    ],
    columns: &[
        column("engine", "engine"),
        column("setting", "setting"),
        percent_of("elongation_error", "elong."),
        percent_of("load_error", "load"),
        sheet::time("frame_ns_min", "min"),
        sheet::time("frame_ns", "median"),
        column("ns_per_joint", "ns/joint")
            .shown(Show::Fixed(0))
            .least(),
        column("over_ours", "× ours").shown(Show::Fixed(2)),
    ],
    counts: |row| is(row, "within"),
    ..sheet::PLAIN
}];

/// The tables after what was run, and why rivals are beyond the bar.
pub(super) fn text(data: &Value, records: &[Record], config: &Config) -> String {
    let bar = percent(Some(config.bar));
    let mut out = format!(
        "hoist: L = 10 m, segments of 1 kg, YA = 2·10⁷ N; one frame of 1/60 s on one thread. Swing: straight at {} rad,\n\
         released from rest, {} s. elong.: of the resting cable, against the analytic one; load: largest distance of the\n\
         swinging load from our own step at 1/7680 s; both in % of L. Rivals: the cheapest setting within {bar} %, by\n\
         powers of two, none beyond {} a frame tried; their cables have no bending and no torsion. *: the least of the\n\
         rows within {bar} %.\n{}",
        config.angle,
        config.time,
        nanoseconds(config.longest_ns),
        SHEETS[0].text(data)
    );
    let beyond: Vec<&Record> = records.iter().filter(|r| !r.within).collect();
    if !beyond.is_empty() {
        out.push_str("\nBeyond the bar\n");
    }
    for r in beyond {
        let cable = format!("{} segments, ratio {}", r.segments, ratio(r.mass_ratio));
        let _ = writeln!(out, "  {}, {cable}: {}", r.engine, remark(r, &bar));
    }
    if cfg!(not(feature = "rapier")) {
        out.push_str("\nLeft out\n  rapier: not compiled in: build with `--features rapier`\n");
    }
    out
}

/// What is said of a row that is not within the bar, given in %.
fn remark(r: &Record, bar: &str) -> String {
    let best = percent(Some(r.outcome.error()));
    match (&r.outcome.failure, r.searched) {
        (None, true) => format!("{bar} % not reached; best of {}: {best} %", r.tried),
        (None, false) => format!("`{}` is beyond {bar} %", r.setting),
        (Some(reason), true) => {
            format!(
                "{bar} % not reached, no run of {} to its end; the first: {reason}",
                r.tried
            )
        }
        (Some(reason), false) => format!("`{}`: {reason}", r.setting),
    }
}

/// Per cent, two digits.
fn percent(error: Option<f64>) -> String {
    match error.map(|e| 100.0 * e) {
        None => "-".to_owned(),
        Some(e) if e < 1e-3 => format!("{e:.0e}"),
        Some(e) if e < 0.1 => format!("{e:.3}"),
        Some(e) if e < 1.0 => format!("{e:.2}"),
        Some(e) => format!("{}", (100.0 * e).round() / 100.0),
    }
}
