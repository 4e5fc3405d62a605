//! Two programs in turns: base and head, each in processes of its own, asked in the order base, head, head, base.
//!
//! Two errors make a ratio of times. Interruptions and the load of other cores last some milliseconds to minutes: each step
//! counts with its least time of all blocks of a process, and the blocks of both programs alternate. The places of code,
//! stack and heap, which the system draws anew for each process, change a step by some tenths of a percent, at times by ten
//! percent, until the process ends: so many short rounds start both programs anew. A round gives one ratio; [`Ratio`] is
//! their median with its interval. A figure whose interval holds the bar takes further rounds, up to [`FURTHER`] times as
//! many.
//!
//! A figure fails where the interval is above 1 and the ratio above 1 + [`SLOWER`]. Instructions nearly repeat, and fail
//! above 1 + [`SMALL`] where a cable has 24 segments, above 1 + [`TOLERANCE`] elsewhere. A figure that the base has and the
//! head has not fails as well.

use super::base::Program;
use super::callgrind::Counter;
use super::cases::{CASES, Case};
use super::compare::{Comparison, Row, TOLERANCE};
use super::formats::{Entry, Metric, Metrics};
use super::measures::{Measure, Missing};
use super::peer::Peer;
use super::ratio::{Ratio, median};
use super::start::PASS;
use indicatif::ProgressBar;
use rayon::prelude::*;
use std::time::Duration;

/// Relative growth of a time that passes.
pub(super) const SLOWER: f64 = 0.03;

/// Relative growth of instructions that passes at 24 segments.
pub(super) const SMALL: f64 = 0.01;

/// Most rounds of a figure whose interval holds the bar, over those of the others.
const FURTHER: usize = 4;

/// Rounds between two looks at whether a figure needs more.
const BETWEEN: usize = 8;

/// Passes that warm a process up, and tell how many make a block of the slower program.
const FIRST: usize = 3;

/// Run-to-run spread of the instruction count (seeds of hash tables), relative.
const REPEATS: f64 = 0.0015;

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Starts of both programs, before figures whose interval holds the bar take more.
    rounds: usize,
    /// Quads of a round: base, head, head, base.
    quads: usize,
    /// Quads of driven minutes, each as long as many blocks; another minute warms up.
    minutes: usize,
    /// Time that a program is asked for at once.
    block: Duration,
}

impl Effort {
    /// Resolves a difference of half a percent.
    pub const FULL: Self = Self {
        rounds: 80,
        quads: 4,
        minutes: 1,
        block: Duration::from_millis(2),
    };

    /// Resolves some percent.
    pub const QUICK: Self = Self {
        rounds: 32,
        ..Self::FULL
    };
}

/// Two programs, and how they are compared.
#[derive(Debug, Clone)]
pub struct Versus {
    pub base: Program,
    pub head: Program,
    /// How much is measured.
    pub effort: Effort,
    /// Longest time of an answer.
    pub limit: Duration,
    /// `None` counts no instructions.
    pub counter: Option<Counter>,
    /// A case that only the base has is a failure. Off if cases were chosen by name.
    pub every_case: bool,
}

/// Compares the times of all cases, and their instructions where there is a counter. `progress` advances once for each
/// figure and round.
pub fn against(
    versus: &Versus,
    cases: &[Case],
    progress: &ProgressBar,
) -> Result<Vec<Row>, String> {
    let mut samples: Vec<Sample<'_>> = cases.iter().flat_map(Sample::of).collect();
    progress.set_length((versus.effort.rounds * samples.len()) as u64);
    let (mut note, mut lost) = (String::new(), Vec::new());
    for round in 0..versus.effort.rounds * FURTHER {
        if round >= versus.effort.rounds && round.is_multiple_of(BETWEEN) {
            samples.iter_mut().for_each(Sample::decide);
        }
        let open = samples.iter().filter(|sample| !sample.is_decided).count();
        if open == 0 {
            break;
        }
        if round >= versus.effort.rounds {
            progress.inc_length(open as u64);
        }
        let mut pair = started(versus, round)?;
        let [base, head] = pair.each_ref().map(|peer| &peer.hello);
        if base.toolchain != head.toolchain {
            note = format!(
                "the base is of {}, the head of {}",
                base.toolchain, head.toolchain
            );
        }
        if versus.every_case {
            lost = base.cases.iter().filter_map(|name| gone(name)).collect();
        }
        for sample in samples.iter_mut().filter(|sample| !sample.is_decided) {
            sample.round(&mut pair, &versus.effort)?;
            progress.inc(1);
        }
    }
    let mut all: Vec<Row> = samples.iter().map(|s| s.compared(&note)).collect();
    if let Some(counter) = &versus.counter {
        progress.set_message("instructions");
        // Not of what one of them does not have.
        let counted = cases.par_iter().filter(|case| {
            let known = |c: &Row| c.case == case.name() && c.ratio.is_some();
            case.counts_instructions() && all.iter().any(known)
        });
        let counted = counted.map(|case| instructions(versus, counter, case));
        let counted: Vec<_> = counted.collect();
        all.extend(counted);
        all.sort_by_key(|c| cases.iter().position(|case| case.name() == c.case));
    }
    all.extend(lost);
    Ok(all)
}

