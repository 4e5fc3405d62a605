//! Errors of motions as tables: by setting and ratio, what the default keeps, its order, solvers, costs.

use super::{Drive, Record, Results};
use serde_json::{Value, json};
use std::sync::LazyLock;
use taut_model::JointKind;
use taut_output::row::{Row, is, number_of, text_of};
use taut_output::settings::distinct;
use taut_output::sheet::{self, Across, Column, Sheet, Show, column};

const JOINT: Column = column("joint", "{} joints");
const DRIVE: Column = column("drive", "{}").shown(Show::Row(drive));
const RATIOS: &[Column] = &[column("mass_ratio", "{}").shown(Show::Ratio)];

/// The tables of motions and of costs.
pub(super) const SHEETS: &[Sheet] = &[
    Sheet {
        list: "records",
        title: "Error of the load, horizontal/vertical (mm); gN: steps redone; † time of the end (s); * least of the rows at\n\
                the same Δt",
        shared: &[JOINT, column("segments", "{} segments"), DRIVE],
        columns: &[
            column("setting", "setting"),
            column("dt", "1/Δt").shown(Show::Row(rate)),
        ],
        across: Some(Across {
            by: RATIOS,
            cells: &[column("horizontal_m", "")
                .shown(Show::Row(motion))
                .least_of(error)],
            several: false,
            most: usize::MAX,
        }),
        takes: is_motion,
        counts: |row| is(row, "stable"),
        rivals: &["dt"],
    },
    Sheet {
        list: "costs",
        title: "What the parts of a step cost, alone and in turns",
        columns: &[
            column("segments", "segments"),
            column("what", "step"),
            sheet::time("step_ns", "time"),
            column("ratio", "ratio").shown(Show::Fixed(3)),
        ],
        counts: |_| false,
        ..sheet::PLAIN
    },
];

const ORDERS: Sheet = Sheet {
    title: "Observed order of the default between its rates, and what is not known of the reference",
    columns: &[
        column("joint", "joints"),
        column("segments", "segments"),
        column("drive", "drive"),
        column("mass_ratio", "ratio").shown(Show::Ratio),
        column("orders", "orders"),
        column("reference_mm", "reference")
            .unit("mm")
            .shown(Show::Error(0)),
    ],
    ..sheet::PLAIN
};

const SOLVERS: Sheet = Sheet {
    title: "The default with every solver, Cosserat joints: error of the load (mm) and median step, beside other runs;\n\
            * least of the stable runs",
    shared: &[column("segments", "{} segments")],
    columns: &[
        column("backend", "solver"),
        column("iterations", "iter."),
        column("refinements", "refined"),
    ],
    across: Some(Across {
        by: RATIOS,
        cells: &[
            column("horizontal_m", "mm")
                .shown(Show::Row(distance))
                .least_of(error),
            sheet::time("step_ns", "step"),
        ],
        several: false,
        most: usize::MAX,
    }),
    counts: |row| is(row, "stable"),
    ..sheet::PLAIN
};

fn rate(row: &Row) -> String {
    number_of(row, "dt").map_or(String::new(), |dt| format!("{:.0}", 1.0 / dt))
}

fn drive(row: &Row) -> String {
    let aside = text_of(row, "drive") == "aside";
    if aside {
        "anchor moved 0.5 m in 2 s"
    } else {
        "anchor on a circle"
    }
    .to_owned()
}

/// The load's distance from the reference \[m].
fn error(row: &Row) -> Option<f64> {
    Some(number_of(row, "horizontal_m")?.hypot(number_of(row, "vertical_m")?))
}

/// Cell of a lost run: † and the time that it held \[s].
fn lost(row: &Row) -> Option<String> {
    let held = number_of(row, "held_s").unwrap_or(f64::NAN);
    (!is(row, "stable")).then(|| format!("†{held:.2}"))
}

fn motion(row: &Row) -> String {
    lost(row).unwrap_or_else(|| {
        let [across, along] =
            ["horizontal_m", "vertical_m"].map(|key| mm(number_of(row, key).unwrap_or(f64::NAN)));
        let redone = number_of(row, "redone").filter(|n| *n > 0.0);
        format!(
            "{across}/{along}{}",
            redone.map_or(String::new(), |n| format!(" g{n}"))
        )
    })
}

fn distance(row: &Row) -> String {
    lost(row).unwrap_or_else(|| mm(error(row).unwrap_or(f64::NAN)))
}

