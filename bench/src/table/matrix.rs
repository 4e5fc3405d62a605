//! Every backend on a matrix, and the index of the graded set.

use super::{error, mark_columns, nanoseconds, table, text};
use crate::ladder::Omission;
use crate::matrix::solve::{About, Record, Results};
use crate::matrix::suite::{Entry, Topology};
use comfy_table::{CellAlignment, ContentArrangement, Table};
use std::fmt::Write;

/// Most characters of a line.
const WIDTH: u16 = 118;

/// What has no rows, and why: those with the same reason together.
fn omissions(omissions: &[Omission]) -> String {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for Omission { backend, reason } in omissions {
        match reasons.iter_mut().find(|(known, _)| known == reason) {
            Some((_, backends)) => backends.push(backend),
            None => reasons.push((reason, vec![backend])),
        }
    }
    if reasons.is_empty() {
        return String::new();
    }
    let mut t = table(&[]);
    t.set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(WIDTH);
    for (reason, backends) in reasons {
        t.add_row([backends.join(", "), reason.to_owned()]);
    }
    for column in t.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Left);
    }
    // Its header is empty.
    format!("\nLeft out\n{}", text(&t).trim_start_matches('\n'))
}

/// What a system is, in a few lines.
fn heading(about: &About) -> String {
    let kind = if about.symmetric {
        "symmetric"
    } else {
        "not symmetric"
    };
    let mut out = format!(
        "\n{}: {kind}, {} rows in {} blocks, {} entries",
        about.matrix, about.dim, about.blocks, about.entries
    );
    if about.duplicates > 0 {
        let _ = write!(out, " ({} of the file added to others)", about.duplicates);
    }
    if let Some(condition) = about.condition {
        let _ = write!(out, ", condition about {condition:.0e}");
    }
    if let Some(condition) = about.condition_scaled {
        let _ = write!(out, " ({condition:.0e} with rows scaled)");
    }
    if let (Some(order), Some(entries), Some(flops)) =
        (about.order, about.factor_entries, about.factor_flops)
    {
        let _ = write!(
            out,
            "\neliminated in {order} order by those that keep it: {:.1e} entries, {:.1e} operations",
            entries as f64, flops as f64
        );
    }
    let _ = writeln!(out, "\nb: {}; x: {}", about.right_hand_side, about.solution);
    out
}

fn iterations(r: &Record) -> String {
    match (r.iterations, r.iterations_used) {
        (0, _) => String::new(),
        (limit, used) if used < limit => format!("{used} of {limit}"),
        (limit, _) => limit.to_string(),
    }
}

/// All rows of a system, in their order.
#[must_use]
pub fn solved(results: &Results) -> String {
    let mut t = table(&[
        "solver",
        "analyse",
        "factorise",
        "solve",
        "normwise",
        "compon.",
        "error",
        "iter",
        "status",
    ]);
    for r in &results.records {
        t.add_row([
            r.backend.clone(),
            nanoseconds(r.analyze_ns),
            nanoseconds(r.factorize_ns),
            nanoseconds(r.solve_ns),
            error(Some(r.backward_error)),
            error(Some(r.backward_error_componentwise)),
            error(r.forward_error),
            iterations(r),
            r.status.clone(),
        ]);
    }
    mark_columns(
        &mut t,
        &results.records,
        Record::ended,
        &[
            (1, |r| Some(r.analyze_ns)),
            (2, |r| Some(r.factorize_ns)),
            (3, |r| Some(r.solve_ns)),
            (4, |r| Some(r.backward_error)),
            (5, |r| Some(r.backward_error_componentwise)),
            (6, |r| r.forward_error),
        ],
    );
    whole(results, &t)
}

/// The table of a system below its heading, with what was left out.
fn whole(results: &Results, t: &Table) -> String {
    format!(
        "{}{}{}",
        heading(&results.about),
        text(t),
        omissions(&results.omissions)
    )
}

/// All rows of a system from the fastest on.
#[must_use]
pub fn compared(results: &Results) -> String {
    let mut t = table(&[
        "solver",
        "iter",
        "factor+solve",
        "ratio",
        "ns/block",
        "analyse",
        "factorise",
        "solve",
        "compon.",
        "error",
        "status",
    ]);
    let mut records: Vec<&Record> = results.records.iter().collect();
    records.sort_by(|a, b| a.total_ns().total_cmp(&b.total_ns()));
    for r in &records {
        t.add_row([
            r.backend.clone(),
            iterations(r),
            nanoseconds(r.total_ns()),
            if r.ratio < 100.0 {
                format!("{:.2}", r.ratio)
            } else {
                format!("{:.0}", r.ratio)
            },
            format!("{:.0}", r.ns_per_block_row),
            nanoseconds(r.analyze_ns),
            nanoseconds(r.factorize_ns),
            nanoseconds(r.solve_ns),
            error(Some(r.backward_error_componentwise)),
            error(r.forward_error),
            r.status.clone(),
        ]);
    }
    mark_columns(
        &mut t,
        &records,
        |r| r.ended(),
        &[
            (2, |r| Some(r.total_ns())),
            (4, |r| Some(r.ns_per_block_row)),
            (5, |r| Some(r.analyze_ns)),
            (6, |r| Some(r.factorize_ns)),
            (7, |r| Some(r.solve_ns)),
            (8, |r| Some(r.backward_error_componentwise)),
            (9, |r| r.forward_error),
        ],
    );
    whole(results, &t)
}

/// The graded set by topology and size.
#[must_use]
pub fn suite(entries: &[Entry]) -> String {
    let mut t = table(&[
        "topology",
        "N",
        "systems",
        "with x",
        "rows",
        "condition from",
        "to",
        "scaled from",
        "to",
        "MB",
    ]);
    let key = |e: &Entry| (e.topology, e.size);
    for group in entries.chunk_by(|a, b| key(a) == key(b)) {
        let conditions = || group.iter().filter_map(|e| e.condition);
        let scaled = || group.iter().filter_map(|e| e.condition_scaled);
        let bytes: u64 = group.iter().map(|e| e.bytes).sum();
        let rows = || group.iter().map(|e| e.dim);
        let topology = match group[0].topology {
            Topology::Chain => "chain",
            Topology::Ring => "ring",
            Topology::Net => "net",
        };
        t.add_row([
            topology.to_owned(),
            group[0].size.to_string(),
            group.len().to_string(),
            group.iter().filter(|e| e.solution).count().to_string(),
            match (rows().min(), rows().max()) {
                (Some(least), Some(most)) if least < most => format!("{least} … {most}"),
                (least, _) => least.unwrap_or(0).to_string(),
            },
            error(conditions().reduce(f64::min)),
            error(conditions().reduce(f64::max)),
            error(scaled().reduce(f64::min)),
            error(scaled().reduce(f64::max)),
            format!("{:.2}", bytes as f64 / 1e6),
        ]);
    }
    text(&t)
}
