//! The estimate of the load's error ([`StepOptions::estimate`]) against the error.

use crate::study::question::*;
use nalgebra::Vector3;
use std::fmt::Write;
use std::time::Instant;
use taut_integrator::{ErrorEstimate, StepOptions, Stepper};
use taut_measure::inputs::Inputs;
use taut_measure::lean::Leaner;
use taut_measure::trajectory::{load_position, steps_in};
use taut_model::{SceneError, SceneSource};

pub(crate) const STUDY: Study = Study {
    name: "estimate",
    question: question!("estimate", &[]),
    run: |matches, reporter| study(Asked::read(matches).quick, reporter.cases),
    ..study::PLAIN
};

/// Sub-steps of the reference.
const FINE: usize = 8;

/// Within which factor of the error an estimate is right, and the least part of it that it may be.
const FACTOR: f64 = 3.0;
const LEAST: f64 = 0.1;

/// Part of the load's way beyond which nothing is asked.
const PARTED: f64 = 0.1;

struct Config {
    /// Mass ratios, or masses of the load, as scene parameters.
    ratios: &'static [&'static str],
    /// Steps that one of the coarse run covers.
    every: &'static [usize],
    /// Simulated time \[s].
    time: f64,
    /// Runs whose times are compared.
    repeats: usize,
}

impl Config {
    fn new(quick: bool) -> Self {
        Self {
            ratios: pick(quick, [&["10", "1e3", "1e5"], &["1e3"]]),
            every: pick(quick, [&[2, 4, 8], &[2]]),
            time: pick(quick, [10.0, 2.0]),
            repeats: pick(quick, [7, 3]),
        }
    }
}

/// Runs all cases, in parallel, then those of the times.
fn study(quick: bool, cases: &Cases) -> Result<Found, ExperimentError> {
    let config = Config::new(quick);
    let all = config.ratios.iter().flat_map(|ratio| scenes(ratio));
    let all: Vec<Case> = all.collect();
    let estimates = cases.parallel("estimates", &all, |case| rows(case, &config))?;
    let timed = STUDY.question().pairs("timed");
    let timed: Vec<Case> = timed
        .map(|(scene, text)| Case(scene, text.to_owned()))
        .collect();
    let costs = cases.in_turn("costs", &timed, |case| costs(case, &config))?;
    let estimates = estimates.all()?.concat();
    let (verdict, missed) = verdict(&estimates, &config);
    let rows = json!({ "estimates": estimates, "costs": costs.all()?.concat() });
    Ok(Found {
        settings: set([
            (
                "coarse runs",
                format!("{} steps a step", counts(config.every)),
            ),
            ("references", format!("{FINE} sub-steps")),
            ("simulated", seconds(config.time)),
        ]),
        text: format!("{}\n{verdict}", STUDY.tables(&rows)),
        rows,
        missed,
        ..Found::default()
    })
}

/// Table of inputs of the gantries.
const DRIVE: &str = "time,trolley_speed,hoist_speed\n0,0,0\n1,0.5,0.1\n4,0.5,0.1\n5,0,0\n";

