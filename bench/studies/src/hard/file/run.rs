//! Runs the cases of files.

use super::probes::{PROBES, Probe, Seen, Swing};
use super::text::{Names, defined};
use super::{CaseError, CaseFile, CheckEntry, Distance, Fewer, Rows, Run, Solvers};
use crate::hard::{solvers, together};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use taut_ground::choice::Choice;
use taut_ground::columns::{ColumnError, Columns};
use taut_ground::modes::natural;
use taut_ground::pace;
use taut_ground::trajectory::{ENERGY_TOLERANCE, Sample, steps_in};
use taut_integrator::{
    GeometricStiffness, StepError, StepOptions, StepReport, Stepper, static_equilibrium,
};
use taut_model::Scene;
use taut_model::scene_file::SceneSource;
use taut_output::check::{Check, ExperimentError, Measure, Outcome};
use toml::{Table, Value};

/// Runs a case and checks it.
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
            let (found, own) = checked(run, &row, &names, None)?;
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
pub(in crate::hard) fn verify(file: &CaseFile) -> Result<(), ExperimentError> {
    let mut names = Names::new(true);
    names.define(&file.values)?;
    for run in &file.run {
        for row in rows(run, &names)? {
            checked(run, &row, &names, Some(0))?;
        }
    }
    Ok(())
}

/// The scenes on which the solvers' claims are audited.
pub(in crate::hard) fn scenes(file: &CaseFile) -> Result<Vec<Scene>, ExperimentError> {
    let mut scenes = Vec::new();
    let mut shared = Names::new(true);
    shared.define(&file.values)?;
    for run in &file.run {
        for row in &run.audit {
            let mut names = with_row(&shared, row)?;
            names.define(&run.values)?;
            let mut scene = built(run, &names)?;
            displaced(run, &mut scene, &mut names)?;
            for input in inputs(run, &mut names, &scene, 0.0)? {
                match input {
                    Input::Control(control, value) => scene.set_control(control, value, 0.0),
                    Input::Velocity(body, velocity) => scene.bodies.velocity[body] = velocity,
                }
            }
            scenes.push(scene);
        }
    }
    Ok(scenes)
}

/// Rows of values that are run.
fn rows(run: &Run, shared: &Names) -> Result<Vec<Table>, CaseError> {
    let quick = shared.is_quick();
    Ok(match &run.each {
        Rows::Combined(lists) => combined(run, lists, shared)?,
        Rows::Listed(rows) => {
            let is_long = |row: &Table| row.get("long").and_then(Value::as_bool) == Some(true);
            let kept = rows.iter().filter(|row| !(quick && is_long(row)));
            kept.cloned().collect()
        }
    })
}

/// All combinations of lists of values, or of the shorter ones; a table stands for its own values.
fn combined(
    run: &Run,
    lists: &BTreeMap<String, Value>,
    names: &Names,
) -> Result<Vec<Table>, CaseError> {
    let mut all = vec![Table::new()];
    for (name, list) in lists {
        let shorter = run.quick.get(name).filter(|_| names.is_quick());
        let list = match shorter.unwrap_or(list) {
            Value::Array(list) => list.clone(),
            count => (0..names.number(count)? as i64)
                .map(Value::Integer)
                .collect(),
        };
        let longer = |known: &Table, value: &Value| {
            let mut row = known.clone();
            match value {
                Value::Table(several) => row.extend(several.clone()),
                one => drop(row.insert(name.clone(), one.clone())),
            }
            row
        };
        let longer = |known: &Table| list.iter().map(|v| longer(known, v)).collect::<Vec<_>>();
        all = all.iter().flat_map(longer).collect();
    }
    Ok(all)
}

fn with_row(shared: &Names, row: &Table) -> Result<Names, CaseError> {
    let mut names = shared.clone();
    for (name, value) in row.iter().filter(|(name, _)| *name != "long") {
        names.add(name, value)?;
    }
    Ok(names)
}

