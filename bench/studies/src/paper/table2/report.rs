//! The limits beside the paper's rows, linear theory, the laws that the columns follow and the limit of the sweeps; the
//! paper's words on solvers, starts and joints; tables and charts.

use super::rows::{ROWS, Row};
use super::{CG, DIRECT, HEAVY, LENGTH, LIGHT, ORDINARY, PAPER, PER_DECADE};
use super::{SEEDED, STIFFENED, SWEEPS, Solver, TIMES};
use crate::fit::line;
use crate::options::pick;
use crate::paper::words::{chart, extremes, filled, named_check, number, table, text, with};
use crate::paper::{DT, GRAVITY};
use serde_json::{Value, json};
use taut_output::check::{Check, Verdict};
use taut_output::plot::Chart;

/// Largest rise of a limit by the heavy top, in decades; the theory of a uniform cable ignores it.
/// A limit below the theory is due to rounding down to a step of the grid.
const HEAVY_TOP: f64 = 0.25;

/// log₁₀ of the limit, and what ends it: `g` a gap, `t` a turn, `x` a step that failed.
fn cell(record: &Value) -> String {
    let mark = match record["failure"].as_str() {
        None => "",
        Some(f) if f.contains("gap") => "g",
        Some(f) if f.contains("turns") => "t",
        Some(_) => "x",
    };
    match decade(record, "stable") {
        None => format!("<0{mark}"),
        Some(decade) if is_capped(record) => format!("≥{decade:.2}"),
        Some(decade) => format!("{decade:.2}{mark}"),
    }
}

fn decade(record: &Value, key: &str) -> Option<f64> {
    record[key].as_f64().map(f64::log10)
}

/// The largest ratio tried is stable.
fn is_capped(record: &Value) -> bool {
    record["capped"] == true
}

/// log₁₀ of a limit that lies inside the range tried.
fn limit(record: &Value) -> Option<f64> {
    decade(record, "stable").filter(|_| !is_capped(record))
}

/// The paper's rows, each with what its cells of [`LENGTH`] share, and by their names with their limits: as text, as ratio,
/// its decade, and that again where it lies inside the range tried.
fn rows(records: &[Value]) -> Vec<Value> {
    let row = |row: &Row| {
        let mut all = row.read();
        let is_own = |r: &&Value| {
            let own = ["young_gpa", "zeta_per_m2"].map(|key| r[key] == all[key]);
            own == [true; 2] && r["segments"] == row.segments && r["length_m"] == LENGTH
        };
        let own: Vec<&Value> = records.iter().filter(is_own).collect();
        if let Some(shared) = own.iter().find(|r| r["setting"] == PAPER) {
            all = with(&all, shared);
        }
        for r in own {
            let name = filled("{ends}, {setting}, {solver}", r);
            all[format!("{name}: stable")] = r["stable"].clone();
            all[format!("{name}: decade")] = decade(r, "stable").into();
            all[format!("{name}: limit")] = limit(r).into();
            all[name] = cell(r).into();
        }
        all
    };
    ROWS.iter().map(row).collect()
}

/// A cell's column in [`rows`].
type Cell<'a> = (&'a str, &'a str, Solver);

fn shown<'a>(row: &'a Value, (ends, setting, solver): Cell<'_>) -> Option<&'a str> {
    row[format!("{ends}, {setting}, {solver}")].as_str()
}

fn at(row: &Value, (ends, setting, solver): Cell<'_>, what: &str) -> Option<f64> {
    row[format!("{ends}, {setting}, {solver}: {what}")].as_f64()
}

/// The paper's rows and claims beside the limits found, and the limits beside linear theory.
pub fn checks(records: &[Value], quick: bool) -> Vec<Check> {
    let (rows, step) = (rows(records), 1.0 / pick(quick, PER_DECADE));
    let mut checks: Vec<Check> = rows.iter().filter_map(published).collect();
    checks.extend(linear_theory(records, step));
    checks.extend(scaling(&rows, step));
    let light = [3, 20].into_iter().zip(SWEEPS);
    checks.extend(light.filter_map(|(n, solver)| light_sweeps(&rows, step, n, solver)));
    checks.extend(enough(records, 20, 5.0));
    checks.extend(enough(records, 3, 3.0));
    checks.extend(claims(&rows));
    checks.extend(warm_start(records));
    checks.extend(fitted(records));
    checks
}