/// A scene with its parameters.
#[derive(Debug)]
struct Case(&'static str, String);

impl Case {
    fn name(&self) -> String {
        let driven = if self.0 == "gantry" { " driven" } else { "" };
        format!("{}{driven} {}", self.0, self.1)
    }

    fn source(&self) -> Result<SceneSource, SceneError> {
        let pairs = self.1.split(' ').filter_map(|text| text.split_once('='));
        SceneSource::load(self.0, &pairs.collect::<Vec<_>>())
    }
}

/// The scenes of the question with a ratio, but for those without a reference: the equilibrium of a ring is not found at 10⁵, and a pile's
/// fine steps take hours.
fn scenes(ratio: &str) -> impl Iterator<Item = Case> {
    let known = |case: &Case| !["ring", "pile"].contains(&case.0) || !case.1.contains("1e5");
    let scenes = STUDY.question().pairs("scenes");
    let of = |(scene, text): (_, &str)| Case(scene, text.replace("{}", ratio));
    scenes.map(of).filter(known)
}

/// A run, as far as it is compared.
struct Run {
    path: Vec<Vector3<f64>>,
    error: ErrorEstimate,
    seconds: f64,
}

fn once(
    source: &SceneSource,
    substeps: usize,
    estimate: Option<usize>,
    time: f64,
) -> Result<Run, ExperimentError> {
    let scene = source.build()?;
    let inputs = match source {
        SceneSource::Gantry(_) => Inputs::parse(DRIVE, &scene)?,
        _ => Inputs::default(),
    };
    let options = StepOptions {
        substeps,
        estimate,
        ..StepOptions::default()
    };
    let steps = steps_in(time, options.dt);
    let mut stepper = Stepper::new(scene, options)?;
    let mut path = Vec::with_capacity(steps);
    let mut error = ErrorEstimate::default();
    let begun = Instant::now();
    let failure = motions::follow(&mut stepper, &inputs, steps, |stepper, report| {
        path.push(load_position(stepper.scene()));
        error = report.error.unwrap_or(error);
        Ok(())
    });
    let seconds = begun.elapsed().as_secs_f64();
    match failure {
        Some(failure) => Err(failure.reason.into()),
        None => Ok(Run {
            path,
            error,
            seconds,
        }),
    }
}

/// Estimates and errors \[mm].
fn rows(case: &Case, config: &Config) -> Result<Vec<Value>, ExperimentError> {
    let source = case.source()?;
    // Loads of capstans fall.
    let time = match case.0 {
        "capstan" => config.time.min(1.0),
        _ => config.time,
    };
    let fine = once(&source, FINE, None, time)?;
    let finer = source.with_segments(2.0)?;
    let finer = finer.map(|source| once(&source, FINE, None, time));
    let finer = finer.transpose()?;
    let apart = |a: &Run, b: &Run| 1e3 * motions::apart(&a.path, &b.path);
    let of = |&every: &usize| {
        let run = once(&source, 1, Some(every), time)?;
        let box_of = |[low, high]: [Vector3<f64>; 2], x: &Vector3<f64>| [low.inf(x), high.sup(x)];
        let [low, high] = run.path.iter().fold([run.path[0]; 2], box_of);
        let extent_mm = 1e3 * (high - low).norm();
        let error_mm = apart(&run, &fine);
        let estimate_mm = (!run.error.lost).then_some(1e3 * run.error.time);
        Ok(json!({
            "scene": case.name(),
            "every": every,
            "extent_mm": extent_mm,
            "error_mm": error_mm,
            // `null` where the coarse run was lost.
            "estimate_mm": estimate_mm,
            "of_error": estimate_mm.map(|estimate| estimate / error_mm),
            "algebra_mm": 1e3 * run.error.algebra,
            // The distance of twice as many segments, `null` where their number is not a parameter.
            "segments_error_mm": finer.as_ref().map(|finer| apart(&fine, finer)),
            "segments_mm": 1e3 * run.error.segments,
            "parted": error_mm > PARTED * extent_mm,
        }))
    };
    config.every.iter().map(of).collect()
}

/// The times of runs with coarse runs over those without, in turns: the medians.
fn costs(case: &Case, config: &Config) -> Result<Vec<Value>, ExperimentError> {
    let source = case.source()?;
    let of = |&every: &usize| {
        let ratio = |_| {
            let runs = [Some(every), None].map(|every| once(&source, 1, every, config.time));
            let [with, without] = runs;
            Ok(with?.seconds / without?.seconds)
        };
        let ratios = (0..config.repeats).map(ratio);
        let mut ratios = ratios.collect::<Result<Vec<f64>, ExperimentError>>()?;
        ratios.sort_by(f64::total_cmp);
        let cost = ratios[ratios.len() / 2];
        Ok(json!({ "scene": case.name(), "every": every, "cost": cost }))
    };
    config.every.iter().map(of).collect()
}

/// For the estimates of one coarse run: their number, the number within the factor, and the least
/// estimate over its error.
fn score(rows: &[Value], every: usize) -> (usize, usize, f64) {
    let judged = rows
        .iter()
        .filter(|row| row["every"] == every && row["parted"] == false);
    let parts: Vec<f64> = judged
        .map(|row| row["of_error"].as_f64().unwrap_or(0.0))
        .collect();
    let right = |part: &&f64| (1.0 / FACTOR..=FACTOR).contains(*part);
    let least = parts.iter().copied().fold(f64::INFINITY, f64::min);
    (parts.len(), parts.iter().filter(right).count(), least)
}

/// How many estimates are right, and what the coarse run of two steps misses.
fn verdict(estimates: &[Value], config: &Config) -> (String, Option<String>) {
    let mut text = String::new();
    let mut missed = None;
    for &every in config.every {
        let (all, right, least) = score(estimates, every);
        let part = 100.0 * right as f64 / all.max(1) as f64;
        let _ = writeln!(
            text,
            "coarse run of {every} steps: {right} of {all} estimates ({part:.0} %) within a factor {FACTOR} of the error, the least {least:.2} of it"
        );
        if every == config.every[0] && (part < 90.0 || least < LEAST) {
            missed = Some(format!(
                "{part:.0} % of the estimates are right, the least is {least:.2} of its error"
            ));
        }
    }
    (text, missed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_driven_hoist_is_estimated() {
        let text = "segments=6 mass_ratio=1e3 equilibrium=true move_x=1";
        let case = Case("hoist", text.to_owned());
        let config = Config {
            time: 4.0,
            ..Config::new(true)
        };
        let rows = rows(&case, &config).expect("runs");
        let part = rows[0]["of_error"].as_f64().expect("an estimate");
        assert!((0.5..=2.0).contains(&part), "{rows:?}");
        assert_eq!(score(&rows, 2).1, 1);
    }
}
