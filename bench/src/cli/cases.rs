//! The files of cases on the command line: `--shard`, `--resume`, `--cases`, and what a file says that its cases come from.

use super::Failure;
use super::study::Call;
use crate::machine::{self, Machine};
use crate::run_file::Sum;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, Args, Command, FromArgMatches};
use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use taut_measure::files::{self, FileError};
use taut_studies::cases::{Cases, Header, Journal, Known, Shard, shared};

/// Which cases are run, and where they are kept.
#[derive(Debug, Args)]
pub(crate) struct CasesArgs {
    /// Runs one of N shards, and no tables: those are `taut merge`'s, of the files of all shards
    #[arg(long, value_name = "I/N", help_heading = "Cases")]
    shard: Option<Shard>,
    /// Takes what the file of an earlier run holds and runs the rest; runs all where there is no file
    #[arg(long, help_heading = "Cases")]
    resume: bool,
    /// File that keeps each case as it is finished (default: target/taut/NAME.cases, or NAME.I-of-N.cases)
    #[arg(long = "cases", value_name = "PATH", help_heading = "Cases")]
    kept: Option<PathBuf>,
}

/// The cases of a call, and the machines that they run on or have run on.
pub(crate) struct Opened {
    pub(crate) cases: Cases,
    pub(crate) machine: String,
    /// The file that keeps them.
    pub(crate) path: PathBuf,
}

impl CasesArgs {
    fn shard(&self) -> Shard {
        self.shard.unwrap_or(Shard::WHOLE)
    }

    /// Where the cases of a study are kept.
    fn path(&self, study: &str) -> PathBuf {
        let own = || match self.shard() {
            Shard::WHOLE => format!("target/taut/{study}.cases"),
            Shard { number, of } => format!("target/taut/{study}.{number}-of-{of}.cases"),
        };
        self.kept.clone().unwrap_or_else(|| own().into())
    }
}

/// The file of a call's cases.
pub(crate) fn path(call: &Call<'_>) -> Result<PathBuf, Failure> {
    Ok(CasesArgs::from_arg_matches(call.matches)?.path(call.study.name))
}

/// Opens the file of a call. One that nobody asked for may be impossible to write: then the study runs without.
pub(crate) fn open(call: &Call<'_>) -> Result<Opened, Failure> {
    let args = CasesArgs::from_arg_matches(call.matches)?;
    let (shard, path) = (args.shard(), args.path(call.study.name));
    let is_asked_for = args.resume || args.shard.is_some() || args.kept.is_some();
    let header = header(call)?;
    let machine = header.machine.clone();
    let (cases, machine) = match Journal::open(&path, header, args.resume, is_asked_for) {
        Ok((journal, written)) => (
            Cases::new(shard, written.known, Some(journal)),
            written.machines.join("; "),
        ),
        Err(e) if is_asked_for => return Err(Failure::Input(e)),
        Err(e) => {
            files::complain(&format!("{e}: this run cannot be resumed"));
            (Cases::new(shard, Known::new(), None), machine)
        }
    };
    Ok(Opened {
        cases,
        machine,
        path,
    })
}

/// Version of this program, with a sum of its file, and how it was built. Sources may have changed since, and two builds of
/// changed ones have one commit: only the program itself tells what it computes.
pub(crate) fn version() -> Result<String, FileError> {
    static OWN: OnceLock<u32> = OnceLock::new();
    // What runs, though another build may have taken its place.
    let running = PathBuf::from("/proc/self/exe");
    let program = || match running.exists() {
        true => Ok(running),
        false => std::env::current_exe().map_err(FileError::at("taut".as_ref(), "read")),
    };
    let own = shared(&OWN, || sum_of(&program()?))?;
    let build: Vec<&str> = machine::build_options().collect();
    let version = env!("CARGO_PKG_VERSION");
    Ok(format!("{version} ({own:08x}), {}", build.join(" ")))
}

fn sum_of(path: &Path) -> Result<u32, FileError> {
    let mut sum = Sum::default();
    let read = File::open(path).and_then(|mut file| io::copy(&mut file, &mut sum));
    read.map_err(FileError::at(path, "read"))?;
    Ok(sum.finalize())
}

/// Identity of a call's cases: program, command, input files.
pub(crate) fn header(call: &Call<'_>) -> Result<Header, FileError> {
    Ok(Header {
        version: version()?,
        command: command(call),
        inputs: inputs(call)?,
        machine: Machine::current().to_string(),
    })
}

/// The words of a call with the options that were given, in the order of the help.
fn command(call: &Call<'_>) -> Vec<String> {
    let mut words: Vec<String> = call.words.iter().map(ToString::to_string).collect();
    let options = call.options.command(Command::new(call.options.name));
    for option in options.get_arguments() {
        let id = option.get_id().as_str();
        if call.matches.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        let values = call.matches.get_raw(id).into_iter().flatten();
        let values = values.map(|value| value.to_string_lossy().into_owned());
        words.extend(match option.get_long() {
            Some(long) if is_flag(option) => vec![format!("--{long}")],
            Some(long) => values.map(|value| format!("--{long}={value}")).collect(),
            None => values.collect(),
        });
    }
    words
}

fn is_flag(option: &Arg) -> bool {
    matches!(option.get_action(), ArgAction::SetTrue)
}

/// The files that a call reads, each with a sum. What is missing the study tells; what is a pipe can be read once, by the
/// study.
fn inputs(call: &Call<'_>) -> Result<Vec<String>, FileError> {
    let paths = (call.study.reads)(call.matches).into_iter();
    let there: BTreeSet<PathBuf> = paths.filter(|path| path.is_file()).collect();
    there.iter().map(|path| input(path)).collect()
}

fn input(path: &Path) -> Result<String, FileError> {
    let shown = path.display();
    Ok(match path.is_file() {
        true => format!("{shown} {:08x}", sum_of(path)?),
        false => format!("{shown} is missing"),
    })
}

/// The inputs that a header names as they are now.
pub(crate) fn anew(inputs: &[String]) -> Result<Vec<String>, FileError> {
    let paths = inputs.iter().filter_map(|input| input.rsplit_once(' '));
    paths.map(|(path, _)| input(path.as_ref())).collect()
}
