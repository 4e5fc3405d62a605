//! Figures against the baseline and against their bars.
//!
//! | figures | fail where |
//! |---|---|
//! | instructions | more than [`TOLERANCE`] above the baseline's of the same compiler and processor |
//! | errors, the own backends' allocations | beyond the bar of the case |
//! | times, other backends' allocations | never |
//!
//! A figure that is no number fails, as do a case that cannot be measured and a figure of the baseline that is no longer
//! among the tracked ones. A figure that the baseline does not have is new and fails at its bar alone. Counts of two
//! versions of valgrind differ by less than the tolerance: the version is shown, not compared.

use super::cases::CASES;
use super::formats::Entry;
use super::measures::{Figure, Kind, Measure, Missing};
use super::ratio::Ratio;
use std::collections::HashSet;
use std::fmt;

/// Relative change of instructions that passes in silence: more fails, a larger saving is pointed
/// out.
pub const TOLERANCE: f64 = 0.02;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// Within tolerance or bar.
    Pass,
    Fail,
    /// Fewer instructions by more than the tolerance: the baseline can be lowered. Against another program: faster beyond the
    /// interval.
    Better,
    /// Slower than another program beyond the interval, but within the bar.
    Slower,
    /// Not in the baseline.
    New,
    /// Instructions of another compiler or processor, within the tolerance or not.
    OtherToolchain,
    NotMeasured,
    /// Shown without judgement.
    Shown,
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pass => "pass",
            Self::Fail => "FAIL",
            Self::Better => "better",
            Self::Slower => "slower",
            Self::New => "new",
            Self::OtherToolchain => "not compared",
            Self::NotMeasured => "not measured",
            Self::Shown => "-",
        })
    }
}

/// A figure beside that of the baseline, or that of another program.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// `scene/backend`.
    pub case: String,
    pub measure: String,
    /// The baseline's value, or the base's: of times the median of all rounds.
    pub before: Option<f64>,
    /// The value now, or the head's.
    pub now: Option<f64>,
    /// The head's over the base's, as the median of the rounds' ratios.
    pub ratio: Option<Ratio>,
    /// The bar, for errors.
    pub bar: Option<f64>,
    pub verdict: Comparison,
    /// Reason or remark beside the verdict.
    pub note: String,
}

impl Row {
    /// A failed row without values.
    pub(super) fn new(case: &str, measure: &str) -> Self {
        Self {
            case: case.to_owned(),
            measure: measure.to_owned(),
            before: None,
            now: None,
            ratio: None,
            bar: None,
            verdict: Comparison::Fail,
            note: String::new(),
        }
    }

    /// The row with the reason why it has no value.
    pub(super) fn without(self, missing: Missing) -> Self {
        let verdict = match missing {
            Missing::NotMeasured(_) => Comparison::NotMeasured,
            Missing::Failed(_) => Comparison::Fail,
        };
        let note = missing.reason();
        Self {
            verdict,
            note,
            ..self
        }
    }
}

/// Every figure beside the baseline's of the same name, in the figures' order; then those of the baseline that are no
/// longer tracked.
pub fn compare(figures: &[Figure], baseline: &[Entry]) -> Vec<Row> {
    let mut rows: Vec<Row> = figures
        .iter()
        .map(|figure| {
            let name = figure.name();
            row(figure, baseline.iter().find(|e| e.name == name))
        })
        .collect();
    let known: HashSet<String> = tracked().collect();
    let gone = baseline.iter().filter(|e| !known.contains(&e.name));
    rows.extend(gone.map(|e| {
        let (case, measure) = e.name.rsplit_once('/').unwrap_or((&e.name, ""));
        Row {
            before: Some(e.value),
            note: "no longer tracked: `--update` takes it out of the baseline".to_owned(),
            ..Row::new(case, measure)
        }
    }));
    rows
}

/// The names of all figures of all cases, in order.
fn tracked() -> impl Iterator<Item = String> {
    CASES.iter().flat_map(|case| {
        let name = case.name();
        case.measures().map(move |m| format!("{name}/{}", m.name()))
    })
}

fn row(figure: &Figure, entry: Option<&Entry>) -> Row {
    let row = Row {
        before: entry.map(|e| e.value),
        bar: figure.bar,
        ..Row::new(&figure.case, figure.measure.name())
    };
    let value = match &figure.value {
        Ok(value) => *value,
        Err(missing) => return row.without(missing.clone()),
    };
    let (verdict, note) = judge(figure, value, entry);
    Row {
        now: Some(value),
        verdict,
        note,
        ..row
    }
}

