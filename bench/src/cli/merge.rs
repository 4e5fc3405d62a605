//! `taut merge`: the shards of a study as one.

use super::console::Console;
use super::study::{self, Outputs};
use super::{Failure, cases, parse};
use clap::Args;
use std::ffi::OsString;
use std::path::PathBuf;
use taut_studies::cases::{Cases, Header, Written, not_cases};

pub(crate) const AFTER_HELP: &str = "\
Example: taut merge target/taut/stability.1-of-2.cases target/taut/stability.2-of-2.cases --json stability.json";

#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// The files of all shards
    #[arg(value_name = "FILE.cases", required = true)]
    files: Vec<PathBuf>,
    /// Writes the rows to a file as well, as the study itself (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
    /// Writes the rows of the first table to a file as well, as CSV (`-` as above)
    #[arg(long, value_name = "PATH")]
    csv: Option<PathBuf>,
}

/// Tells and writes what the study of these files comes to.
pub(crate) fn run(args: &MergeArgs, console: Console) -> Result<(), Failure> {
    let written = Written::read(&args.files).map_err(Failure::Input)?;
    let first = &args.files[0];
    // Before its options are read, which may be others in another version or be read from the files.
    let same = Header {
        version: cases::version()?,
        inputs: cases::anew(&written.header.inputs)?,
        ..written.header.clone()
    };
    let refused = |other| written.header.check(first, other, "this program");
    refused(&same).map_err(Failure::Input)?;
    let words = std::iter::once("taut").chain(written.header.command.iter().map(String::as_str));
    let unknown = || Failure::Input(not_cases(first));
    let cli = parse::parse(words.map(OsString::from)).map_err(|_| unknown())?;
    let call = study::call(&cli)?.ok_or_else(unknown)?;
    let own = cases::header(&call)?;
    refused(&own).map_err(Failure::Input)?;
    if args.csv.is_some() && call.study.question().sheets.is_empty() {
        let words = call.words.join(" ");
        let message = format!("`taut {words}` has no table of rows for `--csv`: use `--json`");
        return Err(Failure::Input(message));
    }
    let outputs = Outputs::open(
        &call,
        args.json.as_deref(),
        args.csv.as_deref(),
        &args.files,
    )?;
    let cases = Cases::merged(written.known).shown_by(console.progress(0));
    let machines = written.machines.join("; ");
    study::run_and_print(&call, &cases, machines, &own.command, &outputs, console)
}
