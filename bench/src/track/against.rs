//! Two programs in turns: base and head, each in processes of its own, asked in the order base, head, head, base.
//!
//! Each such quad gives one ratio of the head's time to the base's, free of what slows the machine steadily or ever more.
//! Some quads make a round. A round starts both programs anew, for where a process lies in memory costs or gains it some
//! percent until it ends: many short rounds tell more than a few long ones. [`Ratio`] is the median of all, with its
//! interval.
//!
//! A figure fails where the interval is above 1 and the ratio above 1 + [`SLOWER`]. Instructions nearly repeat, and fail
//! above 1 + [`SMALL`] where a cable has 24 segments, above 1 + [`TOLERANCE`] elsewhere.

use super::base::Program;
use super::callgrind::Counter;
use super::cases::Case;
use super::compare::{TOLERANCE, Verdict};
use super::formats::{Entry, Metric};
use super::measures::{Measure, Missing};
use super::peer::{Peer, PeerError};
use super::ratio::{Ratio, median};
use super::start::PASS;
use indicatif::ProgressBar;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::time::Duration;

/// What a time may grow by.
pub(super) const SLOWER: f64 = 0.03;

/// What instructions may grow by at 24 segments.
pub(super) const SMALL: f64 = 0.01;

/// Minutes at once: where the system interrupts more than a step in a hundred, it seldom meets the same three times.
const MINUTES: usize = 3;

/// What counts of the same program differ by at most, with the seeds of hash tables, over the base.
const REPEATS: f64 = 0.0015;

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Starts of both programs.
    rounds: usize,
    /// Quads of a round.
    quads: usize,
    /// Time that a program is asked for at once.
    block: Duration,
}

impl Effort {
    /// What finds a difference of a percent.
    pub const FULL: Self = Self {
        rounds: 20,
        quads: 6,
        block: Duration::from_millis(4),
    };

    /// What finds some percent.
    pub const QUICK: Self = Self {
        rounds: 16,
        quads: 3,
        block: Duration::from_millis(3),
    };
}

/// Two programs, and how they are compared.
#[derive(Debug, Clone)]
pub struct Versus {
    /// What is compared with.
    pub base: Program,
    /// What is compared.
    pub head: Program,
    /// How much is measured.
    pub effort: Effort,
    /// Longest time of an answer.
    pub limit: Duration,
    /// What instructions are counted with; none where they are not.
    pub counter: Option<Counter>,
}

/// A figure of two programs.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// `scene/backend`.
    pub case: String,
    /// What was measured.
    pub measure: Measure,
    /// The base's value: of times the median of all blocks.
    pub base: Option<f64>,
    /// The head's.
    pub head: Option<f64>,
    /// The head's over the base's, which is no ratio of medians.
    pub ratio: Option<Ratio>,
    /// The verdict.
    pub verdict: Verdict,
    /// What there is to say besides.
    pub note: String,
}

/// Compares the times of all cases, and their instructions where there is a counter. `progress` advances once for each
/// figure and round.
///
/// # Errors
/// [`PeerError`] of either program.
pub fn against(
    versus: &Versus,
    cases: &[Case],
    progress: &ProgressBar,
) -> Result<Vec<Compared>, PeerError> {
    let mut samples: Vec<Sample<'_>> = cases.iter().flat_map(Sample::of).collect();
    progress.set_length((versus.effort.rounds * samples.len()) as u64);
    let mut note = String::new();
    for round in 0..versus.effort.rounds {
        let mut pair = started(versus, round)?;
        let [base, head] = pair.each_ref().map(|peer| &peer.toolchain);
        if base != head {
            note = format!("the base is of {base}, the head of {head}");
        }
        for sample in &mut samples {
            sample.round(&mut pair, &versus.effort)?;
            progress.inc(1);
        }
    }
    let mut all: Vec<Compared> = samples.iter().map(|s| s.compared(&note)).collect();
    if let Some(counter) = &versus.counter {
        progress.set_message("instructions");
        // Not of what one of them does not have.
        let counted = cases.par_iter().filter(|case| {
            let known = |c: &Compared| c.case == case.name() && c.ratio.is_some();
            case.counts_instructions() && all.iter().any(known)
        });
        let counted = counted.map(|case| instructions(versus, counter, case));
        let counted: Vec<_> = counted.collect();
        all.extend(counted);
        all.sort_by_key(|c| cases.iter().position(|case| case.name() == c.case));
    }
    Ok(all)
}

