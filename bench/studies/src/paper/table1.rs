//! Table I: the largest load/particle mass ratio at which a chain of particles stays together \[SL §III].
//!
//! Five links of 1 m, particles of 1 kg, dropped from the horizontal at g = 10 m/s², the paper's step at 1/60 s, 30 s.
//! The paper calls a run unstable where the link violations φ_d show "large, or even diverging, variations"; here it is
//! one criterion for all rows: *stable is finite with max |φ_d|/d below 0.2*. Every row is run a second time with the
//! particles 10⁻⁶ m out of the plane: the paper's scalar bend angle (e) resists one of two transverse directions, and
//! what holds in the plane is lost in space; the bend vector (f) holds in both.
//!
//! The scan of the table has lost its exponents. Those of ε are inferred (the masses' ratios that they give reproduce
//! the ones that can be read); a ratio with two readings is shown with both, and the nearer one counts.

use super::search::largest;
use super::words::{self, chart, filled, named_check, number, table, text, with};
use crate::checks::each;
use crate::options::pick;
use indicatif::ProgressBar;
use serde_json::{Value, json};
use taut_integrator::{Form, StepError, StepOptions, Stepper};
use taut_measure::pace;
use taut_measure::trajectory::steps_in;
use taut_model::{ChainModel, ParticleChainParams};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Largest |φ_d|/d of a stable run.
pub const BAR: f64 = 0.2;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    pub model: ChainModel,
    /// Compliance of the links \[m/N].
    pub links: f64,
    /// Compliance of the added rows \[m/N or rad/(N m)]; of no meaning for (a).
    pub added: f64,
    /// log₁₀ of the paper's ratio, in every way that it can be read; none for ours.
    pub paper: &'static [f64],
}

/// The paper's rows, and those of (f) with the compliances of (e).
pub const ROWS: [Row; 12] = {
    use ChainModel::{BendAngle, BendVector, Links, LoadEnforcement, MasslessCable, Truncated};
    const fn row(model: ChainModel, links: f64, added: f64, paper: &'static [f64]) -> Row {
        Row {
            model,
            links,
            added,
            paper,
        }
    }
    [
        row(Links, 1e-8, 0.0, &[2.0]),
        row(MasslessCable, 1e-8, 1e-9, &[2.0]),
        row(LoadEnforcement, 1e-8, 1e-9, &[5.0, 6.0]),
        row(LoadEnforcement, 1e-8, 1e-12, &[7.0, 9.0]),
        row(LoadEnforcement, 1e-18, 1e-22, &[19.0, 20.0]),
        row(Truncated, 1e-8, 1e-9, &[2.0]),
        row(BendAngle, 1e-8, 1e-4, &[3.0]),
        row(BendAngle, 1e-11, 1e-9, &[7.0]),
        row(BendAngle, 1e-18, 1e-17, &[15.0]),
        row(BendVector, 1e-8, 1e-4, &[]),
        row(BendVector, 1e-11, 1e-9, &[]),
        row(BendVector, 1e-18, 1e-17, &[]),
    ]
};

/// Simulated time \[s].
pub(super) const TIME: f64 = 30.0;

/// How far off the limit both of its sides are shown, in decades.
const ASIDE: f64 = 0.3;

/// All rows; quick one of each kind.
pub fn rows(quick: bool) -> Vec<Row> {
    let few = [0, 2, 6, 8, 9].map(|i| ROWS[i]);
    pick(quick, [ROWS.to_vec(), few.to_vec()])
}

/// Displacements out of the plane \[m].
pub const NOISES: [f64; 2] = [0.0, 1e-6];

/// End of the scan, in decades: far above every row's limit.
const TOP: f64 = 24.0;

/// The paper's step, with the KKT matrix eliminated in chain order: forming S would lose the inverse mass of loads
/// above 10¹⁵ particles' masses, which is the limit of the arithmetic, not of the model.
fn options() -> StepOptions {
    StepOptions {
        form: Form::Kkt,
        refinements: 2,
        ..StepOptions::paper()
    }
}

