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

use crate::checks::each;
use crate::options::pick;
use indicatif::ProgressBar;
use serde::Serialize;
use taut_ground::pace;
use taut_ground::trajectory::steps_in;
use taut_integrator::{Form, StepError, StepOptions, Stepper};
use taut_model::{ChainModel, ParticleChainParams};
use taut_output::check::{Check, ExperimentError, Outcome, csv};
use taut_output::plot::{Axis, Chart, Mark, Series};
use taut_output::table;

/// Largest |φ_d|/d of a stable run.
pub const BAR: f64 = 0.2;

/// Distance from the paper's decade that still rounds to it.
const SAME_DECADE: f64 = 0.5;

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

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub rows: Vec<Row>,
    /// Simulated time \[s].
    pub time: f64,
    /// Step of the upward scan, in decades.
    pub scan: f64,
    /// Width to which the limit is bisected, in decades.
    pub width: f64,
    /// How far off the limit both of its sides are shown, in decades.
    pub aside: f64,
    /// Displacements out of the plane \[m].
    pub noises: Vec<f64>,
}

impl Config {
    /// All rows; quick one of each kind, coarsely.
    pub fn new(quick: bool) -> Self {
        let few = || [0, 2, 6, 8, 9].map(|i| ROWS[i]).to_vec();
        Self {
            rows: if quick { few() } else { ROWS.to_vec() },
            time: 30.0,
            scan: pick(quick, [0.25, 1.0]),
            width: pick(quick, [0.01, 0.1]),
            aside: 0.3,
            noises: vec![0.0, 1e-6],
        }
    }
}

/// One measured row.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// Letter of the model.
    pub model: String,
    /// Compliance of the links \[m/N].
    pub links_compliance: f64,
    /// Compliance of the added rows \[m/N or rad/(N m)].
    pub added_compliance: f64,
    /// Displacement out of the plane at the start \[m].
    pub noise_m: f64,
    /// The paper's log₁₀ of the ratio, the nearest reading.
    pub paper_log10: Option<f64>,
    /// log₁₀ of the largest ratio up to which all are stable.
    pub limit_log10: f64,
    /// The scan ended stable: `limit_log10` is a lower bound.
    pub at_least: bool,
    /// Largest |φ_d|/d a little below the limit.
    pub below: f64,
    /// Largest |φ_d|/d a little above the limit, up to the end of the run; infinite where it was not finite.
    pub above: f64,
    /// When the run above the limit ended \[s].
    pub above_ends_s: f64,
}

/// End of the scan, in decades: far above every row's limit.
const TOP: f64 = 24.0;

/// How far a run came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fate {
    /// Largest |φ_d|/d.
    pub(super) violation: f64,
    /// When it ended \[s].
    pub(super) time: f64,
    /// The run reached its end unbroken.
    pub(super) stable: bool,
}

/// The paper's step, with the KKT matrix eliminated in chain order: forming S would lose the inverse mass of loads
/// above 10¹⁵ particles' masses, which is the limit of the arithmetic, not of the model.
pub(super) fn options() -> StepOptions {
    StepOptions {
        form: Form::Kkt,
        refinements: 2,
        ..StepOptions::paper()
    }
}

pub(super) fn letter(model: ChainModel) -> &'static str {
    model.scene_name().trim_start_matches("particles-")
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

/// Runs a chain until `time`, or until a link's violation over its length reaches `bar`. `each`
/// sees every state before that.
pub(super) fn drop_chain(
    params: &ParticleChainParams,
    options: StepOptions,
    noise: f64,
    (time, bar): (f64, f64),
    mut each: impl FnMut(&mut Stepper) -> Result<(), StepError>,
) -> Result<Fate, ExperimentError> {
    let mut scene = params.build()?;
    // Signs without a pattern, so that no mode of the chain is left out.
    let signs = [0.3, -1.0, 0.7, -0.2, 0.9];
    for (x, sign) in scene.bodies.position.iter_mut().zip(signs.iter().cycle()) {
        x.y += noise * sign;
    }
    let mut stepper = Stepper::new(scene, options)?;
    let names = &stepper.scene().constraint_names;
    let starts = &stepper.linearized().row_start;
    let links: Vec<usize> = names
        .iter()
        .zip(starts)
        .filter(|(name, _)| name.starts_with("link-"))
        .map(|(_, row)| *row)
        .collect();
    let mut violation = 0.0_f64;
    for _ in 0..steps_in(time, stepper.options().dt) {
        if pace::step(&mut stepper).is_err() {
            violation = f64::INFINITY;
        }
        for &row in &links {
            let phi = stepper.linearized().phi[row].abs() / params.spacing;
            violation = if phi.is_nan() {
                f64::INFINITY
            } else {
                violation.max(phi)
            };
        }
        if violation >= bar {
            return Ok(Fate {
                violation,
                time: stepper.time(),
                stable: false,
            });
        }
        each(&mut stepper)?;
    }
    Ok(Fate {
        violation,
        time,
        stable: true,
    })
}

