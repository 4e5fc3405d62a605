//! The study of the main job: its options, what it says, its rows with what its page shows besides.

use super::extras::measure;
use super::table::{FUNCTIONS, answer, rows};
use super::{Config, OwnScene, Results, SceneNote};
use crate::cases::{Cases, Elsewhere};
use crate::options::overrides;
use crate::study::question::*;
use clap::ArgMatches;
use clap::parser::ValueSource;
use std::path::PathBuf;
use taut_measure::source;
use taut_model::{ContactScene, HoistParams, Network, SceneSource};

pub(crate) const STUDY: Study = Study {
    name: "bench",
    question: question!("bench", FUNCTIONS),
    options: Own::augment_args,
    reads: |matches| {
        let scenes = matches.get_many::<String>("scenes").into_iter().flatten();
        let files = scenes.filter(|scene| source::is_file(scene));
        let controls = matches.get_one("controls").cloned();
        files.map(PathBuf::from).chain(controls).collect()
    },
    run: |matches, reporter| {
        run(
            &Asked::read(matches),
            &Own::from_arg_matches(matches)?,
            reporter,
        )
    },
};

#[derive(Debug, Args)]
struct Own {
    /// Other scenes instead of the hoist, by name or as TOML files; the networks ring, junction, cranes, ladder, net as in
    /// `taut study scenes`: `--segments` are the ladder's cables, the net's rows and columns; stack, floor and pile over
    /// the mass ratios, with every method of contacts (the pile's cables of 6 segments unless `--set segments`)
    #[arg(long = "scene", value_delimiter = ',', value_name = "SCENE")]
    scenes: Vec<String>,
    /// What the operator does in these scenes: a CSV file with the columns `time` (s) and names of the scene's controls;
    /// linear in between, the first and the last row hold outside
    #[arg(long, value_name = "FILE.csv", requires = "scenes")]
    controls: Option<PathBuf>,
    /// Overrides a parameter of the hoist, or of each scene named
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Prints every row: each solver, each limit of iterations
    #[arg(long)]
    rows: bool,
}

fn config(asked: &Asked, own: &Own) -> Result<Config, ExperimentError> {
    let mut config = Config::new(asked.quick);
    if !asked.segments.is_empty() {
        config.segments.clone_from(&asked.segments);
    }
    asked.ratios(&mut config.ratios)?;
    asked.iterations(&mut config.iterations)?;
    let needs = format!("it must be at least one step of {:.4} s", config.dt);
    asked.time(&mut config.time, config.dt, 1, &needs)?;
    asked.refuse_limits()?;
    config.choices = asked.choices()?;
    if !own.scenes.is_empty() {
        config.own = own_scenes(asked, own, &config.ratios)?;
        return Ok(config);
    }
    let swept = |o: &&String| {
        let key = o.split('=').next().unwrap_or_default();
        ["segments", "mass_ratio", "load_mass"].contains(&key)
    };
    if let Some(o) = own.overrides.iter().find(swept) {
        let reason = "has no effect on the main job: use `--segments` and `--ratios`";
        return Err(Refused(format!("`--set {o}` {reason}")).into());
    }
    config.scene = hoist(&config.scene, &overrides(&own.overrides)?)?;
    Ok(config)
}

/// The scenes named, each once; those on the ground at each mass ratio, unless their own is set.
fn own_scenes(
    asked: &Asked,
    options: &Own,
    ratios: &[f64],
) -> Result<Vec<OwnScene>, ExperimentError> {
    let swept = [
        ("--segments", asked.segments.is_empty()),
        (
            "--ratios",
            asked.ratios.is_empty() || options.scenes.iter().all(|s| is_swept(s)),
        ),
    ];
    if let Some((option, _)) = swept.iter().find(|(_, is_absent)| !is_absent) {
        let reason = "is for the hoist and for networks: set what the scene has with `--set`";
        return Err(Refused(format!("`{option}` {reason}")).into());
    }
    let overrides = overrides(&options.overrides)?;
    let mut own: Vec<OwnScene> = Vec::new();
    for name in &options.scenes {
        if own.iter().any(|known| known.name == *name) {
            continue;
        }
        let is_set = overrides.iter().any(|(key, _)| *key == "mass_ratio");
        let at: Vec<Option<String>> = if is_swept(name) && !is_set {
            ratios.iter().map(|r| Some(format!("{r:?}"))).collect()
        } else {
            vec![None]
        };
        for ratio in &at {
            let ratio = ratio.as_deref().map(|r| ("mass_ratio", r));
            let mut all: Vec<(&str, &str)> = shorter(name).collect();
            all.extend(overrides.iter().copied());
            all.extend(ratio);
            let (_, scene) = source::built(name, &all)?;
            source::mass_ratio(&scene)?;
            own.push(OwnScene {
                name: name.clone(),
                inputs: source::inputs(options.controls.as_deref(), &scene)?,
                scene,
            });
        }
    }
    Ok(own)
}

