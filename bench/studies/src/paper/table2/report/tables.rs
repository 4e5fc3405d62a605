//! Readings of the scan and the limits found, as text.

use super::{PAPER, find, find_with, log};
use crate::paper::table2::{Config, DT, Ends, LENGTH, ROWS, Record, Row, Setting, Solver};
use std::fmt::Write;
use taut_output::table::{of_records, table, text};

/// Readings of the scan; the limits by joint and step, by solver, from other starts and at the
/// fitted length. Every cell is a row of the CSV file.
pub fn text_tables(records: &[Record], config: &Config) -> String {
    let mut out = reading();
    let _ = writeln!(
        out,
        "\nlog₁₀ of the largest stable ratio load/segment (<0: 1 is unstable) for {} s at Δt = 1/{:.0} s, cables of \
         {LENGTH} m;\nwhat ends it: g a gap, t a turn. alt., ord.: the twist definition of the paper's joint, exactly \
         planar or with seeds\nof 1e-6 rad/s in all directions; K: Cosserat joint, geometric stiffness; linear: theory \
         for planar alt.",
        config.time,
        1.0 / DT
    );
    let _ = writeln!(out, "\nDirect solver, by joint and step");
    out.push_str(&setting_table(records));
    let _ = writeln!(
        out,
        "\nThe paper's joint in the plane, by solver: Gauss–Seidel with 3 and 20 iterations, conjugate gradient, direct; \
         then\nGauss–Seidel with a light top, also with geometric stiffness (K)"
    );
    out.push_str(&solver_table(records));
    out.push_str(&others(records));
    out
}

fn reading() -> String {
    let mut out = "The paper's rows: the scan, and how it is read\n".to_owned();
    let mut t = table(&[
        "Y (GN/m²)",
        "N",
        "ζ, scan",
        "read as",
        "M/m, scan",
        "read as",
        "certain",
        "Euler's load at 1 m",
        "Euler's length",
    ]);
    for row in ROWS {
        t.add_row([
            row.young.to_string(),
            row.segments.to_string(),
            row.scanned_zeta.to_owned(),
            format!("{:.0e}", row.zeta),
            row.scanned_ratio.to_owned(),
            format!("{:.0e}", row.ratio),
            if row.inferred { "inferred" } else { "legible" }.to_owned(),
            format!("{:.1e}", row.euler(LENGTH)),
            format!("{:.2} m", row.euler_length()),
        ]);
    }
    out.push_str(&text(&t));
    out
}

/// Young's modulus, ζ, segments of a row.
fn head(row: &Row) -> Vec<String> {
    vec![
        row.young.to_string(),
        format!("{:.0e}", row.zeta),
        row.segments.to_string(),
        log(row.ratio),
    ]
}

fn setting_table(records: &[Record]) -> String {
    let names = Setting::ALL.map(|s| s.to_string());
    let mut header = vec!["Y", "ζ", "N", "paper", "Euler", "linear"];
    header.extend(names.iter().map(String::as_str));
    let mut t = table(&header);
    for row in &ROWS {
        let Some(first) = find(records, row, PAPER, Solver::Direct) else {
            continue;
        };
        let mut cells = head(row);
        cells.push(log(first.euler));
        cells.push(first.predicted.map_or_else(String::new, log));
        cells.extend(Setting::ALL.map(|setting| {
            let cell = find(records, row, setting, Solver::Direct);
            cell.map_or_else(String::new, Record::cell)
        }));
        t.add_row(cells);
    }
    text(&t)
}

fn solver_table(records: &[Record]) -> String {
    let mut t = table(&[
        "Y",
        "ζ",
        "N",
        "paper",
        "3",
        "20",
        "CG",
        "direct",
        "light, 3",
        "light, 20",
        "light K, 3",
        "light K, 20",
    ]);
    let sweeps = [Solver::Sweeps(3), Solver::Sweeps(20)];
    for row in &ROWS {
        let mut cells = head(row);
        let heavy = Solver::ALL.map(|solver| find(records, row, PAPER, solver));
        if heavy.iter().all(Option::is_none) {
            continue;
        }
        let light = [PAPER, Setting::Stiffened].map(|setting| {
            sweeps.map(|solver| find_with(records, Ends::Light, row, setting, solver))
        });
        let all = heavy.into_iter().chain(light.into_iter().flatten());
        cells.extend(all.map(|cell| cell.map_or_else(String::new, Record::cell)));
        t.add_row(cells);
    }
    text(&t)
}

fn others(records: &[Record]) -> String {
    let others = || {
        records
            .iter()
            .filter(|r| r.length != LENGTH || r.solver.ends_with("warm start"))
    };
    if others().next().is_none() {
        return String::new();
    }
    let mut out =
        "\nFrom the last step's multipliers; at the length that fits the paper's column (its joint in the plane)\n".to_owned();
    let t = of_records(
        others(),
        &[
            ("solver", &|r| r.solver.replace("Gauss–Seidel, ", "")),
            ("length", &|r| format!("{:.2} m", r.length)),
            ("Y", &|r| r.young.to_string()),
            ("ζ", &|r| format!("{:.0e}", r.zeta)),
            ("N", &|r| r.segments.to_string()),
            ("paper", &|r| log(r.paper)),
            ("Euler", &|r| log(r.euler)),
            ("linear", &|r| r.predicted.map_or_else(String::new, log)),
            ("limit", &|r| r.cell()),
        ],
    );
    out.push_str(&t);
    out
}
