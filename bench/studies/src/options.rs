//! Options that several experiments read, each with what it stands for and what it refuses.

use clap::{ArgMatches, Args, Command};
use std::any::Any;
use std::path::{Path, PathBuf};
use taut_measure::choice::Choice;
use taut_measure::trajectory::steps_in;
use taut_output::settings::distinct;

/// An option whose value cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Refused(pub String);

fn refused<T>(reason: String) -> Result<T, Refused> {
    Err(Refused(reason))
}

/// Options that several questions read; each takes some of them.
#[derive(Debug, Clone, Default, Args)]
pub struct Asked {
    /// Numbers of segments
    #[arg(long, value_delimiter = ',', value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub(crate) segments: Vec<usize>,
    /// Mass ratios load/segment
    #[arg(long, value_delimiter = ',', value_name = "R", value_parser = number, allow_negative_numbers = true)]
    pub(crate) ratios: Vec<f64>,
    /// Solvers: a backend with options after colons, `/kkt` for the KKT form, such as cg:jacobi or umfpack/kkt
    #[arg(long, value_delimiter = ',', value_name = "B")]
    pub(crate) backends: Vec<String>,
    /// Limits of iterations for the iterative solvers
    #[arg(long, value_delimiter = ',', value_name = "K", value_parser = count, allow_negative_numbers = true)]
    iterations: Vec<usize>,
    /// Simulated time of what is run to its end (s)
    #[arg(long, value_name = "S", value_parser = number, allow_negative_numbers = true)]
    time: Option<f64>,
    /// A tenth of the work, under 10 s
    #[arg(long)]
    pub(crate) quick: bool,
}

/// Adds options by name to a command: its own, else those of [`Asked`].
pub(crate) fn taking(command: Command, names: &[&str], own: fn(Command) -> Command) -> Command {
    let all = Asked::augment_args(own(Command::new("all")));
    let named = |name: &&str| all.get_arguments().find(|arg| arg.get_id() == *name);
    let found = names.iter().filter_map(named).enumerate();
    // The help keeps the order of the names.
    command.args(found.map(|(k, arg)| arg.clone().display_order(k)))
}

/// The values of an option; none where a command does not take it.
fn given<T: Any + Clone + Send + Sync>(matches: &ArgMatches, name: &str) -> Vec<T> {
    let values = matches.try_get_many::<T>(name).ok().flatten();
    values.into_iter().flatten().cloned().collect()
}

/// The files that the paths of an option lead to.
pub(crate) fn read_by(
    matches: &ArgMatches,
    name: &str,
    files: fn(&Path) -> Vec<PathBuf>,
) -> Vec<PathBuf> {
    let paths = given::<PathBuf>(matches, name).into_iter();
    paths.flat_map(|path| files(&path)).collect()
}

impl Asked {
    pub(crate) fn read(matches: &ArgMatches) -> Self {
        Self {
            segments: given(matches, "segments"),
            ratios: given(matches, "ratios"),
            backends: given(matches, "backends"),
            iterations: given(matches, "iterations"),
            time: given(matches, "time").pop(),
            quick: given::<bool>(matches, "quick") == [true],
        }
    }

    /// The numbers given, ascending and once each, in place of others.
    pub(crate) fn segments(&self, numbers: &mut Vec<usize>) {
        *numbers = sorted(&self.segments, std::mem::take(numbers));
    }

    /// The ratios given, ascending and once each, in place of others.
    pub(crate) fn ratios(&self, ratios: &mut Vec<f64>) -> Result<(), Refused> {
        if !self.ratios.is_empty() {
            ratios.clone_from(&self.ratios);
        }
        require_positive("a number of `--ratios`", ratios)?;
        ratios.sort_by(f64::total_cmp);
        ratios.dedup();
        Ok(())
    }