/// Overrides for a pile: a step of its default size takes up to seconds, too long for hundreds of
/// rows.
fn shorter(name: &str) -> impl Iterator<Item = (&'static str, &'static str)> {
    let is_pile = ContactScene::named(name) == Some(ContactScene::Pile);
    is_pile.then_some(("segments", "6")).into_iter()
}

/// True for a scene on the ground, which is measured over mass ratios as the hoist is.
fn is_swept(name: &str) -> bool {
    ContactScene::named(name).is_some()
}

/// True if networks are asked for. The study of branches and loops runs these: it sets them
/// swinging, grows them, and compares orders of elimination.
pub(crate) fn are_networks(matches: &ArgMatches) -> Result<bool, Refused> {
    let names = matches.get_many::<String>("scenes").into_iter().flatten();
    let (networks, others): (Vec<&String>, Vec<&String>) =
        names.partition(|name| Network::named(name).is_some());
    let Some(network) = networks.first() else {
        return Ok(false);
    };
    let is_given =
        |id: &&(&str, &str)| matches.value_source(id.0) == Some(ValueSource::CommandLine);
    let unread = [
        ("overrides", "--set"),
        ("controls", "--controls"),
        ("time", "--time"),
        ("rows", "--rows"),
    ];
    let unread = unread.iter().find(is_given).map(|(_, option)| *option);
    match unread.or_else(|| others.first().map(|other| other.as_str())) {
        None => Ok(true),
        Some(what) => Err(Refused(format!(
            "`--scene {network}` does not go with `{what}`: give the network as a file, `taut scene {network} > {network}.toml`"
        ))),
    }
}

fn hoist(
    defaults: &HoistParams,
    overrides: &[(&str, &str)],
) -> Result<HoistParams, ExperimentError> {
    let text = SceneSource::Hoist(Box::new(defaults.clone())).to_toml()?;
    match SceneSource::parse(&text, overrides)? {
        SceneSource::Hoist(params) => Ok(*params),
        _ => Err(Refused("the main job runs the hoist only".to_owned()).into()),
    }
}

const ANSWER: &str = "\
Fastest: the least median time of a whole step with multipliers and elongation within the error, unrefined where that
suffices; next: the same of another family of solvers, and how many times as long it takes; k×: iterations a step";

/// Legend of the answer for scenes on the ground.
const ON_THE_GROUND: &str =
    "\nOn the ground: with the velocities after a refined step within the error";

/// Where the rest is.
const MORE: &str =
    "Every row: `taut bench --rows`, target/taut/bench.json; plots: target/taut/report.html";

fn about(config: &Config, scenes: &[SceneNote]) -> Result<String, ExperimentError> {
    let rate = 1.0 / config.dt;
    let scene = if config.own.is_empty() {
        let (hoist, mass) = (&config.scene, config.scene.resolve()?.segment_mass);
        format!(
            "hoist: L = {} m, segments of {mass} kg, Δt = 1/{rate:.0} s, anchor moved {} m",
            hoist.length, hoist.move_x
        )
    } else {
        let mut names: Vec<&str> = config.own.iter().map(|own| own.name.as_str()).collect();
        names.dedup();
        format!("{}: Δt = 1/{rate:.0} s", names.join(", "))
    };
    let stand_in = |note: &SceneNote| {
        let body = note.stand_in.as_ref()?;
        Some(format!(
            "\n{}: no load is named, `{body}` moves most and stands in for it",
            note.scene
        ))
    };
    let stand_ins: String = scenes.iter().filter_map(stand_in).collect();
    let lost: String = scenes
        .iter()
        .filter_map(lost)
        .map(|s| format!("\n{s}"))
        .collect();
    Ok(format!(
        "{scene}; {} s simulated{stand_ins}{lost}",
        config.time
    ))
}

