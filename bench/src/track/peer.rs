//! A program in a process of its own that times the steps of a case whenever it is asked to.
//!
//! `taut track --measure` says [`Hello`], then answers each line of its input, a [`Question`], with a line, an [`Answer`];
//! it ends with its input. It builds a scene when it is first asked for it, and remembers the least time of each step: its
//! answers fall. Asked in turns, two such programs measure within milliseconds of each other.

use super::base::Program;
use super::cases::{CASES, Case, Workload, named};
use super::measures::{Measure, Missing};
use super::minute::Minutes;
use super::start::{PASS, Start};
use super::{child, toolchain, wall};
use crate::machine::PROFILE;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::io::{self, BufRead, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;
use taut_integrator::{StepError, Stepper};
use taut_measure::choice::Choice;

/// Version of the messages and of the measurements behind them.
const SCHEMA: u32 = 2;

/// First message of a program.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Hello {
    schema: u32,
    /// [`PROFILE`].
    build: String,
    /// Compiler and processor.
    pub(super) toolchain: String,
    /// The names of its cases.
    pub(super) cases: Vec<String>,
}

/// Request for a time.
#[derive(Debug, Serialize, Deserialize)]
struct Question {
    case: String,
    /// The measure's: `time-min` or `time-p99`.
    measure: String,
    /// Passes or minutes.
    repeats: usize,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Answer {
    /// The time of all that was measured of it so far \[ns].
    Ns(f64),
    /// Reason for a missing time; not a fault.
    Missing(String),
    /// The measurement failed.
    Failed(String),
}

/// Answers until the input ends; each step is slowed by the part `slowed` of its time.
pub fn serve(slowed: f64, mut input: impl BufRead, mut output: impl Write) -> io::Result<()> {
    let hello = Hello {
        schema: SCHEMA,
        build: PROFILE.to_owned(),
        toolchain: toolchain(),
        cases: CASES.map(|case| case.name()).into(),
    };
    say(&mut output, &hello)?;
    let mut timed = HashMap::new();
    while let Some(line) = child::line(&mut input)? {
        let answer = match serde_json::from_str::<Question>(&line) {
            Ok(question) => match answer(&mut timed, question, slowed) {
                Ok(ns) => Answer::Ns(ns),
                Err(Missing::NotMeasured(why)) => Answer::Missing(why),
                Err(Missing::Failed(why)) => Answer::Failed(why),
            },
            Err(e) => Answer::Failed(format!("`{line}` is no question: {e}")),
        };
        say(&mut output, &answer)?;
    }
    Ok(())
}

fn say(to: &mut impl Write, what: &impl Serialize) -> io::Result<()> {
    writeln!(to, "{}", serde_json::to_string(what)?)?;
    to.flush()
}

/// A case, and the least times of its steps \[ns].
struct Timed {
    choice: Choice,
    start: Start,
    stepper: Stepper,
    least: [f64; PASS],
    minutes: Minutes,
}

impl Timed {
    fn new(case: &Case, choice: Choice) -> Result<Self, StepError> {
        let start = Start::new(case.workload)?;
        Ok(Self {
            stepper: start.stepper(&choice)?,
            choice,
            start,
            least: [f64::INFINITY; PASS],
            minutes: Minutes::new(),
        })
    }
}

/// The time that a question asks for \[ns].
fn answer(
    all: &mut HashMap<String, Timed>,
    question: Question,
    slowed: f64,
) -> Result<f64, Missing> {
    let absent = Missing::NotMeasured;
    let case = named(&question.case).map_err(absent)?;
    let timed = match all.entry(question.case) {
        Entry::Occupied(known) => known.into_mut(),
        Entry::Vacant(new) => {
            let choice = case.choice().map_err(absent)?;
            new.insert(Timed::new(&case, choice)?)
        }
    };
    let is = |measure: Measure| question.measure == measure.name();
    if is(Measure::P99) && case.workload == Workload::Gantry {
        for _ in 0..question.repeats {
            let Timed { start, choice, .. } = timed;
            timed.minutes.drive(start.scene(), choice, slowed)?;
        }
        return Ok(timed.minutes.p99());
    }
    if !is(Measure::Min) {
        return Err(absent(format!("`{}` is not timed", question.measure)));
    }
    for _ in 0..question.repeats {
        wall::pass(&timed.start, &mut timed.stepper, &mut timed.least, slowed)?;
    }
    Ok(timed.least.iter().sum::<f64>() / PASS as f64)
}

/// A program that was started and answers. It ends with this.
pub(super) struct Peer {
    path: PathBuf,
    limit: Duration,
    child: Child,
    to: ChildStdin,
    answers: Receiver<String>,
    /// The last line on its standard error, once that is closed.
    said: Receiver<String>,
    pub(super) hello: Hello,
}

impl Drop for Peer {
    fn drop(&mut self) {
        child::end(&mut self.child);
    }
}

impl Peer {
    /// Starts a program, which has to say that it measures, and to answer within `limit` ever after.
    pub(super) fn start(program: &Program, limit: Duration) -> Result<Self, String> {
        let fail = |e: io::Error| {
            let program = program.path.display();
            format!(
                "cannot start `{program}`: {e}; `--against` takes a program `taut` or a revision"
            )
        };
        let mut command = Command::new(&program.path);
        command.args(["track", "--measure"]);
        if program.slowed > 0.0 {
            command.args(["--slowed", &program.slowed.to_string()]);
        }
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().map_err(fail)?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(to), Some(out), Some(err)) = pipes else {
            child::end(&mut child);
            return Err(fail(io::ErrorKind::BrokenPipe.into()));
        };
        let mut peer = Self {
            path: program.path.clone(),
            limit,
            child,
            to,
            answers: child::lines(out),
            said: child::last_line(err),
            hello: Hello::default(),
        };
        peer.hello = peer.hello()?;
        Ok(peer)
    }

