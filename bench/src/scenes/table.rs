//! The networks for people: a table for each case, loops, growth.

use super::{BAR, Record, Results};
use crate::table::{
    error, mark_columns, mark_least, nanoseconds, omissions, ratio, table, text, verdict,
};
use comfy_table::Cell;
use std::fmt::Write;
use taut_model::Network;

/// A table for each case, one for the closing of loops, the growth of cost with size, and what was left out.
#[must_use]
pub fn text_tables(results: &Results) -> String {
    let mut out = String::new();
    let case = |r: &Record| (r.scene.clone(), r.size, r.mass_ratio.to_bits());
    for rows in results.records.chunk_by(|a, b| case(a) == case(b)) {
        let r = &rows[0];
        let _ = writeln!(
            out,
            "\n{}, {}, load/segment mass ratio {}: {} bodies, {} rows",
            r.scene,
            size(r),
            ratio(r.mass_ratio),
            r.bodies,
            r.rows
        );
        out.push_str(&rows_table(rows));
    }
    out.push_str(&loops(&results.records));
    out.push_str(&growth(results));
    out.push_str(&omissions(&results.omissions));
    out
}

fn size(r: &Record) -> String {
    match Network::named(&r.scene) {
        Some(Network::Ladder) => format!("{} cables", r.size),
        Some(Network::Net) => format!("{0} × {0} nodes", r.size),
        _ => format!("{} segments", r.size),
    }
}

fn iterations(r: &Record) -> String {
    match r.iterations {
        0 => String::new(),
        limit if r.iterations_used < limit => format!("{} of {limit}", r.iterations_used),
        limit => limit.to_string(),
    }
}

fn rows_table(rows: &[Record]) -> String {
    let mut t = table(&[
        "solver", "iter", "claims", "step", "solve", "min", "ns/row", "error", "at r0", "load",
        "entries", "bar",
    ]);
    for r in rows {
        let row = [
            // The longest name of an order makes the table too wide.
            r.backend.replace("minimum-degree", "min-deg"),
            iterations(r),
            r.status.clone(),
            nanoseconds(r.step_ns),
            nanoseconds(r.solve_ns),
            nanoseconds(r.solve_ns_min),
            format!("{:.0}", r.solve_ns_per_row),
            error(r.forward_error),
            error(r.forward_error_unrefined),
            error(r.load_difference),
            r.factor_entries.map_or_else(String::new, |n| n.to_string()),
        ];
        let mut row = row.map(Cell::new).to_vec();
        row.push(verdict(mark(r), Some(keeps_bar(r)).filter(|kept| !kept)));
        t.add_row(row);
    }
    mark_columns(
        &mut t,
        rows,
        counts,
        &[
            (3, |r| Some(r.step_ns)),
            (4, |r| Some(r.solve_ns)),
            (5, |r| Some(r.solve_ns_min)),
            (6, |r| Some(r.solve_ns_per_row)),
            (7, |r| r.forward_error),
            (8, |r| r.forward_error_unrefined),
            (9, |r| r.load_difference),
        ],
    );
    text(&t)
}

/// Whether it is one of those that are compared: what failed, missed the bar or ran out of iterations is not.
fn counts(r: &Record) -> bool {
    keeps_bar(r) && (r.iterations == 0 || r.iterations_used < r.iterations)
}

/// Whether it neither failed nor missed the bar.
fn keeps_bar(r: &Record) -> bool {
    mark(r).is_empty()
}

fn mark(r: &Record) -> &'static str {
    match (r.error.is_some(), r.within_bar) {
        (true, _) => "failed",
        (false, Some(false)) => "MISSED",
        _ => "",
    }
}

