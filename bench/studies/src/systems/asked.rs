//! Questions as files: the systems of which scenes, which solvers, with which limits and refinements, or to which errors.

use super::{Asking, SolveRow, Start, State, StudyResult, collected};
use crate::options::choice;
use crate::study::Reporter;
use crate::study::question::*;
use clap::ArgMatches;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;
use taut_measure::choice::{Choice, Omission};
use taut_measure::files::read_text;
use taut_measure::reference::reference_choice;
use taut_measure::source::{built, is_file};

/// Most systems of a file, refinements, steps and iterations.
const MOST: [usize; 4] = [10_000, 100, 100_000, 10_000_000];

const NAMES: &str =
    "`on` must name scenes, as `on = [{ scenes = [\"net\"] }]`, and each key of `set` have values";
const MANY: &str = "at most 10000 systems: take fewer values of `set`";
const COUNTS: &str = "`refinements` must be numbers from 0 to 100";
const TARGETS: &str = "`targets` must be positive errors";
const LIMITS: &str =
    "`iterations` must be numbers from 1 to 10000000, and no name of `backends` holds them";

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct File {
    on: Vec<Group>,
    x: String,
    after: usize,
    dt: f64,
    backends: Vec<String>,
    iterations: Vec<usize>,
    refinements: Vec<usize>,
    targets: Vec<f64>,
    starts: Vec<Start>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Group {
    scenes: Vec<String>,
    #[serde(default)]
    set: BTreeMap<String, Vec<Value>>,
}

impl Default for File {
    fn default() -> Self {
        Self {
            on: Vec::new(),
            x: String::new(),
            after: 0,
            dt: 1.0 / 60.0,
            backends: Vec::new(),
            iterations: vec![10, 100, 1000],
            refinements: vec![1],
            targets: Vec::new(),
            starts: vec![Start::Cold],
        }
    }
}

#[derive(Debug, Clone)]
struct Problem {
    scene: String,
    set: BTreeMap<String, Value>,
}

#[derive(Clone, Serialize, Deserialize)]
struct Shared {
    scene: String,
    settings: String,
    others: Option<String>,
    x: Option<Value>,
    rows: usize,
}

impl File {
    fn read(path: &Path) -> Result<Self, ExperimentError> {
        let text = read_text(path)?;
        let read = toml::from_str(&text).map_err(|e| {
            let before = &text[..e.span().unwrap_or_default().start];
            let line = 1 + before.matches('\n').count();
            let message = e.message().replace("a sequence", "a list");
            format!(
                "{}: line {line}: {}",
                path.display(),
                message.replace('\n', ", ")
            )
        });
        Ok(read?)
    }

    /// What cannot be asked.
    fn fault(&self) -> Option<&'static str> {
        let values = |g: &Group| g.set.values().map(|v| v.len() as f64).product::<f64>();
        let systems = |g: &Group| values(g) * g.scenes.len() as f64;
        let counts: Vec<f64> = self.on.iter().map(systems).collect();
        let is_set = |g: &Group| g.set.contains_key(&self.x);
        let is_x = self.x.is_empty() || self.on.iter().any(is_set);
        let is_positive = |x: &f64| x.is_finite() && *x > 0.0;
        let few = |k: &usize| *k <= MOST[1];
        let is_limit = |k: &usize| (1..=MOST[3]).contains(k);
        let is_limited = |name: &String| name.contains("iterations=");
        let mut values = self.on.iter().flat_map(|g| g.set.values().flatten());
        let faults = [
            (counts.is_empty(), NAMES),
            (counts.contains(&0.0), NAMES),
            (counts.iter().sum::<f64>() > MOST[0] as f64, MANY),
            (!is_positive(&self.dt), "`dt` must be a positive time"),
            (self.refinements.is_empty(), COUNTS),
            (!self.refinements.iter().all(few), COUNTS),
            (!self.targets.iter().all(is_positive), TARGETS),
            (self.after > MOST[2], "`after` must be at most 100000"),
            (!self.iterations.iter().all(is_limit), LIMITS),
            (self.backends.iter().any(is_limited), LIMITS),
            (values.any(Value::is_null), "`set` holds numbers and words"),
            (self.starts.is_empty(), "`starts` must hold one"),
            (!is_x, "`x` must be one of the keys of `set`"),
        ];
        let found = faults.iter().find(|(is_so, _)| *is_so);
        found.map(|(_, fault)| *fault)
    }

    /// With what the command line asks; quick the first value of each setting and a tenth of the iterations.
    fn with(mut self, asked: &Asked) -> Result<Self, ExperimentError> {
        let segments = asked.segments.iter().map(|n| json!(n)).collect();
        let ratios = asked.ratios.iter().map(|r| json!(r)).collect::<Vec<_>>();
        for (key, values) in [("segments", segments), ("mass_ratio", ratios)] {
            if !values.is_empty() {
                self.on.retain(|group| group.set.contains_key(key));
                let sets = self.on.iter_mut().map(|group| &mut group.set);
                sets.for_each(|set| drop(set.insert(key.to_owned(), values.clone())));
            }
        }
        if asked.quick {
            let sets = self.on.iter_mut().flat_map(|group| group.set.values_mut());
            sets.for_each(|values| values.truncate(1));
            self.iterations.iter_mut().for_each(|k| *k = k.div_ceil(10));
        }
        asked.iterations(&mut self.iterations)?;
        if !asked.backends.is_empty() {
            self.backends.clone_from(&asked.backends);
        }
        match self.fault() {
            Some(fault) => Err(fault.into()),
            None => Ok(self),
        }
    }

    fn problems(&self) -> Vec<Problem> {
        let of = |group: &Group| {
            let plain = group.scenes.iter().map(|scene| Problem {
                scene: scene.clone(),
                set: BTreeMap::new(),
            });
            group
                .set
                .iter()
                .fold(plain.collect(), |all: Vec<_>, (key, values)| {
                    let with = |problem: &Problem, value: &Value| {
                        let mut problem = problem.clone();
                        problem.set.insert(key.clone(), value.clone());
                        problem
                    };
                    let each = |problem| values.iter().map(move |value| with(problem, value));
                    all.iter().flat_map(each).collect()
                })
        };
        self.on.iter().flat_map(of).collect()
    }

    fn rows(
        &self,
        problem: &Problem,
        asking: &Asking,
    ) -> Result<(Vec<SolveRow<Shared>>, Vec<Omission>), ExperimentError> {
        let said = |value: &Value| value.as_str().map_or(value.to_string(), str::to_owned);
        let set = problem.set.iter().map(|(k, value)| (&k[..], said(value)));
        let set: Vec<(&str, String)> = set.collect();
        let overrides = set.iter().map(|(key, value)| (*key, &value[..]));
        let overrides: Vec<(&str, &str)> = overrides.collect();
        let named = |e| format!("`{}` with the values of `set`: {e}", problem.scene);
        let (_, scene) = built(&problem.scene, &overrides).map_err(named)?;
        let state = match self.after {
            0 => State::tense(scene, &asking.step),
            steps => State::after(steps, scene, reference_choice().options(self.dt)),
        }?;
        let settings = |left_out: &str| {
            let own = overrides.iter().filter(|(key, _)| *key != left_out);
            let own: Vec<_> = own.collect();
            list(&own, |(key, value)| format!("{key} = {value}"))
        };
        let shared = Shared {
            scene: problem.scene.clone(),
            settings: settings(""),
            others: Some(settings(&self.x)).filter(|others| !others.is_empty()),
            x: problem.set.get(&self.x).cloned(),
            rows: state.rows(),
        };
        Ok(asking.rows(&shared, &state))
    }
}

