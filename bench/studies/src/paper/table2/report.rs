//! The limits beside the paper's rows, linear theory, the laws that the columns follow and the limit of the sweeps; the
//! paper's words on solvers, starts and joints; tables and charts.

use super::rows::Row;
use super::{CG, DIRECT, DT, GRAVITY, HEAVY, LENGTH, LIGHT, ORDINARY, PAPER, PER_DECADE, ROWS};
use super::{SEEDED, STIFFENED, SWEEPS, Solver, TIMES};
use crate::options::pick;
use crate::paper::timing::line;
use crate::paper::words::{chart, filled, table, tell, text, with};
use serde_json::{Value, json};
use taut_output::check::{Check, Verdict};
use taut_output::plot::{Chart, Mark, Series};

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

fn is_of(record: &Value, row: &Row) -> bool {
    record["young_gpa"] == row.young
        && record["zeta_per_m2"] == row.zeta
        && record["segments"] == row.segments
}

/// A cell of the cable of [`LENGTH`].
fn find<'a>(
    records: &'a [Value],
    row: &Row,
    ends: &str,
    (setting, solver): (&str, Solver),
) -> Option<&'a Value> {
    let mut own = records
        .iter()
        .filter(|r| is_of(r, row) && r["length_m"] == LENGTH);
    own.find(|r| r["ends"] == ends && r["setting"] == setting && r["solver"] == solver.0)
}

/// The paper's rows and claims beside the limits found, and the limits beside linear theory.
pub fn checks(records: &[Value], quick: bool) -> Vec<Check> {
    let step = 1.0 / pick(quick, PER_DECADE);
    let mut checks: Vec<Check> = ROWS.iter().filter_map(|r| published(records, r)).collect();
    checks.extend(linear_theory(records, step));
    checks.extend(scaling(records, step));
    let light = [3, 20].into_iter().zip(SWEEPS);
    checks.extend(light.filter_map(|(n, solver)| light_sweeps(records, step, n, solver)));
    checks.extend(enough(records, 20, 5.0));
    checks.extend(enough(records, 3, 3.0));
    checks.extend(claims(records));
    checks.extend(warm_start(records));
    checks.extend(fitted(records));
    checks
}

fn published(records: &[Value], row: &Row) -> Option<Check> {
    let swept = find(records, row, HEAVY, (PAPER, SWEEPS[1]))?;
    let direct = find(records, row, HEAVY, (PAPER, DIRECT));
    let found = decade(swept, "stable").unwrap_or(f64::NAN);
    let paper = row.ratio.log10();
    let mark = if row.inferred { " (inferred)" } else { "" };
    let more =
        json!({ "decade": paper, "mark": mark, "swept": cell(swept), "direct": cell(direct?) });
    Some(tell("table2-row", with(swept, &more)).off((found - paper).abs()))
}