/// Names of the runs together: each value is a series over them, but for those that are one number.
fn gathered(runs: &[&Names]) -> Names {
    let mut together = runs.first().map(|n| (*n).clone()).unwrap_or_default();
    for (name, series) in &mut together.values.known {
        let all = runs.iter().filter_map(|n| n.values.known.get(name));
        let all: Vec<f64> = all.flatten().copied().collect();
        let same = |x: &f64| x.to_bits() == all[0].to_bits();
        *series = if all.iter().all(same) {
            all[..1].to_vec()
        } else {
            all
        };
    }
    together
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
        let runs = combinations.iter().map(|names| {
            let mut names = names.clone();
            names.define(&run.values)?;
            seen(run, names, choice.as_ref(), most)
        });
        let runs: Result<_, ExperimentError> = runs.collect();
        found.push((choice.map(|c| c.family()), runs?));
    }
    let all: Vec<&Names> = found.iter().flat_map(|(_, runs)| runs).collect();
    let mut all = gathered(&all);
    all.define(&run.finds)?;
    let mut checks = Vec::new();
    for entry in &run.check {
        if !holds(entry.only.as_deref(), &all)? {
            continue;
        }
        if entry.by_solver {
            let by_solver = found.iter().map(|(family, runs)| {
                let own = gathered(&runs.iter().collect::<Vec<_>>());
                Ok((family.clone().unwrap_or_default(), check(entry, &own)?))
            });
            let by_solver: Result<Vec<_>, CaseError> = by_solver.collect();
            checks.extend(together(&all.text(&entry.case)?, by_solver?));
        } else {
            checks.push(check(entry, &all)?);
        }
    }
    Ok((checks, all))
}

fn holds(condition: Option<&str>, names: &Names) -> Result<bool, CaseError> {
    condition.map_or(Ok(true), |text| {
        Ok(super::expression::number(text, &names.values)? != 0.0)
    })
}

/// The scene of a run.
fn built(run: &Run, names: &Names) -> Result<Scene, ExperimentError> {
    let table = names.table(&run.scene)?;
    let mut scene = SceneSource::parse(&table.to_string(), &[])?.build()?;
    for group in &run.bodies {
        let segments = scene.cable(&group.cable)?.bodies.clone();
        let bodies = &mut scene.bodies;
        for i in segments.into_iter().step_by(group.every.unwrap_or(1)) {
            if let Some(heavier) = &group.heavier {
                let times = names.number(heavier)?;
                bodies.mass[i] *= times;
                bodies.inertia[i] *= times;
            }
            for (k, v) in group.velocity.iter().flatten().enumerate() {
                bodies.velocity[i][k] = names.number(v)?;
            }
        }
    }
    Ok(scene)
}

/// What drives a scene: the value of a control, or the velocity (m/s) of a driven body.
#[derive(PartialEq)]
enum Input {
    Control(usize, f64),
    Velocity(usize, Vector3<f64>),
}

/// Inputs at a time (s).
fn inputs(
    run: &Run,
    names: &mut Names,
    scene: &Scene,
    time: f64,
) -> Result<Vec<Input>, ExperimentError> {
    if run.drive.is_empty() {
        return Ok(Vec::new());
    }
    names.values.set("time", time);
    names.values.set("dt", dt(run, names)?);
    let input = |(name, value): (&String, &Value)| {
        Ok(match value {
            Value::Array(parts) => {
                let parts: Result<Vec<f64>, _> = parts.iter().map(|v| names.number(v)).collect();
                let mut velocity = Vector3::zeros();
                velocity.iter_mut().zip(parts?).for_each(|(v, x)| *v = x);
                Input::Velocity(scene.body(name)?, velocity)
            }
            value => Input::Control(scene.control(name)?, names.number(value)?),
        })
    };
    run.drive.iter().map(input).collect()
}

