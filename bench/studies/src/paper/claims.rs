//! Claims of the paper in words, each with a number \[SL §I-C, §III, §VII, §IX].
//!
//! **Explicit bending.** The chain of links (a) with the bending of (f) as an external force, −Jᵀ φ/ε from the state at
//! the beginning of the step, against the same bending as regularised rows. An explicit spring does nothing against what
//! a step does not see coming: a stiff one (Δt² k > 4 m) is unstable by itself, a soft one holds no tension.

use super::chains::{BENDING, LINKS};
use super::table1::{self, BAR, ROWS, Row, chain, drop_chain, options};
use super::table2::{self, largest};
use super::timing;
use crate::checks::each;
use crate::options::pick;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use serde::Serialize;
use taut_ground::trajectory::Failure;
use taut_integrator::{StepError, Stepper};
use taut_model::{ChainModel, Constraint, Linearized, Scene};
use taut_output::check::{Check, ExperimentError, Measure, Outcome, Verdict, csv};
use taut_output::plot::{Axis, Chart, Mark, Series};
use taut_output::table;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Bending compliances \[rad/(N m)].
    pub compliances: Vec<f64>,
    pub particles: Vec<usize>,
    /// Simulated time \[s].
    pub time: f64,
    /// Steps a decade.
    pub per_decade: u32,
}

impl Config {
    /// The whole set, or four compliances, two lengths, 10 s.
    pub fn new(quick: bool) -> Self {
        let all = vec![1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0];
        Self {
            compliances: pick(quick, [all, vec![1e-5, 1e-4, 1e-2, 1.0]]),
            particles: pick(quick, [vec![3, 5, 10, 20], vec![5, 10]]),
            time: pick(quick, [30.0, 10.0]),
            per_decade: pick(quick, [8, 2]),
        }
    }
}

/// How the bending of a chain acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bending {
    None,
    /// As an external force of the state at the beginning of a step.
    Explicit,
    /// As rows with a compliance.
    Rows,
}

impl Bending {
    fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Explicit => "explicit force",
            Self::Rows => "regularised rows",
        }
    }
}

/// Largest stable ratio of a chain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// How its bending acts.
    pub bending: String,
    /// Bending compliance \[rad/(N m)]; none without bending.
    pub compliance: Option<f64>,
    /// Particles, with the load.
    pub particles: usize,
    /// log₁₀ of the largest stable ratio; none where 10 is unstable.
    pub limit_log10: Option<f64>,
}

/// The rows of bending of a chain, to be evaluated at another chain's positions.
struct BendingForces {
    scene: Scene,
    rows: Linearized,
    bends: Vec<usize>,
}

impl BendingForces {
    fn new(row: &Row, particles: usize) -> Result<Self, ExperimentError> {
        let mut params = chain(row, 0.0);
        params.particles = particles;
        let scene = params.build()?;
        let is_bend = |c: &Constraint| matches!(c, Constraint::LinkBend(_));
        let bends = (0..scene.constraints.len()).filter(|&c| is_bend(&scene.constraints[c]));
        Ok(Self {
            rows: Linearized::new(&scene),
            bends: bends.collect(),
            scene,
        })
    }

    /// Puts −Jᵀ φ/ε at the stepper's present state on its bodies.
    fn apply(&mut self, stepper: &mut Stepper) -> Result<(), StepError> {
        let positions = &stepper.scene().bodies.position;
        self.scene.bodies.position.clone_from(positions);
        self.rows.update(&self.scene, 0.0);
        let mut forces = vec![Vector3::zeros(); positions.len()];
        for &bend in &self.bends {
            for slot in self.rows.slot_range(bend) {
                let block = self.rows.block(slot);
                for (row, j) in self.rows.row_range(bend).zip(block.chunks_exact(6)) {
                    let lambda = -self.rows.phi[row] / self.rows.compliance[row];
                    forces[self.rows.slots[slot].body] += Vector3::new(j[0], j[1], j[2]) * lambda;
                }
            }
        }
        for (i, force) in forces.into_iter().enumerate() {
            stepper.set_load(i, force, Vector3::zeros())?;
        }
        Ok(())
    }
}

/// log₁₀ of the least load tried: long chains with next to no load are whips, which the criterion does not forgive.
const LEAST: f64 = 1.0;

/// Largest stable load of a chain with bending of a compliance.
pub fn limit(
    config: &Config,
    bending: Bending,
    compliance: f64,
    particles: usize,
) -> Result<Record, ExperimentError> {
    let model = match bending {
        Bending::Rows => ChainModel::BendVector,
        Bending::None | Bending::Explicit => ChainModel::Links,
    };
    let vector = Row {
        model: ChainModel::BendVector,
        added: compliance,
        ..BENDING
    };
    let row = Row { model, ..vector };
    let found = largest(8, config.per_decade, |ratio| {
        let mut params = chain(&row, LEAST + ratio.log10());
        params.particles = particles;
        let mut forces = match bending {
            Bending::Explicit => Some(BendingForces::new(&vector, particles)?),
            Bending::None | Bending::Rows => None,
        };
        let fate = drop_chain(&params, options(), 0.0, (config.time, BAR), |stepper| {
            forces
                .as_mut()
                .map_or(Ok(()), |forces| forces.apply(stepper))
        })?;
        let failure = Failure {
            time: fate.time,
            reason: format!("violation {:.2}", fate.violation),
        };
        Ok::<_, ExperimentError>((!fate.stable).then_some(failure))
    })?;
    Ok(Record {
        bending: bending.name().to_owned(),
        compliance: (bending != Bending::None).then_some(compliance),
        particles,
        limit_log10: found.stable.map(|ratio| LEAST + ratio.log10()),
    })
}

