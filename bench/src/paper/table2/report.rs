//! Tables, checks, chart.

use super::{Config, Record};
use crate::paper::Check;
use crate::plot::Chart;
use crate::table::{table, text};
use super::{ROWS, Setting, Solver, Row};
use std::fmt::Write;

pub fn checks(_records: &[Record]) -> Vec<Check> { Vec::new() }
pub fn charts(_records: &[Record]) -> Vec<Chart> { Vec::new() }

fn log(ratio: f64) -> String { format!("{:.2}", ratio.log10()) }

impl Record {
    /// log₁₀ of the limit.
    fn cell(&self) -> String {
        match self.stable {
            None => "<0".to_owned(),
            Some(r) if self.capped => format!("≥{}", log(r)),
            Some(r) => log(r),
        }
    }

    fn is(&self, row: &Row, setting: Setting, solver: Solver) -> bool {
        (self.young, self.zeta, self.segments) == (row.young, row.zeta, row.segments)
            && self.setting == setting.to_string()
            && self.solver == solver.to_string()
    }
}

fn find(records: &[Record], row: Row, setting: Setting, solver: Solver, length: f64) -> Option<&Record> {
    records.iter().find(|r| r.is(&row, setting, solver) && (r.length - length).abs() < 1e-9)
}

pub fn text_tables(records: &[Record], _config: &Config) -> String {
    let mut out = String::new();
    for solver in Solver::ALL {
        let _ = writeln!(out, "\n{solver}");
        let mut header: Vec<String> = ["Y", "ζ", "N", "paper", "Euler", "linear"].map(str::to_owned).to_vec();
        header.extend(Setting::ALL.map(|s| s.to_string()));
        let mut t = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
        for row in ROWS {
            let Some(first) = find(records, row, Setting::ALL[0], solver, 1.0) else { continue };
            let mut cells = vec![row.young.to_string(), format!("{:.0e}", row.zeta), row.segments.to_string(), log(row.ratio), log(first.euler), log(first.predicted.unwrap())];
            cells.extend(Setting::ALL.map(|s| find(records, row, s, solver, 1.0).map_or("-".into(), |r| format!("{} {}", r.cell(), r.failure.as_ref().map_or("", |f| if f.contains("gap") {"g"} else if f.contains("turns") {"t"} else {"x"})))));
            t.add_row(cells);
        }
        out.push_str(&text(&t));
    }
    for r in records.iter().filter(|r| r.solver.contains("warm") || r.length != 1.0) {
        let _ = writeln!(out, "{} {} {} L={:.2} {} {}: {} paper {} euler {:.2} pred {:?}", r.young, r.zeta, r.segments, r.length, r.setting, r.solver, r.cell(), r.paper, r.euler.log10(), r.predicted.map(f64::log10));
    }
    out
}