pub(crate) const STUDY: Study = Study {
    name: "systems",
    question: question!("systems", FUNCTIONS),
    options: Own::augment_args,
    reads: |matches| read_by(matches, "file", files),
    run: |matches, reporter| {
        let path = Own::from_arg_matches(matches)?.file;
        let name = path.display().to_string();
        ask(&STUDY, &name, File::read(&path)?, matches, reporter)
    },
};

pub(crate) const ITERATIVE: Study = Study {
    name: "iterative",
    question: question!("iterative", FUNCTIONS),
    run: |matches, reporter| {
        let file = File::deserialize(&ITERATIVE.question().asks)?;
        ask(&ITERATIVE, "iterative", file, matches, reporter)
    },
    ..study::PLAIN
};

/// A question's file, and those of its scenes.
fn files(path: &Path) -> Vec<PathBuf> {
    // A pipe can be read once.
    let file = path.is_file().then(|| File::read(path).unwrap_or_default());
    let groups = file.unwrap_or_default().on.into_iter();
    let scenes = groups.flat_map(|group| group.scenes).filter(|s| is_file(s));
    std::iter::once(path.to_owned())
        .chain(scenes.map(PathBuf::from))
        .collect()
}

const FUNCTIONS: Functions = &[
    ("cell", Text(cell)),
    ("reached", Worth(reached)),
    (
        "counts",
        Holds(|row| reached(row).is_some() && has_ended(row)),
    ),
];

fn reached(row: &Row) -> Option<f64> {
    let is_there = row["error"].is_null() && row["reached"] == true;
    number_of(row, "system_ns").filter(|_| is_there)
}

