//! Experiments on the command line: `taut study NAME`, and the commands that run one experiment each. All are run, reported
//! and written here.

use super::Failure;
use super::cases::{self, CasesArgs, Opened};
use super::console::Console;
use super::{Cli, report};
use clap::{Arg, ArgMatches, Args, Command, value_parser};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use taut_measure::files::{self, FileError, Output};
use taut_output::check::ExperimentError;
use taut_output::row;
use taut_studies::cases::Cases;
use taut_studies::ladder::is_lost;
use taut_studies::studies::{self, BENCH, STUDIES};
use taut_studies::study::{Found, Reporter, Study};

/// `taut study`, with a command for each study; without a name it lists them.
pub(crate) fn with_studies(command: Command) -> Command {
    command
        .subcommands(STUDIES.map(study_command))
        .subcommand_value_name("NAME")
        .subcommand_help_heading("Studies")
        .disable_help_subcommand(true)
        .allow_external_subcommands(true)
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

pub(crate) fn described(command: Command, study: &Study, call: &str) -> Command {
    let question = study.question();
    let calls = question
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
        .about(question.about)
        .after_help(examples);
    if question.details.is_empty() {
        command.long_about(None)
    } else {
        command.long_about(format!("{}\n\n{}", question.about, question.details))
    }
}

pub(crate) fn with_options(command: Command, study: &Study) -> Command {
    let json = format!(
        "Writes {} to a file as well (`-` for standard output, which then holds nothing else)",
        study.question().writes
    );
    CasesArgs::augment_args(study.command(command)).arg(file("json", json))
}

/// An option for a file of rows, of which a shard has not all.
fn file(name: &'static str, help: impl Into<String>) -> Arg {
    Arg::new(name)
        .long(name)
        .value_name("PATH")
        .value_parser(value_parser!(PathBuf))
        .conflicts_with("shard")
        .help(help.into())
}

/// The names of the studies and what each measures.
fn list() -> String {
    let line = |study: &Study| format!("{:<10} {}\n", study.name, study.question().about);
    let lines: String = STUDIES.into_iter().map(line).collect();
    format!(
        "{lines}\n`taut study NAME --help` lists the options of a study, `taut study NAME` runs it.\n"
    )
}

/// An experiment as it is called.
pub(crate) struct Call<'a> {
    /// The command, without its options.
    pub(crate) words: Vec<&'static str>,
    pub(crate) options: &'static Study,
    pub(crate) study: &'static Study,
    /// Its options.
    pub(crate) matches: &'a ArgMatches,
}

/// The experiment that a command calls: the study asked for, else that of a command of its own, else the main job.
pub(crate) fn call(cli: &Cli) -> Result<Option<Call<'_>>, Failure> {
    if let Some(matches) = cli.matches.subcommand_matches("study") {
        let named = matches.subcommand();
        let named = named.and_then(|(name, own)| Some((studies::named(name)?, own)));
        return Ok(named.map(|(study, matches)| Call {
            words: vec!["study", study.name],
            options: study,
            study,
            matches,
        }));
    }
    let (name, matches) = cli
        .matches
        .subcommand()
        .unwrap_or((BENCH.name, &cli.matches));
    let Some(options) = studies::named(name) else {
        return Ok(None);
    };
    let is_main_job = options.name == BENCH.name;
    Ok(Some(Call {
        words: vec![options.name],
        options,
        study: if is_main_job {
            studies::main_job(matches)?
        } else {
            options
        },
        matches,
    }))
}

/// Runs the experiment that is called; lists the studies where none is.
pub(crate) fn run(cli: &Cli, console: Console) -> Result<(), Failure> {
    match call(cli)? {
        Some(call) => perform(&call, console),
        None => Ok(files::print(&list())?),
    }
}

/// Where the rows go.
pub(crate) struct Outputs {
    json: Option<Output>,
    csv: Option<Output>,
}

impl Outputs {
    /// Checks that the outputs can be written and are not among the files read: `read` and those of
    /// the call.
    pub(crate) fn open(
        call: &Call<'_>,
        json: Option<&Path>,
        csv: Option<&Path>,
        read: &[PathBuf],
    ) -> Result<Self, FileError> {
        let own = (call.study.reads)(call.matches);
        let read: Vec<&Path> = own.iter().chain(read).map(PathBuf::as_path).collect();
        let [json, csv] = files::open([("--json", json), ("--csv", csv)], &read)?;
        Ok(Self { json, csv })
    }

    /// True if standard output carries rows and nothing else.
    fn are_rows_alone(&self) -> bool {
        self.json.iter().chain(&self.csv).any(Output::is_stdout)
    }
}