fn judge(figure: &Figure, value: f64, entry: Option<&Entry>) -> (Comparison, String) {
    if !value.is_finite() {
        return (Comparison::Fail, "not a number".to_owned());
    }
    let known = |verdict| match entry {
        Some(_) => verdict,
        None => Comparison::New,
    };
    let verdict = match figure.measure.kind() {
        Kind::Wall => known(Comparison::Shown),
        Kind::Barred => match figure.bar {
            Some(bar) if value > bar => Comparison::Fail,
            Some(_) => known(Comparison::Pass),
            None => known(Comparison::Shown),
        },
        Kind::Instructions => return instructions(value, &figure.condition, entry),
    };
    (verdict, String::new())
}

fn instructions(value: f64, toolchain: &str, entry: Option<&Entry>) -> (Comparison, String) {
    let Some(entry) = entry else {
        return (Comparison::New, String::new());
    };
    if compiled(&entry.extra) != compiled(toolchain) {
        let note = format!("the baseline is of {}, this of {toolchain}", entry.extra);
        return (Comparison::OtherToolchain, note);
    }
    let growth = value / entry.value - 1.0;
    // A baseline that makes no ratio passes nothing.
    let within = growth <= TOLERANCE;
    let verdict = match within {
        false => Comparison::Fail,
        true if growth < -TOLERANCE => Comparison::Better,
        true => Comparison::Pass,
    };
    (verdict, String::new())
}

/// Compiler and processor of a toolchain, without its valgrind.
fn compiled(toolchain: &str) -> &str {
    let parts = toolchain.rsplit_once(", valgrind");
    parts.map_or(toolchain, |(compiled, _)| compiled)
}

/// Figures that were counted against nothing: instructions without a verdict.
pub fn uncompared(rows: &[Row]) -> usize {
    use Comparison::{Better, Fail, Pass};
    let counted = rows
        .iter()
        .filter(|r| r.measure == Measure::Instructions.name());
    counted
        .filter(|r| !matches!(r.verdict, Pass | Fail | Better))
        .count()
}