/// Runs the chains, in parallel: no bending, explicit and regularised bending of each compliance, and both ends of that
/// for each number of particles. `progress` advances once a chain.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Vec<Record>, ExperimentError> {
    let particles = chain(&LINKS, 0.0).particles;
    let mut tasks = vec![(Bending::None, 0.0, particles)];
    for &compliance in &config.compliances {
        tasks.push((Bending::Explicit, compliance, particles));
        tasks.push((Bending::Rows, compliance, particles));
    }
    for &n in config.particles.iter().filter(|n| **n != particles) {
        tasks.push((Bending::None, 0.0, n));
        tasks.push((Bending::Rows, BENDING.added, n));
    }
    each(&tasks, progress, |&(bending, compliance, particles)| {
        limit(config, bending, compliance, particles)
    })
}

fn power(decade: f64) -> String {
    if decade.is_finite() {
        format!("10^{decade:.2}")
    } else {
        "below 10".to_owned()
    }
}

/// log₁₀ of a limit, −∞ where 10 is unstable.
fn decade(record: &Record) -> f64 {
    record.limit_log10.unwrap_or(f64::NEG_INFINITY)
}

/// Largest limit of the records that a test picks.
fn best(records: &[Record], pick: impl Fn(&&Record) -> bool) -> f64 {
    let limits = records.iter().filter(pick).map(decade);
    limits.fold(f64::NEG_INFINITY, f64::max)
}

/// Checks of bending as a force and as rows, and of the chains' length.
pub fn bending_checks(records: &[Record]) -> Vec<Check> {
    let particles = chain(&LINKS, 0.0).particles;
    let of = |bending: Bending| {
        let name = bending.name();
        best(records, |r| r.bending == name && r.particles == particles)
    };
    let (none, explicit, rows) = (of(Bending::None), of(Bending::Explicit), of(Bending::Rows));
    let mut checks = vec![
        Check::claim(
            "bending as an explicit force",
            "does not stabilise",
            format!(
                "{} with the best compliance, {} without bending",
                power(explicit),
                power(none)
            ),
            Verdict::of(explicit < none + 0.25),
            "stiff bending is unstable by itself, soft bending holds no tension; \
             chain (a), 5 particles, 1/60 s",
        ),
        Check::claim(
            "bending as regularised rows",
            "stabilises",
            format!(
                "{} with the best compliance, {} without bending",
                power(rows),
                power(none)
            ),
            Verdict::of(rows > none + 1.0),
            "chain (f); (e) in exactly planar motion only",
        ),
    ];
    let over = |bending: Bending| -> Vec<f64> {
        let same = |r: &&Record| {
            let default = r.compliance.is_none_or(|c| c == BENDING.added);
            r.bending == bending.name() && default
        };
        records.iter().filter(same).map(decade).collect()
    };
    let spread = [Bending::None, Bending::Rows].map(|bending| {
        let limits = over(bending);
        let low = limits.iter().copied().fold(f64::INFINITY, f64::min);
        limits.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low
    });
    let numbers: Vec<usize> = {
        let mut all: Vec<usize> = records.iter().map(|r| r.particles).collect();
        all.sort_unstable();
        all.dedup();
        all
    };
    let weak = spread.map(|s| s < 0.5);
    checks.push(Check::claim(
        "number of links",
        "weak dependence",
        format!("{:.2} decades without bending, {:.2} with", spread[0], spread[1]),
        match weak {
        [true, true] => Verdict::Holds,
        [false, false] => Verdict::DoesNotHold,
        _ => Verdict::HoldsOnlyIf,
        },
        format!(
        "N = {}; the more links, the more of them whip near the limit of the chain without bending",
        numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
        ),
    ));
    checks
}

fn supplementary(records: &[table1::Record]) -> Vec<Check> {
    let limit = |model: &str| {
        let of = records.iter().filter(|r| r.model == model);
        of.map(|r| r.limit_log10).fold(f64::NEG_INFINITY, f64::max)
    };
    let links = limit("a");
    if ["a", "b", "c", "d", "e"]
        .iter()
        .any(|m| !limit(m).is_finite())
    {
        return Vec::new();
    }
    let gain = |model: &str| limit(model) - links;
    let ours = |models: &[&str]| {
        let gains = models.iter().map(|m| format!("({m}) {:+.2}", gain(m)));
        format!("{} decades", gains.collect::<Vec<_>>().join(", "))
    };
    let note = "gain over the chain of links alone, in exactly planar motion";
    vec![
        Check::claim(
            "massless cable besides the chain",
            "does not stabilise",
            ours(&["b", "d"]),
            Verdict::of(gain("b").max(gain("d")) < 0.5),
            note,
        ),
        Check::claim(
            "load enforcement, bending",
            "stabilise",
            ours(&["c", "e"]),
            Verdict::of(gain("c").min(gain("e")) > 1.0),
            note,
        ),
    ]
}

