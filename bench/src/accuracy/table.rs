//! The sweep's tables for people.

use super::{Case, Drive, Record, Results};
use crate::table::{mark_least, nanoseconds, ratio, table, text};
use std::fmt::Write;
use taut_model::JointKind;

/// All tables: motions by setting and ratio, what the default keeps, its order, solvers, costs.
#[must_use]
pub fn tables(results: &Results) -> String {
    let mut out = String::new();
    for group in groups(results) {
        let case = group[0].case;
        let uncertainty = group.iter().map(|r| r.reference_m).fold(0.0, f64::max);
        let _ = writeln!(
            out,
            "\n{}, {} segments, {}: error of the load, horizontal/vertical (mm)\n† time of the end (s); * least error of \
             the rows at the same Δt; reference to {:.0e} mm",
            joint(case.joint),
            case.segments,
            drive(case.drive),
            1e3 * uncertainty
        );
        out.push_str(&motions(&group));
        out.push_str(&orders(&group));
    }
    out.push_str(&verdicts(results));
    out.push_str(&solvers(results));
    out.push_str(&costs(results));
    out
}

fn joint(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Spherical => "Spherical joints",
        JointKind::Cosserat => "Cosserat joints",
        JointKind::Paper => "The paper's joints",
        _ => "Joints of a kind without a name here",
    }
}

fn drive(drive: Drive) -> &'static str {
    match drive {
        Drive::Aside => "anchor moved 0.5 m in 2 s",
        Drive::Circle => "anchor on a circle",
    }
}

/// Whether the record is one of settings and rates, not of another solver.
fn is_motion(r: &Record) -> bool {
    r.backend == results_backend() && r.refinements == 1 && r.iterations == 0
}

/// The solver that the settings run with.
fn results_backend() -> String {
    let options = taut_integrator::StepOptions::default();
    crate::Choice::schur(options.backend).family()
}

/// The records of motions, by joint, segments and drive.
fn groups(results: &Results) -> Vec<Vec<&Record>> {
    let mut groups: Vec<Vec<&Record>> = Vec::new();
    let same =
        |a: &Case, b: &Case| (a.joint, a.segments, a.drive) == (b.joint, b.segments, b.drive);
    for record in results.records.iter().filter(|r| is_motion(r)) {
        match groups.iter_mut().find(|g| same(&g[0].case, &record.case)) {
            Some(group) => group.push(record),
            None => groups.push(vec![record]),
        }
    }
    groups
}

fn ratios(group: &[&Record]) -> Vec<f64> {
    let mut ratios: Vec<f64> = group.iter().map(|r| r.case.mass_ratio).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.dedup();
    ratios
}

fn motions(group: &[&Record]) -> String {
    let ratios = ratios(group);
    let mut rows: Vec<(&str, f64)> = Vec::new();
    for r in group {
        if !rows.contains(&(&r.setting, r.dt)) {
            rows.push((&r.setting, r.dt));
        }
    }
    let mut header = vec!["setting".to_owned(), "1/Δt".to_owned()];
    header.extend(ratios.iter().map(|r| ratio(*r)));
    let mut out = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    let find = |ratio: f64, (setting, dt): (&str, f64)| {
        let own =
            |r: &&&Record| (r.case.mass_ratio, r.setting.as_str(), r.dt) == (ratio, setting, dt);
        group.iter().find(own)
    };
    for &(setting, dt) in &rows {
        let mut cells = vec![setting.to_owned(), format!("{:.0}", 1.0 / dt)];
        for &ratio in &ratios {
            let found = find(ratio, (setting, dt));
            cells.push(found.map_or_else(String::new, |r| cell(r)));
        }
        out.add_row(cells);
    }
    // Of the rows at the same time step.
    for (i, &ratio) in ratios.iter().enumerate() {
        let of = |row: &(&str, f64)| {
            let stable = find(ratio, *row).filter(|r| r.stable);
            (row.1, stable.map(|r| r.error()))
        };
        mark_least(&mut out, 2 + i, &rows.iter().map(of).collect::<Vec<_>>());
    }
    text(&out)
}

