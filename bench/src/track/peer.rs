//! A program in a process of its own that times the steps of a case whenever it is asked to.
//!
//! `taut track --measure` says [`Hello`], then answers each line of its input, a [`Question`], with a line, an [`Answer`];
//! it ends with its input. Scenes are built when they are first asked for and kept. Asked in turns, two such programs
//! measure within milliseconds of each other, so that what slows the machine slows both.

use super::base::Program;
use super::cases::{Place, named};
use super::measures::{Measure, Missing};
use super::minute::Minutes;
use super::start::{PASS, Start};
use super::{child, toolchain, wall};
use crate::machine::PROFILE;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::io::{self, BufRead, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;
use taut_ground::choice::Choice;
use taut_integrator::{StepError, Stepper};

/// Of these messages, and of what they ask for.
const SCHEMA: u32 = 1;

/// What a program says first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Hello {
    /// [`SCHEMA`].
    schema: u32,
    /// [`PROFILE`].
    build: String,
    /// Compiler and processor.
    toolchain: String,
}

/// What it is asked for.
#[derive(Debug, Serialize, Deserialize)]
struct Question {
    /// The case's name.
    case: String,
    /// The measure's: `time-min` or `time-p99`.
    measure: String,
    /// Passes or minutes, of which each step's least time counts.
    repeats: usize,
}

/// What it answers.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Answer {
    /// A time \[ns].
    Ns(f64),
    /// Why it has none, which is no fault.
    Missing(String),
    /// What failed.
    Failed(String),
}