/// Direct solves of the explicit tension: joint, definition and length as they come.
fn linear_theory(records: &[Value], step: f64) -> Option<Check> {
    let is_direct =
        |r: &&Value| r["solver"] == DIRECT.0 && !SEEDED.iter().any(|s| r["setting"] == *s);
    let distance = |r: &Value| Some(decade(r, "predicted")? - limit(r)?);
    let direct = records.iter().filter(is_direct);
    let all: Vec<f64> = direct.filter_map(distance).collect();
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

fn scaling(records: &[Value], step: f64) -> Vec<Check> {
    let direct = |row: &Row, setting| find(records, row, HEAVY, (setting, DIRECT));
    let limit = |row: &Row, setting| limit(direct(row, setting)?);
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
        let [_, theory] = line(&points(&|r| decade(direct(r, PAPER)?, "predicted")));
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
fn light_sweeps(records: &[Value], step: f64, n: usize, solver: Solver) -> Option<Check> {
    let light = |row: &Row| find(records, row, LIGHT, (STIFFENED, solver));
    let distance =
        |row: &Row| Some((limit(light(row)?)? - sweep_limit(n, row.segments).log10()).abs());
    let worst = ROWS.iter().filter_map(distance).reduce(f64::max)?;
    let differ = |rows: &[Row]| {
        let limits: Vec<f64> = rows
            .iter()
            .filter_map(|r| light(r)?["stable"].as_f64())
            .collect();
        limits.windows(2).any(|w| w[0] != w[1])
    };
    let depends = differ(&ROWS[..5]) || differ(&ROWS[5..]);
    let word = if depends { "dependent" } else { "independent" };
    Some(tell("light-sweeps", json!({ "n": n, "word": word, "bar": step })).off(worst))
}

/// Smallest and largest of the limits of a column, as text; and the logarithm of the largest.
fn range(records: &[Value], setting: &str, solver: Solver) -> Option<(String, f64)> {
    let cells = ROWS
        .iter()
        .filter_map(|r| find(records, r, HEAVY, (setting, solver)));
    let mut cells: Vec<&Value> = cells.collect();
    let value = |r: &Value| decade(r, "stable").unwrap_or(-1.0);
    // The last of equal ones is the largest, the first the smallest.
    cells.sort_by(|a, b| value(a).total_cmp(&value(b)));
    let (low, high) = (cells.first()?, cells.last()?);
    let [low, top] = [low, high].map(|r| cell(r).trim_end_matches(['g', 't', 'x']).to_owned());
    Some((format!("10^({low} … {top})"), value(high)))
}

fn claims(records: &[Value]) -> Vec<Check> {
    let column = |setting, solver| range(records, setting, solver);
    let mut checks = Vec::new();
    let [swept, cg, direct] = [SWEEPS[1], CG, DIRECT].map(|s| column(PAPER, s));
    if let (Some((_, swept)), Some((cg, c)), Some((direct, d))) = (swept, cg, direct) {
        let light = light_limit(records, SWEEPS[1]);
        let row = json!({ "direct": direct, "cg": cg, "light": light });
        checks.push(tell("direct-more", row).so(c > swept + 1.0 && d > swept + 1.0));
    }
    let [alternative, ordinary] = SEEDED.map(|s| column(s, DIRECT));
    if let (Some((alternative, a)), Some((ordinary, o))) = (alternative, ordinary) {
        let row = json!({ "ordinary": ordinary, "alternative": alternative });
        checks.push(tell("joint-in-space", row).so(a >= 5.0 || o >= 5.0));
    }
    if let Some((ours, _)) = column(STIFFENED, DIRECT) {
        let cell = |r| find(records, r, HEAVY, (STIFFENED, DIRECT));
        let cells: Vec<&Value> = ROWS.iter().filter_map(cell).collect();
        let lost = cells.iter().filter(|r| !is_capped(r)).count();
        let said = tell("stiffened", json!({ "rows": cells.len(), "ours": ours }));
        checks.push(said.off(lost as f64));
    }
    checks
}

/// Largest limit of the sweeps with a light top, paper's joint in the plane, as a logarithm.
fn light_limit(records: &[Value], solver: Solver) -> Option<f64> {
    let limit = |r: &Row| limit(find(records, r, LIGHT, (PAPER, solver))?);
    ROWS.iter().filter_map(limit).reduce(f64::max)
}

/// Check that `n` sweeps suffice up to 10^`least` in every row whose cable holds that with a
/// direct solver.
pub(in crate::paper) fn enough(records: &[Value], n: usize, least: f64) -> Option<Check> {
    let solver = SWEEPS[usize::from(n == 20)];
    let reaches = |r: &Value| decade(r, "stable").is_some_and(|found| found >= least - 1e-9);
    let able = ROWS.iter().filter_map(|r| {
        let swept = find(records, r, HEAVY, (PAPER, solver))?;
        reaches(find(records, r, HEAVY, (PAPER, DIRECT))?).then(|| reaches(swept))
    });
    let able: Vec<bool> = able.collect();
    let kept = able.iter().filter(|kept| **kept).count();
    let light = light_limit(records, solver);
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
    Some(tell("sweeps-enough", row).judged(verdict))
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
        let is_cold = |r: &&Value| {
            r["solver"] == solver
                && r["setting"] == warm["setting"]
                && ["young_gpa", "zeta_per_m2", "segments", "length_m", "ends"]
                    .iter()
                    .all(|key| r[*key] == warm[*key])
        };
        let cold = records.iter().find(is_cold);
        worst = cold.map_or(worst, |cold| worst.min(decade(warm) - decade(cold)));
    }
    let row = json!({ "worst": worst, "shown": shown.join("; ") });
    (!shown.is_empty()).then(|| tell("warm-start", row).so(worst >= 0.0))
}

/// The direct limits at the length that fits the paper's column best.
fn fitted(records: &[Value]) -> Option<Check> {
    let is_fitted = |r: &&Value| r["length_m"] != LENGTH && r["solver"] == DIRECT.0;
    let fitted = || records.iter().filter(is_fitted);
    let distance = |r: &Value| Some((limit(r)? - decade(r, "paper")?).abs());
    let worst = fitted().filter_map(distance).fold(0.0, f64::max);
    let lengths = ROWS.map(|r| r.euler_length());
    let low = lengths.into_iter().fold(f64::INFINITY, f64::min);
    let high = lengths.into_iter().fold(0.0, f64::max);
    let more = json!({ "low": low, "high": high });
    Some(tell("one-length", with(fitted().next()?, &more)).off(worst))
}

/// Readings of the scan; the limits by joint and step, by solver, from other starts and at the
/// fitted length. Every cell is a row of the CSV file.
pub fn text_tables(records: &[Value], quick: bool) -> String {
    let scan: Vec<Value> = ROWS.iter().map(Row::read).collect();
    let rows: Vec<Value> = ROWS.iter().filter_map(|r| cells(records, r)).collect();
    let solver = |r: &Value| r["solver"].as_str().unwrap_or_default().to_owned();
    let is_other = |r: &&Value| r["length_m"] != LENGTH || solver(r).ends_with("warm start");
    let more = |r: &Value| {
        let solver = solver(r).replace("Gauss–Seidel, ", "");
        with(r, &json!({ "solver": solver, "limit": cell(r) }))
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
        "time": pick(quick, TIMES),
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
fn cells(records: &[Value], row: &Row) -> Option<Value> {
    let own = records
        .iter()
        .filter(|r| is_of(r, row) && r["length_m"] == LENGTH);
    let own: Vec<&Value> = own.collect();
    let mut cells = (*own.iter().find(|r| r["setting"] == PAPER)?).clone();
    for r in own {
        cells[filled("{ends}, {setting}, {solver}", r)] = cell(r).into();
    }
    Some(cells)
}

/// The limits over Y/ζ, for 24 and for 6 segments.
pub(super) fn charts(records: &[Value]) -> Vec<Chart> {
    let panel = |rows: &[Row]| {
        let line = |name, mark, value: &dyn Fn(&Row) -> Option<f64>| {
            let point = |r: &Row| Some([r.young / r.zeta, value(r)?]);
            Series::new(name, rows.iter().filter_map(point).collect(), mark)
        };
        let limit = |name, setting, solver| {
            let value = |r: &Row| find(records, r, HEAVY, (setting, solver))?["stable"].as_f64();
            line(name, Mark::LineAndPoints, &value)
        };
        let linear = |r: &Row| find(records, r, HEAVY, (PAPER, DIRECT))?["predicted"].as_f64();
        let stiffened = "geometric stiffness, at least";
        let series = vec![
            line("paper, as read", Mark::Points, &|r| Some(r.ratio)),
            limit("paper's joint, direct", PAPER, DIRECT),
            line("linear theory", Mark::Line, &linear),
            limit("20 iterations", PAPER, SWEEPS[1]),
            limit("3 iterations", PAPER, SWEEPS[0]),
            limit(stiffened, STIFFENED, DIRECT),
            limit("seeded, ordinary", SEEDED[1], DIRECT),
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
