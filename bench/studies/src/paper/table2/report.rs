//! The limits beside the paper's rows, linear theory, the laws that the columns follow and the limit of the sweeps; the
//! paper's words on solvers, starts and joints; tables and charts.

use super::{Case, Config, DT, Ends, GRAVITY, LENGTH, PAPER, ROWS, Record, Row, Setting, Solver};
use crate::paper::timing::line;
use crate::paper::words::{chart, table, tell, text, with};
use serde_json::{Value, json};
use taut_output::check::{Check, Verdict};
use taut_output::plot::{Chart, Mark, Series};

const HEAVY: Ends = Ends::Heavy;

const ORDINARY: Setting = Setting::ALL[1];

/// Largest rise of a limit by the heavy top, in decades; the theory of a uniform cable ignores it.
/// A limit below the theory is due to rounding down to a step of the grid.
const HEAVY_TOP: f64 = 0.25;

impl Record {
    /// log₁₀ of the limit, and what ends it: `g` a gap, `t` a turn, `x` a step that failed.
    fn cell(&self) -> String {
        let mark = match self.failure.as_deref() {
            None => "",
            Some(f) if f.contains("gap") => "g",
            Some(f) if f.contains("turns") => "t",
            Some(_) => "x",
        };
        match self.stable.map(f64::log10) {
            None => format!("<0{mark}"),
            Some(decade) if self.capped => format!("≥{decade:.2}"),
            Some(decade) => format!("{decade:.2}{mark}"),
        }
    }

    /// log₁₀ of a limit that lies inside the range tried.
    fn limit(&self) -> Option<f64> {
        self.stable.filter(|_| !self.capped).map(f64::log10)
    }

    fn reaches(&self, decade: f64) -> bool {
        self.stable.is_some_and(|s| s.log10() >= decade - 1e-9)
    }
}

/// A cell of the cable of [`LENGTH`].
fn find<'a>(
    records: &'a [Record],
    row: &Row,
    ends: Ends,
    how: (Setting, Solver),
) -> Option<&'a Record> {
    let is_it = |c: &Case| (c.row, c.length, c.ends) == (*row, LENGTH, ends);
    let mut cells = records.iter().filter(|r| is_it(&r.case));
    cells.find(|r| (r.case.setting, r.case.solver) == how)
}

/// The paper's rows and claims beside the limits found, and the limits beside linear theory.
pub fn checks(records: &[Record], config: &Config) -> Vec<Check> {
    let step = 1.0 / f64::from(config.per_decade);
    let mut checks: Vec<Check> = ROWS.iter().filter_map(|r| published(records, r)).collect();
    checks.extend(linear_theory(records, step));
    checks.extend(scaling(records, step));
    checks.extend(
        [3, 20]
            .iter()
            .filter_map(|&n| light_sweeps(records, step, n)),
    );
    checks.extend(
        [(20, 5.0), (3, 3.0)]
            .iter()
            .filter_map(|&(n, d)| enough(records, n, d)),
    );
    checks.extend(claims(records));
    checks.extend(warm_start(records));
    checks.extend(fitted(records));
    checks
}

fn published(records: &[Record], row: &Row) -> Option<Check> {
    let swept = find(records, row, HEAVY, (PAPER, Solver::Sweeps(20)))?;
    let direct = find(records, row, HEAVY, (PAPER, Solver::Direct))?.cell();
    let found = swept.stable.map_or(f64::NAN, f64::log10);
    let paper = row.ratio.log10();
    let mark = if row.inferred { " (inferred)" } else { "" };
    let more = json!({ "decade": paper, "mark": mark, "swept": swept.cell(), "direct": direct });
    Some(tell("table2-row", with(swept, &more)).off((found - paper).abs()))
}

/// Direct solves of the explicit tension: joint, definition and length as they come.
fn linear_theory(records: &[Record], step: f64) -> Option<Check> {
    let is_seeded = |r: &&Record| matches!(r.case.setting, Setting::Seeded(_));
    let direct = records.iter().filter(|r| r.case.solver == Solver::Direct);
    let distance = |r: &Record| Some(r.predicted?.log10() - r.limit()?);
    let all: Vec<f64> = direct
        .filter(|r| !is_seeded(r))
        .filter_map(distance)
        .collect();
    let worst = all.iter().map(|d| d.abs()).max_by(f64::total_cmp)?;
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let side = if mean > 0.0 { "below" } else { "above" };
    let bar = step + HEAVY_TOP;
    let row = json!({ "count": all.len(), "mean": mean.abs(), "side": side, "bar": bar });
    Some(tell("linear-theory", row).off(worst))
}

