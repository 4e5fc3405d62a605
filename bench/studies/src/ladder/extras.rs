//! Measurements of the main job beside its rows: the times of single steps, and patterns.

use super::{Config, OwnScene};
use crate::cases::Cases;
use crate::systems::failed;
use serde::{Deserialize, Serialize};
use std::time::Instant;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_measure::inputs::Inputs;
use taut_measure::reference;
use taut_measure::trajectory::steps_in;
use taut_model::{HoistParams, Network, NetworkParams, Scene};
use taut_output::check::ExperimentError;
use taut_solver::BlockPattern;

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Extras {
    /// Times of the single steps of a run of the first scene.
    pub trace: Trace,
    /// Patterns of S and of its factor, of each scene.
    pub patterns: Vec<Pattern>,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Trace {
    /// The scene and the solver.
    pub title: String,
    /// Δt \[s].
    pub dt: f64,
    /// One time a step \[ns].
    pub step_ns: Vec<f64>,
}

impl Trace {
    /// The time that a share of the steps keeps \[ns].
    pub fn quantile(&self, share: f64) -> f64 {
        let mut sorted = self.step_ns.clone();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().saturating_sub(1);
        let at = (share * last as f64).round() as usize;
        sorted.get(at).copied().unwrap_or(f64::NAN)
    }

    /// The median, what 95 and 99 of 100 steps keep, and the longest \[ns].
    pub fn quantiles(&self) -> [(&'static str, f64); 4] {
        let shares = [("p50", 0.5), ("p95", 0.95), ("p99", 0.99), ("max", 1.0)];
        shares.map(|(name, share)| (name, self.quantile(share)))
    }
}

/// Where a symmetric matrix and its factor have blocks; lower triangles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pattern {
    /// The scene and the order.
    pub title: String,
    pub blocks: usize,
    /// (row, column) of the matrix's blocks.
    pub matrix: Vec<[usize; 2]>,
    /// (row, column) of the further blocks of the factor.
    pub fill: Vec<[usize; 2]>,
}

/// Measures them on the scenes of the user's own, else on a hoist, with the patterns of a ring and a net besides.
pub(super) fn measure(config: &Config, cases: &Cases) -> Result<Extras, ExperimentError> {
    let (scenes, time) = match &config.own[..] {
        [] => (hoist_and_networks()?, config.stability_time),
        own => (own.to_vec(), config.time),
    };
    let names: Vec<&str> = scenes.iter().map(|own| own.name.as_str()).collect();
    let measured = cases.in_turn("plots", &names[..1], |_| {
        let patterns = scenes.iter();
        let patterns = patterns.map(|own| pattern(&own.name, own.scene.clone()));
        Ok::<_, StepError>(Extras {
            trace: trace(&scenes[0], time)?,
            patterns: patterns.collect::<Result<_, _>>()?,
        })
    })?;
    Ok(measured.all()?.remove(0))
}

fn hoist_and_networks() -> Result<Vec<OwnScene>, StepError> {
    let hoist = HoistParams {
        segments: 24,
        mass_ratio: 1e3,
        seed: 1,
        move_x: 0.5,
        move_duration: 1.5,
        ..HoistParams::default()
    };
    let network = |network, segments| {
        let params = NetworkParams {
            segments,
            ..NetworkParams::new(network)
        };
        params.build()
    };
    let scenes = [
        (
            "hoist of 24 segments, load 10³ segments",
            reference::scene(&hoist)?,
        ),
        ("ring of 24 segments", network(Network::Ring, 24)?),
        ("net of 6 × 6 nodes", network(Network::Net, 6)?),
    ];
    let own = scenes.map(|(name, scene)| OwnScene {
        name: name.to_owned(),
        scene,
        inputs: Inputs::default(),
    });
    Ok(own.to_vec())
}

/// The steps of a scene with the default solver.
fn trace(own: &OwnScene, time: f64) -> Result<Trace, StepError> {
    let options = StepOptions::default();
    let (title, dt) = (
        format!("{}, solver {}", own.name, options.backend),
        options.dt,
    );
    let mut stepper = Stepper::new(own.scene.clone(), options)?;
    let mut step_ns = Vec::new();
    for _ in 0..steps_in(time, dt) {
        own.inputs.apply(&mut stepper)?;
        let start = Instant::now();
        // Where the run is lost the rows say why.
        if stepper.step().is_err() {
            break;
        }
        step_ns.push(start.elapsed().as_nanos() as f64);
    }
    Ok(Trace { title, dt, step_ns })
}

/// Where S and its factor have blocks at the start of a scene.
fn pattern(name: &str, scene: Scene) -> Result<Pattern, StepError> {
    let mut stepper = Stepper::new(scene, StepOptions::default())?;
    stepper.solve()?;
    let order = stepper.elimination().taken;
    let p = stepper.system().0.pattern();
    let blocks = |p: &BlockPattern| -> Vec<[usize; 2]> {
        let columns = 0..p.blocks();
        let of = |j| p.column(j).map(move |k| [p.row(k), j]);
        columns.flat_map(of).collect()
    };
    let matrix = blocks(p);
    let factor = taut_solver::factor_pattern(p).map_err(failed)?;
    let mut fill = blocks(&factor);
    fill.retain(|at| !matrix.contains(at));
    Ok(Pattern {
        title: format!("{name}, order {order}"),
        blocks: p.blocks(),
        matrix,
        fill,
    })
}
