//! Self-test of comparisons on this machine: the program must pass against itself, and must fail
//! every time against a copy that spins after each step until its time is 10 % longer.

use super::against::{Versus, against};
use super::cases::Case;
use super::compare::{Comparison, Row};
use indicatif::ProgressBar;

/// The part that each step is made longer by.
pub(super) const SLOWED: f64 = 0.1;

/// How often comparisons came out as they have to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SelfTest {
    /// Comparisons of each kind.
    pub trials: usize,
    /// Figures that a trial has; none in a build without the backends of the cases.
    pub figures: usize,
    /// Comparisons with itself that have no failure.
    pub same: usize,
    /// Comparisons with the slower copy in which every figure fails.
    pub slowed: usize,
    /// The least and the greatest ratio of the comparisons with itself, each with its figure; `None` without any.
    pub same_ratios: Option<[Extreme; 2]>,
    /// Those of the slower copy.
    pub slowed_ratios: Option<[Extreme; 2]>,
}

/// A ratio, and `scene/backend measure` that it is of.
pub(super) type Extreme = (f64, String);

impl SelfTest {
    /// True if every comparison came out right.
    pub fn is_passed(&self) -> bool {
        self.same == self.trials && self.slowed == self.trials
    }
}

/// Compares this program so many times with itself, and as often with itself made slower by a tenth, in turns.
pub fn self_test(
    versus: &Versus,
    cases: &[Case],
    trials: usize,
    progress: &ProgressBar,
) -> Result<SelfTest, String> {
    let mut test = SelfTest {
        trials,
        ..SelfTest::default()
    };
    let mut slower = versus.clone();
    slower.head.slowed = SLOWED;
    for trial in 1..=trials {
        progress.set_message(format!("trial {trial} of {trials}"));
        progress.reset();
        let same = against(versus, cases, progress)?;
        let measured = |c: &&Row| c.verdict != Comparison::NotMeasured;
        test.figures = same.iter().filter(measured).count();
        if test.figures == 0 {
            break;
        }
        test.same += usize::from(all(&same, |verdict| verdict != Comparison::Fail));
        widen(&mut test.same_ratios, &same);
        let slowed = against(&slower, cases, progress)?;
        test.slowed += usize::from(all(&slowed, |verdict| verdict == Comparison::Fail));
        widen(&mut test.slowed_ratios, &slowed);
    }
    Ok(test)
}

/// True if any figure was measured and every measured one has a right verdict.
fn all(compared: &[Row], is_right: fn(Comparison) -> bool) -> bool {
    let verdicts = compared.iter().map(|c| c.verdict);
    let mut judged = verdicts
        .filter(|v| *v != Comparison::NotMeasured)
        .peekable();
    judged.peek().is_some() && judged.all(is_right)
}

fn widen(extremes: &mut Option<[Extreme; 2]>, compared: &[Row]) {
    for row in compared {
        let Some(ratio) = row.ratio else { continue };
        let here = || (ratio.value, format!("{} {}", row.case, row.measure));
        let [least, most] = extremes.get_or_insert_with(|| [here(), here()]);
        if ratio.value < least.0 {
            *least = here();
        }
        if ratio.value > most.0 {
            *most = here();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::measures::Missing;
    use super::*;

    #[test]
    fn what_was_not_measured_is_no_trial() {
        let found = |missing| Row::new("gantry/banded", "time-min").without(missing);
        let absent = || found(Missing::NotMeasured(String::new()));
        let failed = || found(Missing::Failed(String::new()));
        let fails = |verdict| verdict == Comparison::Fail;
        assert!(!all(&[absent()], fails) && !all(&[absent()], |_| true));
        assert!(all(&[absent(), failed()], fails));
    }
}
