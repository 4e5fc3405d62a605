//! The networks for people: a table for each case, loops, growth.

use super::BAR;
use taut_model::Network;
use taut_output::row::{Row, has_ended, has_no_error, is, iterations, number_of, text_of};
use taut_output::sheet::{self, Across, Column, Sheet, Show, column};
use taut_output::table::{error, nanoseconds};

const SOLVER: Column = column("backend", "solver").shown(Show::Row(solver));
const ITERATIONS: Column = column("iterations", "iter").shown(Show::Row(iterations));
const RATIO: Column = column("mass_ratio", "load/segment mass ratio {}").shown(Show::Ratio);

/// A table for each case, one for the closing of loops, the growth of cost with size.
pub(super) const SHEETS: &[Sheet] = &[
    Sheet {
        list: "records",
        shared: &[
            column("scene", "{}"),
            column("size", "{}").shown(Show::Row(size)),
            RATIO,
            column("bodies", "{} bodies"),
            column("rows", "{} rows"),
        ],
        columns: &[
            SOLVER,
            ITERATIONS,
            column("status", "claims"),
            sheet::time("step_ns", "step"),
            sheet::time("solve_ns", "solve"),
            sheet::time("solve_ns_min", "min"),
            column("solve_ns_per_row", "ns/row")
                .shown(Show::Fixed(0))
                .least(),
            sheet::error("forward_error", "error"),
            sheet::error("forward_error_unrefined", "at r0"),
            sheet::error("load_difference", "load"),
            column("factor_entries", "entries"),
            column("within_bar", "bar").shown(Show::Row(mark)),
        ],
        counts,
        ..sheet::PLAIN
    },
    Sheet {
        list: "records",
        title: "Closing a loop: error of the multipliers and linear solve (minimum), ring of N segments",
        shared: &[RATIO],
        columns: &[SOLVER, column("iterations", "iter")],
        across: Some(Across {
            by: &[column("size", "N = {}")],
            cells: &[column("solve_ns_min", "")
                .shown(Show::Row(closing))
                .least_of(least)],
            several: false,
            most: 5,
        }),
        takes: closes_a_loop,
        counts,
        ..sheet::PLAIN
    },
    Sheet {
        list: "growth",
        title: "Growth of the linear solve: exponent of its time over the number of rows",
        shared: &[RATIO],
        columns: &[SOLVER, column("iterations", "iter")],
        across: Some(Across {
            by: &[column("scene", "{}")],
            cells: &[column("exponent", "").shown(Show::Fixed(2))],
            several: false,
            most: usize::MAX,
        }),
        ..sheet::PLAIN
    },
];

/// The solver; the longest name of an order would make the table too wide.
fn solver(row: &Row) -> String {
    text_of(row, "backend").replace("minimum-degree", "min-deg")
}

fn size(row: &Row) -> String {
    let size = number_of(row, "size").unwrap_or(f64::NAN);
    match Network::named(text_of(row, "scene")) {
        Some(Network::Ladder) => format!("{size} cables"),
        Some(Network::Net) => format!("{size} × {size} nodes"),
        _ => format!("{size} segments"),
    }
}

/// True for a row to compare: it did not fail, miss the bar or run out of iterations.
fn counts(row: &Row) -> bool {
    mark(row).is_empty() && has_ended(row)
}

fn mark(row: &Row) -> String {
    let missed = row["within_bar"].is_boolean() && !is(row, "within_bar");
    match (has_no_error(row), missed) {
        (false, _) => "failed",
        (true, true) => "MISSED",
        _ => "",
    }
    .to_owned()
}

/// True for rows of the ring by solvers that close the loop: border rows, other orders, solvers
/// that order by themselves, groups.
fn closes_a_loop(row: &Row) -> bool {
    let kept = ["banded", "faer", "umfpack", "gauss-seidel:groups"];
    let is_kept = kept.iter().any(|k| text_of(row, "backend").starts_with(k));
    text_of(row, "scene") == Network::Ring.name() && is_kept
}

fn closing(row: &Row) -> String {
    let time = nanoseconds(least(row).unwrap_or(f64::NAN));
    format!("{} {time}", error(number_of(row, "forward_error")))
}

fn least(row: &Row) -> Option<f64> {
    number_of(row, "solve_ns_min")
}

pub(super) const LEGEND: &str = "\
step: median time of a whole step; solve, min: median and minimum of its linear solve with refinement; error: of the
multipliers against extended precision (r0: without refinement); load: distance of the load from that of the reference
solver, over the scene's extent (-: lost on the way); entries: of the factor; bar: where a direct solver misses it";

/// The bar in words.
pub(super) fn bar() -> String {
    format!("bar of the direct solvers, error and load: {BAR:.0e}")
}