/// Base and head, of which neither is always the one that was started first.
fn started(versus: &Versus, round: usize) -> Result<[Peer; 2], PeerError> {
    let start = |program| Peer::start(program, versus.limit);
    if round.is_multiple_of(2) {
        return Ok([start(&versus.base)?, start(&versus.head)?]);
    }
    let head = start(&versus.head)?;
    Ok([start(&versus.base)?, head])
}

/// What is measured of a time.
struct Sample<'a> {
    case: &'a Case,
    name: String,
    measure: Measure,
    /// Passes or minutes at once, from the first round on.
    repeats: Option<usize>,
    /// Times of the base and of the head \[ns].
    times: [Vec<f64>; 2],
    /// The ratios of each round.
    ratios: Vec<Vec<f64>>,
    missing: Option<Missing>,
}

impl<'a> Sample<'a> {
    /// Those of a case.
    fn of(case: &'a Case) -> impl Iterator<Item = Self> {
        let timed = |m: &Measure| matches!(m, Measure::Min | Measure::P99);
        case.measures().filter(timed).map(move |measure| Self {
            case,
            name: case.name(),
            measure,
            repeats: None,
            times: [Vec::new(), Vec::new()],
            ratios: Vec::new(),
            missing: None,
        })
    }

    /// A time of one of the two; none, once and for all, where there is none.
    fn time(&mut self, peer: &mut Peer, repeats: usize) -> Result<Option<f64>, PeerError> {
        if self.missing.is_some() {
            return Ok(None);
        }
        match peer.time(&self.name, self.measure, repeats)? {
            Ok(ns) => Ok(Some(ns)),
            Err(missing) => {
                self.missing = Some(missing);
                Ok(None)
            }
        }
    }

    /// A round of quads with a pair that was just started.
    fn round(&mut self, pair: &mut [Peer; 2], effort: &Effort) -> Result<(), PeerError> {
        // Builds the scene, and warms up.
        for peer in &mut *pair {
            self.time(peer, 1)?;
        }
        // A minute is as long as many passes.
        let is_minute = self.measure == Measure::P99;
        let repeats = match self.repeats {
            Some(known) => known,
            None => {
                let Some(ns) = self.time(&mut pair[0], 1)? else {
                    return Ok(());
                };
                let fit = effort.block.as_nanos() as f64 / (ns * PASS as f64);
                let fit = if is_minute {
                    MINUTES
                } else {
                    fit.clamp(1.0, 1e4) as usize
                };
                *self.repeats.insert(fit)
            }
        };
        let quads = if is_minute {
            effort.quads.div_ceil(3)
        } else {
            effort.quads
        };
        let mut ratios = Vec::with_capacity(quads);
        for _ in 0..quads {
            let mut sums = [0.0, 0.0];
            for one in [0, 1, 1, 0] {
                let Some(ns) = self.time(&mut pair[one], repeats)? else {
                    return Ok(());
                };
                self.times[one].push(ns);
                sums[one] += ns;
            }
            ratios.push(sums[1] / sums[0]);
        }
        self.ratios.push(ratios);
        Ok(())
    }

    fn compared(&self, note: &str) -> Compared {
        let [base, head] = [0, 1].map(|one: usize| median(&mut self.times[one].clone()));
        let ratio = Ratio::of(&self.ratios);
        let found = match &self.missing {
            Some(missing) => Err(missing.clone()),
            None => Ok((base, head, ratio, judge(ratio, SLOWER))),
        };
        let mut compared = Compared::new(self.case, self.measure, found);
        if compared.ratio.is_some() {
            note.clone_into(&mut compared.note);
        }
        compared
    }
}

