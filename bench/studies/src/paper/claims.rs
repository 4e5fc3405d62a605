//! Claims of the paper in words, each with a number \[SL §I-C, §III, §VII, §IX].
//!
//! **Explicit bending.** The chain of links (a) with the bending of (f) as an external force, −Jᵀ φ/ε from the state at
//! the beginning of the step, against the same bending as regularised rows. An explicit spring does nothing against what
//! a step does not see coming: a stiff one (Δt² k > 4 m) is unstable by itself, a soft one holds no tension.

use super::chains::{BENDING, LINKS};
use super::search::largest;
use super::table1::{self, BAR, ROWS, Row, chain, drop_chain};
use super::words::{self, chart, extremes, named_check, table, with};
use super::{table2, timing};
use crate::checks::each;
use crate::motions;
use crate::options::pick;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use taut_integrator::{StepError, Stepper};
use taut_model::{BodyVectors, ChainModel, Constraint, ParticleChainParams, Scene};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};
use taut_output::plot::Chart;

/// How the bending of a chain acts: not at all, as an external force of the state at the beginning of a step, as rows with
/// a compliance.
const NONE: &str = "none";
const FORCE: &str = "explicit force";
const AS_ROWS: &str = "regularised rows";

/// The bending, its compliance \[rad/(N m)], the particles with the load.
type Task = (&'static str, f64, usize);

/// Puts −Jᵀ φ/ε of a chain's rows of bending, at the stepper's present state, on its bodies.
fn bend(chain: &mut Scene, stepper: &mut Stepper) -> Result<(), StepError> {
    let positions = &stepper.scene().bodies.position;
    chain.bodies.position.clone_from(positions);
    let rows = motions::linearized(chain);
    let mut lambda = vec![0.0; rows.rows()];
    for (i, constraint) in chain.constraints.iter().enumerate() {
        if matches!(constraint, Constraint::LinkBend(_)) {
            for row in rows.row_range(i) {
                lambda[row] = -rows.phi[row] / rows.compliance[row];
            }
        }
    }
    let mut forces = BodyVectors::new(positions.len());
    rows.add_transposed(&lambda, &mut forces);
    for i in 0..chain.bodies.len() {
        let [x, y, z, ..] = forces.get(i);
        stepper.set_load(i, Vector3::new(x, y, z), Vector3::zeros())?;
    }
    Ok(())
}

/// log₁₀ of the least load tried: long chains with next to no load are whips, which the criterion does not forgive.
const LEAST: f64 = 1.0;

/// log₁₀ of the largest stable ratio of a chain; none where 10 is unstable.
fn limit(quick: bool, task: Task) -> Result<Value, ExperimentError> {
    let (bending, compliance, particles) = task;
    let vector = Row {
        model: ChainModel::BendVector,
        added: compliance,
        ..BENDING
    };
    let row = if bending == AS_ROWS { vector } else { LINKS };
    let (time, per_decade) = pick(quick, [(30.0, 8.0), (10.0, 2.0)]);
    let (stable, _) = largest([8.0, 1.0, 1.0 / per_decade], |decade| {
        let params = |row| ParticleChainParams {
            particles,
            ..chain(row, LEAST + decade)
        };
        let bent = (bending == FORCE).then(|| params(&vector).build());
        let mut bent = bent.transpose()?;
        let push = |stepper: &mut Stepper| match &mut bent {
            Some(bent) => bend(bent, stepper),
            None => Ok(()),
        };
        let (violation, _) = drop_chain(&params(&row), 0.0, (time, BAR), push)?;
        Ok::<_, ExperimentError>((violation >= BAR).then_some(()))
    })?;
    Ok(json!({
        "bending": bending,
        "compliance": (bending != NONE).then_some(compliance),
        "particles": particles,
        "limit_log10": stable.map(|decade| LEAST + decade),
    }))
}

/// Runs the chains, in parallel: no bending, explicit and regularised bending of each compliance, and both ends of that
/// for each number of particles. `progress` advances once a chain.
pub fn run(quick: bool, progress: &ProgressBar) -> Result<Vec<Value>, ExperimentError> {
    let all = vec![1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0];
    let usual = chain(&LINKS, 0.0).particles;
    let mut tasks = vec![(NONE, 0.0, usual)];
    for compliance in pick(quick, [all, vec![1e-5, 1e-4, 1e-2, 1.0]]) {
        tasks.extend([FORCE, AS_ROWS].map(|bending| (bending, compliance, usual)));
    }
    for n in pick(quick, [vec![3, 10, 20], vec![10]]) {
        tasks.extend([(NONE, 0.0, n), (AS_ROWS, BENDING.added, n)]);
    }
    each(&tasks, progress, |&task| limit(quick, task))
}

fn power(decade: f64) -> String {
    match decade.is_finite() {
        true => format!("10^{decade:.2}"),
        false => "below 10".to_owned(),
    }
}

/// log₁₀ of a limit, −∞ where 10 is unstable.
fn decade(row: &Value) -> f64 {
    row["limit_log10"].as_f64().unwrap_or(f64::NEG_INFINITY)
}

/// Smallest and largest limit of the rows that a test picks.
fn range(rows: &[Value], pick: impl Fn(&Value) -> bool) -> [f64; 2] {
    extremes(rows.iter().filter(|row| pick(row)).map(decade))
}

/// Bending of a chain of the usual length.
fn is_usual(row: &Value, bending: &str) -> bool {
    row["bending"] == bending && row["particles"] == chain(&LINKS, 0.0).particles
}

/// Checks of bending as a force and as rows, and of the chains' length.
pub fn bending_checks(rows: &[Value]) -> Vec<Check> {
    let best = |bending| range(rows, |row| is_usual(row, bending))[1];
    let (none, force, as_rows) = (best(NONE), best(FORCE), best(AS_ROWS));
    let row = |best| json!({ "best": power(best), "none": power(none) });
    let spread = [NONE, AS_ROWS].map(|bending| {
        let [low, high] = range(rows, |row| {
            let compliance = row["compliance"].as_f64();
            row["bending"] == bending && compliance.is_none_or(|c| c == BENDING.added)
        });
        high - low
    });
    let numbers: BTreeSet<u64> = rows
        .iter()
        .filter_map(|r| r["particles"].as_u64())
        .collect();
    let numbers: Vec<String> = numbers.iter().map(u64::to_string).collect();
    let length = json!({ "none": spread[0], "rows": spread[1], "numbers": numbers.join(", ") });
    let verdict = match spread.map(|s| s < 0.5) {
        [true, true] => Verdict::Holds,
        [false, false] => Verdict::DoesNotHold,
        _ => Verdict::HoldsOnlyIf,
    };
    vec![
        named_check("explicit-bending", row(force)).so(force < none + 0.25),
        named_check("bending-rows", row(as_rows)).so(as_rows > none + 1.0),
        named_check("links", length).judged(verdict),
    ]
}

/// Gains of the additions to the chain of links; none where a limit is not known.
fn supplementary(records: &[Value]) -> Vec<Check> {
    let limit = |model: &str| {
        let [_, most] = range(records, |r| r["model"] == model);
        most
    };
    let links = limit("a");
    let gains = ["b", "c", "d", "e"].map(|model| limit(model) - links);
    let [b, c, d, e] = gains;
    if !gains.iter().all(|gain| gain.is_finite()) {
        return Vec::new();
    }
    let row = json!({ "b": b, "c": c, "d": d, "e": e });
    vec![
        named_check("massless-cable", row.clone()).so(b.max(d) < 0.5),
        named_check("load-enforcement", row).so(c.min(e) > 1.0),
    ]
}

/// A row with its limit as text and as a ratio.
fn reported(row: &Value) -> Value {
    let ratio = 10.0_f64.powf(decade(row).max(0.0));
    with(row, &json!({ "limit": power(decade(row)), "ratio": ratio }))
}

/// The limits over the compliance; that without bending is a level from end to end.
fn charts(rows: &[Value]) -> Chart {
    let of = |bending| rows.iter().filter(move |row| is_usual(row, bending));
    let ends = [of(FORCE).next(), of(FORCE).next_back()]
        .into_iter()
        .flatten();
    let level = ends.zip(of(NONE).cycle());
    let level = level.map(|(end, none)| with(none, &json!({ "compliance": end["compliance"] })));
    let level: Vec<Value> = level.collect();
    chart("claims", &Value::Null, rows.iter().chain(&level))
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let rows = &*table2::ROWS;
    let rows = pick(quick, [rows.iter().collect(), vec![&rows[7], &rows[9]]]);
    // Times first, while nothing else runs.
    let times = timing::run(true, progress)?;
    progress.reset();
    let chosen = [0, 1, 2, 5, 6].map(|i| ROWS[i]);
    let chains = table1::run(&chosen, &[0.0], quick, progress)?;
    progress.reset();
    let swept = table2::run(&table2::sweeps_only(&rows), false, progress)?;
    progress.reset();
    let records = run(quick, progress)?;
    let mut checks = bending_checks(&records);
    checks.extend(supplementary(&chains));
    checks.extend(table2::enough(&swept, 3, 3.0));
    checks.extend(table2::enough(&swept, 20, 5.0));
    checks.extend(timing::cost(&times));
    let rows: Vec<Value> = records.iter().map(reported).collect();
    let text = table("claims", &rows) + "\n";
    words::outcome(checks, text, &records, vec![charts(&rows)])
}