/// Checks by the times of a step.
fn cost(records: &[timing::Record], config: &timing::Config) -> Vec<Check> {
    let sweeps = config.sweeps[0];
    let of = |r: &&timing::Record| r.sweeps == sweeps;
    let line = records
        .iter()
        .filter(of)
        .filter(|r| r.ratio == config.ratio);
    let points: Vec<[f64; 2]> = line.map(|r| [r.elements as f64, r.least]).collect();
    let exponent = timing::exponent(&points);
    let loaded = records
        .iter()
        .filter(of)
        .filter(|r| r.elements == config.loaded);
    let times: Vec<f64> = loaded.map(|r| r.least).collect();
    let least = times.iter().copied().fold(f64::INFINITY, f64::min);
    let most = times.iter().copied().fold(0.0, f64::max);
    let elements = |i: Option<&usize>| i.copied().unwrap_or_default();
    vec![
        Check::number(
            "cost over the number of elements",
            [1.0, exponent],
            "",
            Measure::Absolute,
            0.1,
        )
        .published()
        .by("difference of the log–log exponent of the least times from 1")
        .noting(format!(
            "{} to {} elements, {sweeps} iterations",
            elements(config.elements.first()),
            elements(config.elements.last())
        )),
        Check::within(
            "cost over the load",
            "independent",
            format!("{:.1} % between mass ratios", 100.0 * (most / least - 1.0)),
            most / least - 1.0,
            0.25,
        )
        .published()
        .by("largest of the least times over the smallest, less 1")
        .noting(format!(
            "{} elements, {sweeps} iterations, mass ratios 10 to 10⁵",
            config.loaded
        )),
    ]
}

fn text(records: &[Record]) -> String {
    let t = table::of_records(
        records,
        &[
            ("bending", &|r| r.bending.clone()),
            ("ε rad/(N m)", &|r| {
                r.compliance
                    .map_or_else(String::new, |c| format!("{c:.0e}"))
            }),
            ("particles", &|r| r.particles.to_string()),
            ("largest stable ratio", &|r| power(decade(r))),
        ],
    );
    t + "\n"
}

fn chart(records: &[Record]) -> Chart {
    let particles = chain(&LINKS, 0.0).particles;
    let series = [Bending::Explicit, Bending::Rows].map(|bending| {
        let of = |r: &&Record| r.bending == bending.name() && r.particles == particles;
        let point = |r: &Record| Some([r.compliance?, 10.0_f64.powf(decade(r).max(0.0))]);
        let points = records.iter().filter(of).filter_map(point).collect();
        Series::new(bending.name(), points, Mark::LineAndPoints)
    });
    let none = best(records, |r| {
        r.compliance.is_none() && r.particles == particles
    });
    let ends = series[0].points.first().zip(series[0].points.last());
    let level = ends.map(|(a, b)| vec![[a[0], 10.0_f64.powf(none)], [b[0], 10.0_f64.powf(none)]]);
    let mut series = series.to_vec();
    series.push(Series::new(
        "no bending",
        level.unwrap_or_default(),
        Mark::Line,
    ));
    Chart {
        title: "bending as a force and as rows, chain of 5 particles".to_owned(),
        x: Axis::log("bending compliance (rad/(N m))"),
        y: Axis::log("largest stable load/particle mass ratio (1: below 10)"),
        series,
    }
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let (config, timed) = (Config::new(quick), timing::Config::new(true));
    let rows = match quick {
        true => vec![table2::ROWS[7], table2::ROWS[9]],
        false => table2::ROWS.to_vec(),
    };
    // Times first, while nothing else runs.
    let times = timing::run(&timed, progress)?;
    let table1_config = table1::Config {
        rows: [0, 1, 2, 5, 6].map(|i| ROWS[i]).to_vec(),
        noises: vec![0.0],
        ..table1::Config::new(quick)
    };
    progress.reset();
    let chains = table1::run(&table1_config, progress)?;
    progress.reset();
    let swept = table2::run(&table2::sweeps_only(&rows), progress)?;
    progress.reset();
    let records = run(&config, progress)?;
    let mut checks = bending_checks(&records);
    checks.extend(supplementary(&chains));
    let iterations = [(3, 3.0), (20, 5.0)];
    checks.extend(
        iterations
            .into_iter()
            .filter_map(|(n, decade)| table2::enough(&swept, n, decade)),
    );
    checks.extend(cost(&times, &timed));
    Ok(Outcome {
        checks,
        text: text(&records),
        csv: csv(&records)?,
        charts: vec![chart(&records)],
        ..Outcome::default()
    })
}