/// Answers until the input ends; each step is slowed by the part `slowed` of its time.
///
/// # Errors
/// Streams that cannot be read or written.
pub fn serve(slowed: f64, mut input: impl BufRead, mut output: impl Write) -> io::Result<()> {
    let hello = Hello {
        schema: SCHEMA,
        build: PROFILE.to_owned(),
        toolchain: toolchain(),
    };
    say(&mut output, &hello)?;
    let mut server = Server {
        slowed,
        starts: Vec::new(),
        steppers: Vec::new(),
    };
    while let Some(line) = child::line(&mut input)? {
        let answer = match serde_json::from_str::<Question>(&line) {
            Ok(question) => server.answer(&question),
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

/// What has been built to answer.
struct Server {
    slowed: f64,
    starts: Vec<(Place, Start)>,
    /// By the names of their cases.
    steppers: Vec<(String, Stepper)>,
}

impl Server {
    fn answer(&mut self, question: &Question) -> Answer {
        match self.time(question) {
            Ok(ns) => Answer::Ns(ns),
            Err(Missing::NotMeasured(why)) => Answer::Missing(why),
            Err(Missing::Failed(why)) => Answer::Failed(why),
        }
    }

    fn time(&mut self, question: &Question) -> Result<f64, Missing> {
        let absent = Missing::NotMeasured;
        let case = named(&question.case).map_err(|e| absent(e.to_string()))?;
        let choice = case.choice().map_err(absent)?;
        let failed = |e: StepError| Missing::Failed(e.to_string());
        let start = self.start(case.place).map_err(failed)?;
        if question.measure == Measure::P99.name() && case.place == Place::Gantry {
            let (scene, mut minutes) = (self.starts[start].1.scene(), Minutes::new());
            for _ in 0..question.repeats {
                minutes.drive(scene, &choice, self.slowed).map_err(failed)?;
            }
            return Ok(minutes.p99());
        }
        if question.measure != Measure::Min.name() {
            return Err(absent(format!("`{}` is not timed", question.measure)));
        }
        let stepper = self
            .stepper(&question.case, start, &choice)
            .map_err(failed)?;
        let (start, stepper) = (&self.starts[start].1, &mut self.steppers[stepper].1);
        let mut least = [f64::INFINITY; PASS];
        for _ in 0..question.repeats {
            wall::pass(start, stepper, &mut least, self.slowed).map_err(failed)?;
        }
        Ok(least.iter().sum::<f64>() / PASS as f64)
    }

    /// The number of a place's start.
    fn start(&mut self, place: Place) -> Result<usize, StepError> {
        if let Some(known) = self.starts.iter().position(|(p, _)| *p == place) {
            return Ok(known);
        }
        self.starts.push((place, Start::new(place)?));
        Ok(self.starts.len() - 1)
    }

    /// The number of a case's stepper.
    fn stepper(&mut self, case: &str, start: usize, choice: &Choice) -> Result<usize, StepError> {
        if let Some(known) = self.steppers.iter().position(|(name, _)| name == case) {
            return Ok(known);
        }
        let stepper = self.starts[start].1.stepper(choice)?;
        self.steppers.push((case.to_owned(), stepper));
        Ok(self.steppers.len() - 1)
    }
}

/// A program that was started and answers. It ends with this.
pub(super) struct Peer {
    program: Program,
    limit: Duration,
    child: Child,
    to: ChildStdin,
    answers: Receiver<String>,
    /// The last line on its standard error, once that is closed.
    said: Receiver<String>,
    /// Compiler and processor that it was built with and for.
    pub(super) toolchain: String,
}

impl Drop for Peer {
    fn drop(&mut self) {
        child::end(&mut self.child);
    }
}

impl Peer {
    /// Starts a program, which has to say that it measures, and to answer within `limit` ever after.
    pub(super) fn start(program: &Program, limit: Duration) -> Result<Self, PeerError> {
        let failed = |source| PeerError::Start {
            program: program.path.clone(),
            source,
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
        let mut child = command.spawn().map_err(failed)?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(to), Some(out), Some(err)) = pipes else {
            child::end(&mut child);
            return Err(failed(io::ErrorKind::BrokenPipe.into()));
        };
        let mut peer = Self {
            program: program.clone(),
            limit,
            child,
            to,
            answers: child::lines(out),
            said: child::last_line(err),
            toolchain: String::new(),
        };
        peer.toolchain = peer.hello()?;
        Ok(peer)
    }

    /// Its toolchain, where it speaks as this program does and was built as it was.
    fn hello(&mut self) -> Result<String, PeerError> {
        let program = self.program.path.clone();
        let line = self.next().map_err(|e| match e {
            PeerError::Ended { program, said, .. } => PeerError::Stranger { program, said },
            other => other,
        })?;
        let value: serde_json::Value = serde_json::from_str(&line).unwrap_or_default();
        match value["schema"].as_u64() {
            None => {
                return Err(PeerError::Stranger {
                    program,
                    said: line,
                });
            }
            Some(schema) if schema != u64::from(SCHEMA) => {
                return Err(PeerError::Schema { program, schema });
            }
            Some(_) => {}
        }
        let hello: Hello = serde_json::from_value(value).map_err(|_| PeerError::Stranger {
            program: program.clone(),
            said: line,
        })?;
        if hello.build != PROFILE {
            return Err(PeerError::Build {
                program,
                build: hello.build,
            });
        }
        Ok(hello.toolchain)
    }

    /// A time of a case \[ns], or why there is none.
    pub(super) fn time(
        &mut self,
        case: &str,
        measure: Measure,
        repeats: usize,
    ) -> Result<Result<f64, Missing>, PeerError> {
        let question = Question {
            case: case.to_owned(),
            measure: measure.name().to_owned(),
            repeats,
        };
        // A program that no longer reads has ended, and has said why.
        let _ = say(&mut self.to, &question);
        let line = self.next()?;
        match serde_json::from_str(&line) {
            Ok(Answer::Ns(ns)) if ns.is_finite() && ns > 0.0 => Ok(Ok(ns)),
            Ok(Answer::Missing(why)) => Ok(Err(Missing::NotMeasured(why))),
            Ok(Answer::Failed(why)) => Ok(Err(Missing::Failed(why))),
            _ => Err(PeerError::Answer {
                program: self.program.path.clone(),
                line,
            }),
        }
    }

    /// Its next line.
    fn next(&mut self) -> Result<String, PeerError> {
        let program = self.program.path.clone();
        match self.answers.recv_timeout(self.limit) {
            Ok(line) => Ok(line),
            Err(RecvTimeoutError::Timeout) => Err(PeerError::Late {
                program,
                limit: self.limit,
            }),
            Err(RecvTimeoutError::Disconnected) => {
                let status = child::wait(&mut self.child, self.limit).ok().flatten();
                let said = self.said.recv_timeout(Duration::from_secs(1));
                Err(PeerError::Ended {
                    program,
                    status: status.map_or_else(|| "no status".to_owned(), |s| s.to_string()),
                    said: said.unwrap_or_default(),
                })
            }
        }
    }
}

/// A program that cannot be compared.
#[derive(Debug)]
pub enum PeerError {
    /// It cannot be started.
    Start {
        /// The program.
        program: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It does not know what it is asked: no `taut`, or an older one.
    Stranger {
        /// The program.
        program: PathBuf,
        /// What it said.
        said: String,
    },
    /// It measures something else.
    Schema {
        /// The program.
        program: PathBuf,
        /// What it speaks.
        schema: u64,
    },
    /// It was built with another profile.
    Build {
        /// The program.
        program: PathBuf,
        /// With that.
        build: String,
    },
    /// It ended while it was asked.
    Ended {
        /// The program.
        program: PathBuf,
        /// How.
        status: String,
        /// What it said last.
        said: String,
    },
    /// It does not answer in time.
    Late {
        /// The program.
        program: PathBuf,
        /// In that.
        limit: Duration,
    },
    /// Its answer is no time.
    Answer {
        /// The program.
        program: PathBuf,
        /// The answer.
        line: String,
    },
}

impl fmt::Display for PeerError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Start { program, .. }
        | Self::Stranger { program, .. }
        | Self::Schema { program, .. }
        | Self::Build { program, .. }
        | Self::Ended { program, .. }
        | Self::Late { program, .. }
        | Self::Answer { program, .. }) = self;
        let program = program.display();
        match self {
            Self::Start { source, .. } => write!(
                f,
                "cannot start `{program}`: {source}; `--against` takes a program `taut` or a revision"
            ),
            Self::Stranger { said, .. } => write!(
                f,
                "`{program}` cannot be compared: it is no `taut`, or one older than `taut track --against`; it said: {}",
                shortened(said)
            ),
            Self::Schema { schema, .. } => write!(
                f,
                "`{program}` measures by schema {schema}, this program by {SCHEMA}: compare revisions with the same one"
            ),
            Self::Build { build, .. } => write!(
                f,
                "`{program}` is a {build} build, this program a {PROFILE} build: build both alike"
            ),
            Self::Ended { status, said, .. } => write!(
                f,
                "`{program}` ended while it was measured: {status}; it said: {}",
                shortened(said)
            ),
            Self::Late { limit, .. } => write!(
                f,
                "`{program}` did not answer within {} s: `--limit` gives it longer",
                limit.as_secs()
            ),
            Self::Answer { line, .. } => {
                write!(
                    f,
                    "`{program}` answered what is no time: {}",
                    shortened(line)
                )
            }
        }
    }
}

impl std::error::Error for PeerError {}

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