/// Time and error of the ring over its segments: border rows, other orders, solvers that order by themselves, groups.
fn loops(records: &[Record]) -> String {
    let ring: Vec<&Record> = records
        .iter()
        .filter(|r| r.scene == Network::Ring.name())
        .collect();
    let Some(first) = ring.first() else {
        return String::new();
    };
    let mut sizes: Vec<usize> = ring.iter().map(|r| r.size).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let kept = ["banded", "faer", "umfpack", "gauss-seidel:groups"];
    let mut solvers: Vec<(&str, usize)> = Vec::new();
    for r in &ring {
        let key = (r.backend.as_str(), r.iterations);
        let wanted = kept.iter().any(|k| r.backend.starts_with(k));
        if wanted && r.mass_ratio == first.mass_ratio && !solvers.contains(&key) {
            solvers.push(key);
        }
    }
    // Five sizes side by side, the largest among them.
    let columns = &sizes[sizes.len().saturating_sub(5)..];
    let mut header = vec!["solver".to_owned(), "iter".to_owned()];
    header.extend(columns.iter().map(|n| format!("N = {n}")));
    let mut t = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    let find = |n: usize, (backend, limit): (&str, usize)| {
        ring.iter().find(|r| {
            (r.size, r.backend.as_str(), r.iterations) == (n, backend, limit)
                && r.mass_ratio == first.mass_ratio
        })
    };
    for &(backend, limit) in &solvers {
        let mut cells = vec![backend.to_owned()];
        cells.push(if limit == 0 {
            String::new()
        } else {
            limit.to_string()
        });
        cells.extend(columns.iter().map(|&n| {
            find(n, (backend, limit)).map_or_else(String::new, |r| {
                format!("{} {}", error(r.forward_error), nanoseconds(r.solve_ns_min))
            })
        }));
        t.add_row(cells);
    }
    for (i, &n) in columns.iter().enumerate() {
        let of = |solver: &(&str, usize)| {
            let kept = find(n, *solver).filter(|r| counts(r));
            ((), kept.map(|r| r.solve_ns_min))
        };
        mark_least(&mut t, 2 + i, &solvers.iter().map(of).collect::<Vec<_>>());
    }
    format!(
        "\nClosing a loop: error of the multipliers and linear solve (minimum), ring of N segments, ratio {}\n{}",
        ratio(first.mass_ratio),
        text(&t)
    )
}

fn growth(results: &Results) -> String {
    if results.growth.is_empty() {
        return String::new();
    }
    let mut scenes: Vec<&str> = Vec::new();
    let mut solvers: Vec<(&str, usize)> = Vec::new();
    for g in &results.growth {
        if !scenes.contains(&g.scene.as_str()) {
            scenes.push(&g.scene);
        }
        let key = (g.backend.as_str(), g.iterations);
        if !solvers.contains(&key) {
            solvers.push(key);
        }
    }
    let most = |scene: &str| {
        let own = results.growth.iter().filter(|g| g.scene == scene);
        own.map(|g| g.rows[1]).max().unwrap_or(0)
    };
    let mut header = vec!["solver".to_owned(), "iter".to_owned()];
    header.extend(scenes.iter().map(|s| format!("{s} ≤ {} rows", most(s))));
    let mut t = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    for (backend, limit) in solvers {
        let mut cells = vec![backend.to_owned()];
        cells.push(if limit == 0 {
            String::new()
        } else {
            limit.to_string()
        });
        cells.extend(scenes.iter().map(|scene| {
            let own = results.growth.iter().find(|g| {
                (g.scene.as_str(), g.backend.as_str(), g.iterations) == (*scene, backend, limit)
            });
            own.map_or_else(String::new, |g| format!("{:.2}", g.exponent))
        }));
        t.add_row(cells);
    }
    format!(
        "\nGrowth of the linear solve: exponent of its time over the number of rows\n{}",
        text(&t)
    )
}

/// What the columns of the tables are.
pub const LEGEND: &str = "\
step: median time of a whole step; solve, min: median and minimum of its linear solve with refinement; error: of the
multipliers against extended precision (r0: without refinement); load: distance of the load from that of the reference
solver, over the scene's extent (-: lost on the way); entries: of the factor; bar: where a direct solver misses it";

/// The bar in words.
#[must_use]
pub fn bar() -> String {
    format!("bar of the direct solvers, error and load: {BAR:.0e}")
}