/// A failure for a case of the base, unless this program has it too.
fn gone(name: &str) -> Option<Row> {
    let known = CASES.iter().any(|case| case.name() == name);
    let why = "the base has this case, the head has not".to_owned();
    (!known).then(|| Row::new(name, Measure::Min.name()).without(Missing::Failed(why)))
}

/// Base and head, of which neither is always the one that was started first.
fn started(versus: &Versus, round: usize) -> Result<[Peer; 2], String> {
    let start = |program| Peer::start(program, versus.limit);
    if round.is_multiple_of(2) {
        return Ok([start(&versus.base)?, start(&versus.head)?]);
    }
    let head = start(&versus.head)?;
    Ok([start(&versus.base)?, head])
}

/// Measurements of one time.
struct Sample<'a> {
    case: &'a Case,
    measure: Measure,
    /// Times of base and head \[ns], round by round.
    times: Vec<[f64; 2]>,
    missing: Option<Missing>,
    /// Further rounds would not change the verdict.
    is_decided: bool,
}

impl<'a> Sample<'a> {
    /// Samples of a case, one for each measure of time.
    fn of(case: &'a Case) -> impl Iterator<Item = Self> {
        let timed = |m: &Measure| matches!(m, Measure::Min | Measure::P99);
        case.measures().filter(timed).map(move |measure| Self {
            case,
            measure,
            times: Vec::new(),
            missing: None,
            is_decided: false,
        })
    }

    /// Decided is a figure whose interval does not hold the bar, or that is missing.
    fn decide(&mut self) {
        let Ratio { low, high, .. } = self.ratio();
        let bar = 1.0 + SLOWER;
        self.is_decided |= self.missing.is_some() || bar < low || high < bar;
    }

    fn ratio(&self) -> Ratio {
        Ratio::of(self.times.iter().map(|[base, head]| head / base))
    }

    /// A round with a pair that was just started.
    fn round(&mut self, pair: &mut [Peer; 2], effort: &Effort) -> Result<(), String> {
        if self.missing.is_some() {
            return Ok(());
        }
        let (name, measure) = (self.case.name(), self.measure);
        let is_minute = measure == Measure::P99;
        let [base, head] = pair;
        let first = if is_minute { 1 } else { FIRST };
        let mut least = [
            base.time(&name, measure, first)?,
            head.time(&name, measure, first)?,
        ];
        let (quads, repeats) = match &least {
            [Ok(base), Ok(head)] if !is_minute => {
                let fit = effort.block.as_nanos() as f64 / (base.max(*head) * PASS as f64);
                let quads = (fit * effort.quads as f64).clamp(1.0, effort.quads as f64);
                (quads as usize, fit.clamp(1.0, 1e4) as usize)
            }
            _ => (effort.minutes, 1),
        };
        for one in std::iter::repeat_n([0, 1, 1, 0], quads).flatten() {
            if least.iter().all(Result::is_ok) {
                least[one] = pair[one].time(&name, measure, repeats)?;
            }
        }
        match both(least) {
            Ok(times) => self.times.push(times),
            Err(missing) => self.missing = Some(missing),
        }
        Ok(())
    }

    fn compared(&self, note: &str) -> Row {
        let row = Row::new(&self.case.name(), self.measure.name());
        if let Some(missing) = &self.missing {
            return row.without(missing.clone());
        }
        let ratio = self.ratio();
        let [base, head] = [0, 1].map(|one| Some(median(self.times.iter().map(|t| t[one]))));
        Row {
            before: base,
            now: head,
            ratio: Some(ratio),
            verdict: judge(ratio, SLOWER),
            note: note.to_owned(),
            ..row
        }
    }
}

/// The times of base and head. What the head alone lacks has failed; what the base lacks is compared with nothing.
fn both([base, head]: [Result<f64, Missing>; 2]) -> Result<[f64; 2], Missing> {
    match (base, head) {
        (Ok(base), Ok(head)) => Ok([base, head]),
        (_, Err(Missing::Failed(why))) => Err(Missing::Failed(why)),
        (Ok(_), Err(Missing::NotMeasured(why))) => Err(Missing::Failed(format!(
            "the base has this figure, the head has not: {why}"
        ))),
        (Err(Missing::NotMeasured(why) | Missing::Failed(why)), _) => {
            Err(Missing::NotMeasured(format!("of the base: {why}")))
        }
    }
}

/// The verdict on a ratio that may be 1 + `bar`.
fn judge(ratio: Ratio, bar: f64) -> Comparison {
    match ratio {
        // Written so that NaN fails too.
        r if !(r.value <= 1.0 + bar || r.low <= 1.0) => Comparison::Fail,
        r if r.low > 1.0 => Comparison::Slower,
        r if r.high < 1.0 => Comparison::Better,
        _ => Comparison::Pass,
    }
}