/// Mean of log₁₀ of limits over those of other cells.
fn mean_ratio(pairs: impl Iterator<Item = (Option<f64>, Option<f64>)>) -> Option<f64> {
    let logs: Vec<f64> = pairs.filter_map(|(a, b)| Some(a? - b?)).collect();
    (!logs.is_empty()).then(|| logs.iter().sum::<f64>() / logs.len() as f64)
}

fn scaling(records: &[Record], step: f64) -> Vec<Check> {
    let direct = |row: &Row, setting| find(records, row, HEAVY, (setting, Solver::Direct));
    let limit = |row: &Row, setting| direct(row, setting)?.limit();
    let mut checks = Vec::new();
    for rows in [&ROWS[..5], &ROWS[5..]] {
        let points = |value: &dyn Fn(&Row) -> Option<f64>| -> Vec<[f64; 2]> {
            let point = |r: &Row| Some([(r.young / r.zeta).log10(), value(r)?]);
            rows.iter().filter_map(point).collect()
        };
        let found = points(&|r| limit(r, PAPER));
        if found.len() < rows.len() {
            continue;
        }
        let [_, slope] = line(&found);
        let [_, theory] = line(&points(&|r| Some(direct(r, PAPER)?.predicted?.log10())));
        let row = json!({ "n": rows[0].segments, "slope": slope, "theory": theory });
        checks.push(tell("table2-exponent", row).off((slope - 1.0).abs()));
    }
    let twins = ROWS[..5].iter().flat_map(|a| {
        let same = move |b: &&Row| (a.young, a.zeta) == (b.young, b.zeta);
        ROWS[5..].iter().filter(same).map(move |b| (a, b))
    });
    if let Some(mean) = mean_ratio(twins.map(|(a, b)| (limit(a, PAPER), limit(b, PAPER)))) {
        let row = json!({ "ratio": 10.0_f64.powf(mean), "bar": step });
        let distance = (mean - 4.0_f64.log10()).abs();
        checks
            .push(tell("segments-paper", json!({ "ratio": row["ratio"] })).off((mean - 1.0).abs()));
        checks.push(tell("segments-mass", row).off(distance));
    }
    let both = ROWS.iter().map(|r| (limit(r, PAPER), limit(r, ORDINARY)));
    if let Some(mean) = mean_ratio(both) {
        let row = json!({ "ratio": 10.0_f64.powf(mean) });
        checks.push(tell("twist-definitions", row).off((mean - 1.0).abs()));
    }
    checks
}

/// k l/(g Δt²): the ratio at which k sweeps leave the load's joint open by a segment's length l.
fn sweep_limit(iterations: usize, segments: usize) -> f64 {
    iterations as f64 * LENGTH / segments as f64 / (GRAVITY * DT * DT)
}

/// The limit of n sweeps with a light top and geometric stiffness, and whether it depends on the material.
fn light_sweeps(records: &[Record], step: f64, n: usize) -> Option<Check> {
    let light = |row: &Row| {
        let solver = Solver::Sweeps(n);
        find(records, row, Ends::Light, (Setting::Stiffened, solver))
    };
    let distance =
        |row: &Row| Some((light(row)?.limit()? - sweep_limit(n, row.segments).log10()).abs());
    let worst = ROWS.iter().filter_map(distance).reduce(f64::max)?;
    let differ = |rows: &[Row]| {
        let limits: Vec<f64> = rows.iter().filter_map(|r| light(r)?.stable).collect();
        limits.windows(2).any(|w| w[0] != w[1])
    };
    let depends = differ(&ROWS[..5]) || differ(&ROWS[5..]);
    let word = if depends { "dependent" } else { "independent" };
    Some(tell("light-sweeps", json!({ "n": n, "word": word, "bar": step })).off(worst))
}

/// Smallest and largest of the limits of a column, as text; and the logarithm of the largest.
fn range(records: &[Record], setting: Setting, solver: Solver) -> Option<(String, f64)> {
    let cells = ROWS
        .iter()
        .filter_map(|r| find(records, r, HEAVY, (setting, solver)));
    let mut cells: Vec<&Record> = cells.collect();
    let value = |r: &Record| r.stable.map_or(-1.0, f64::log10);
    // The last of equal ones is the largest, the first the smallest.
    cells.sort_by(|a, b| value(a).total_cmp(&value(b)));
    let (low, high) = (cells.first()?, cells.last()?);
    let [low, top] = [low, high].map(|r| r.cell().trim_end_matches(['g', 't', 'x']).to_owned());
    Some((format!("10^({low} … {top})"), value(high)))
}

