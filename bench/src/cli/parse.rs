//! From the program's arguments to a command.

use super::Cli;
use super::study::{described, with_options, with_studies};
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, CommandFactory, FromArgMatches};
use std::ffi::OsString;
use taut_studies::studies::{BENCH, COMMANDS, STUDIES};

/// The command line. The commands of experiments are those of their studies; the main job's options stand without a
/// command too.
fn command() -> clap::Command {
    let cli = with_options(Cli::command(), BENCH)
        .about("Sparse linear solvers on hoisting cables: speed against error")
        .long_about(None)
        .mut_subcommand("study", with_studies);
    COMMANDS.into_iter().fold(cli, |cli, study| {
        cli.mut_subcommand(study.name, |own| described(own, study, study.name))
    })
}

/// The arguments as a command. Options of the main job stand before no other command.
pub(crate) fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Cli, clap::Error> {
    let mut cli = command();
    let matches = cli.clone().try_get_matches_from(arguments)?;
    let given =
        |a: &&Arg| matches.value_source(a.get_id().as_str()) == Some(ValueSource::CommandLine);
    let own = cli
        .get_arguments()
        .filter(|a| !a.is_global_set())
        .find(given);
    if let (Some(command), Some(option)) = (matches.subcommand_name(), own) {
        let option = option.get_long().unwrap_or_default();
        let message = format!("`--{option}` stands before `{command}`: put it after it");
        return Err(cli.error(ErrorKind::ArgumentConflict, message));
    }
    let study = matches.subcommand_matches("study");
    let study = study.and_then(ArgMatches::subcommand_name);
    if let Some(name) = study.filter(|name| STUDIES.iter().all(|study| study.name != *name)) {
        let names = STUDIES.map(|study| study.name).join(", ");
        let message = format!("`{name}` is no study: choose one of {names}");
        return Err(cli.error(ErrorKind::InvalidSubcommand, message));
    }
    let cli = Cli::from_arg_matches(&matches)?;
    Ok(Cli { matches, ..cli })
}

/// The command that the arguments begin with, as it is called.
pub(crate) fn asked_for() -> String {
    let names = std::env::args_os().skip(1);
    let names = names.filter(|a| a != "-q" && a != "--quiet");
    let (mut found, mut asked) = (&command(), "taut".to_owned());
    for name in names {
        let Some(next) = found.find_subcommand(name) else {
            break;
        };
        asked = format!("{asked} {}", next.get_name());
        found = next;
    }
    asked
}

#[cfg(test)]
mod tests {
    use super::super::Command;
    use super::*;

    fn parsed(line: &str) -> Result<Cli, clap::Error> {
        parse(line.split_whitespace().map(OsString::from))
    }

    #[test]
    fn quiet_stands_before_and_after_every_command() {
        for line in [
            "taut --quiet",
            "taut -q --quick",
            "taut --quick --quiet",
            "taut --quiet bench",
            "taut bench --quiet --quick",
            "taut study linear -q",
            "taut run hoist --quiet",
            "taut -q run hoist",
            "taut backends --quiet",
        ] {
            let cli = parsed(line).unwrap_or_else(|e| panic!("{line}: {e}"));
            assert!(cli.quiet, "{line}");
        }
        for line in ["taut", "taut bench", "taut --quick", "taut run hoist"] {
            assert!(!parsed(line).unwrap().quiet, "{line}");
        }
        let cli = parsed("taut -q bench --segments 3 --quick").unwrap();
        assert!(matches!(cli.command, Some(Command::Bench)), "{cli:?}");
    }

    #[test]
    fn options_of_the_main_job_stand_before_no_command() {
        for (line, option) in [
            ("taut --quick bench", "--quick"),
            ("taut -q --segments 3 static", "--segments"),
            ("taut --rows bench", "--rows"),
        ] {
            let error = parsed(line).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::ArgumentConflict, "{line}");
            assert!(error.to_string().contains(option), "{line}: {error}");
        }
    }

    /// The commands in a help text: lines that begin with `taut`, each of them one or several.
    fn examples(help: &str) -> Vec<String> {
        let lines = help.lines().map(str::trim);
        let lines = lines.map(|l| l.strip_prefix("Example: ").unwrap_or(l));
        let commands = lines.filter(|l| l.split(' ').next() == Some("taut"));
        let commands = commands.flat_map(|l| l.split("&&"));
        // Where the output goes is the shell's.
        let own = commands.map(|c| c.split(" > ").next().unwrap_or(c));
        own.map(|c| c.trim().to_owned()).collect()
    }

    #[test]
    fn every_help_ends_with_an_example_that_is_understood() {
        let cli = command();
        let mut seen = 0;
        let studies = cli.find_subcommand("study").expect("a command");
        let commands = cli.get_subcommands().chain(studies.get_subcommands());
        for command in std::iter::once(&cli).chain(commands) {
            let name = command.get_name();
            let help = command.get_after_help().map(ToString::to_string);
            let help = help.unwrap_or_else(|| panic!("`{name}` has no example"));
            let last = help.lines().last().map(examples).unwrap_or_default();
            let holds = help.contains("Example") && !last.is_empty();
            assert!(holds, "{name}: {help}");
            for example in examples(&help) {
                parsed(&example).unwrap_or_else(|e| panic!("{example}: {e}"));
                seen += 1;
            }
            let holds = help.contains(&format!("taut {name}"))
                || help.contains(&format!("taut study {name}"))
                || name == "taut";
            assert!(holds, "{help}");
        }
        assert!(seen > cli.get_subcommands().count(), "{seen}");
        let found = examples("Examples:\n  taut a --b > c && taut d\nother taut");
        assert_eq!(found, ["taut a --b", "taut d"]);
    }

    #[test]
    fn workflows_to_copy_call_what_is_understood() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/ci");
        let files = std::fs::read_dir(folder).expect("the folder").flatten();
        let texts = files.map(|f| std::fs::read_to_string(f.path()).expect("a workflow"));
        let mut seen = 0;
        for line in texts.flat_map(|t| t.lines().map(str::to_owned).collect::<Vec<_>>()) {
            let Some((_, arguments)) = line.split_once("- run: ").and_then(|(_, command)| {
                command
                    .split_once("-- track")
                    .or_else(|| command.split_once("taut track"))
            }) else {
                continue;
            };
            let arguments = arguments.split(" || ").next().unwrap_or_default();
            parsed(&format!("taut track{arguments}")).unwrap_or_else(|e| panic!("{line}: {e}"));
            seen += 1;
        }
        assert_eq!(seen, 4);
    }

    #[test]
    fn the_definition_of_the_command_line_is_sound() {
        command().debug_assert();
    }
}