/// How the step itself is lost, solved directly.
fn lost(note: &SceneNote) -> Option<String> {
    let failure = note.failure.as_ref()?;
    Some(format!(
        "{}: the step itself is unstable at t = {:.3} s: {}",
        note.scene, failure.time, failure.reason
    ))
}

/// Which scenes of the user's own are lost within the time simulated.
fn missed(config: &Config, scenes: &[SceneNote]) -> Option<String> {
    let within = |note: &&SceneNote| note.failure.as_ref().is_some_and(|f| f.time <= config.time);
    let lost: Vec<_> = scenes.iter().filter(within).filter_map(lost).collect();
    (!config.own.is_empty() && !lost.is_empty()).then(|| lost.join("; "))
}

/// Text of the run: all rows, or the answer alone.
fn summary(options: &Own, config: &Config, results: &Results) -> Result<String, ExperimentError> {
    let scene = about(config, &results.scenes)?;
    let answer = answer(results);
    let has_contacts = results.records.iter().any(|r| r.velocity_error.is_some());
    let ground = if has_contacts { ON_THE_GROUND } else { "" };
    Ok(if options.rows {
        let rows = rows(results);
        let legend = STUDY.question().legend;
        format!("{scene}\n{legend}\n{MARK}\n{rows}\n{ANSWER}{ground}\n{answer}")
    } else {
        format!("{scene}\n{ANSWER}{ground}\n\n{answer}\n{MORE}\n")
    })
}

fn run(
    asked: &Asked,
    options: &Own,
    reporter: &mut Reporter<'_>,
) -> Result<Found, ExperimentError> {
    let config = config(asked, options)?;
    // The rows are printed before the plots of the page are measured.
    let results = Cases::unless_elsewhere(super::run(&config, reporter.cases))?;
    if let Some(results) = &results {
        (reporter.say)(&summary(options, &config, results)?)?;
    }
    let extras = measure(&config, reporter.cases)?;
    let results = results.ok_or(Elsewhere)?;
    let mut settings = settings(&config)?;
    if !options.overrides.is_empty() {
        settings.push(("set".to_owned(), options.overrides.join(", ")));
    }
    let controls = options.controls.iter();
    settings.extend(controls.map(|path| ("controls".to_owned(), path.display().to_string())));
    Ok(Found {
        settings,
        rows: data(&results.records)?,
        extras: data(&extras)?,
        missed: missed(&config, &results.scenes),
        omissions: results.omissions,
        ..Found::default()
    })
}

fn settings(config: &Config) -> Result<Vec<Setting>, ExperimentError> {
    let scene = if config.own.is_empty() {
        let hoist = config.scene.resolve()?;
        set([
            ("scene", "hoist".to_owned()),
            ("length", format!("{} m", config.scene.length)),
            ("segments of", format!("{} kg", hoist.segment_mass)),
            ("YA", format!("{} N", number(hoist.stiffness.ea))),
            ("anchor moved", format!("{} m", config.scene.move_x)),
            ("segments", counts(&config.segments)),
            ("load/segment", numbers(&config.ratios)),
        ])
    } else {
        let mut own: Vec<_> = config.own.iter().map(|own| own.name.clone()).collect();
        own.dedup();
        set([("scenes", own.join(", "))])
    };
    let run = set([
        ("solvers", solvers(&config.choices)),
        ("iterations", counts(&config.iterations)),
        ("refinements", ONE_REFINEMENT.to_owned()),
        ("Δt", step(config.dt)),
        ("simulated", seconds(config.time)),
        ("stable for", seconds(config.stability_time)),
    ]);
    Ok([scene, run].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_have_units() {
        let settings = settings(&Config::new(false)).expect("a hoist");
        let value = |name: &str| {
            settings
                .iter()
                .find(|(n, _)| n == name)
                .map(|s| s.1.as_str())
        };
        assert_eq!(value("Δt"), Some("1/60 s"));
        assert_eq!(value("YA"), Some("2·10⁷ N"));
        assert_eq!(value("segments"), Some("24, 100"));
    }
}
