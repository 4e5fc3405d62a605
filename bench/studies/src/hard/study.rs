//! The study of the hard cases: its options, and the cases that it runs.

use super::{Case, CaseFile, Measured, cases, file, named};
use crate::checks::{self, Catalogue};
use crate::options::Refused;
use crate::question;
use crate::study::{Found, Reporter, Study};
use clap::{Args, FromArgMatches};
use std::ffi::OsStr;
use std::path::Path;
use taut_output::check::ExperimentError;

pub(crate) const STUDY: Study = Study {
    name: "hard",
    question: question!("hard", &[]),
    options: Options::augment_args,
    reads: |matches| {
        let cases = matches.get_many("cases").into_iter().flatten();
        let files = cases.filter_map(|case| match case {
            Case::File(file) => Some(&file.files),
            Case::Coded(_) => None,
        });
        files.flatten().cloned().collect()
    },
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter),
};

#[derive(Debug, Args)]
struct Options {
    /// Cases by name, such as H42, or as TOML files, whose keys `--keys` explains (default: all)
    #[arg(value_name = "CASE", value_parser = found)]
    cases: Vec<Case>,
    /// Lists the cases: name, title, and what those of files guarantee, with which number
    #[arg(long)]
    list: bool,
    /// Explains the keys of a case's file
    #[arg(long)]
    keys: bool,
    /// A short form, some seconds altogether
    #[arg(long)]
    quick: bool,
}

fn is_file(argument: &OsStr) -> bool {
    let ending = Path::new(argument).extension();
    ending.is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

/// The case with that name, or of that file.
fn found(argument: &str) -> Result<Case, ExperimentError> {
    if !is_file(argument.as_ref()) {
        return Ok(named(argument)?);
    }
    let file = CaseFile::open(argument.as_ref())?;
    file::verify(&file)?;
    // It lives as long as the program, as those that come with it.
    Ok(Case::File(Box::leak(Box::new(file))))
}

fn listed(case: &Case) -> String {
    let head = format!("{}: {}\n", case.name(), case.title());
    let Case::File(file) = case else {
        return head;
    };
    let lines = file::guarantees(file);
    let lines = lines.iter().map(|line| format!("    {line}\n"));
    std::iter::once(head).chain(lines).collect()
}

fn run(options: &Options, reporter: &mut Reporter<'_>) -> Result<Found, ExperimentError> {
    let mut experiments = options.cases.clone();
    if experiments.is_empty() {
        experiments.extend(cases());
    }
    for (k, case) in experiments.iter().enumerate() {
        let mut before = experiments[..k].iter();
        if before.any(|other| other.name() == case.name() && !other.is(case)) {
            let reason = format!("two cases are called `{}`: rename one", case.name());
            return Err(Refused(reason).into());
        }
    }
    if options.list || options.keys {
        let text = match options.keys {
            true => file::help(),
            false => experiments.iter().map(listed).collect(),
        };
        return Ok(Found {
            text,
            ..Found::default()
        });
    }
    let catalogue = Catalogue {
        legend: STUDY.question().legend,
        reference: "reference",
        experiments,
        quick: options.quick,
    };
    checks::run(&catalogue, reporter, &|_, _| Ok(()))
}