fn drive(stepper: &mut Stepper, inputs: &[Input]) -> Result<(), StepError> {
    for input in inputs {
        match *input {
            Input::Control(control, value) => stepper.set_control(control, value)?,
            Input::Velocity(body, velocity) => {
                stepper.set_velocity(body, velocity, Vector3::zeros())?;
            }
        }
    }
    Ok(())
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
    let Some(modes) = natural(scene, &mode.coordinates) else {
        names.values.set("eigenvalue", f64::NAN);
        return Ok(None);
    };
    let number = names.number(&mode.number)? as usize;
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
fn dt(run: &Run, names: &Names) -> Result<f64, CaseError> {
    let dt = run.step.dt.as_ref();
    dt.map_or(Ok(1.0 / 60.0), |dt| names.number(dt))
}

fn options(
    run: &Run,
    names: &Names,
    choice: Option<&Choice>,
) -> Result<StepOptions, ExperimentError> {
    let dt = dt(run, names)?;
    let mut options = match (choice, run.solvers) {
        (Some(choice), Some(Solvers::EveryUnguarded)) => choice.plain_options(dt),
        (Some(choice), _) => choice.options(dt),
        (None, _) => crate::hard::at(dt),
    };
    if let Some(substeps) = &run.step.substeps {
        options.substeps = names.number(substeps)? as usize;
    }
    options.energy_tolerance = run.step.balance.then_some(ENERGY_TOLERANCE);
    if let Some(scheme) = &run.step.scheme {
        options.scheme = names.text(scheme)?.parse()?;
        options.stiffness = GeometricStiffness::inertia(options.scheme.default_alpha());
    }
    Ok(options)
}

/// A quantity that is seen in each step.
enum Sight {
    Probe(Probe),
    /// One of the columns.
    Column(usize),
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
    let mut scene = built(run, &names)?;
    let swing = displaced(run, &mut scene, &mut names)?;
    let steps = match (&run.steps, &run.time) {
        (Some(steps), _) => names.number(steps)? as usize,
        (None, Some(time)) => steps_in(names.number(time)?, options.dt),
        (None, None) => {
            let (key, place) = ("steps", "[[run]]");
            return Err(CaseError::Missing { key, place }.into());
        }
    };
    let mut stepper = Stepper::new(scene, options)?;
    let see: Result<Vec<_>, CaseError> = run.see.iter().map(|text| defined(text)).collect();
    let see = see?;
    let mut wanted: Vec<String> = Vec::new();
    let mut own: Vec<&str> = vec!["failed"];
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
    let failed = recorded(
        run,
        &mut stepper,
        (&wanted, swing.as_ref()),
        steps,
        &mut names,
    )?;
    names
        .values
        .set("failed", f64::from(u8::from(failed.is_some())));
    let ended = failed.unwrap_or_default();
    names.words.insert("ended".to_owned(), ended);
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

/// The quantity with that name.
fn sights(wanted: &[String], stepper: &Stepper) -> Result<(Vec<Sight>, Columns), CaseError> {
    let probe = |name: &str| PROBES.iter().find(|(known, ..)| *known == name);
    let mut columns = Vec::new();
    let mut all = Vec::new();
    for name in wanted {
        match probe(name) {
            Some(probe) => all.push(Sight::Probe(*probe)),
            None => {
                all.push(Sight::Column(columns.len()));
                columns.push(name.clone());
            }
        }
    }
    let found = Columns::find(&columns, stepper).map_err(|e| {
        let probes = PROBES.iter().map(|(name, ..)| *name);
        match &e {
            ColumnError::UnknownColumn { name, known } => {
                let known = known.iter().map(String::as_str);
                CaseError::unknown("probe", name, known.chain(probes))
            }
            ColumnError::UnknownName {
                name,
                bodies,
                constraints,
                ..
            } => {
                let known = bodies.iter().chain(constraints).map(String::as_str);
                CaseError::unknown("body, joint or cable", name, known)
            }
            ColumnError::UnknownQuantity {
                quantity, known, ..
            } => CaseError::unknown("quantity", quantity, known.iter().copied()),
            other => CaseError::Toml {
                line: 0,
                message: other.to_string(),
            },
        }
    })?;
    Ok((all, found))
}

/// Angles of the cables about the sheaves with friction \[rad].
fn wraps(scene: &Scene) -> Vec<f64> {
    (0..scene.capstans.len()).map(|i| scene.wrap(i)).collect()
}

/// What is seen of a step, or at the beginning.
fn look((sights, columns): &(Vec<Sight>, Columns), seen: &Seen<'_>) -> Vec<f64> {
    let stepper = seen.stepper;
    let report = seen.report.filter(|_| !columns.headings().is_empty());
    let of_columns: Vec<_> = match report {
        None => columns.at_start(stepper).collect(),
        Some(report) => columns
            .values(stepper, &Sample::after(stepper, report))
            .collect(),
    };
    let values = sights.iter().map(|sight| match sight {
        Sight::Probe((.., of)) => of(seen),
        Sight::Column(k) => of_columns[*k].unwrap_or(f64::NAN),
    });
    values.collect()
}

/// Steps, and records what is wanted of each; in words why it ended early, where it may.
fn recorded(
    run: &Run,
    stepper: &mut Stepper,
    (wanted, swing): (&[String], Option<&Swing>),
    steps: usize,
    names: &mut Names,
) -> Result<Option<String>, ExperimentError> {
    let sights = sights(wanted, stepper)?;
    let mut known = names.clone();
    let values = &mut names.values;
    let first = stepper.scene().clone();
    let look = |stepper: &Stepper, report: Option<&StepReport>, wraps: &[f64]| {
        let seen = Seen {
            stepper,
            report,
            first: &first,
            swing,
            wraps,
        };
        look(&sights, &seen)
    };
    let start = look(stepper, None, &wraps(stepper.scene()));
    let mut series: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (name, value) in wanted.iter().zip(start) {
        values.starts.insert(name.clone(), vec![value]);
        series.insert(name.clone(), Vec::with_capacity(steps));
    }
    let (mut failed, mut driven) = (None, Vec::new());
    for _ in 0..steps {
        let now = inputs(run, &mut known, stepper.scene(), stepper.time())?;
        if now != driven {
            drive(stepper, &now)?;
            driven = now;
        }
        let before = wraps(stepper.scene());
        match pace::step(stepper) {
            Ok(report) => {
                let seen = look(stepper, Some(&report), &before);
                for (name, value) in wanted.iter().zip(seen) {
                    if let Some(series) = series.get_mut(name) {
                        series.push(value);
                    }
                }
            }
            Err(e) if run.may_fail => {
                failed = Some(e.to_string());
                break;
            }
            Err(e) => return Err(e.into()),
        }
    }
    values.known.extend(series);
    Ok(failed)
}

/// A check as its entry says, of one run or of several.
fn check(entry: &CheckEntry, names: &Names) -> Result<Check, CaseError> {
    let number = |text: &str| super::expression::number(text, &names.values);
    let words =
        |text: &Option<String>| text.as_deref().map_or(Ok(String::new()), |t| names.text(t));
    let bar = || {
        let (key, place) = ("bar", "[[run.check]]");
        let missing = CaseError::Missing { key, place };
        names.number(entry.bar.as_ref().ok_or(missing)?)
    };
    let case = names.text(&entry.case)?;
    let mut check = if let Some(condition) = &entry.holds {
        let (reference, ours) = (names.text(&entry.reference)?, words(&entry.ours)?);
        Check::stated(case, reference, ours, number(condition)? != 0.0)
    } else if let Some(error) = &entry.error {
        let (error, reference) = (number(error)?, names.text(&entry.reference)?);
        match &entry.ours {
            Some(ours) => Check::within(case, reference, names.text(ours)?, error, bar()?),
            None => Check::off(case, reference, error, &entry.unit, bar()?),
        }
    } else {
        let (key, place) = ("ours", "[[run.check]]");
        let missing = CaseError::Missing { key, place };
        let ours = number(entry.ours.as_ref().ok_or(missing)?)?;
        let measure = match entry.measure {
            Some(Distance::Absolute) => Measure::Absolute,
            _ => Measure::Relative,
        };
        let both = [number(&entry.reference)?, ours];
        Check::number(case, both, entry.unit.clone(), measure, bar()?)
    };
    if entry.claim {
        check = check.published();
    }
    if let Some(by) = &entry.by {
        check = check.by(names.text(by)?);
    }
    check = check.noting(words(&entry.note)?);
    if let Some(limit) = &entry.limit {
        check = check.limited(number(&limit.when)? != 0.0, names.text(&limit.cause)?);
    }
    let parts = &mut check.parts;
    for (part, text) in [
        (&mut parts.algebraic, &entry.algebraic),
        (&mut parts.time, &entry.time),
        (&mut parts.space, &entry.space),
    ] {
        *part = text.as_deref().map(number).transpose()?;
    }
    Ok(check)
}