fn published(row: &Value) -> Option<Check> {
    let swept = (HEAVY, PAPER, SWEEPS[1]);
    shown(row, swept)?;
    let found = at(row, swept, "decade").unwrap_or(f64::NAN);
    Some(named_check("table2-row", row.clone()).off((found - number(row, "decade")).abs()))
}

/// Direct solves of the explicit tension: joint, definition and length as they come.
fn linear_theory(records: &[Value], step: f64) -> Option<Check> {
    let is_direct =
        |r: &&Value| r["solver"] == DIRECT && !SEEDED.iter().any(|s| r["setting"] == *s);
    let distance = |r: &Value| Some(decade(r, "predicted")? - limit(r)?);
    let direct = records.iter().filter(is_direct);
    let all: Vec<f64> = direct.filter_map(distance).collect();
    let worst = all.iter().map(|d| d.abs()).max_by(f64::total_cmp)?;
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let side = if mean > 0.0 { "below" } else { "above" };
    let bar = step + HEAVY_TOP;
    let row = json!({ "count": all.len(), "mean": mean.abs(), "side": side, "bar": bar });
    Some(named_check("linear-theory", row).off(worst))
}

/// Mean of log₁₀ of limits over those of other cells.
fn mean_ratio(pairs: impl Iterator<Item = (Option<f64>, Option<f64>)>) -> Option<f64> {
    let logs: Vec<f64> = pairs.filter_map(|(a, b)| Some(a? - b?)).collect();
    (!logs.is_empty()).then(|| logs.iter().sum::<f64>() / logs.len() as f64)
}

fn scaling(rows: &[Value], step: f64) -> Vec<Check> {
    let limit = |row: &Value, setting| at(row, (HEAVY, setting, DIRECT), "limit");
    let mut checks = Vec::new();
    let parts: Vec<&[Value]> = rows
        .chunk_by(|a, b| a["segments"] == b["segments"])
        .collect();
    for own in &parts {
        let points = |value: &dyn Fn(&Value) -> Option<f64>| -> Vec<[f64; 2]> {
            let point = |r: &Value| Some([decade(r, "young_over_zeta")?, value(r)?]);
            own.iter().filter_map(point).collect()
        };
        let found = points(&|r| limit(r, PAPER));
        if found.len() < own.len() {
            continue;
        }
        let [_, slope] = line(&found);
        let [_, theory] = line(&points(&|r| decade(r, "predicted")));
        let row = json!({ "n": own[0]["segments"], "slope": slope, "theory": theory });
        checks.push(named_check("table2-exponent", row).off((slope - 1.0).abs()));
    }
    let twins = parts[0].iter().flat_map(|a| {
        let same = |b: &&Value| {
            ["young_gpa", "zeta_per_m2"]
                .iter()
                .all(|key| a[*key] == b[*key])
        };
        let twins = parts[1].iter().filter(same);
        twins.map(|b| (limit(a, PAPER), limit(b, PAPER)))
    });
    if let Some(mean) = mean_ratio(twins.collect::<Vec<_>>().into_iter()) {
        let ratio = 10.0_f64.powf(mean);
        let said = named_check("segments-paper", json!({ "ratio": ratio }));
        checks.push(said.off((mean - 1.0).abs()));
        let said = named_check("segments-mass", json!({ "ratio": ratio, "bar": step }));
        checks.push(said.off((mean - 4.0_f64.log10()).abs()));
    }
    let both = rows.iter().map(|r| (limit(r, PAPER), limit(r, ORDINARY)));
    checks.extend(mean_ratio(both).map(|mean| {
        let row = json!({ "ratio": 10.0_f64.powf(mean) });
        named_check("twist-definitions", row).off((mean - 1.0).abs())
    }));
    checks
}

/// k l/(g Δt²): the ratio at which k sweeps leave the load's joint open by a segment's length l.
fn sweep_limit(iterations: usize, segments: f64) -> f64 {
    iterations as f64 * LENGTH / segments / (GRAVITY * DT * DT)
}