    /// The solvers named, each once; every solver where none is.
    pub(crate) fn choices(&self) -> Result<Vec<Choice>, Refused> {
        if self.backends.is_empty() {
            return Ok(Choice::all());
        }
        let choices = self.backends.iter().map(|name| choice(name));
        Ok(distinct(
            choices.collect::<Result<Vec<_>, _>>()?.into_iter(),
        ))
    }

    /// Refuses limits in names, for a study that runs iterative solvers to each of its own.
    pub(crate) fn refuse_limits(&self) -> Result<(), Refused> {
        match self.backends.iter().find(|b| b.contains("iterations=")) {
            None => Ok(()),
            Some(name) => refused(format!(
                "`iterations=` in `{name}` has no effect here: use `--iterations`"
            )),
        }
    }

    /// The limits given, ascending and once each, in place of others.
    pub(crate) fn iterations(&self, limits: &mut Vec<usize>) -> Result<(), Refused> {
        *limits = sorted(&self.iterations, std::mem::take(limits));
        if limits.first() == Some(&0) {
            return refused("`--iterations` holds 0: each limit must be at least 1".to_owned());
        }
        Ok(())
    }

    /// The time given in place of another, in at least so many steps of `dt`, both in seconds.
    pub(crate) fn time(
        &self,
        time: &mut f64,
        dt: f64,
        least: usize,
        needs: &str,
    ) -> Result<(), Refused> {
        *time = self.time.unwrap_or(*time);
        if steps(*time, dt)? < least {
            return refused(format!("`--time` is {time} s: {needs}"));
        }
        Ok(())
    }
}

pub(crate) fn choice(name: &str) -> Result<Choice, Refused> {
    let choice: Choice = name.parse().map_err(Refused)?;
    choice.check().map_err(|e| Refused(e.to_string()))?;
    Ok(choice)
}

/// Of a whole and a quick value the one that is asked for.
pub(crate) fn pick<T>(quick: bool, [whole, short]: [T; 2]) -> T {
    if quick { short } else { whole }
}

/// Keys with their values, of `--set KEY=VALUE`.
pub fn overrides(texts: &[String]) -> Result<Vec<(&str, &str)>, Refused> {
    let split = |t: &String| Refused(format!("`--set {t}` is not of the form KEY=VALUE"));
    texts
        .iter()
        .map(|t| t.split_once('=').ok_or_else(|| split(t)))
        .collect()
}

/// A number, or a fraction of two.
pub fn number(text: &str) -> Result<f64, String> {
    let parse = |t: &str| {
        let number = t.trim().parse::<f64>();
        number.map_err(|_| format!("`{t}` is no number: write it as 60, 1e5 or 1/60"))
    };
    match text.split_once('/') {
        None => parse(text),
        Some((a, b)) => Ok(parse(a)? / parse(b)?),
    }
}

pub fn count(text: &str) -> Result<usize, String> {
    let number = text.trim().parse::<usize>();
    number.map_err(|_| format!("`{text}` is no whole number from 0 on"))
}

/// The numbers given, ascending and once each; those of `default` where none is given.
pub(crate) fn sorted(given: &[usize], default: Vec<usize>) -> Vec<usize> {
    let mut numbers = if given.is_empty() {
        default
    } else {
        given.to_vec()
    };
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// Fails unless every number is positive and finite.
pub fn require_positive(what: &str, numbers: &[f64]) -> Result<(), Refused> {
    match numbers.iter().find(|x| !(x.is_finite() && **x > 0.0)) {
        None => Ok(()),
        Some(x) => refused(format!(
            "{what} is {x}: it must be a positive finite number"
        )),
    }
}

/// The number of steps of `dt` in `time`, both in seconds.
pub fn steps(time: f64, dt: f64) -> Result<usize, Refused> {
    const MOST: f64 = 1e7;
    require_positive("`--time`", &[time])?;
    require_positive("`--dt`", &[dt])?;
    if time / dt > MOST {
        return refused(format!(
            "`--time` {time} s is {:.1e} steps of {dt:.3e} s: at most {MOST:.0e} can be recorded",
            time / dt
        ));
    }
    Ok(steps_in(time, dt))
}