/// Finds every row's limit, in parallel: upwards in steps to the first unstable ratio, then by bisection between it and
/// the one before. `progress` advances once a row.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Vec<Record>, ExperimentError> {
    let noises = &config.noises;
    let tasks: Vec<(&Row, f64)> = config
        .rows
        .iter()
        .flat_map(|row| noises.iter().map(move |&noise| (row, noise)))
        .collect();
    each(&tasks, progress, |(row, noise)| {
        measure(config, row, *noise)
    })
}

fn measure(config: &Config, row: &Row, noise: f64) -> Result<Record, ExperimentError> {
    let fate = |decade: f64| {
        drop_chain(
            &chain(row, decade),
            options(),
            noise,
            (config.time, BAR),
            |_| Ok(()),
        )
    };
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut decade = 0.0;
    while decade <= TOP {
        if !fate(decade)?.stable {
            high = decade;
            break;
        }
        low = decade;
        decade += config.scan;
    }
    while high - low > config.width && high.is_finite() {
        let middle = 0.5 * (low + high);
        if fate(middle)?.stable {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (below, above) = (fate(low - config.aside)?, fate(low + config.aside)?);
    let distance = |paper: &&f64| (low - **paper).abs();
    let paper = row
        .paper
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    Ok(Record {
        model: letter(row.model).to_owned(),
        links_compliance: row.links,
        added_compliance: row.added,
        noise_m: noise,
        paper_log10: paper.copied(),
        limit_log10: low,
        at_least: high.is_infinite(),
        below: below.violation,
        above: above.violation,
        above_ends_s: above.time,
    })
}

/// A power of ten with one decimal in its exponent.
fn power(decade: f64) -> String {
    format!("10^{decade:.2}")
}

/// Ratio of a row as the scan shows it.
fn printed(row: &Row) -> String {
    let readings: Vec<String> = row.paper.iter().map(|p| format!("10^{p}")).collect();
    match readings.len() {
        0 => "not in the paper".to_owned(),
        1 => readings.concat(),
        _ => format!("{} (unreadable)", readings.join(" or ")),
    }
}

fn row_of<'a>(config: &'a Config, record: &Record) -> Option<&'a Row> {
    config.rows.iter().find(|row| {
        row.model.scene_name().ends_with(&record.model)
            && row.links == record.links_compliance
            && row.added == record.added_compliance
    })
}

fn name(record: &Record) -> String {
    match record.model.as_str() {
        "a" => format!("a {:.0e}", record.links_compliance),
        model => format!(
            "{model} {:.0e} {:.0e}",
            record.links_compliance, record.added_compliance
        ),
    }
}

/// Linear theory of stiff bending: the regularised rows hold the tension 3 M g of a swing from the horizontal as long as
/// ε ≤ 4 sin²(π/2N)/(3 M g d), what the longest wave of N links needs.
fn theory(record: &Record) -> Option<Check> {
    let params = ParticleChainParams::default();
    let stiff = ["e", "f"].contains(&record.model.as_str()) && record.added_compliance < 1e-6;
    let wave = (0.5 * std::f64::consts::PI / params.particles as f64).sin();
    let weight = 3.0 * params.gravity * params.spacing * params.mass * record.added_compliance;
    let decade = (4.0 * wave * wave / weight).log10();
    stiff.then(|| {
        let case = format!("table1 {} in theory", name(record));
        let error = (record.limit_log10 - decade).abs();
        Check::within(case, power(decade), power(record.limit_log10), error, 0.3)
            .by("distance in decades from M = 4 sin²(π/2N)/(3 ε g d): the longest wave under three times the load's weight")
    })
}