/// The limit of n sweeps with a light top and geometric stiffness, and whether it depends on the material.
fn light_sweeps(rows: &[Value], step: f64, n: usize, solver: Solver) -> Option<Check> {
    let limit = |row: &Value, what| at(row, (LIGHT, STIFFENED, solver), what);
    let expected = |row: &Value| sweep_limit(n, number(row, "segments")).log10();
    let distance = |row: &Value| Some((limit(row, "limit")? - expected(row)).abs());
    let worst = rows.iter().filter_map(distance).reduce(f64::max)?;
    let depends = rows
        .chunk_by(|a, b| a["segments"] == b["segments"])
        .any(|own| {
            let [low, high] = extremes(own.iter().filter_map(|r| limit(r, "stable")));
            low < high
        });
    let word = if depends { "dependent" } else { "independent" };
    Some(named_check("light-sweeps", json!({ "n": n, "word": word, "bar": step })).off(worst))
}

/// Smallest and largest of the limits of a column, as text; and the logarithm of the largest.
fn range(rows: &[Value], setting: &str, solver: Solver) -> Option<(String, f64)> {
    let cell = (HEAVY, setting, solver);
    let cells = rows.iter().filter_map(|r| {
        let text = shown(r, cell)?.trim_end_matches(['g', 't', 'x']);
        Some((text, at(r, cell, "decade").unwrap_or(-1.0)))
    });
    let mut cells: Vec<(&str, f64)> = cells.collect();
    // The last of equal ones is the largest, the first the smallest.
    cells.sort_by(|a, b| a.1.total_cmp(&b.1));
    let ((low, _), (top, value)) = (cells.first()?, cells.last()?);
    Some((format!("10^({low} … {top})"), *value))
}

fn claims(rows: &[Value]) -> Vec<Check> {
    let mut checks = Vec::new();
    let [swept, cg, direct] = [SWEEPS[1], CG, DIRECT].map(|s| range(rows, PAPER, s));
    if let (Some((_, swept)), Some((cg, c)), Some((direct, d))) = (swept, cg, direct) {
        let light = light_limit(rows, SWEEPS[1]);
        let row = json!({ "direct": direct, "cg": cg, "light": light });
        checks.push(named_check("direct-more", row).so(c > swept + 1.0 && d > swept + 1.0));
    }
    let [alternative, ordinary] = SEEDED.map(|s| range(rows, s, DIRECT));
    if let (Some((alternative, a)), Some((ordinary, o))) = (alternative, ordinary) {
        let row = json!({ "ordinary": ordinary, "alternative": alternative });
        checks.push(named_check("joint-in-space", row).so(a >= 5.0 || o >= 5.0));
    }
    if let Some((ours, _)) = range(rows, STIFFENED, DIRECT) {
        let cells = rows
            .iter()
            .filter_map(|r| shown(r, (HEAVY, STIFFENED, DIRECT)));
        let (kept, lost): (Vec<_>, Vec<_>) = cells.partition(|text| text.starts_with('≥'));
        let row = json!({ "rows": kept.len() + lost.len(), "ours": ours });
        checks.push(named_check("stiffened", row).off(lost.len() as f64));
    }
    checks
}

/// Largest limit of the sweeps with a light top, paper's joint in the plane, as a logarithm.
fn light_limit(rows: &[Value], solver: Solver) -> Option<f64> {
    let limit = |r| at(r, (LIGHT, PAPER, solver), "limit");
    rows.iter().filter_map(limit).reduce(f64::max)
}

/// Check that `n` sweeps suffice up to 10^`least` in every row whose cable holds that with a
/// direct solver.
pub(in crate::paper) fn enough(records: &[Value], n: usize, least: f64) -> Option<Check> {
    let rows = rows(records);
    let solver = SWEEPS[usize::from(n == 20)];
    let reaches = |r: &&Value, solver| {
        let found = at(r, (HEAVY, PAPER, solver), "decade");
        found.is_some_and(|found| found >= least - 1e-9)
    };
    let able: Vec<&Value> = rows.iter().filter(|r| reaches(r, DIRECT)).collect();
    let kept = able.iter().filter(|r| reaches(r, solver)).count();
    let light = light_limit(&rows, solver);
    let lost = light.map_or_else(String::new, |l| {
        format!(", where {n} sweeps end at 10^{l:.2}")
    });
    let verdict = match (kept, able.len()) {
        (_, 0) => Verdict::NotYet,
        (0, _) => Verdict::DoesNotHold,
        (kept, able) if kept < able => Verdict::HoldsOnlyIf,
        _ if light.is_some_and(|l| l < least) => Verdict::HoldsOnlyIf,
        _ => Verdict::Holds,
    };
    let row = json!({ "n": n, "decade": least, "kept": kept, "able": able.len(), "lost": lost });
    Some(named_check("sweeps-enough", row).judged(verdict))
}