/// Runs an experiment, or a shard of it.
fn perform(call: &Call<'_>, console: Console) -> Result<(), Failure> {
    let path = |name| call.matches.try_get_one::<PathBuf>(name).ok().flatten();
    let [json, csv] = ["json", "csv"].map(|name| path(name).map(PathBuf::as_path));
    let asks = |flag| matches!(call.matches.try_get_one::<bool>(flag), Ok(Some(true)));
    if asks("list") || asks("keys") {
        // It runs nothing, and leaves the files of the last run alone.
        let mut reporter = Reporter {
            cases: &Cases::default(),
            machine: String::new(),
            say: &mut |_| Ok(()),
        };
        let found = (call.study.run)(call.matches, &mut reporter);
        return Ok(files::print(&found.map_err(|e| failed(&e))?.text)?);
    }
    refuse_shared(call, [("`--json`", json), ("`--csv`", csv)])?;
    let outputs = Outputs::open(call, json, csv, &[])?;
    let Opened {
        cases,
        machine,
        path,
    } = cases::open(call)?;
    let cases = cases.shown_by(console.progress(0));
    if cases.is_whole() {
        return run_and_print(
            call,
            &cases,
            machine,
            &report::arguments(),
            &outputs,
            console,
        );
    }
    let mut reporter = Reporter {
        cases: &cases,
        machine,
        say: &mut |_| Ok(()),
    };
    let done = Cases::unless_elsewhere((call.study.run)(call.matches, &mut reporter));
    cases.bar().finish_and_clear();
    done.map_err(|e| failed(&e))?;
    cases.finish().map_err(Failure::Input)?;
    if !console.quiet {
        files::print(&format!("{}: {}\n", cases.summary(), path.display()))?;
    }
    Ok(())
}

/// Refuses a file of rows, or of cases, that is another file of the run as well.
fn refuse_shared(call: &Call<'_>, rows: [(&str, Option<&Path>); 2]) -> Result<(), Failure> {
    let kept = cases::path(call)?;
    let name = call.study.name;
    let data = PathBuf::from(format!("target/taut/{name}.report.json"));
    let page = [("the page", Path::new(report::PAGE)), ("its data", &data)];
    let rows = rows
        .into_iter()
        .filter_map(|(option, path)| Some((option, path?)));
    let asked: Vec<_> = rows.chain([("`--cases`", &*kept)]).collect();
    for (k, (option, path)) in asked.iter().enumerate() {
        let mut others = asked[k + 1..].iter().chain(&page);
        if let Some((other, _)) = others.find(|(_, other)| files::is_same(path, other)) {
            let why = format!("{option} and {other} cannot share a file: give each its own");
            let why = io::Error::new(ErrorKind::InvalidInput, why);
            return Err(FileError::at(path, "write")(why).into());
        }
    }
    Ok(())
}

pub(crate) fn failed(e: &ExperimentError) -> Failure {
    if is_lost(e) {
        return Failure::Unstable(e.to_string());
    }
    Failure::Input(e.to_string())
}

/// Runs an experiment whole, prints the machine and its text, writes rows and page. Code 1 where a bar of ours is missed.
pub(crate) fn run_and_print(
    call: &Call<'_>,
    cases: &Cases,
    machine: String,
    arguments: &[String],
    outputs: &Outputs,
    console: Console,
) -> Result<(), Failure> {
    let are_rows_alone = outputs.are_rows_alone();
    let mut text = String::new();
    let mut say = |part: &str| {
        let start = text.len();
        if text.is_empty() {
            text = format!("{machine}\n");
        }
        text.push_str(part);
        if !are_rows_alone {
            cases.bar().suspend(|| files::print(&text[start..]))?;
        }
        Ok(())
    };
    let mut reporter = Reporter {
        cases,
        machine: machine.clone(),
        say: &mut say,
    };
    let found = (call.study.run)(call.matches, &mut reporter);
    cases.bar().finish_and_clear();
    let mut found = found.map_err(|e| failed(&e))?;
    cases.finish().map_err(Failure::Input)?;
    say(&found.text).map_err(|e| failed(&e))?;
    found.text = text;
    if let Some(csv) = &outputs.csv {
        let rows = row::rows_of(&found.rows, call.study.question().sheets[0].list);
        csv.write(|out| row::csv(&rows, out))?;
    }
    if let Some(json) = &outputs.json {
        json.json(&found.rows)?;
    }
    let notes = if are_rows_alone {
        Console { quiet: true }
    } else {
        console
    };
    write_copy(call.study, &found, notes)?;
    let missed = found.missed.take();
    report::write(call.study, found, machine, arguments, notes)?;
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