/// The baseline with the values of now: what was measured is replaced, what could not be measured here stays, what is
/// no longer tracked goes.
pub fn updated(now: &[Entry], baseline: &[Entry]) -> Vec<Entry> {
    let find = |entries: &[Entry], name: &str| entries.iter().find(|e| e.name == name).cloned();
    tracked()
        .filter_map(|name| find(now, &name).or_else(|| find(baseline, &name)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = "ring-24/banded";

    fn figure(measure: Measure, value: f64, bar: Option<f64>) -> Figure {
        Figure {
            case: CASE.to_owned(),
            measure,
            value: Ok(value),
            spread: None,
            condition: "rustc 1, generic, valgrind-2".to_owned(),
            bar,
        }
    }

    fn entry(measure: Measure, value: f64) -> Entry {
        Entry {
            name: format!("{CASE}/{}", measure.name()),
            unit: measure.unit().to_owned(),
            value,
            range: None,
            extra: "rustc 1, generic, valgrind-2".to_owned(),
        }
    }

    fn verdict(measure: Measure, value: f64, bar: Option<f64>, baseline: f64) -> Comparison {
        let rows = compare(&[figure(measure, value, bar)], &[entry(measure, baseline)]);
        assert_eq!(rows.len(), 1);
        rows[0].verdict
    }

    #[test]
    fn two_percent_more_instructions_pass_and_no_more() {
        let of = |value| verdict(Measure::Instructions, value, None, 1000.0);
        assert_eq!(of(1019.0), Comparison::Pass);
        assert_eq!(of(1021.0), Comparison::Fail);
        assert_eq!(of(981.0), Comparison::Pass);
        assert_eq!(of(979.0), Comparison::Better);
        assert_eq!(of(f64::NAN), Comparison::Fail);
        let empty = verdict(Measure::Instructions, 0.0, None, 0.0);
        assert_eq!(empty, Comparison::Fail);
    }

    #[test]
    fn another_compiler_is_shown_and_counted_as_uncompared() {
        for (extra, verdict) in [
            ("rustc 2, generic, valgrind-2", Comparison::OtherToolchain),
            ("rustc 1, x86-64-v3, valgrind-2", Comparison::OtherToolchain),
            ("rustc 1, generic, valgrind-3", Comparison::Fail),
        ] {
            let mut other = entry(Measure::Instructions, 1000.0);
            other.extra = extra.to_owned();
            let rows = compare(&[figure(Measure::Instructions, 2000.0, None)], &[other]);
            assert_eq!(rows[0].verdict, verdict);
            assert_eq!(rows[0].before, Some(1000.0));
            let uncounted = verdict == Comparison::OtherToolchain;
            assert_eq!(uncompared(&rows), usize::from(uncounted));
            let now = "rustc 1, generic, valgrind-2";
            let named = rows[0].note.contains(extra) && rows[0].note.contains(now);
            assert_eq!(named, uncounted);
        }
        let new = compare(&[figure(Measure::Instructions, 2000.0, None)], &[]);
        assert_eq!(uncompared(&new), 1);
    }

    #[test]
    fn errors_fail_at_their_bar_whatever_the_baseline() {
        let of = |value, baseline| verdict(Measure::ForwardError, value, Some(1e-12), baseline);
        assert_eq!(of(9e-13, 1e-16), Comparison::Pass);
        assert_eq!(of(1.1e-12, 1.0), Comparison::Fail);
        assert_eq!(of(f64::NAN, 1e-16), Comparison::Fail);
        assert_eq!(of(f64::INFINITY, 1e-16), Comparison::Fail);
    }

    #[test]
    fn own_backends_must_not_allocate_and_others_may() {
        let of = |value, bar| verdict(Measure::Allocations, value, bar, 0.0);
        assert_eq!(of(0.0, Some(0.0)), Comparison::Pass);
        assert_eq!(of(0.1, Some(0.0)), Comparison::Fail);
        assert_eq!(of(4.0, None), Comparison::Shown);
    }

    #[test]
    fn slower_is_never_a_failure() {
        let case = CASES.iter().find(|case| case.name() == CASE).unwrap();
        let times = case.measures().filter(|m| m.kind() == Kind::Wall);
        let verdicts: Vec<_> = times.map(|m| verdict(m, 1e9, None, 1.0)).collect();
        assert!(!verdicts.is_empty());
        let all_hold = verdicts.iter().all(|v| *v == Comparison::Shown);
        assert!(all_hold, "{verdicts:?}");
    }

    #[test]
    fn new_figures_pass_and_vanished_ones_fail() {
        let new = figure(Measure::ForwardError, 1e-15, Some(1e-12));
        let mut renamed = entry(Measure::ForwardError, 1e-15);
        renamed.name = "ring-23/banded/forward-error".to_owned();
        let rows = compare(std::slice::from_ref(&new), std::slice::from_ref(&renamed));
        let verdicts: Vec<_> = rows.iter().map(|r| (r.case.as_str(), r.verdict)).collect();
        let expected = [
            (CASE, Comparison::New),
            ("ring-23/banded", Comparison::Fail),
        ];
        assert_eq!(verdicts, expected);
        let beyond = figure(Measure::ForwardError, 1e-11, Some(1e-12));
        assert_eq!(compare(&[beyond], &[])[0].verdict, Comparison::Fail);
        // Tracked, but not part of this run.
        assert!(compare(&[], &[entry(Measure::Min, 1.0)]).is_empty());
    }

    #[test]
    fn what_cannot_be_had_here_is_no_failure_and_what_breaks_is() {
        let missing = |why| Figure {
            value: Err(why),
            ..figure(Measure::Instructions, 0.0, None)
        };
        let absent = missing(Missing::NotMeasured("no valgrind".to_owned()));
        let broken = missing(Missing::Failed("pivot".to_owned()));
        let rows = compare(&[absent, broken], &[entry(Measure::Instructions, 1000.0)]);
        let verdicts: Vec<_> = rows.iter().map(|r| (r.verdict, r.note.as_str())).collect();
        let expected = [
            (Comparison::NotMeasured, "no valgrind"),
            (Comparison::Fail, "pivot"),
        ];
        assert_eq!(verdicts, expected);
    }

    #[test]
    fn an_update_replaces_keeps_and_drops() {
        let kept = entry(Measure::Instructions, 1000.0);
        let mut gone = kept.clone();
        gone.name = "ring-23/banded/instructions".to_owned();
        let old = [gone, entry(Measure::Min, 5.0), kept.clone()];
        let now = [entry(Measure::Min, 4.0)];
        // In the order of the cases' figures.
        assert_eq!(updated(&now, &old), [kept, entry(Measure::Min, 4.0)]);
    }
}
