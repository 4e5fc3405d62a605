//! The results as tables, a remark for each row beyond the bar.

use super::search::{Entry, Errors};
use super::{Config, Results};
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

pub(super) const SHEETS: &[Sheet] = &[HOIST, GROUND];

const GROUND: Sheet = Sheet {
    list: "ground",
    title: "On the ground",
    columns: &[
        column("scene", "scene"),
        column("mass_ratio", "ratio").shown(Show::Ratio),
        column("engine", "engine"),
        column("setting", "setting"),
        percent_of("place_error", "place"),
        percent_of("depth_error", "depth"),
        sheet::time("frame_ns_min", "min"),
        sheet::time("frame_ns", "median"),
        column("over_ours", "× ours").shown(Show::Fixed(2)),
    ],
    counts: |row| is(row, "within"),
    rivals: &["scene", "mass_ratio"],
    ..sheet::PLAIN
};

const HOIST: Sheet = Sheet {
    list: "records",
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
};

/// The tables after what was run, and why rivals are beyond the bar.
pub(super) fn text(data: &Value, results: &Results, config: &Config) -> String {
    let bar = percent(Some(config.bar));
    let mut out = format!(
        "hoist: L = 10 m, segments of 1 kg, YA = 2·10⁷ N; one frame of 1/60 s on one thread. Swing: straight at {} rad,\n\
         released from rest, {} s. elong.: of the resting cable, against the analytic one; load: largest distance of the\n\
         swinging load from our own step at 1/7680 s; both in % of L. Rivals: the cheapest setting within {bar} %, by\n\
         powers of two, none beyond {} a frame tried; their cables have no bending and no torsion. *: the least of the\n\
         rows within {bar} %.\n{}{}",
        config.angle,
        config.time,
        nanoseconds(config.longest_ns),
        HOIST.text(data),
        GROUND.text(data),
    );
    let _ = writeln!(
        out,
        "  slide: a box of 2 m/s; stack: 10 boxes, the topmost the heaviest; floor: a load that 24 segments drag; 2 s,\n  \
         μ = 0.3. place: largest distance of a body from its known place, in % of the way, the height or the cable;\n  \
         depth: deepest penetration, in % of an edge or the cable's diameter; both in the second half. × ours: of the\n  \
         medians. Rivals: none beyond {} a frame tried.",
        nanoseconds(config.longest_on_ground_ns)
    );
    let hoisted = results.records.iter().filter_map(|r| {
        let cable = format!("{} segments, ratio {}", r.segments, ratio(r.mass_ratio));
        remark(&r.entry, &cable, &bar)
    });
    let grounded = results.ground.iter().filter_map(|r| {
        let scene = format!("{}, ratio {}", r.scene, ratio(r.mass_ratio));
        remark(&r.entry, &scene, &bar)
    });
    let beyond: Vec<String> = hoisted.chain(grounded).collect();
    if !beyond.is_empty() {
        out.push_str("\nBeyond the bar\n");
    }
    for line in beyond {
        let _ = writeln!(out, "  {line}");
    }
    if cfg!(not(feature = "rapier")) {
        out.push_str("\nLeft out\n  rapier: not compiled in: build with `--features rapier`\n");
    }
    out
}

/// Note on a row beyond the bar (in %) on a scene; `None` within it.
fn remark<E: Errors>(entry: &Entry<E>, scene: &str, bar: &str) -> Option<String> {
    let (setting, tried) = (&entry.setting, entry.tried);
    let best = percent(Some(entry.outcome.error()));
    let reason = match (&entry.outcome.failure, entry.searched) {
        _ if entry.within => return None,
        (None, true) => format!("{bar} % not reached; best of {tried}: {best} %"),
        (None, false) => format!("`{setting}` is beyond {bar} %"),
        (Some(reason), true) => {
            format!("{bar} % not reached, no run of {tried} to its end; the first: {reason}")
        }
        (Some(reason), false) => format!("`{setting}`: {reason}"),
    };
    Some(format!("{}, {scene}: {reason}", entry.engine))
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