/// True for rows over settings and rates, which use the default solver with one refinement.
fn is_motion(row: &Row) -> bool {
    let is_one = |key, count| number_of(row, key) == Some(count);
    text_of(row, "backend") == *SOLVER && is_one("refinements", 1.0) && is_one("iterations", 0.0)
}

/// The solver that the settings run with.
static SOLVER: LazyLock<String> = LazyLock::new(|| {
    let options = taut_integrator::StepOptions::default();
    taut_ground::Choice::schur(options.backend).family()
});

/// The records of settings and rates.
fn motions(results: &Results) -> impl Iterator<Item = &Record> {
    let own = |r: &&Record| r.backend == *SOLVER && r.refinements == 1 && r.iterations == 0;
    results.records.iter().filter(own)
}

/// Two digits, in millimetres.
fn mm(metres: f64) -> String {
    let mm = 1e3 * metres;
    if mm >= 10.0 {
        format!("{mm:.0}")
    } else if mm >= 1.0 {
        format!("{mm:.1}")
    } else if mm >= 0.1 {
        format!("{mm:.2}")
    } else {
        format!("{mm:.3}")
    }
}

/// All tables.
pub(super) fn text(results: &Results, data: &Value) -> String {
    let [motions, costs] = [0, 1].map(|i| SHEETS[i].text(data));
    let (orders, solvers) = (ORDERS.of(&orders(results)), SOLVERS.of(&solvers(results)));
    format!("{motions}{orders}{}{solvers}{costs}", verdicts(results))
}

/// Observed orders of the default between its rates.
fn orders(results: &Results) -> Vec<Value> {
    let default = || motions(results).filter(|r| r.setting == "default");
    let row = |case: &super::Case| {
        let own = || default().filter(|r| r.case == *case);
        let mut runs: Vec<&Record> = own().filter(|r| r.stable).collect();
        runs.sort_by(|a, b| b.dt.total_cmp(&a.dt));
        runs.dedup_by(|a, b| a.dt == b.dt);
        let order = |w: &[&Record]| {
            let order = (w[0].error() / w[1].error()).ln() / (w[0].dt / w[1].dt).ln();
            format!("{order:.2}")
        };
        let orders: Vec<String> = runs.windows(2).map(order).collect();
        json!({
            "joint": case.joint,
            "segments": case.segments,
            "drive": case.drive,
            "mass_ratio": case.mass_ratio,
            "orders": orders.join(" "),
            "reference_mm": own().map(|r| 1e3 * r.reference_m).fold(0.0, f64::max),
        })
    };
    distinct(default().map(|r| r.case))
        .iter()
        .map(row)
        .collect()
}

/// Verdict on the default at the first rate: stable everywhere, and from ratio 100 on within 1 mm
/// across and 10 mm along.
fn verdicts(results: &Results) -> String {
    let first = results.records.iter().map(|r| r.dt).fold(0.0, f64::max);
    let default = motions(results).filter(|r| r.setting == "default" && r.dt == first);
    let mut runs: Vec<&Record> = default.collect();
    // The sweep over solvers repeats some.
    runs.dedup_by(|a, b| a.case == b.case);
    let stable = runs.iter().filter(|r| r.stable).count();
    let heavy = || runs.iter().filter(|r| r.case.mass_ratio >= 100.0);
    let worst = |of: fn(&Record) -> f64| heavy().map(|r| of(r)).fold(0.0, f64::max);
    format!(
        "\nThe default at Δt = 1/{:.0} s: stable in {stable} of {} scenes;\nfrom ratio 100 on at most {} mm across \
         (bar 1) and {} mm along (bar 10).\n",
        1.0 / first,
        runs.len(),
        mm(worst(|r| r.horizontal_m)),
        mm(worst(|r| r.vertical_m)),
    )
}

/// The runs of the default with every solver; none where there is but one.
fn solvers(results: &Results) -> Vec<&Record> {
    let fewest = results.records.iter().map(|r| r.case.segments).min();
    let own = |r: &&Record| {
        let case = (Some(r.case.segments), r.case.joint, r.case.drive);
        r.setting == "default" && case == (fewest, JointKind::Cosserat, Drive::Aside)
    };
    let runs = || results.records.iter().filter(own);
    let first = runs().map(|r| r.dt).fold(0.0, f64::max);
    let others: Vec<&Record> = runs().filter(|r| r.dt == first).collect();
    let is_other = |r: &&&Record| (r.backend != *SOLVER) || r.refinements != 1;
    let ratios = distinct(others.iter().filter(is_other).map(|r| r.case.mass_ratio));
    let beside = others
        .into_iter()
        .filter(|r| ratios.contains(&r.case.mass_ratio));
    beside.collect()
}
