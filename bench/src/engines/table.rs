//! The results as text.

use super::{Config, Record};
use crate::table::{mark_columns, nanoseconds, ratio, table, text};
use comfy_table::CellAlignment;
use std::fmt::Write;

/// A table for each cable, after what was run. At most 120 columns.
#[must_use]
pub fn tables(records: &[Record], config: &Config) -> String {
    let bar = percent(Some(config.bar));
    let mut out = format!(
        "hoist: L = 10 m, segments of 1 kg, YA = 2·10⁷ N; one frame of 1/60 s on one thread. Swing: straight at {} rad,\n\
         released from rest, {} s. elong.: of the resting cable, against the analytic one; load: largest distance of the\n\
         swinging load from our own step at 1/7680 s; both in % of L. Rivals: the cheapest setting within {bar} %, by\n\
         powers of two, none beyond {} a frame tried; their cables have no bending and no torsion. *: the least of the\n\
         rows within {bar} %.\n",
        config.angle,
        config.time,
        nanoseconds(config.longest_ns),
    );
    let same = |a: &Record, b: &Record| (a.segments, a.mass_ratio) == (b.segments, b.mass_ratio);
    for cable in records.chunk_by(same) {
        let r = &cable[0];
        let _ = writeln!(
            out,
            "\n{} segments, load/segment mass ratio {}; reference to {:.0e} %",
            r.segments,
            ratio(r.mass_ratio),
            100.0 * r.reference_error
        );
        out.push_str(&rows(cable, &bar));
    }
    if cfg!(not(feature = "rapier")) {
        out.push_str("\nLeft out\n  rapier: not compiled in: build with `--features rapier`\n");
    }
    out
}

fn rows(cable: &[Record], bar: &str) -> String {
    let mut t = table(&[
        "engine", "setting", "elong. %", "load %", "min", "median", "ns/joint", "× ours",
    ]);
    if let Some(column) = t.column_mut(1) {
        column.set_cell_alignment(CellAlignment::Left);
    }
    let mut remarks = String::new();
    for r in cable {
        t.add_row([
            r.engine.clone(),
            r.setting.clone(),
            percent(r.outcome.elongation_error),
            percent(r.outcome.load_error),
            nanoseconds(r.outcome.frame_ns_min),
            nanoseconds(r.outcome.frame_ns),
            timed(r.ns_per_joint, 0),
            timed(r.over_ours, 2),
        ]);
        if !r.within {
            let _ = writeln!(remarks, "{}: {}", r.engine, remark(r, bar));
        }
    }
    mark_columns(
        &mut t,
        cable,
        |r| r.within,
        &[
            (2, |r| r.outcome.elongation_error),
            (3, |r| r.outcome.load_error),
            (4, |r| Some(r.outcome.frame_ns_min)),
            (5, |r| Some(r.outcome.frame_ns)),
            (6, |r| Some(r.ns_per_joint)),
        ],
    );
    text(&t) + &remarks
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

/// A figure of time, where there is one.
fn timed(value: f64, digits: usize) -> String {
    if value.is_nan() {
        "-".to_owned()
    } else {
        format!("{value:.digits$}")
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