impl Compared {
    /// What was found of base and head, or why nothing was.
    pub(super) fn new(
        case: &Case,
        measure: Measure,
        found: Result<(f64, f64, Ratio, Verdict), Missing>,
    ) -> Self {
        let blank = Self {
            case: case.name(),
            measure,
            base: None,
            head: None,
            ratio: None,
            verdict: Verdict::Fail,
            note: String::new(),
        };
        match found {
            Ok((base, head, ratio, verdict)) => Self {
                base: Some(base),
                head: Some(head),
                ratio: Some(ratio),
                verdict,
                ..blank
            },
            Err(Missing::NotMeasured(note)) => Self {
                verdict: Verdict::NotMeasured,
                note,
                ..blank
            },
            Err(Missing::Failed(note)) => Self { note, ..blank },
        }
    }
}

/// The verdict on a ratio that may be 1 + `bar`.
fn judge(ratio: Ratio, bar: f64) -> Verdict {
    match ratio {
        // Also what is no number.
        r if !(r.value <= 1.0 + bar || r.low <= 1.0) => Verdict::Fail,
        r if r.low > 1.0 => Verdict::Slower,
        r if r.high < 1.0 => Verdict::Better,
        _ => Verdict::Pass,
    }
}

/// Instructions of a step of both programs.
fn instructions(versus: &Versus, counter: &Counter, case: &Case) -> Compared {
    let count = |program: &Program| counter.of(&program.path).per_step(case);
    let counts = count(&versus.base).and_then(|base| Ok((base, count(&versus.head)?)));
    let found = counts.map(|(base, head)| {
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
        (base, head, ratio, judge(ratio, bar))
    });
    Compared::new(case, Measure::Instructions, found.map_err(Missing::from))
}

/// What a measure's ratio is called in files.
fn ratio_name(measure: Measure) -> String {
    format!("{}-against-base", measure.name())
}

/// The ratios as github-action-benchmark reads them, and as Bencher does.
#[must_use]
pub fn ratios(
    compared: &[Compared],
    base: &str,
) -> (Vec<Entry>, BTreeMap<String, BTreeMap<String, Metric>>) {
    let (mut entries, mut metrics) = (Vec::new(), BTreeMap::<_, BTreeMap<_, _>>::new());
    for c in compared {
        let Some(ratio) = c.ratio.filter(|r| r.value.is_finite()) else {
            continue;
        };
        let name = ratio_name(c.measure);
        entries.push(Entry {
            name: format!("{}/{name}", c.case),
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
        metrics
            .entry(c.case.clone())
            .or_default()
            .insert(name, metric);
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
            (1.05, 1.04, 1.06, Verdict::Fail),
            (1.05, 0.99, 1.11, Verdict::Pass),
            (1.02, 1.01, 1.03, Verdict::Slower),
            (1.001, 0.99, 1.01, Verdict::Pass),
            (0.98, 0.97, 0.99, Verdict::Better),
            (f64::NAN, f64::NAN, f64::NAN, Verdict::Fail),
        ] {
            assert_eq!(judge(ratio(value, low, high), SLOWER), verdict, "{value}");
        }
    }

    #[test]
    fn ratios_are_figures_with_their_interval() {
        let compared = Compared {
            case: "gantry/banded".to_owned(),
            measure: Measure::P99,
            base: Some(100.0),
            head: Some(102.0),
            ratio: Some(ratio(1.02, 1.0104, 1.03)),
            verdict: Verdict::Slower,
            note: String::new(),
        };
        let absent = Compared {
            ratio: None,
            ..compared.clone()
        };
        let (entries, metrics) = ratios(&[compared, absent], "abc");
        assert_eq!(entries.len(), 1);
        assert_eq!(entries[0].name, "gantry/banded/time-p99-against-base");
        assert_eq!(entries[0].range.as_deref(), Some("1.0104 to 1.0300"));
        let metric = &metrics["gantry/banded"]["time-p99-against-base"];
        assert_eq!(
            (metric.lower_value, metric.upper_value),
            (Some(1.0104), Some(1.03))
        );
    }
}
