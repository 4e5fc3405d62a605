//! Tables, checks and charts of Table II: the cells that they are made of.

mod charts;
mod checks;
mod claims;
mod tables;

pub use charts::charts;
pub use checks::checks;
pub(in crate::paper) use claims::enough;
pub use tables::text_tables;

use super::{Ends, LENGTH, Record, Row, Setting, Solver};
use taut_model::TwistDefinition;

/// The paper's own joint as it was used there.
const PAPER: Setting = Setting::Planar(TwistDefinition::Alternative);

fn log(ratio: f64) -> String {
    format!("{:.2}", ratio.log10())
}

impl Record {
    /// log₁₀ of the limit, and what ends it: `g` a gap, `t` a turn, `x` a step that failed.
    fn cell(&self) -> String {
        let mark = match self.failure.as_deref() {
            None => "",
            Some(f) if f.contains("gap") => "g",
            Some(f) if f.contains("turns") => "t",
            Some(_) => "x",
        };
        match self.stable {
            None => format!("<0{mark}"),
            Some(r) if self.capped => format!("≥{}", log(r)),
            Some(r) => format!("{}{mark}", log(r)),
        }
    }

    fn is(&self, row: &Row, setting: Setting, solver: Solver) -> bool {
        (self.young, self.zeta, self.segments) == (row.young, row.zeta, row.segments)
            && self.setting == setting.to_string()
            && self.solver == solver.to_string()
    }

    /// log₁₀ of a limit that lies inside the range tried.
    fn limit(&self) -> Option<f64> {
        self.stable.filter(|_| !self.capped).map(f64::log10)
    }
}

/// The cell of the cable of [`LENGTH`] with heavy ends.
fn find<'a>(
    records: &'a [Record],
    row: &Row,
    setting: Setting,
    solver: Solver,
) -> Option<&'a Record> {
    find_with(records, Ends::Heavy, row, setting, solver)
}

fn find_with<'a>(
    records: &'a [Record],
    ends: Ends,
    row: &Row,
    setting: Setting,
    solver: Solver,
) -> Option<&'a Record> {
    let ends = ends.to_string();
    let mut records = records
        .iter()
        .filter(|r| r.length == LENGTH && r.ends == ends);
    records.find(|r| r.is(row, setting, solver))
}

fn is_plain(record: &Record) -> bool {
    record.length == LENGTH && record.ends == Ends::Heavy.to_string()
}