pub(super) fn letter(model: ChainModel) -> &'static str {
    model.name().trim_start_matches("particles-")
}

/// Chain of a row with a load of 10^`decade` particles' masses.
pub(super) fn chain(row: &Row, decade: f64) -> ParticleChainParams {
    ParticleChainParams {
        model: row.model,
        compliance: row.links,
        added_compliance: Some(row.added),
        load_mass: 10.0_f64.powf(decade),
        ..ParticleChainParams::default()
    }
}

/// Runs a chain until `time`, or until a link's violation over its length reaches `bar`: the largest violation, and when it
/// ended. `each` sees every state before that.
pub(super) fn drop_chain(
    params: &ParticleChainParams,
    noise: f64,
    (time, bar): (f64, f64),
    mut each: impl FnMut(&mut Stepper) -> Result<(), StepError>,
) -> Result<(f64, f64), ExperimentError> {
    let mut scene = params.build()?;
    // Signs without a pattern, so that no mode of the chain is left out.
    let signs = [0.3, -1.0, 0.7, -0.2, 0.9];
    for (x, sign) in scene.bodies.position.iter_mut().zip(signs.iter().cycle()) {
        x.y += noise * sign;
    }
    let mut stepper = Stepper::new(scene, options())?;
    let starts = &stepper.linearized().row_start;
    let rows = stepper.scene().constraint_names.iter().zip(starts);
    let links = rows.filter(|(name, _)| name.starts_with("link-"));
    let links: Vec<usize> = links.map(|(_, row)| *row).collect();
    let mut violation = 0.0_f64;
    for _ in 0..steps_in(time, stepper.options().dt) {
        if pace::step(&mut stepper).is_err() {
            violation = f64::INFINITY;
        }
        for &row in &links {
            let phi = stepper.linearized().phi[row].abs() / params.spacing;
            violation = violation.max(if phi.is_nan() { f64::INFINITY } else { phi });
        }
        if violation >= bar {
            return Ok((violation, stepper.time()));
        }
        each(&mut stepper)?;
    }
    Ok((violation, time))
}

/// Finds every row's limit, in parallel. `progress` advances once a row.
pub fn run(
    rows: &[Row],
    noises: &[f64],
    quick: bool,
    progress: &ProgressBar,
) -> Result<Vec<Value>, ExperimentError> {
    let tasks = rows
        .iter()
        .flat_map(|&row| noises.iter().map(move |&noise| (row, noise)));
    let tasks: Vec<_> = tasks.collect();
    // Step of the upward scan, and width to which the limit is bisected, in decades.
    let widths = pick(quick, [[TOP, 0.25, 0.01], [TOP, 1.0, 0.1]]);
    each(&tasks, progress, |&(row, noise)| {
        measure(widths, row, noise)
    })
}

/// A row's limit, a lower bound where the scan ended stable; the largest |φ_d|/d a little below and above it, and when
/// the run above it ended. The paper's ratio is the nearest reading.
fn measure(widths: [f64; 3], row: Row, noise: f64) -> Result<Value, ExperimentError> {
    let fate = |decade: f64| drop_chain(&chain(&row, decade), noise, (TIME, BAR), |_| Ok(()));
    let (stable, failure) = largest(widths, |decade| {
        Ok::<_, ExperimentError>((fate(decade)?.0 >= BAR).then_some(()))
    })?;
    let limit = stable.unwrap_or(0.0);
    let (below, _) = fate(limit - ASIDE)?;
    let (above, ends) = fate(limit + ASIDE)?;
    let distance = |paper: &f64| (limit - paper).abs();
    let papers = row.paper.iter().copied();
    Ok(json!({
        "model": letter(row.model),
        "links_compliance": row.links,
        "added_compliance": row.added,
        "noise_m": noise,
        "paper_log10": papers.min_by(|a, b| distance(a).total_cmp(&distance(b))),
        "limit_log10": limit,
        "at_least": failure.is_none(),
        "below": below,
        // It may be infinite, which JSON does not have.
        "above": if above.is_finite() { above.into() } else { Value::from("inf") },
        "above_ends_s": ends,
    }))
}

