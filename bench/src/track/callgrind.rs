//! Instructions of a step, counted by valgrind's callgrind.
//!
//! This program steps the case in a process of its own, once for some steps and once for twice as many; the difference
//! holds the steps alone. Kernels choose their instructions at run time and take what valgrind offers them, at most AVX2,
//! so that wider ones may be timed than are counted.

use super::cases::Case;
use super::child;
use super::measures::Missing;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Longest time of one run.
const LIMIT: Duration = Duration::from_secs(120);

/// This program under valgrind.
#[derive(Debug, Clone)]
pub struct Counter {
    program: PathBuf,
    /// Compiler, processor compiled for and valgrind.
    toolchain: String,
}

impl Counter {
    /// Checks that valgrind is there, and asks it for its version.
    pub fn new() -> Result<Self, Missing> {
        let [version, _] = run(Command::new("valgrind").arg("--version"))?;
        let program = std::env::current_exe().map_err(|e| unstarted("taut", &e))?;
        Ok(Self {
            program,
            toolchain: format!("{}, {}", super::toolchain(), version.trim()),
        })
    }

    /// Counter for another program, which is taken to be of this one's toolchain.
    pub fn of(&self, program: &Path) -> Self {
        Self {
            program: program.to_owned(),
            ..self.clone()
        }
    }

    /// Toolchain that the counts are valid for.
    pub fn toolchain(&self) -> &str {
        &self.toolchain
    }

    pub fn per_step(&self, case: &Case) -> Result<f64, Missing> {
        let steps = case.counted_steps();
        let (once, twice) = (self.count(case, steps)?, self.count(case, 2 * steps)?);
        if twice <= once {
            return Err(failed(
                "valgrind",
                &format!("{steps} steps took {once} instructions, twice as many {twice}"),
            ));
        }
        Ok((twice - once) as f64 / steps as f64)
    }

    fn count(&self, case: &Case, steps: usize) -> Result<u64, Missing> {
        let [_, said] = run(Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(&self.program)
            .args(["track", "--instructions-of", &case.name()])
            .args(["--steps", &steps.to_string()]))?;
        collected(&said).ok_or_else(|| failed("valgrind", "no line `Collected : N`"))
    }
}

/// A program that does not start.
fn unstarted(program: &str, why: &io::Error) -> Missing {
    Missing::Failed(format!(
        "cannot start `{program}` to count instructions: {why}; install it, or leave `--instructions` out"
    ))
}

/// A program that ran, but did not count.
fn failed(program: &str, how: &str) -> Missing {
    Missing::Failed(format!("`{program}` does not count instructions: {how}"))
}

/// Runs a program to its end, for at most [`LIMIT`]: what it wrote on standard output and on standard error.
fn run(command: &mut Command) -> Result<[String; 2], Missing> {
    let program = command.get_program().to_string_lossy().into_owned();
    let failed = |how: String| failed(&program, &how);
    let (stdin, out, err) = (Stdio::null(), Stdio::piped(), Stdio::piped());
    let spawned = command.stdin(stdin).stdout(out).stderr(err).spawn();
    let mut child = spawned.map_err(|e| unstarted(&program, &e))?;
    let ended = child::wait(&mut child, LIMIT).map_err(|e| failed(e.to_string()))?;
    let status = ended.ok_or_else(|| failed(format!("no end after {} s", LIMIT.as_secs())))?;
    // Short texts, which fit into the pipes.
    let output = child
        .wait_with_output()
        .map_err(|e| failed(e.to_string()))?;
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    if !status.success() {
        if let Some(bytes) = unknown(&stderr) {
            // Valgrind 3.19 lacks few of AVX2: a move between registers, `vmovq` as `C5 .. D6`, is one. Which code meets one is
            // chance, and no fault of the case.
            return Err(Missing::NotMeasured(format!(
                "instructions were not counted: valgrind does not know one of this build, {bytes}"
            )));
        }
        let said = stderr.lines().rev().map(str::trim);
        let last = said.clone().find(|l| !l.is_empty() && !l.starts_with("=="));
        return Err(failed(format!("{status}, {}", last.unwrap_or("silent"))));
    }
    Ok([stdout, stderr])
}

/// The first bytes of an instruction that valgrind said it does not know.
fn unknown(text: &str) -> Option<String> {
    let bytes = text
        .lines()
        .find_map(|l| l.strip_prefix("vex amd64->IR: unhandled instruction bytes: "))?;
    let first: Vec<&str> = bytes.split_whitespace().take(4).collect();
    Some(first.join(" "))
}

/// The count of `Ir`, instructions read, in what callgrind says at its end:
///
/// ```text
/// ==17== Events    : Ir
/// ==17== Collected : 7247606
/// ```
fn collected(text: &str) -> Option<u64> {
    let said = |what: &str| {
        // Searches from the end: the program itself may have printed such lines before.
        text.lines().rev().find_map(|line| {
            let (_, rest) = line.strip_prefix("==")?.split_once("==")?;
            let (key, value) = rest.split_once(':')?;
            (key.trim() == what).then_some(value)
        })
    };
    let column = said("Events")?.split_whitespace().position(|e| e == "Ir")?;
    let count = said("Collected")?.split_whitespace().nth(column)?;
    count.replace(',', "").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLE: &str = "\
==17== Callgrind, a call-graph generating cache profiler
==17== Command: taut track --instructions-of ring-24/banded --steps 30
==17== For interactive control, run 'callgrind_control -h'.
note: Collected : 3
==17==
==17== Events    : Ir
==17== Collected : 7247606
==17==
==17== I   refs:      7,247,606
";

    #[test]
    fn the_count_is_found_by_its_name() {
        assert_eq!(collected(SAMPLE), Some(7_247_606));
        let more = SAMPLE.replace(": Ir", ": Dr Ir");
        let more = more.replace("7247606", "1 2,000");
        assert_eq!(collected(&more), Some(2000));
    }

    #[test]
    fn what_is_no_count_is_none() {
        assert_eq!(collected(""), None);
        assert_eq!(collected(&SAMPLE.replace("Events", "Event")), None);
        assert_eq!(collected(&SAMPLE.replace(": Ir", ": Dw")), None);
        assert_eq!(collected(&SAMPLE.replace("7247606", "many")), None);
        assert_eq!(collected(&SAMPLE.replace(": Ir", ": Dr Ir")), None);
    }

    #[test]
    fn an_unknown_instruction_is_told_from_other_ends() {
        let said = "vex amd64->IR: unhandled instruction bytes: 0xC5 0x79 0xD6 0xCC 0xC5 0x31\n==1== more\n";
        assert_eq!(unknown(said).as_deref(), Some("0xC5 0x79 0xD6 0xCC"));
        assert_eq!(unknown(SAMPLE), None);
    }
}
