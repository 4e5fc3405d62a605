//! Runs the cases of files.

use super::changes::{change, know_changes, shuffled};
use super::drive::{self, Input, body, inputs, numbered};
use super::judge::check;
use super::places::{in_scene, located};
use super::probes::{Placed, Seen, Swing};
use super::rest::{at_rest, under_part};
use super::rows::{combined, gathered, rows, with_row};
use super::sights::{Sights, wraps};
use super::text::{Names, counted, defined, split};
use super::{BodyAt, CaseError, CaseFile, Fewer, Halve, MayFail, Rest, Run, See, Solvers};
use crate::checks::ended;
use crate::hard::{alike, farthest, solvers, together};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::fmt;
use taut_integrator::{
    GeometricStiffness, StepError, StepOptions, StepReport, Stepper, static_equilibrium,
};
use taut_measure::choice::Choice;
use taut_measure::modes::natural;
use taut_measure::pace;
use taut_measure::trajectory::{Limits, Simulation, steps_in};
use taut_model::scene_file::SceneSource;
use taut_model::{Constraint, RowLaw, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_solver::SolveError;
use toml::{Table, Value};

pub(in crate::hard) fn outcome(
    file: &CaseFile,
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    let mut names = Names::new(quick);
    names.define(&file.values)?;
    let mut checks = Vec::new();
    for run in &file.run {
        let rows = rows(run, &names)?;
        progress.inc_length(rows.len() as u64);
        for row in rows {
            let (found, own) = match checked(run, &row, &names, None) {
                Ok(both) => both,
                // Later runs need what this one keeps; the others are still reported.
                Err(e) if run.keep.is_empty() => {
                    checks.push(ended("the run itself", &e));
                    progress.inc(1);
                    continue;
                }
                Err(e) => return Err(e),
            };
            checks.extend(found);
            for name in &run.keep {
                let value = super::expression::number(name, &own.values)?;
                names.values.set(name, value);
            }
            progress.inc(1);
        }
    }
    Ok(checks.into())
}

/// Finds all names of a case, without a step.
pub(in crate::hard) fn verify(file: &CaseFile) -> Result<(), CaseError> {
    let mut names = Names::new(true);
    let shared = names.define(&file.values);
    shared.map_err(|e| located(e.into(), &file.text, None))?;
    for (k, run) in file.run.iter().enumerate() {
        let found = verified(run, &names);
        found.map_err(|e| located(e, &file.text, Some(k)))?;
    }
    Ok(())
}

fn verified(run: &Run, shared: &Names) -> Result<(), ExperimentError> {
    for row in rows(run, shared)? {
        let (_, found) = checked(run, &row, shared, Some(0))?;
        for name in &run.keep {
            super::expression::number(name, &found.values)?;
        }
    }
    audited(run, shared).map(drop)
}

/// The scenes on which the solvers' claims are audited.
pub(in crate::hard) fn scenes(file: &CaseFile) -> Result<Vec<Scene>, ExperimentError> {
    let mut shared = Names::new(true);
    shared.define(&file.values)?;
    let runs = file.run.iter().map(|run| audited(run, &shared));
    Ok(runs.collect::<Result<Vec<_>, _>>()?.concat())
}

fn audited(run: &Run, shared: &Names) -> Result<Vec<Scene>, ExperimentError> {
    let mut scenes = Vec::new();
    for row in &run.audit {
        let mut names = with_row(shared, row)?;
        names.define(&run.values)?;
        let mut scene = shuffled(run, &names, built(run, &names)?)?;
        displaced(run, &mut scene, &mut names)?;
        for input in inputs(run, &mut names, &scene, 0.0)? {
            match input {
                Input::Control(control, value) => scene.set_control(control, value, 0.0),
                Input::Velocity(body, velocity) => scene.bodies.velocity[body] = velocity,
                Input::Load(body, force, torque) => {
                    scene.bodies.force[body] = force;
                    scene.bodies.torque[body] = torque;
                }
            }
        }
        scenes.push(scene);
    }
    Ok(scenes)
}

/// A row of values: its runs, by each solver that it asks for, and its checks, with what is known in the end.
fn checked(
    run: &Run,
    row: &Table,
    shared: &Names,
    most: Option<usize>,
) -> Result<(Vec<Check>, Names), ExperimentError> {
    let names = with_row(shared, row)?;
    let combinations = combined(run, &run.over, &names)?.into_iter();
    let combinations: Result<Vec<_>, _> = combinations.map(|row| with_row(&names, &row)).collect();
    let combinations = combinations?;
    let choices = match run.solvers {
        _ if most.is_some() => vec![None],
        None => vec![None],
        Some(_) => {
            let mut all = solvers();
            match run.solvers {
                Some(Solvers::FirstUnguarded) => all.truncate(1),
                Some(Solvers::EveryDirect) => all.retain(|choice| !choice.backend.is_iterative()),
                _ => {}
            }
            match run.quick_solvers.filter(|_| shared.is_quick()) {
                Some(Fewer::Direct) => all.retain(|choice| !choice.backend.is_iterative()),
                Some(Fewer::First) => all.truncate(1),
                None => {}
            }
            all.into_iter().map(Some).collect()
        }
    };
    let mut found: Vec<(Option<String>, Vec<Names>)> = Vec::new();
    for choice in choices {
        let runs = match &run.halve {
            Some(halve) => halved(run, halve, &names, most)?,
            None => {
                let runs = combinations.par_iter().with_max_len(1).map(|names| {
                    let mut names = names.clone();
                    names.define(&run.values)?;
                    seen(run, names, choice.as_ref(), most)
                });
                let mut runs = runs.collect::<Result<Vec<_>, ExperimentError>>()?;
                compare(run, &mut runs);
                runs
            }
        };
        found.push((choice.map(|c| c.family()), runs));
    }
    let of_first = found.first().map_or(&[][..], |(_, runs)| runs).iter();
    let of_first: Vec<_> = of_first.map(|run| run.path.clone()).collect();
    for (_, runs) in &mut found {
        for (run, first) in runs.iter_mut().zip(&of_first) {
            run.values.set("from_first", farthest(&run.path, first));
        }
    }
    let all: Vec<&Names> = found.iter().flat_map(|(_, runs)| runs).collect();
    let mut all = gathered(&all);
    all.define(&run.finds)?;
    let mut checks = Vec::new();
    for entry in &run.check {
        // Names are to be known whether a check is made or not.
        if !holds(entry.only.as_deref(), &all)? && most.is_none() {
            continue;
        }
        if entry.by_solver {
            let by_solver = found.iter().map(|(family, runs)| {
                let own = gathered(&runs.iter().collect::<Vec<_>>());
                Ok((family.clone().unwrap_or_default(), check(entry, &own)?))
            });
            let by_solver: Result<Vec<_>, CaseError> = by_solver.collect();
            checks.extend(together(&all.text(&entry.case)?, by_solver?));
        } else if let Some([called, several]) = &entry.by_run {
            let runs = found.iter().flat_map(|(_, runs)| runs);
            let by_run = runs.map(|own| Ok((own.text(called)?, check(entry, own)?)));
            let by_run: Result<Vec<_>, CaseError> = by_run.collect();
            checks.extend(alike(&all.text(&entry.case)?, several, by_run?));
        } else {
            checks.push(check(entry, &all)?);
        }
    }
    Ok((checks, all))
}

/// The runs at both ends of a bracket, with the value in it that halvings find.
fn halved(
    run: &Run,
    halve: &Halve,
    names: &Names,
    most: Option<usize>,
) -> Result<Vec<Names>, ExperimentError> {
    let at = |value: f64| {
        let mut names = names.clone();
        names.values.set(&halve.name, value);
        names.define(&run.values)?;
        seen(run, names, None, most)
    };
    let (mut low, mut high) = (names.number(&halve.from)?, names.number(&halve.to)?);
    let mut ends = vec![at(low)?, at(high)?];
    let first = ends[0].values.known.clone();
    let up = |of: &Names| -> Result<bool, CaseError> {
        let mut values = of.values.clone();
        let of_first = first.iter();
        let of_first = of_first.map(|(name, value)| (format!("low.{name}"), value.clone()));
        values.known.extend(of_first);
        Ok(super::expression::number(&halve.up, &values)? != 0.0)
    };
    if !up(&ends[0])? && up(&ends[1])? {
        for _ in 0..names.count("times", &halve.times, 0.0..=1e3)? {
            let middle = low.midpoint(high);
            if up(&at(middle)?)? {
                high = middle;
            } else {
                low = middle;
            }
        }
    }
    for end in &mut ends {
        end.values.set("found", low.midpoint(high));
        end.values.set("width", 0.5 * (high - low));
    }
    Ok(ends)
}

/// Tells each run how far its path is from that of the last one, and from that of the next.
fn compare(run: &Run, runs: &mut [Names]) {
    if run.path.is_empty() {
        return;
    }
    let paths: Vec<_> = runs.iter().map(|run| run.path.clone()).collect();
    let last = paths.len() - 1;
    for (k, run) in runs.iter_mut().enumerate() {
        let apart = |other: usize| farthest(&paths[k], &paths[other]);
        run.values.set("apart", apart(last));
        run.values.set("to_next", apart(last.min(k + 1)));
    }
}

pub(super) fn holds(condition: Option<&str>, names: &Names) -> Result<bool, CaseError> {
    condition.map_or(Ok(true), |text| {
        Ok(super::expression::number(text, &names.values)? != 0.0)
    })
}

fn built(run: &Run, names: &Names) -> Result<Scene, ExperimentError> {
    let table = names.table(&run.scene);
    let table = table.map_err(|e| e.inside(&"scene"))?;
    let read = SceneSource::parse(&table.to_string(), &[]).and_then(|scene| scene.build());
    let mut scene = read.map_err(|fault| in_scene(&fault, &table, run, names))?;
    if let Some(stretch) = &run.stretch {
        let law = RowLaw::new(names.number(stretch)?, 0.0);
        for constraint in &mut scene.constraints {
            if let Constraint::Spherical(joint) = constraint {
                joint.stretch = law;
            }
        }
    }
    for group in &run.bodies {
        let cables = scene.cables.iter().map(|cable| &cable.name);
        let segments = scene.cables[numbered("cable", &group.cable, cables)?]
            .bodies
            .clone();
        let bodies = &mut scene.bodies;
        let every = counted("every", group.every.unwrap_or(1) as f64, 1.0..=1e9);
        let every = every.map_err(|e| e.inside(&"bodies"))?;
        for i in segments.into_iter().step_by(every) {
            if let Some(heavier) = &group.heavier {
                let times = names.number(heavier)?;
                bodies.mass[i] *= times;
                bodies.inertia[i] *= times;
            }
            for (k, v) in group.velocity.iter().flatten().enumerate() {
                bodies.velocity[i][k] = names.number(v)?;
            }
            if let Some(spin) = group.spin.map(Vector3::from) {
                bodies.velocity[i] += spin.cross(&bodies.position[i]);
                bodies.angular_velocity[i] = spin;
            }
            if let Some(turning) = group.turning {
                bodies.angular_velocity[i] = turning.into();
            }
        }
    }
    Ok(scene)
}

/// Moves a scene into the natural oscillation that its run starts in, about the equilibrium if it asks for one, whose
/// frequency `names` then have.
fn displaced(
    run: &Run,
    scene: &mut Scene,
    names: &mut Names,
) -> Result<Option<Swing>, ExperimentError> {
    let Some(mode) = &run.mode else {
        return Ok(None);
    };
    if std::mem::take(&mut scene.start_in_equilibrium) {
        *scene = static_equilibrium(scene.clone(), &StepOptions::default().backend)?;
    }
    let inside = |e: CaseError| e.inside(&"mode");
    for coordinate in &mode.coordinates {
        counted("coordinates", *coordinate as f64, 0.0..=5.0).map_err(inside)?;
    }
    let modes = natural(scene, &mode.coordinates);
    let Some(modes) = modes.filter(|modes| modes.shapes.ncols() > 0) else {
        names.values.set("eigenvalue", f64::NAN);
        return Ok(None);
    };
    let last = (modes.shapes.ncols() - 1) as f64;
    let number = names
        .count("number", &mode.number, 0.0..=last)
        .map_err(inside)?;
    names.values.set("eigenvalue", modes.frequency(number));
    let largest = modes.shapes.column(number).iamax();
    let swing = Swing {
        body: largest / 6,
        coordinate: largest % 6,
        rest: scene.bodies.orientation[largest / 6],
    };
    modes.displace(scene, number, names.number(&mode.amplitude)?);
    Ok(Some(swing))
}

/// Time step of a run \[s].
pub(super) fn dt(run: &Run, names: &Names) -> Result<f64, CaseError> {
    let dt = run.step.dt.as_ref();
    dt.map_or(Ok(1.0 / 60.0), |dt| names.number(dt))
}

/// What is wrong with a name under `step`.
fn unread(fault: &dyn fmt::Display, key: &str) -> CaseError {
    CaseError::message(fault).inside(&key).inside(&"step")
}

fn options(
    run: &Run,
    names: &Names,
    choice: Option<&Choice>,
) -> Result<StepOptions, ExperimentError> {
    let dt = dt(run, names)?;
    let paper = run.step.paper.as_ref().map(|paper| names.number(paper));
    let mut options = match (choice, run.solvers) {
        (Some(choice), Some(Solvers::EveryUnguarded | Solvers::FirstUnguarded)) => {
            choice.plain_options(dt)
        }
        (Some(choice), _) => choice.options(dt),
        (None, _) if paper.transpose()?.unwrap_or(0.0) != 0.0 => StepOptions {
            dt,
            ..StepOptions::paper()
        },
        (None, _) => crate::hard::at(dt),
    };
    if let Some(guard) = &run.step.guard
        && names.number(guard)? == 0.0
    {
        options.guard = None;
    }
    if let Some(substeps) = &run.step.substeps {
        options.substeps = names.count("substeps", substeps, 1.0..=1e4)?;
    }
    if let Some(backend) = &run.step.backend {
        options.backend = backend.parse().map_err(|e| unread(&e, "backend"))?;
        options.refinements = 0;
    }
    options.energy_tolerance = run.step.balance.0;
    if let Some(scheme) = &run.step.scheme {
        let scheme = names.text(scheme)?.parse();
        options.scheme = scheme.map_err(|e| unread(&e, "scheme"))?;
        options.stiffness = GeometricStiffness::inertia(options.scheme.default_alpha());
    }
    if let Some(alpha) = &run.step.alpha {
        options.stiffness = GeometricStiffness::inertia(names.number(alpha)?);
    }
    Ok(options)
}

/// Steps through a run; its names with those of what is seen, one number each.
fn seen(
    run: &Run,
    mut names: Names,
    choice: Option<&Choice>,
    most: Option<usize>,
) -> Result<Names, ExperimentError> {
    let options = options(run, &names, choice)?;
    names.values.set("dt", options.dt);
    let weights = options.scheme.weights();
    names.values.set("scheme.next", weights.next);
    names.values.set("scheme.now", weights.now);
    names.values.set("scheme.before", weights.before);
    let laid = built(run, &names)?;
    let mut scene = shuffled(run, &names, at_rest(run, laid.clone(), choice)?)?;
    let swing = displaced(run, &mut scene, &mut names)?;
    let follow = match &run.rest {
        Some(Rest::Followed { follow, .. }) => Some(follow),
        _ => None,
    };
    let steps = match (follow.or(run.steps.as_ref()), &run.time) {
        (Some(steps), _) => names.count("steps", steps, 0.0..=MOST_STEPS)?,
        (None, Some(time)) => {
            names.count("time", time, 0.0..=MOST_STEPS * options.dt)?;
            steps_in(names.number(time)?, options.dt)
        }
        (None, None) => {
            let (key, place) = ("steps", "[[run]]");
            return Err(CaseError::Missing { key, place }.into());
        }
    };
    let mut stepper = Stepper::new(scene, options)?;
    let texts = texts(run, &names)?;
    let see: Result<Vec<_>, CaseError> = texts.iter().map(|text| defined(text)).collect();
    let see = see?;
    let places = places(run, &names, stepper.scene())?;
    let mut wanted: Vec<String> = Vec::new();
    let mut own: Vec<&str> = vec!["failed", "singular", "ended_at"];
    for (name, formula) in &see {
        let mut inside = Vec::new();
        formula.names(&mut inside);
        for inner in inside {
            let known = own.contains(&inner) || names.values.known.contains_key(inner);
            if !known && !wanted.iter().any(|w| w == inner) {
                wanted.push(inner.to_owned());
            }
        }
        own.push(name);
    }
    let steps = most.unwrap_or(steps);
    recorded(
        run,
        &mut stepper,
        (&wanted, swing.as_ref(), &places, &laid),
        steps,
        &mut names,
    )?;
    for (name, formula) in &see {
        let series = formula.series(&names.values).map_err(|e| e.within(name))?;
        if series.len() != 1 {
            let start = formula.at_start(&names.values)?;
            names.values.starts.insert((*name).to_owned(), start);
        }
        names.values.known.insert((*name).to_owned(), series);
    }
    // A series over the steps is of no use to the checks.
    names.values.known.retain(|_, series| series.len() == 1);
    Ok(names)
}

/// Most steps of a run.
const MOST_STEPS: f64 = 1e8;

/// What a run sees, entries that stand several times written out.
fn texts(run: &Run, names: &Names) -> Result<Vec<String>, CaseError> {
    let mut texts = Vec::new();
    for entry in &run.see {
        match entry {
            See::One(text) => texts.push(names.text(text)?),
            See::Largest { repeat, see } => {
                let (name, formula) = split(see)?;
                let count = names.count("repeat", repeat, 1.0..=1e4)?;
                let of = |k: usize| formula.replace("{k}", &k.to_string());
                let one = |k: usize| format!("{name}.{k} = {}", of(k));
                texts.extend((0..count).map(one));
                let mut all: Vec<String> = (0..count).map(|k| format!("[{name}.{k}]")).collect();
                // In pairs: formulas nest to a limited depth.
                while all.len() > 1 {
                    let larger = |pair: &[String]| match pair {
                        [a, b] => format!("max({a}, {b})"),
                        rest => rest.concat(),
                    };
                    all = all.chunks(2).map(larger).collect();
                }
                texts.push(format!("{name} = {}", all.concat()));
            }
        }
    }
    Ok(texts)
}

/// Bodies, and where they have to be.
fn places(run: &Run, names: &Names, scene: &Scene) -> Result<Vec<Placed>, ExperimentError> {
    let filled = names.filled(&Value::Array(run.places.clone()));
    let filled = filled.map_err(|e| e.inside(&"places"))?;
    let filled = filled.as_array().into_iter().flatten();
    let place = |entry: &Value| {
        let place: BodyAt = entry
            .clone()
            .try_into()
            .map_err(|e| CaseError::read(e.message(), []).inside(&"places"))?;
        Ok((body(scene, &place.body)?, Vector3::from(place.place)))
    };
    filled.map(place).collect()
}

/// Steps, and records what is wanted of each; and when and why it ended early, where it may.
fn recorded(
    run: &Run,
    stepper: &mut Stepper,
    (wanted, swing, places, laid): (&[String], Option<&Swing>, &[Placed], &Scene),
    steps: usize,
    names: &mut Names,
) -> Result<(), ExperimentError> {
    let mut sights = Sights::find(wanted, run.table.as_ref(), stepper)?;
    let mut known = names.clone();
    let first = stepper.scene().clone();
    let shape = OnceCell::new();
    let look =
        |sights: &Sights<'_>, stepper: &Stepper, report: Option<&StepReport>, wraps: &[f64]| {
            let seen = Seen {
                stepper,
                report,
                first: &first,
                swing,
                places,
                laid,
                shape: &shape,
                wraps,
            };
            sights.look(&seen)
        };
    let start = look(&sights, stepper, None, &wraps(stepper.scene()));
    let mut series: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (name, value) in wanted.iter().zip(start) {
        names.values.starts.insert(name.clone(), vec![value]);
        series.insert(name.clone(), Vec::with_capacity(steps));
    }
    let path = path(run, names, &first)?;
    if steps == 0 {
        let scene = stepper.scene();
        inputs(run, &mut known, scene, 0.0)?;
        know_changes(run, scene)?;
        names.path = path
            .iter()
            .map(|body| first.bodies.position[*body])
            .collect();
    }
    let each = (1.0 / (60.0 * stepper.options().dt)).round() as usize;
    let mut watched = Simulation::new(steps, Limits::Scene(first.gap_limits()));
    let mut driven = Vec::new();
    for n in 1..=steps {
        let now = inputs(run, &mut known, stepper.scene(), stepper.time())?;
        if now != driven {
            drive::set(stepper, &now)?;
            driven = now;
        }
        change(run, stepper, n)?;
        let before = wraps(stepper.scene());
        let report = match (&run.rest, run.may_fail) {
            (Some(Rest::Followed { pass, .. }), _) => {
                let pass = pass.as_ref().map(|pass| names.number(pass)).transpose()?;
                let part = n as f64 / steps as f64;
                let scene = under_part(stepper.scene().clone(), laid, part, pass)?;
                *stepper = Stepper::new(scene, stepper.options().clone())?;
                sights = Sights::find(wanted, run.table.as_ref(), stepper)?;
                None
            }
            (_, MayFail::Nothing) => Some(pace::step(stepper)?),
            (_, MayFail::Step) => {
                let made = pace::step(stepper);
                made.map_err(|e| watched.fail(stepper.time(), e)).ok()
            }
            (_, MayFail::Limits) => watched.step(stepper).map(|sample| sample.report),
        };
        if report.is_some() || watched.failure.is_none() {
            let seen = look(&sights, stepper, report.as_ref(), &before);
            for (name, value) in wanted.iter().zip(seen) {
                if let Some(series) = series.get_mut(name) {
                    series.push(value);
                }
            }
            if n % each.max(1) == 0 {
                let places = &stepper.scene().bodies.position;
                names.path.extend(path.iter().map(|body| places[*body]));
            }
        }
        if watched.failure.is_some() {
            break;
        }
    }
    names.values.set("ended_at", stepper.time());
    tell_end(watched, names);
    names.values.known.extend(series);
    Ok(())
}

/// The bodies whose ways are compared.
fn path(run: &Run, names: &Names, scene: &Scene) -> Result<Vec<usize>, ExperimentError> {
    let path = names.filled(&Value::Array(run.path.clone()));
    let path = path.map_err(|e| e.inside(&"path"))?;
    let path = path.as_array().into_iter().flatten();
    let bodies = path.map(|name| match name.as_str() {
        Some(name) => body(scene, name),
        None => body(scene, &name.to_string()),
    });
    Ok(bodies.collect::<Result<_, _>>()?)
}

/// Names the end of a run that ended early.
fn tell_end(watched: Simulation, names: &mut Names) {
    let singular = matches!(
        &watched.error,
        Some(StepError::Solve {
            source: SolveError::Singular { .. },
            culprit: Some(_),
            ..
        })
    );
    let failed = watched.failure.is_some();
    for (name, holds) in [("failed", failed), ("singular", singular)] {
        names.values.set(name, f64::from(u8::from(holds)));
    }
    let ended = watched.failure.map_or_else(String::new, |f| f.reason);
    names.words.insert("ended".to_owned(), ended);
}