fn has_bending(record: &Value) -> bool {
    record["model"] == "e" || record["model"] == "f"
}

/// The record with its name, the paper's ratio as the scan shows it, and the limit in theory.
///
/// Linear theory of stiff bending: the regularised rows hold the tension 3 M g of a swing from the horizontal as long as
/// ε ≤ 4 sin²(π/2N)/(3 M g d), what the longest wave of N links needs.
fn reported(record: &Value) -> Value {
    let is_its = |row: &&Row| {
        record["model"] == letter(row.model)
            && record["links_compliance"] == row.links
            && record["added_compliance"] == row.added
    };
    let papers = ROWS.iter().find(is_its).map_or(&[][..], |row| row.paper);
    let paper: Vec<String> = papers.iter().map(|p| format!("10^{p}")).collect();
    let printed = match paper.len() {
        0 | 1 => paper.concat(),
        _ => format!("{} (unreadable)", paper.join(" or ")),
    };
    let params = ParticleChainParams::default();
    let added = number(record, "added_compliance");
    let wave = (0.5 * std::f64::consts::PI / params.particles as f64).sin();
    let weight = 3.0 * params.gravity * params.spacing * params.mass * added;
    let is_stiff = has_bending(record) && added < 1e-6;
    let paper = record["paper_log10"].as_f64();
    let more = json!({
        "printed": printed,
        "added": if record["model"] == "a" { String::new() } else { format!("{added:.0e}") },
        "theory": is_stiff.then(|| (4.0 * wave * wave / weight).log10()),
        "at_least": if record["at_least"] == true { "≥ " } else { "" },
        "paper": paper.map(|p| format!("10^{p}")),
    });
    let mut row = with(record, &more);
    let name = filled("{model} {links_compliance:.0e} {added}", &row);
    row["name"] = name.trim_end().into();
    row
}

/// The table's rows against the paper in the plane; what is left of (e) and (f) in space, beside the paper or the limit of
/// its bending in the plane with the same compliances.
pub fn checks(records: &[Value]) -> Vec<Check> {
    let rows: Vec<Value> = records.iter().map(reported).collect();
    let of = |name, row: &Value, key| {
        let error = number(row, "limit_log10") - row[key].as_f64()?;
        Some(named_check(name, row.clone()).off(error.abs()))
    };
    let planar = || rows.iter().filter(|r| r["noise_m"] == 0.0);
    let beside = planar().filter_map(|r| of("chain", r, "paper_log10"));
    let theory = planar().filter_map(|r| of("chain-theory", r, "theory"));
    let mut checks: Vec<Check> = beside.chain(theory).collect();
    let in_space = |r: &&Value| r["noise_m"] != 0.0 && has_bending(r);
    checks.extend(rows.iter().filter(in_space).filter_map(|row| {
        let same = ["links_compliance", "added_compliance"];
        let is_its = |r: &&Value| r["model"] == "e" && same.iter().all(|key| r[*key] == row[*key]);
        let limit = &planar().find(is_its)?["limit_log10"];
        let row = with(row, &json!({ "planar": limit }));
        let published = of("chain-angle", &row, "paper_log10");
        published.or_else(|| of("chain-vector", &row, "planar"))
    }));
    checks
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let records = run(&rows(quick), &NOISES, quick, progress)?;
    let rows: Vec<Value> = records.iter().map(reported).collect();
    let ends = records.iter().map(|r| number(r, "above_ends_s"));
    let row = json!({ "ends": ends.fold(0.0, f64::max), "rows": table("table1", &rows) });
    let (checks, text) = (checks(&records), text("table1", &row));
    let charts = vec![chart("table1", &Value::Null, &records)];
    words::outcome(checks, text, &records, charts)
}