/// The table's rows against the paper in the plane; what is left of (e) and (f) in space.
pub fn checks(config: &Config, records: &[Record]) -> Vec<Check> {
    let mut checks = Vec::new();
    for record in records.iter().filter(|r| r.noise_m == 0.0) {
        let (Some(row), Some(paper)) = (row_of(config, record), record.paper_log10) else {
            continue;
        };
        let error = (record.limit_log10 - paper).abs();
        let case = format!("table1 {}", name(record));
        checks.push(
            Check::within(
                case,
                printed(row),
                power(record.limit_log10),
                error,
                SAME_DECADE,
            )
            .published()
            .by("distance in decades from the nearest reading, in exactly planar motion"),
        );
    }
    checks.extend(
        records
            .iter()
            .filter(|r| r.noise_m == 0.0)
            .filter_map(theory),
    );
    let space = records.iter().filter(|r| r.noise_m > 0.0);
    for record in space.filter(|r| ["e", "f"].contains(&r.model.as_str())) {
        // Limit of the paper's bending in the plane, with the same compliances.
        let planar = records.iter().find(|r| {
            r.model == "e"
                && r.noise_m == 0.0
                && (r.links_compliance, r.added_compliance)
                    == (record.links_compliance, record.added_compliance)
        });
        let Some(planar) = planar else {
            continue;
        };
        let lost = planar.limit_log10 - record.limit_log10;
        let case = format!("table1 {} in space", name(record));
        let ours = power(record.limit_log10);
        let (row, paper) = (row_of(config, record), record.paper_log10);
        let check = match (row, paper) {
            (Some(row), Some(paper)) => {
                let error = (record.limit_log10 - paper).abs();
                Check::within(case, printed(row), ours, error, SAME_DECADE).published()
                    .by("distance in decades from the paper's, with the particles 10⁻⁶ m out of the plane")
                    .noting("one scalar angle resists one of two transverse directions")
            }
            _ => {
                let reference = format!("(e) in the plane: {}", power(planar.limit_log10));
                Check::within(case, reference, ours, lost.abs(), 0.25)
                    .by("decades lost with the particles 10⁻⁶ m out of the plane")
            }
        };
        checks.push(check);
    }
    checks
}

fn text(records: &[Record]) -> String {
    let mut t = table::table(&[
        "model",
        "ε links",
        "ε added",
        "noise m",
        "paper",
        "limit",
        "max φ/d below",
        "above",
        "ends at s",
    ]);
    for r in records {
        let at_least = if r.at_least { "≥ " } else { "" };
        let added = if r.model == "a" {
            String::new()
        } else {
            format!("{:.0e}", r.added_compliance)
        };
        t.add_row([
            r.model.clone(),
            format!("{:.0e}", r.links_compliance),
            added,
            format!("{:.0e}", r.noise_m),
            r.paper_log10
                .map_or_else(String::new, |p| format!("10^{p}")),
            format!("{at_least}{}", power(r.limit_log10)),
            format!("{:.3}", r.below),
            format!("{:.2}", r.above),
            format!("{:.1}", r.above_ends_s),
        ]);
    }
    format!(
        "ε: m/N, of bending rad/(N m); max φ/d: largest link violation over the link's length in 30 s, 0.3 decades below and\n\
         above the limit, and when the run above it ends ({:.1} s: it lasts, chains near their limit are chaotic)\n{}",
        records.iter().map(|r| r.above_ends_s).fold(0.0, f64::max),
        table::text(&t)
    )
}

fn chart(records: &[Record]) -> Chart {
    let points = |noise: bool| -> Vec<[f64; 2]> {
        let rows = records.iter().filter(|r| (r.noise_m > 0.0) == noise);
        rows.filter_map(|r| Some([r.paper_log10?, r.limit_log10]))
            .collect()
    };
    Chart {
        title: "Table I: largest stable load/particle mass ratio".to_owned(),
        x: Axis::linear("paper, log₁₀ of the ratio"),
        y: Axis::linear("ours, log₁₀ of the ratio"),
        series: vec![
            Series::new("equal", vec![[0.0, 0.0], [20.0, 20.0]], Mark::Line),
            Series::new("in the plane", points(false), Mark::Points),
            Series::new("10⁻⁶ m out of it", points(true), Mark::Points),
        ],
    }
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let config = Config::new(quick);
    let records = run(&config, progress)?;
    Ok(Outcome {
        checks: checks(&config, &records),
        text: text(&records) + "\n",
        csv: csv(&records)?,
        charts: vec![chart(&records)],
        ..Outcome::default()
    })
}
