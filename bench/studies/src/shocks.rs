//! Shocks: kicks, jerks, drops. What becomes of a cable that something violent happens to, for each setting of the step.

mod run;
mod scene;

use crate::study::question::*;
use rayon::prelude::*;
use run::{Run, initial_energy, measure, times};
use scene::{FRAME, SEGMENTS, Shock, scene};
use taut_integrator::{Guard, Scheme, StepError, StepOptions};
use taut_measure::cache;
use taut_solver::Backend;

pub(crate) const STUDY: Study = Study {
    name: "shocks",
    question: question!("shocks", FUNCTIONS),
    run: |matches, reporter| study(&Asked::read(matches), reporter.cases),
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[
    ("verdict", Text(verdict)),
    ("gain", Text(gain)),
    ("fails", Holds(fails)),
];

fn study(asked: &Asked, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = Config::new(asked.quick);
    asked.ratios(&mut config.ratios)?;
    let needs = "the shocks need at least 1 s";
    asked.time(&mut config.time, FRAME, 60, needs)?;
    let rows = run(&config, cases)?;
    Ok(Found {
        settings: set([
            ("shocks", list(&config.shocks, ToString::to_string)),
            ("steps", list(&config.settings, |s| s.0.to_owned())),
            ("load/segment", numbers(&config.ratios)),
            ("lengths", format!("{} m", numbers(&config.lengths))),
            ("Δt", step(FRAME)),
            ("simulated", seconds(config.time)),
            (
                "references",
                format!("{} steps a frame", counts(&config.fineness)),
            ),
            ("timed", format!("{REPEATS} times")),
        ]),
        text: text(&rows, &config),
        rows,
        ..Found::default()
    })
}

/// Largest gain of energy, over the largest kinetic energy of the reference, that counts as none.
const GAIN: f64 = 0.01;

/// Largest error of the load's position, over the cable's length, in the right swing.
const SWING: f64 = 0.01;

/// The elongation may be larger than the reference's by this factor …
const STRETCH: f64 = 1.05;

/// … and by this part of the cable's length.
const SLACK: f64 = 1e-3;

/// Runs of which the fastest counts for the time of a step.
const REPEATS: usize = 3;

struct Config {
    /// The steps of the first are timed, and its outcomes listed one by one.
    settings: Vec<Setting>,
    shocks: Vec<Shock>,
    ratios: Vec<f64>,
    /// Lengths of the cable \[m].
    lengths: Vec<f64>,
    /// Simulated time \[s].
    time: f64,
    /// Steps a frame of the two reference motions, the finer one last.
    fineness: [usize; 2],
}

impl Config {
    fn new(quick: bool) -> Self {
        Self {
            settings: pick(quick, [settings(), few()]),
            shocks: Shock::ALL.to_vec(),
            ratios: pick(quick, [vec![1e2, 1e3, 1e4, 1e5, 1e6], vec![1e3, 1e5]]),
            lengths: pick(quick, [vec![10.0, 1.0], vec![10.0]]),
            time: pick(quick, [10.0, 5.0]),
            fineness: pick(quick, [[128, 256], [16, 32]]),
        }
    }
}

type Setting = (&'static str, StepOptions);

/// A change of the guard under a name.
type Tuned = (&'static str, fn(&mut Guard));

/// The default, which is guarded and takes third differences, the default without its guard, and the paper's step.
fn few() -> Vec<Setting> {
    let default = StepOptions::default();
    let unguarded = StepOptions {
        guard: None,
        ..default.clone()
    };
    vec![
        ("default", default),
        ("default, no guard", unguarded),
        ("paper", StepOptions::paper()),
    ]
}

/// The few, other schemes with and without guard, other guards.
fn settings() -> Vec<Setting> {
    let third = |a, gamma| Scheme::ThirdDifference { a, gamma };
    let (spook, implicit) = (Scheme::Spook, Scheme::LinearlyImplicit);
    let schemes = [
        ("weights 0.75, -0.2", third(0.75, -0.2), true),
        ("weights 0.3, -0.02", third(0.3, -0.02), true),
        ("spook", spook, true),
        ("spook, no guard", spook, false),
        ("implicit", implicit, true),
        ("implicit, no guard", implicit, false),
    ];
    let guards: [Tuned; 6] = [
        ("guard tolerance 0.001", |g| g.tolerance = 0.001),
        ("guard tolerance 0.02", |g| g.tolerance = 0.02),
        ("guard substeps 4", |g| g.substeps = 4),
        ("guard halvings 2", |g| g.halvings = 2),
        ("guard hold 0", |g| g.hold = 0),
        ("guard hold 8", |g| g.hold = 8),
    ];
    let schemes = schemes.map(|(name, scheme, guarded)| {
        let alpha = scheme.default_alpha();
        (name, motions::step(scheme, alpha, FRAME, guarded))
    });
    let guards = guards.map(|(name, change)| {
        let mut options = StepOptions::default();
        options.guard.as_mut().into_iter().for_each(change);
        (name, options)
    });
    few().into_iter().chain(schemes).chain(guards).collect()
}

/// A shock with its mass ratio and the cable's length \[m].
type Case = (Shock, f64, f64);

/// Runs every setting through every shock, in parallel, then times the first setting's steps alone. A shock with its ratio and
/// length is a case, with its reference and all its settings.
fn run(config: &Config, cases: &Cases) -> Result<Value, ExperimentError> {
    let mut shocks: Vec<Case> = Vec::new();
    for &length in &config.lengths {
        for &shock in &config.shocks {
            shocks.extend(config.ratios.iter().map(|&ratio| (shock, ratio, length)));
        }
    }
    let parts = cases.parallel("shocks", &shocks, |&case| outcomes(config, case))?;
    let timings = cases.in_turn("timing", &shocks, |&case| {
        let timing = times(case, &config.settings[0].1, config.time, REPEATS)?;
        Ok::<_, StepError>([timing.max, timing.median])
    })?;
    let mut parts = parts.all()?;
    for (part, [max, median]) in parts.iter_mut().zip(timings.all()?) {
        part[0]["worst_step_ns"] = json!(max);
        part[0]["median_step_ns"] = json!(median);
    }
    let of = |setting: usize| parts.iter().map(move |part| part[setting].clone());
    let outcomes: Vec<Value> = (0..config.settings.len()).flat_map(of).collect();
    Ok(json!({ "time": config.time, "fineness": config.fineness, "outcomes": outcomes }))
}

fn outcomes(config: &Config, case: Case) -> Result<Vec<Value>, ExperimentError> {
    let [coarser, finer] = config.fineness;
    let fine_run = |substeps| fine_run(config.time, case, substeps);
    let (coarser, finer) = rayon::join(|| fine_run(coarser), || fine_run(finer));
    let reference = Reference::new(case, &coarser?, finer?)?;
    let settings = config.settings.par_iter().map(|(name, options)| {
        let run = measure(case, options, config.time)?;
        outcome(name, case, &run, &reference)
    });
    settings.collect()
}

fn fine_run(time: f64, case: Case, substeps: usize) -> Result<Run, StepError> {
    // Steps and not sub-steps, so that every one of them is seen.
    let options = StepOptions {
        dt: FRAME / substeps as f64,
        ..StepOptions::default()
    };
    // Which direct solver it was does not matter; the rest does.
    let defining = StepOptions {
        backend: Backend::Banded,
        ..options.clone()
    };
    let (shock, ratio, length) = case;
    let (scene, shock_end) = (scene(shock, ratio, length)?, shock.end());
    let key = format!("shock {time} {shock_end} {defining:?} {scene:?}");
    cache::cached(&key, || measure(case, &options, time))
}

/// The fine motion that runs are judged by.
struct Reference {
    /// The finer of two.
    run: Run,
    /// Distance between the two ends of the load: what is not known of it \[m]. Infinite where one of them failed.
    uncertainty: f64,
    /// Total energy that the motion starts with \[J]: of the scene; of the reference after a jerk, whose work is not
    /// known beforehand.
    start_energy: f64,
    /// Largest gap of a joint at rest \[m].
    equilibrium_gap: f64,
}

impl Reference {
    fn new((shock, ratio, length): Case, coarser: &Run, run: Run) -> Result<Self, StepError> {
        let failed = coarser.failure.is_some() || run.failure.is_some();
        Ok(Self {
            uncertainty: if failed {
                f64::INFINITY
            } else {
                run.distance(coarser)
            },
            start_energy: match shock {
                Shock::Jerk => run.first_energy,
                _ => initial_energy(&scene(shock, ratio, length)?),
            },
            equilibrium_gap: shock.equilibrium_gap(ratio, length)?,
            run,
        })
    }
}

/// A setting's run through one shock, against the reference, with the four verdicts.
fn outcome(
    setting: &str,
    (shock, ratio, length): Case,
    run: &Run,
    reference: &Reference,
) -> Result<Value, ExperimentError> {
    let finite = run.failure.is_none();
    let scale_j = reference.run.peak_kinetic;
    let gain = (run.peak_energy - reference.start_energy) / scale_j;
    let error_m = run.distance(&reference.run);
    let elongation_bar_m = STRETCH * reference.run.swing_elongation + SLACK * length;
    let bar = (SWING * length).max(3.0 * reference.uncertainty);
    let swing = match () {
        () if reference.uncertainty > SWING * length => "chaotic",
        () if finite && error_m <= bar => "right",
        () => "wrong",
    };
    let case = json!({
        "setting": setting,
        "shock": shock.to_string(),
        "ratio": ratio,
        "length": length,
    });
    let verdicts = json!({
        "error_m": error_m,
        "uncertainty_m": reference.uncertainty,
        // Largest energy after the shock less that which the motion started with, over `scale_j`.
        "gain": gain,
        "scale_j": scale_j,
        "elongation_bar_m": elongation_bar_m,
        // Largest gap of the last second less the largest at rest, over a segment's length.
        "excess_gap": (run.gap - reference.equilibrium_gap) / (length / SEGMENTS as f64),
        "finite": finite,
        "keeps_length": finite && run.elongation <= elongation_bar_m,
        "no_gain": finite && gain <= GAIN,
        "swing": swing,
        "worst_step_ns": null,
        "median_step_ns": null,
    });
    Ok(joined([case, data(run)?, verdicts]))
}

/// True if the run is finite, keeps its length and gains no energy.
fn survives(row: &Row) -> bool {
    ["finite", "keeps_length", "no_gain"]
        .iter()
        .all(|key| is(row, key))
}

/// True if a verdict is bad. A chaotic swing is not.
fn fails(row: &Row) -> bool {
    !survives(row) || text_of(row, "swing") == "wrong"
}

/// A row for each setting, then the first setting's outcomes one by one, then its failures. At most 120 columns.
fn text(data: &Value, config: &Config) -> String {
    let rows = rows_of(data, "outcomes");
    let settings: Vec<&[Row]> = rows.chunk_by(|a, b| a["setting"] == b["setting"]).collect();
    let Some(first) = settings.first() else {
        return String::new();
    };
    let failures = STUDY.sheet("failures").of(first);
    let summaries: Vec<Value> = settings.iter().map(|runs| summary(runs)).collect();
    format!(
        "{} runs of {} s at Δt = 1/60 s for each setting, against the default scheme at Δt/{} (± what Δt/{} differs \
         from it)\n\n{}\n\
         length: elongation in the last second ≤ {STRETCH} × the reference's + {SLACK:.0e} L; energy: gained ≤ {} % of\nits \
         largest kinetic energy; swing: the load ends within {SWING} L, or 3 × ±, of the reference; chaotic: all but\nthe \
         swing, where ± exceeds {SWING} L; redone: steps; sub: implicit sub-steps, unconv.: not converged; solves: all\n\
         (above: a step); most: of a step; worst: step; gap: largest of the last second less that at rest, over a segment\n\n\
         Setting `{}`\n{}{}",
        first.len(),
        config.time,
        config.fineness[1],
        config.fineness[0],
        STUDY.sheet("summary").of(&summaries),
        100.0 * GAIN,
        text_of(&first[0], "setting"),
        STUDY.question().sheets[0].of(&json!({ "outcomes": first })),
        if failures.is_empty() {
            "\nNo failure.\n"
        } else {
            &failures
        }
    )
}

/// How many runs of a setting pass what, and what they cost together.
fn summary(runs: &[Row]) -> Value {
    let count = |of: &dyn Fn(&Row) -> bool| runs.iter().filter(|r| of(r)).count();
    let values = |key| runs.iter().filter_map(move |r| number_of(r, key));
    let sum = |key| values(key).sum::<f64>();
    let swings = |row: &Row, swing| text_of(row, "swing") == swing;
    json!({
        "setting": runs[0]["setting"],
        "finite": count(&|r| is(r, "finite")),
        "length": count(&|r| is(r, "keeps_length")),
        "energy": count(&|r| is(r, "no_gain")),
        "swing": count(&|r| swings(r, "right")),
        "passes": count(&|r| survives(r) && swings(r, "right")),
        "chaotic": count(&|r| survives(r) && swings(r, "chaotic")),
        "fails": count(&fails),
        "redone": sum("redone"),
        "unconverged": sum("unconverged_substeps"),
        "solves": sum("solves") / sum("steps").max(1.0),
        "most": values("max_solves").fold(0.0, f64::max),
        "worst_step_ns": values("worst_step_ns").fold(f64::NAN, f64::max),
    })
}

fn verdict(row: &Row) -> String {
    if !is(row, "finite") {
        return "ENDS".to_owned();
    }
    let swing = text_of(row, "swing");
    let faults = [
        (!is(row, "keeps_length"), "LENGTH"),
        (!is(row, "no_gain"), "ENERGY"),
        (swing == "wrong", "SWING"),
        (swing == "chaotic", "chaotic"),
    ];
    let faults = faults.iter().filter(|(bad, _)| *bad).map(|(_, name)| *name);
    let faults: Vec<&str> = faults.collect();
    if faults.is_empty() {
        "pass".to_owned()
    } else {
        faults.join(" ")
    }
}

fn gain(row: &Row) -> String {
    number_of(row, "gain").map_or("-".to_owned(), percent)
}

fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    if percent.abs() < 1000.0 {
        format!("{percent:+.2} %")
    } else {
        format!("{percent:+.0e} %")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_measure::trajectory::Failure;

    fn judge(uncertainty: f64, change: impl FnOnce(&mut Run)) -> Row {
        let reference = Reference {
            run: Run {
                peak_kinetic: 100.0,
                swing_elongation: 1.0,
                ..Run::default()
            },
            uncertainty,
            start_energy: -50.0,
            equilibrium_gap: 0.0,
        };
        let mut run = Run {
            peak_energy: -50.0,
            ..Run::default()
        };
        change(&mut run);
        let row = outcome("", (Shock::Drop, 1e3, 10.0), &run, &reference).unwrap();
        row.as_object().unwrap().clone()
    }

    #[test]
    fn each_verdict_has_its_bar() {
        assert!(!fails(&judge(0.0, |_| ())));
        let gains = |joules| judge(0.0, |r| r.peak_energy += joules);
        assert!(is(&gains(0.99), "no_gain") && !is(&gains(1.01), "no_gain"));
        assert!(fails(&gains(1.01)));
        let longer = |metres| is(&judge(0.0, |r| r.elongation = metres), "keeps_length");
        assert!(longer(1.059) && !longer(1.061));
        let swing = |uncertainty, error| {
            let row = judge(uncertainty, |r| r.load[0] = error);
            text_of(&row, "swing").to_owned()
        };
        assert_eq!(swing(0.0, 0.099), "right");
        assert_eq!(swing(0.0, 0.101), "wrong");
        assert_eq!(swing(0.05, 0.149), "right");
        assert_eq!(swing(0.05, 0.151), "wrong");
        assert_eq!(swing(0.11, 0.0), "chaotic");
        let (time, reason) = (1.0, String::new());
        let ends = judge(0.0, |r| r.failure = Some(Failure { time, reason }));
        assert!(
            ["finite", "keeps_length", "no_gain"]
                .iter()
                .all(|key| !is(&ends, key))
        );
        assert_eq!(text_of(&ends, "swing"), "wrong");
    }

    #[test]
    fn the_table_fits_and_tells_of_failures() {
        let config = Config {
            settings: few(),
            shocks: vec![Shock::Kick { speed: 20.0 }, Shock::Drop],
            ratios: vec![1e2, 1e6],
            time: 0.2,
            fineness: [1, 2],
            ..Config::new(false)
        };
        let data = run(&config, &Cases::default()).unwrap();
        let rows = rows_of(&data, "outcomes");
        assert_eq!(rows.len(), 3 * 8);
        let shown = taut_output::table::plain(&text(&data, &config));
        let widest = shown.lines().map(|l| l.chars().count()).max();
        assert!(widest <= Some(120), "{widest:?}\n{shown}");
        let failures = rows[..8].iter().filter(|r| fails(r)).count();
        assert_eq!(shown.contains("\nFailures"), failures > 0, "{shown}");
        let is_timed = |row: &Row| number_of(row, "worst_step_ns").is_some();
        assert!(rows[..8].iter().all(is_timed));
        assert_eq!(text(&json!({}), &config), "");
    }

    #[test]
    fn numbers_are_short() {
        let found = [0.1234, -2.0, 1e3].map(percent);
        assert_eq!(found, ["+12.34 %", "-200.00 %", "+1e5 %"]);
    }
}