fn claims(records: &[Record]) -> Vec<Check> {
    let column = |setting, solver| range(records, setting, solver);
    let mut checks = Vec::new();
    let [swept, cg, direct] =
        [Solver::Sweeps(20), Solver::Cg, Solver::Direct].map(|s| column(PAPER, s));
    if let (Some((_, swept)), Some((cg, c)), Some((direct, d))) = (swept, cg, direct) {
        let light = light_limit(records, Solver::Sweeps(20));
        let row = json!({ "direct": direct, "cg": cg, "light": light });
        checks.push(tell("direct-more", row).so(c > swept + 1.0 && d > swept + 1.0));
    }
    let [alternative, ordinary] =
        [Setting::ALL[2], Setting::ALL[3]].map(|s| column(s, Solver::Direct));
    if let (Some((alternative, a)), Some((ordinary, o))) = (alternative, ordinary) {
        let row = json!({ "ordinary": ordinary, "alternative": alternative });
        checks.push(tell("joint-in-space", row).so(a >= 5.0 || o >= 5.0));
    }
    if let Some((ours, _)) = column(Setting::Stiffened, Solver::Direct) {
        let rows = ROWS.iter();
        let cells =
            rows.filter_map(|r| find(records, r, HEAVY, (Setting::Stiffened, Solver::Direct)));
        let cells: Vec<&Record> = cells.collect();
        let lost = cells.iter().filter(|r| !r.capped).count();
        let said = tell("stiffened", json!({ "rows": cells.len(), "ours": ours }));
        checks.push(said.off(lost as f64));
    }
    checks
}

/// Largest limit of the sweeps with a light top, paper's joint in the plane, as a logarithm.
fn light_limit(records: &[Record], solver: Solver) -> Option<f64> {
    let limit = |r: &Row| find(records, r, Ends::Light, (PAPER, solver))?.limit();
    ROWS.iter().filter_map(limit).reduce(f64::max)
}

/// Check that `n` sweeps suffice up to 10^`decade` in every row whose cable holds that with a
/// direct solver.
pub(in crate::paper) fn enough(records: &[Record], n: usize, decade: f64) -> Option<Check> {
    let able: Vec<bool> = ROWS
        .iter()
        .filter_map(|r| {
            let swept = find(records, r, HEAVY, (PAPER, Solver::Sweeps(n)))?;
            let direct = find(records, r, HEAVY, (PAPER, Solver::Direct))?;
            direct.reaches(decade).then(|| swept.reaches(decade))
        })
        .collect();
    let kept = able.iter().filter(|kept| **kept).count();
    let light = light_limit(records, Solver::Sweeps(n));
    let lost = light.map_or_else(String::new, |l| {
        format!(", where {n} sweeps end at 10^{l:.2}")
    });
    let verdict = match (kept, able.len()) {
        (_, 0) => Verdict::NotYet,
        (0, _) => Verdict::DoesNotHold,
        (kept, able) if kept < able => Verdict::HoldsOnlyIf,
        _ if light.is_some_and(|l| l < decade) => Verdict::HoldsOnlyIf,
        _ => Verdict::Holds,
    };
    let row = json!({ "n": n, "decade": decade, "kept": kept, "able": able.len(), "lost": lost });
    Some(tell("sweeps-enough", row).judged(verdict))
}

/// The last step's multipliers as a start, row by row beside the groups' own solutions.
fn warm_start(records: &[Record]) -> Option<Check> {
    let (mut shown, mut worst) = (Vec::new(), f64::INFINITY);
    for warm in records {
        let Solver::WarmSweeps(n) = warm.case.solver else {
            continue;
        };
        shown.push(format!("N {}, {n}: 10^{}", warm.segments, warm.cell()));
        let decade = |r: &Record| r.stable.map_or(0.0, f64::log10);
        let how = (warm.case.setting, Solver::Sweeps(n));
        let cold = find(records, &warm.case.row, HEAVY, how);
        worst = cold.map_or(worst, |cold| worst.min(decade(warm) - decade(cold)));
    }
    let row = json!({ "worst": worst, "shown": shown.join("; ") });
    (!shown.is_empty()).then(|| tell("warm-start", row).so(worst >= 0.0))
}