/// Iterations, time and the gain over the direct solver.
fn cell(row: &Row) -> String {
    let us = number_of(row, "system_ns").map_or("-".to_owned(), |ns| digits(ns * 1e-3));
    let k = number_of(row, "iterations").unwrap_or(0.0);
    let is_direct = row["start"].is_null();
    match (reached(row), number_of(row, "direct_ns")) {
        _ if !row["error"].is_null() => "failed".to_owned(),
        (Some(_), _) if is_direct => format!("r{} {us}", row["refinements"]),
        _ if is_direct => "–".to_owned(),
        (Some(ns), Some(direct)) => format!("{k}: {us} ×{}", digits(direct / ns)),
        (Some(_), None) => format!("{k}: {us}"),
        _ if row["reached"] == true => "guess".to_owned(),
        _ => format!(
            "no ({:.0e})",
            number_of(row, "forward_error").unwrap_or(f64::NAN)
        ),
    }
}

#[derive(Debug, Args)]
struct Own {
    /// The question, a TOML file
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

fn ask(
    study: &Study,
    name: &str,
    file: File,
    matches: &ArgMatches,
    reporter: &Reporter<'_>,
) -> Result<Found, ExperimentError> {
    let asked = Asked::read(matches);
    let file = file.with(&asked).map_err(|e| format!("{name}: {e}"))?;
    let choices: Vec<Choice> = match &file.backends[..] {
        [] => Choice::all(),
        names => {
            let named = names.iter().map(|name| choice(name));
            distinct(named.collect::<Result<Vec<_>, _>>()?.into_iter())
        }
    };
    let asking = Asking {
        choices,
        limits: file.iterations.clone(),
        refinements: file.refinements.clone(),
        targets: file.targets.clone(),
        starts: file.starts.clone(),
        step: reference_choice().plain_options(file.dt),
        budget: Some(Duration::from_millis(pick(asked.quick, [10, 1]))),
    };
    let problems = file.problems();
    let solve = |problem: &Problem| file.rows(problem, &asking);
    let (rows, omissions) = collected(reporter.cases.in_turn("systems", &problems, solve)?)?;
    let result = StudyResult {
        settings: set([
            ("solvers", solvers(&asking.choices)),
            ("iterations", counts(&file.iterations)),
            ("refinements", counts(&file.refinements)),
            ("errors", numbers(&file.targets)),
            ("steps before", file.after.to_string()),
            ("Δt", step(file.dt)),
        ]),
        heading: format!("{name}: {} systems", problems.len()),
        study,
        rows: data(&rows)?,
        conclusion: String::new(),
        omissions,
    };
    Ok(result.into())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Both numbers of refinements of the reference solver, timed once.
    pub(in crate::systems) fn asking() -> Asking {
        let choice = reference_choice();
        Asking {
            step: choice.plain_options(1.0 / 60.0),
            choices: vec![choice],
            limits: vec![],
            refinements: vec![0, 1],
            targets: vec![],
            starts: vec![Start::Cold],
            budget: Some(Duration::ZERO),
        }
    }

    #[test]
    fn a_short_file_asks_a_question() {
        let text =
            "on = [{ scenes = ['net'], set = { rows = [2, 3], mass_ratio = [10] } }]\nx = 'rows'";
        let file: File = toml::from_str(text).expect("a question");
        assert_eq!(file.fault(), None);
        let problems = file.problems();
        assert_eq!(problems.len(), 2);
        let (rows, omitted) = file.rows(&problems[1], &asking()).expect("rows");
        assert!(omitted.is_empty());
        let [before, after] = &rows[..] else {
            panic!("two refinements: {}", rows.len())
        };
        let shared = (before.of.others.as_deref(), &before.of.x);
        assert_eq!(shared, (Some("mass_ratio = 10"), &Some(json!(3))));
        assert!(after.forward_error <= before.forward_error && after.forward_error < 1e-14);
        assert!(after.system_ns > Some(0.0) && after.status.as_deref() == Some("direct"));
    }

    #[test]
    fn what_cannot_be_asked_is_a_fault() {
        for text in [
            "",
            "on = [{ scenes = [] }]",
            "on = [{ scenes = ['net'], set = { rows = [] } }]",
            "on = [{ scenes = ['net'] }]\nx = 'rows'",
            "on = [{ scenes = ['net'] }]\ndt = 0",
            "on = [{ scenes = ['net'] }]\nrefinements = [101]",
            "on = [{ scenes = ['net'] }]\ntargets = [0]",
            "on = [{ scenes = ['net'] }]\niterations = [0]",
            "on = [{ scenes = ['net'] }]\nafter = 100001",
            "on = [{ scenes = ['net'] }]\nbackends = ['cg:iterations=3']",
            "on = [{ scenes = ['net'] }]\nstarts = []",
        ] {
            let file: File = toml::from_str(text).expect("TOML");
            assert!(file.fault().is_some(), "{text}");
        }
    }
}
