//! `taut study NAME`: the experiments beside the main job, each with options of its own.

use super::console::Console;
use super::deliver::{Way, deliver};
use crate::Failure;
use clap::error::ErrorKind;
use clap::{ArgMatches, Args, Command, FromArgMatches};
use std::path::{Path, PathBuf};
use taut_ground::files::{self, Output};
use taut_output::row;
use taut_studies::studies::{self, STUDIES};
use taut_studies::study::Study;

/// The study asked for with its options; none for the list.
#[derive(Debug)]
pub(crate) struct StudyArgs(Option<(&'static Study, ArgMatches)>);

/// Where the rows of a study go.
#[derive(Debug, Args)]
struct Files {
    /// Writes all rows to a file as well (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
    /// Writes the rows of its first table to a file as well, as CSV (`-` as above)
    #[arg(long, value_name = "PATH")]
    csv: Option<PathBuf>,
}

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
        let Some(study) = studies::named(name) else {
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
    let command = Files::augment_args((study.options)(Command::new(study.name)));
    let example = format!("Example: taut study {} {}", study.name, study.example);
    // Last, for options bring a text of their own.
    command
        .about(study.about)
        .long_about(None)
        .after_help(example)
}

/// Runs the study asked for; without one, lists them all.
pub(crate) fn run(args: &StudyArgs, console: Console) -> Result<(), Failure> {
    let Some((study, matches)) = &args.0 else {
        return Ok(files::print(&list())?);
    };
    let read = (study.reads)(matches);
    let read: Vec<&Path> = read.iter().map(PathBuf::as_path).collect();
    let files = Files::from_arg_matches(matches)?;
    let options = [
        ("--json", files.json.as_deref()),
        ("--csv", files.csv.as_deref()),
    ];
    let [json, csv] = files::open(options, &read)?;
    let bar = console.progress(0).with_message(study.name);
    let found = (study.run)(matches, &bar).map_err(|e| Failure::Input(e.to_string()))?;
    bar.finish_and_clear();
    let way = Way {
        console,
        json: json.as_ref(),
        is_rows_alone: json.iter().chain(&csv).any(Output::is_stdout),
    };
    if let Some(csv) = &csv {
        let rows = row::rows_of(&found.rows, study.sheets[0].list);
        csv.write(|out| row::csv(&rows, out))?;
    }
    deliver(study.name, found, way)
}

/// The names of the studies and what each measures.
fn list() -> String {
    let line = |study: &Study| format!("{:<10} {}\n", study.name, study.about);
    let lines: String = STUDIES.into_iter().map(line).collect();
    format!(
        "{lines}\n`taut study NAME --help` lists the options of a study, `taut study NAME` runs it.\n"
    )
}