fn cell(r: &Record) -> String {
    if !r.stable {
        return format!("†{:.2}", r.held_s);
    }
    let redone = if r.redone > 0 {
        format!(" g{}", r.redone)
    } else {
        String::new()
    };
    format!("{}/{}{redone}", mm(r.horizontal_m), mm(r.vertical_m))
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

/// Observed orders of the default between its rates.
fn orders(group: &[&Record]) -> String {
    let mut out = String::from("observed order of the default between these rates:");
    for ratio_ in ratios(group) {
        let mut runs: Vec<&&Record> = group
            .iter()
            .filter(|r| r.setting == "default" && r.case.mass_ratio == ratio_ && r.stable)
            .collect();
        runs.sort_by(|a, b| b.dt.total_cmp(&a.dt));
        runs.dedup_by(|a, b| a.dt == b.dt);
        let orders: Vec<_> = runs
            .windows(2)
            .map(|w| {
                let order = (w[0].error() / w[1].error()).ln() / (w[0].dt / w[1].dt).ln();
                format!("{order:.2}")
            })
            .collect();
        let _ = write!(out, " {}: {};", ratio(ratio_), orders.join(" "));
    }
    out.pop();
    out.push('\n');
    out
}

/// What is asked of the default at the first rate: stable everywhere, 1 mm across and 10 mm along from ratio 100 on.
fn verdicts(results: &Results) -> String {
    let default = |r: &&Record| r.setting == "default" && is_motion(r);
    let first = results.records.iter().map(|r| r.dt).fold(0.0, f64::max);
    let mut runs: Vec<&Record> = results
        .records
        .iter()
        .filter(default)
        .filter(|r| r.dt == first)
        .collect();
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

fn solvers(results: &Results) -> String {
    let fewest = results.records.iter().map(|r| r.case.segments).min();
    let runs: Vec<&Record> = results
        .records
        .iter()
        .filter(|r| r.setting == "default" && Some(r.case.segments) == fewest)
        .filter(|r| r.case.joint == JointKind::Cosserat && r.case.drive == Drive::Aside)
        .collect();
    let first = runs.iter().map(|r| r.dt).fold(0.0, f64::max);
    let runs: Vec<&Record> = runs.into_iter().filter(|r| r.dt == first).collect();
    let others: Vec<&Record> = runs.iter().copied().filter(|r| !is_motion(r)).collect();
    if others.is_empty() {
        return String::new();
    }
    let ratios = ratios(&others);
    let mut header = vec![
        "solver".to_owned(),
        "iter.".to_owned(),
        "refined".to_owned(),
    ];
    for r in &ratios {
        header.push(format!("{}: mm", ratio(*r)));
        header.push("step".to_owned());
    }
    let mut out = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    let mut rows: Vec<(&str, usize, usize)> = Vec::new();
    for r in &runs {
        let row = (r.backend.as_str(), r.iterations, r.refinements);
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    let find = |ratio: f64, row: (&str, usize, usize)| {
        runs.iter().find(|r| {
            (r.backend.as_str(), r.iterations, r.refinements) == row && r.case.mass_ratio == ratio
        })
    };
    for &row in &rows {
        let count = |n: usize| {
            if n == 0 {
                "-".to_owned()
            } else {
                n.to_string()
            }
        };
        let mut cells = vec![row.0.to_owned(), count(row.1), row.2.to_string()];
        for &ratio in &ratios {
            let found = find(ratio, row);
            cells.push(found.map_or_else(String::new, |r| {
                if r.stable {
                    mm(r.error())
                } else {
                    format!("†{:.2}", r.held_s)
                }
            }));
            cells.push(found.map_or_else(String::new, |r| nanoseconds(r.step_ns)));
        }
        out.add_row(cells);
    }
    for (i, &ratio) in ratios.iter().enumerate() {
        let stable = |row: &(&str, usize, usize)| find(ratio, *row).filter(|r| r.stable);
        let errors = rows.iter().map(|row| ((), stable(row).map(|r| r.error())));
        mark_least(&mut out, 3 + 2 * i, &errors.collect::<Vec<_>>());
        let times = rows.iter().map(|row| ((), stable(row).map(|r| r.step_ns)));
        mark_least(&mut out, 4 + 2 * i, &times.collect::<Vec<_>>());
    }
    format!(
        "\nThe default with every solver, {} segments, Cosserat joints: error of the load (mm) and median step, beside \
         other runs;\n* least of the stable runs\n{}",
        fewest.unwrap_or(0),
        text(&out)
    )
}

fn costs(results: &Results) -> String {
    let mut out = table(&["segments", "step", "time", "ratio"]);
    for c in &results.costs {
        out.add_row([
            c.segments.to_string(),
            c.what.clone(),
            nanoseconds(c.step_ns),
            format!("{:.3}", c.ratio),
        ]);
    }
    format!(
        "\nWhat the parts of a step cost, alone and in turns\n{}",
        text(&out)
    )
}
