//! Experiments on the command line: `taut study NAME`, and the commands that run one experiment each. All are run, told
//! and written here.

use super::Failure;
use super::console::Console;
use super::report;
use crate::machine::Machine;
use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, value_parser};
use std::path::{Path, PathBuf};
use taut_ground::files::{self, Output};
use taut_output::check::ExperimentError;
use taut_output::row;
use taut_studies::studies::{self, BENCH, STUDIES};
use taut_studies::study::{Found, Reporter, Study};

/// The study asked for with its options; none for the list.
#[derive(Debug)]
pub(crate) struct StudyArgs(Option<(&'static Study, ArgMatches)>);

impl Args for StudyArgs {
    fn augment_args(command: Command) -> Command {
        command
            .subcommands(STUDIES.map(study_command))
            .subcommand_value_name("NAME")
            .subcommand_help_heading("Studies")
            .disable_help_subcommand(true)
            .allow_external_subcommands(true)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for StudyArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let Some((name, own)) = matches.subcommand() else {
            return Ok(Self(None));
        };
        let Some(study) = STUDIES.into_iter().find(|study| study.name == name) else {
            let names = STUDIES.map(|study| study.name).join(", ");
            let message = format!("`{name}` is no study: choose one of {names}");
            return Err(clap::Error::raw(ErrorKind::InvalidSubcommand, message));
        };
        Ok(Self(Some((study, own.clone()))))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn study_command(study: &'static Study) -> Command {
    let command = described(
        Command::new(study.name),
        study,
        &format!("study {}", study.name),
    );
    command.arg(file(
        "csv",
        "Writes the rows of its first table to a file as well, as CSV (`-` as above)",
    ))
}

/// The command of a study, called in that way.
pub(crate) fn described(command: Command, study: &Study, call: &str) -> Command {
    let calls = study
        .examples
        .iter()
        .map(|arguments| format!("taut {call} {arguments}"));
    let calls: Vec<String> = calls.collect();
    let examples = match &calls[..] {
        [one] => format!("Example: {one}"),
        several => format!("Examples:\n  {}", several.join("\n  ")),
    };
    // Last, for options bring a text of their own.
    let command = with_options(command, study)
        .about(study.about)
        .after_help(examples);
    if study.details.is_empty() {
        command.long_about(None)
    } else {
        command.long_about(format!("{}\n\n{}", study.about, study.details))
    }
}

/// A command with the options of a study.
pub(crate) fn with_options(command: Command, study: &Study) -> Command {
    let json = format!(
        "Writes {} to a file as well (`-` for standard output, which then holds nothing else)",
        study.writes
    );
    (study.options)(command).arg(file("json", json))
}

/// An option for a file that is written.
fn file(name: &'static str, help: impl Into<String>) -> Arg {
    Arg::new(name)
        .long(name)
        .value_name("PATH")
        .value_parser(value_parser!(PathBuf))
        .help(help.into())
}

/// The names of the studies and what each measures.
fn list() -> String {
    let line = |study: &Study| format!("{:<10} {}\n", study.name, study.about);
    let lines: String = STUDIES.into_iter().map(line).collect();
    format!(
        "{lines}\n`taut study NAME --help` lists the options of a study, `taut study NAME` runs it.\n"
    )
}

/// Runs the study asked for; without one, lists them all.
pub(crate) fn run(args: &StudyArgs, console: Console) -> Result<(), Failure> {
    match &args.0 {
        Some((study, matches)) => perform(study, matches, console),
        None => Ok(files::print(&list())?),
    }
}

/// Runs the experiment whose command was given; without a command the main job.
pub(crate) fn run_own(matches: &ArgMatches, console: Console) -> Result<(), Failure> {
    let (name, matches) = matches.subcommand().unwrap_or((BENCH.name, matches));
    let study = match studies::named(name) {
        Some(study) if study.name != BENCH.name => study,
        _ => studies::main_job(matches)?,
    };
    perform(study, matches, console)
}

/// Runs an experiment, prints the machine and its text, writes rows and page. Code 1 where a bar of ours is missed.
fn perform(study: &Study, matches: &ArgMatches, console: Console) -> Result<(), Failure> {
    let read = (study.reads)(matches);
    let read: Vec<&Path> = read.iter().map(PathBuf::as_path).collect();
    let path = |name| matches.try_get_one::<PathBuf>(name).ok().flatten();
    let [json, csv] = ["json", "csv"].map(|name| path(name).map(PathBuf::as_path));
    let [json, csv] = files::open([("--json", json), ("--csv", csv)], &read)?;
    let are_rows_alone = json.iter().chain(&csv).any(Output::is_stdout);
    let bar = console.progress(0).with_message(study.name);
    let machine = Machine::current().to_string();
    let mut text = String::new();
    let mut say = |part: &str| {
        let start = text.len();
        if text.is_empty() {
            text = format!("{machine}\n");
        }
        text.push_str(part);
        if !are_rows_alone {
            bar.suspend(|| files::print(&text[start..]))?;
        }
        Ok(())
    };
    let mut reporter = Reporter {
        progress: &bar,
        machine: machine.clone(),
        say: &mut say,
    };
    let found = (study.run)(matches, &mut reporter);
    bar.finish_and_clear();
    let failed = |e: ExperimentError| Failure::Input(e.to_string());
    let mut found = found.map_err(failed)?;
    say(&found.text).map_err(failed)?;
    found.text = text;
    if let Some(csv) = &csv {
        let rows = row::rows_of(&found.rows, study.sheets[0].list);
        csv.write(|out| row::csv(&rows, out))?;
    }
    if let Some(json) = &json {
        json.json(&found.rows)?;
    }
    let notes = if are_rows_alone {
        Console { quiet: true }
    } else {
        console
    };
    write_copy(study, &found, notes)?;
    let missed = found.missed.take();
    report::write(study, found, notes)?;
    missed.map_or(Ok(()), |missed| Err(Failure::Check(missed)))
}

/// Writes the rows to `target/taut/`.
fn write_copy(study: &Study, found: &Found, console: Console) -> Result<(), Failure> {
    let copy = PathBuf::from(format!("target/taut/{}.json", study.name));
    if let Err(e) = files::write_json(&copy, &found.rows) {
        // The table is out and the file asked for is written: this costs the copy only.
        files::complain(&e.to_string());
        return Ok(());
    }
    console.note(&format!("\nrows written to {}", copy.display()))
}