/// The last step's multipliers as a start, row by row beside the groups' own solutions.
fn warm_start(records: &[Value]) -> Option<Check> {
    let (mut shown, mut worst) = (Vec::new(), f64::INFINITY);
    for warm in records {
        let solver = warm["solver"].as_str().unwrap_or_default();
        let Some(solver) = solver.strip_suffix(", warm start") else {
            continue;
        };
        let n = solver.trim_matches(|c: char| !c.is_ascii_digit());
        shown.push(format!("N {}, {n}: 10^{}", warm["segments"], cell(warm)));
        let decade = |r: &Value| decade(r, "stable").unwrap_or(0.0);
        let same = [
            "setting",
            "young_gpa",
            "zeta_per_m2",
            "segments",
            "length_m",
            "ends",
        ];
        let is_cold =
            |r: &&Value| r["solver"] == solver && same.iter().all(|key| r[*key] == warm[*key]);
        let cold = records.iter().find(is_cold);
        worst = cold.map_or(worst, |cold| worst.min(decade(warm) - decade(cold)));
    }
    let row = json!({ "worst": worst, "shown": shown.join("; ") });
    (!shown.is_empty()).then(|| named_check("warm-start", row).so(worst >= 0.0))
}

/// The direct limits at the length that fits the paper's column best.
fn fitted(records: &[Value]) -> Option<Check> {
    let is_fitted = |r: &&Value| r["length_m"] != LENGTH && r["solver"] == DIRECT;
    let fitted = || records.iter().filter(is_fitted);
    let distance = |r: &Value| Some((limit(r)? - decade(r, "paper")?).abs());
    let worst = fitted().filter_map(distance).fold(0.0, f64::max);
    let [low, high] = extremes(ROWS.iter().map(Row::euler_length));
    let more = json!({ "low": low, "high": high });
    Some(named_check("one-length", with(fitted().next()?, &more)).off(worst))
}

/// Readings of the scan; the limits by joint and step, by solver, from other starts and at the
/// fitted length. Every cell is a row of the CSV file.
pub fn text_tables(records: &[Value], quick: bool) -> String {
    let rows = rows(records);
    let measured = || rows.iter().filter(|r| r["setting"] == PAPER);
    let solver = |r: &Value| r["solver"].as_str().unwrap_or_default().to_owned();
    let is_other = |r: &&Value| r["length_m"] != LENGTH || solver(r).ends_with("warm start");
    let more = |r: &Value| {
        let solver = solver(r).replace("Gauss–Seidel, ", "");
        with(r, &json!({ "solver": solver, "limit": cell(r) }))
    };
    let others: Vec<Value> = records.iter().filter(is_other).map(more).collect();
    let has_others = !others.is_empty();
    let others = json!({ "others": table("table2-others", &others) });
    let row = json!({
        "time": pick(quick, TIMES),
        "dt": DT,
        "length": LENGTH,
        "scan": table("scan", &rows),
        "settings": table("table2-settings", measured()),
        "solvers": table("table2-solvers", measured()),
        "others": has_others.then(|| text("others", &others)),
    });
    text("table2", &row)
}

/// The limits over Y/ζ, for 24 and for 6 segments.
pub(super) fn charts(records: &[Value]) -> Vec<Chart> {
    let rows = rows(records);
    let parts = rows.chunk_by(|a, b| a["segments"] == b["segments"]);
    parts.map(|own| chart("table2", &own[0], own)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_leave_a_gap_of_a_segment_at_their_limit() {
        let ratio = sweep_limit(20, 24.0);
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