/// Instructions of a step of both programs.
fn instructions(versus: &Versus, counter: &Counter, case: &Case) -> Row {
    let row = Row::new(&case.name(), Measure::Instructions.name());
    let count = |program: &Program| counter.of(&program.path).per_step(case);
    let counts = count(&versus.base).and_then(|base| Ok((base, count(&versus.head)?)));
    let (base, head) = match counts {
        Ok(counts) => counts,
        Err(missing) => return row.without(missing),
    };
    let bar = if case.has_24_segments() {
        SMALL
    } else {
        TOLERANCE
    };
    let value = head / base;
    let ratio = Ratio {
        value,
        low: value - REPEATS,
        high: value + REPEATS,
    };
    Row {
        before: Some(base),
        now: Some(head),
        ratio: Some(ratio),
        verdict: judge(ratio, bar),
        ..row
    }
}

/// The ratios as github-action-benchmark reads them, and as Bencher does.
pub fn ratios(rows: &[Row], base: &str) -> (Vec<Entry>, Metrics) {
    let (mut entries, mut metrics) = (Vec::new(), Metrics::new());
    for row in rows {
        let Some(ratio) = row.ratio.filter(|r| r.value.is_finite()) else {
            continue;
        };
        let name = format!("{}-against-base", row.measure);
        entries.push(Entry {
            name: format!("{}/{name}", row.case),
            unit: "of the base".to_owned(),
            value: ratio.value,
            range: Some(format!("{:.4} to {:.4}", ratio.low, ratio.high)),
            extra: format!("the base is {base}"),
        });
        let metric = Metric {
            value: ratio.value,
            lower_value: Some(ratio.low),
            upper_value: Some(ratio.high),
        };
        let case = metrics.entry(row.case.clone()).or_default();
        case.insert(name, metric);
    }
    (entries, metrics)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(value: f64, low: f64, high: f64) -> Ratio {
        Ratio { value, low, high }
    }

    #[test]
    fn a_time_fails_beyond_interval_and_bar() {
        for (value, low, high, verdict) in [
            (1.05, 1.04, 1.06, Comparison::Fail),
            (1.05, 0.99, 1.11, Comparison::Pass),
            (1.02, 1.01, 1.03, Comparison::Slower),
            (1.001, 0.99, 1.01, Comparison::Pass),
            (0.98, 0.97, 0.99, Comparison::Better),
            (f64::NAN, f64::NAN, f64::NAN, Comparison::Fail),
        ] {
            assert_eq!(judge(ratio(value, low, high), SLOWER), verdict, "{value}");
        }
    }

    #[test]
    fn figures_take_further_rounds_while_their_interval_holds_the_bar() {
        let case = &CASES[0];
        let decided = |ratios: &[f64], missing| {
            let mut sample = Sample {
                case,
                measure: Measure::Min,
                times: ratios.iter().map(|ratio| [100.0, 100.0 * ratio]).collect(),
                missing,
                is_decided: false,
            };
            sample.decide();
            sample.is_decided
        };
        assert!(decided(&[0.99, 1.0, 1.01], None));
        assert!(decided(&[1.08, 1.1, 1.12], None));
        assert!(!decided(&[0.98, 1.02, 1.06], None));
        assert!(!decided(&[1.0, 1.0, f64::NAN], None));
        assert!(decided(&[], Some(Missing::NotMeasured(String::new()))));
    }

    #[test]
    fn what_the_head_alone_lacks_fails_and_what_the_base_lacks_is_not_compared() {
        let absent = || Err(Missing::NotMeasured("no solver".to_owned()));
        let failed = || Err(Missing::Failed("no pivot".to_owned()));
        assert_eq!(both([Ok(2.0), Ok(3.0)]), Ok([2.0, 3.0]));
        for times in [[Ok(2.0), absent()], [absent(), failed()]] {
            assert!(matches!(both(times), Err(Missing::Failed(_))));
        }
        for base in [absent(), failed()] {
            assert!(matches!(
                both([base, Ok(3.0)]),
                Err(Missing::NotMeasured(_))
            ));
        }
        assert!(matches!(
            both([absent(), absent()]),
            Err(Missing::NotMeasured(_))
        ));
    }

    #[test]
    fn a_case_that_the_head_has_lost_is_a_failure_with_its_name() {
        assert_eq!(gone("gantry/banded"), None);
        let lost = gone("hoist-23/banded").unwrap();
        let found = (lost.case.as_str(), lost.verdict);
        assert_eq!(found, ("hoist-23/banded", Comparison::Fail));
    }

    #[test]
    fn ratios_are_figures_with_their_interval() {
        let absent = Row::new("gantry/banded", Measure::P99.name());
        let compared = Row {
            ratio: Some(ratio(1.02, 1.0104, 1.03)),
            ..absent.clone()
        };
        let (entries, metrics) = ratios(&[compared, absent], "abc");
        assert_eq!(entries.len(), 1);
        assert_eq!(entries[0].name, "gantry/banded/time-p99-against-base");
        assert_eq!(entries[0].range.as_deref(), Some("1.0104 to 1.0300"));
        let metric = &metrics["gantry/banded"]["time-p99-against-base"];
        let found = (metric.lower_value, metric.upper_value);
        assert_eq!(found, (Some(1.0104), Some(1.03)));
    }
}