    /// Reads the first message; fails if the program has another schema or another build profile.
    fn hello(&mut self) -> Result<Hello, String> {
        let line = self.next();
        let program = self.path.display();
        let stranger = |said: &str| {
            let said = shortened(said);
            format!(
                "`{program}` cannot be compared: it is no `taut`, or one older than `taut track --against`; it said: {said}"
            )
        };
        let line = line.map_err(|(why, said)| said.map_or(why, |said| stranger(&said)))?;
        let value: serde_json::Value = serde_json::from_str(&line).unwrap_or_default();
        match (value["schema"].as_u64(), serde_json::from_value(value)) {
            (Some(schema), _) if schema != u64::from(SCHEMA) => Err(format!(
                "`{program}` measures by schema {schema}, this program by {SCHEMA}: compare revisions with the same one"
            )),
            (_, Ok(Hello { build, .. })) if build != PROFILE => Err(format!(
                "`{program}` is a {build} build, this program a {PROFILE} build: build both alike"
            )),
            (_, Ok(hello)) => Ok(hello),
            (_, Err(_)) => Err(stranger(&line)),
        }
    }

    /// A time of a case \[ns], or the reason why it is missing.
    pub(super) fn time(
        &mut self,
        case: &str,
        measure: Measure,
        repeats: usize,
    ) -> Result<Result<f64, Missing>, String> {
        let question = Question {
            case: case.to_owned(),
            measure: measure.name().to_owned(),
            repeats,
        };
        // A program that no longer reads has ended, and has said why.
        let _ = say(&mut self.to, &question);
        let line = self.next().map_err(|(why, _)| why)?;
        match serde_json::from_str(&line) {
            Ok(Answer::Ns(ns)) if ns.is_finite() && ns > 0.0 => Ok(Ok(ns)),
            Ok(Answer::Missing(why)) => Ok(Err(Missing::NotMeasured(why))),
            Ok(Answer::Failed(why)) => Ok(Err(Missing::Failed(why))),
            _ => Err(format!(
                "`{}` answered what is no time: {}",
                self.path.display(),
                shortened(&line)
            )),
        }
    }

    /// Its next line; or why there is none, and of one that ended its last line on standard error.
    fn next(&mut self) -> Result<String, (String, Option<String>)> {
        let program = self.path.display();
        match self.answers.recv_timeout(self.limit) {
            Ok(line) => Ok(line),
            Err(RecvTimeoutError::Timeout) => {
                let limit = self.limit.as_secs_f64();
                let late = format!(
                    "`{program}` did not answer within {limit} s: `--limit` gives it longer"
                );
                Err((late, None))
            }
            Err(RecvTimeoutError::Disconnected) => {
                let status = child::wait(&mut self.child, self.limit).ok().flatten();
                let status = status.map_or_else(|| "no status".to_owned(), |s| s.to_string());
                let said = self.said.recv_timeout(Duration::from_secs(1));
                let said = said.unwrap_or_default();
                let shown = shortened(&said);
                let ended =
                    format!("`{program}` ended while it was measured: {status}; it said: {shown}");
                Err((ended, Some(said)))
            }
        }
    }
}

/// The beginning of what a program said.
fn shortened(said: &str) -> String {
    match said.char_indices().nth(300) {
        Some((end, _)) => format!("{} …", &said[..end]),
        None if said.is_empty() => "nothing".to_owned(),
        None => said.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn served(questions: &str, slowed: f64) -> Vec<Value> {
        let mut output = Vec::new();
        serve(slowed, questions.as_bytes(), &mut output).unwrap();
        let text = String::from_utf8(output).unwrap();
        text.lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }

    #[test]
    fn every_question_has_an_answer() {
        let questions = [
            json!({ "case": "ring-24/banded", "measure": "time-min", "repeats": 2 }).to_string(),
            json!({ "case": "ring-23/banded", "measure": "time-min", "repeats": 2 }).to_string(),
            json!({ "case": "ring-24/banded", "measure": "load-error", "repeats": 1 }).to_string(),
            "what?".to_owned(),
        ];
        let said = served(&questions.join("\n"), 0.0);
        assert_eq!(said[0]["schema"], SCHEMA);
        if cfg!(feature = "banded") {
            assert!(said[1]["ns"].as_f64() > Some(0.0), "{said:?}");
            assert!(said[3]["missing"].is_string(), "{said:?}");
        }
        let unknown = said[2]["missing"].as_str().unwrap();
        assert!(unknown.contains("ring-23/banded"), "{unknown}");
        assert!(said[4]["failed"].as_str().unwrap().contains("what?"));
    }

    #[test]
    fn a_slowed_step_takes_longer() {
        if !cfg!(feature = "banded") {
            return;
        }
        let question = json!({ "case": "ring-24/banded", "measure": "time-min", "repeats": 30 });
        let time = |slowed| {
            served(&question.to_string(), slowed)[1]["ns"]
                .as_f64()
                .unwrap()
        };
        // Threefold, so that no disturbance hides it.
        assert!(time(2.0) > 1.5 * time(0.0));
    }
}