/// The direct limits at the length that fits the paper's column best.
fn fitted(records: &[Record]) -> Option<Check> {
    let is_fitted = |r: &&Record| r.length_m != LENGTH && r.case.solver == Solver::Direct;
    let fitted = || records.iter().filter(is_fitted);
    let distance = |r: &Record| Some((r.limit()? - r.paper.log10()).abs());
    let worst = fitted().filter_map(distance).fold(0.0, f64::max);
    let lengths = ROWS.map(|r| r.euler_length());
    let low = lengths.into_iter().fold(f64::INFINITY, f64::min);
    let high = lengths.into_iter().fold(0.0, f64::max);
    let more = json!({ "low": low, "high": high });
    Some(tell("one-length", with(fitted().next()?, &more)).off(worst))
}

/// Readings of the scan; the limits by joint and step, by solver, from other starts and at the
/// fitted length. Every cell is a row of the CSV file.
pub fn text_tables(records: &[Record], config: &Config) -> String {
    let scan: Vec<Value> = ROWS.iter().map(Row::read).collect();
    let rows: Vec<Value> = ROWS.iter().filter_map(|r| cells(records, r)).collect();
    let is_other =
        |r: &&Record| r.length_m != LENGTH || matches!(r.case.solver, Solver::WarmSweeps(_));
    let more = |r: &Record| {
        let solver = r.solver.replace("Gauss–Seidel, ", "");
        with(r, &json!({ "solver": solver, "limit": r.cell() }))
    };
    let others: Vec<Value> = records.iter().filter(is_other).map(more).collect();
    let others = match others.is_empty() {
        true => String::new(),
        false => text(
            "others",
            &json!({ "others": table("table2-others", &others) }),
        ),
    };
    let row = json!({
        "time": config.time,
        "dt": DT,
        "length": LENGTH,
        "scan": table("scan", &scan),
        "settings": table("table2-settings", &rows),
        "solvers": table("table2-solvers", &rows),
        "others": others,
    });
    text("table2", &row)
}

/// All cells of a row of the paper that is among the records.
fn cells(records: &[Record], row: &Row) -> Option<Value> {
    let own = || {
        records
            .iter()
            .filter(|r| r.case.row == *row && r.length_m == LENGTH)
    };
    let paper = own().find(|r| r.case.setting == PAPER)?;
    let mut cells = with(paper, &Value::Null);
    for r in own() {
        cells[format!("{}, {}, {}", r.ends, r.setting, r.solver)] = r.cell().into();
    }
    Some(cells)
}

/// The limits over Y/ζ, for 24 and for 6 segments.
pub(super) fn charts(records: &[Record]) -> Vec<Chart> {
    let panel = |rows: &[Row]| {
        let line = |name, mark, value: &dyn Fn(&Row) -> Option<f64>| {
            let point = |r: &Row| Some([r.young / r.zeta, value(r)?]);
            Series::new(name, rows.iter().filter_map(point).collect(), mark)
        };
        let limit = |name, setting, solver| {
            let value = |r: &Row| find(records, r, HEAVY, (setting, solver))?.stable;
            line(name, Mark::LineAndPoints, &value)
        };
        let linear = |r: &Row| find(records, r, HEAVY, (PAPER, Solver::Direct))?.predicted;
        let stiffened = "geometric stiffness, at least";
        let series = vec![
            line("paper, as read", Mark::Points, &|r| Some(r.ratio)),
            limit("paper's joint, direct", PAPER, Solver::Direct),
            line("linear theory", Mark::Line, &linear),
            limit("20 iterations", PAPER, Solver::Sweeps(20)),
            limit("3 iterations", PAPER, Solver::Sweeps(3)),
            limit(stiffened, Setting::Stiffened, Solver::Direct),
            limit("seeded, ordinary", Setting::ALL[3], Solver::Direct),
        ];
        chart("table2", &json!({ "n": rows[0].segments }), series)
    };
    vec![panel(&ROWS[..5]), panel(&ROWS[5..])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_leave_a_gap_of_a_segment_at_their_limit() {
        let ratio = sweep_limit(20, 24);
        assert!((ratio * GRAVITY * DT * DT / 20.0 - LENGTH / 24.0).abs() < 1e-15);
    }

    #[test]
    fn means_leave_out_what_has_no_limit() {
        let pairs = [
            (Some(3.0), Some(2.0)),
            (None, Some(1.0)),
            (Some(2.5), Some(2.0)),
        ];
        assert_eq!(mean_ratio(pairs.into_iter()), Some(0.75));
        assert_eq!(mean_ratio([(None, None)].into_iter()), None);
    }
}
