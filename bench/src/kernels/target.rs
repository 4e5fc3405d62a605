//! What the solve is to reach, and whether it does: computed from the rows of a run.

use super::{Joint, Record};
use serde::Serialize;
use taut_lanes::Level;

/// A bar and the worst figure of the run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Target {
    /// What is measured.
    pub what: String,
    /// What that is a number of: `ns` (a joint), `×` (times something), or nothing.
    pub unit: &'static str,
    /// Whether the bar is the most or the least that it may be.
    pub at_most: bool,
    /// The bar.
    pub bar: f64,
    /// The worst figure over all cases, by least times; none where nothing was measured.
    pub worst: Option<f64>,
    /// The same by medians.
    pub worst_median: Option<f64>,
    /// The best figure, by least times.
    pub best: Option<f64>,
    /// Segments of the case with the worst figure.
    pub segments: Option<usize>,
    /// Whether the worst figure keeps the bar; none where nothing was measured.
    pub reached: Option<bool>,
}

/// A figure of a case: its segments, by least times and by medians.
type Figure = (usize, f64, f64);

impl Target {
    fn new(
        what: impl Into<String>,
        unit: &'static str,
        (at_most, bar): (bool, f64),
        figures: &[Figure],
    ) -> Self {
        // NaN, a solver that failed, is the worst of all.
        let badness = |x: f64| match x {
            x if x.is_nan() => f64::INFINITY,
            x if at_most => x,
            x => -x,
        };
        let by_badness = |of: fn(&Figure) -> f64| {
            move |a: &&Figure, b: &&Figure| badness(of(a)).total_cmp(&badness(of(b)))
        };
        let worst = figures.iter().max_by(by_badness(|f| f.1));
        let best = figures.iter().min_by(by_badness(|f| f.1));
        let median = figures.iter().max_by(by_badness(|f| f.2));
        let keeps = |x: f64| if at_most { x <= bar } else { x >= bar };
        Self {
            what: what.into(),
            unit,
            at_most,
            bar,
            worst: worst.map(|f| f.1),
            worst_median: median.map(|f| f.2),
            best: best.map(|f| f.1),
            segments: worst.map(|f| f.0),
            reached: worst.map(|f| keeps(f.1)),
        }
    }
}

/// Times and ratios are those of joints of 5 rows, where nothing else is said.
#[must_use]
pub fn targets(records: &[Record]) -> Vec<Target> {
    let named = |options: &'static str| move |r: &Record| r.options == options;
    let five: Vec<&Record> = records
        .iter()
        .filter(|r| r.joint_rows == Joint::Untwisted.rows())
        .collect();
    let time = |what: &str, bar: f64, of: &dyn Fn(&Record) -> bool| {
        Target::new(what, "ns", (true, bar), &times(&five, of))
    };
    let faster = |what: &str, bar: f64, than: &dyn Fn(&Record) -> bool| {
        Target::new(what, "×", (false, bar), &faster_than(&five, than))
    };
    let wide = Level::best().widest() >= 4;
    let one = "one cable, a joint";
    let mut targets = match wide {
        true => vec![
            time(one, 25.0, &named("banded")),
            time("the same, aim", 20.0, &named("banded")),
        ],
        false => vec![time(&format!("{one}, without AVX"), 50.0, &named("banded"))],
    };
    targets.extend([
        faster("faster than dpbtrf", 7.0, &|r| {
            r.options.starts_with("lapack")
        }),
        faster("faster than the best of faer", 12.0, &|r| {
            r.options.starts_with("faer")
        }),
        faster("faster than UMFPACK on S", 80.0, &|r| {
            r.options.starts_with("umfpack") && !r.options.ends_with("/kkt")
        }),
        faster("faster than UMFPACK on the KKT matrix", 200.0, &|r| {
            r.options.starts_with("umfpack") && r.options.ends_with("/kkt")
        }),
        time("batch of 8, a joint", 8.0, &named("batch")),
        // One thread is the faster: `taut_solver`'s chains say why, so there is no row to measure.
        time("2 threads, from 400 segments on, a joint", 12.0, &|_| false),
        Target::new(
            "joints of 6 rows over those of 5",
            "×",
            (true, 1.6),
            &six_over_five(records),
        ),
        time(
            "with one refinement, a joint",
            65.0,
            &named("banded+refine"),
        ),
        Target::new(
            "componentwise backward error, joints of 3, 5, 6 rows",
            "",
            (true, 1e-15),
            &backward_errors(records),
        ),
    ]);
    targets
}

fn times(records: &[&Record], of: &dyn Fn(&Record) -> bool) -> Vec<Figure> {
    let own = records.iter().filter(|r| of(r));
    own.map(|r| (r.segments, r.ns_per_joint, r.ns_per_joint_median))
        .collect()
}

/// How many times the time of `banded` the fastest of some takes, case by case.
fn faster_than(records: &[&Record], of: &dyn Fn(&Record) -> bool) -> Vec<Figure> {
    let cases = records.chunk_by(|a, b| same_case(a, b));
    cases
        .filter_map(|case| {
            let failed = |r: &&&Record| r.options == "banded" && r.error.is_some();
            if case.iter().any(|r| failed(&r)) {
                return Some((case[0].segments, f64::NAN, f64::NAN));
            }
            let own = case.iter().filter(|r| of(r) && r.error.is_none());
            let least = |x: f64, r: Option<f64>| r.map_or(x, |r| x.min(r));
            let ratios = own.map(|r| (r.ratio, r.ratio_median));
            let (a, b) = ratios.fold((f64::INFINITY, f64::INFINITY), |(a, b), (r, m)| {
                (least(a, r), least(b, m))
            });
            a.is_finite().then_some((case[0].segments, a, b))
        })
        .collect()
}

fn same_case(a: &Record, b: &Record) -> bool {
    (a.segments, a.joint_rows) == (b.segments, b.joint_rows) && a.mass_ratio == b.mass_ratio
}

fn six_over_five(records: &[Record]) -> Vec<Figure> {
    let banded = |joint: Joint| {
        let own = move |r: &&Record| r.options == "banded" && r.joint_rows == joint.rows();
        records.iter().filter(own)
    };
    let pair = |six: &Record| {
        let fits =
            |five: &&Record| five.segments == six.segments && five.mass_ratio == six.mass_ratio;
        let five = banded(Joint::Untwisted).find(fits)?;
        let (least, median) = (five.ns_per_joint, five.ns_per_joint_median);
        Some((
            six.segments,
            six.ns_per_joint / least,
            six.ns_per_joint_median / median,
        ))
    };
    banded(Joint::Cosserat).filter_map(pair).collect()
}

/// Of `banded`, one cable and batch.
fn backward_errors(records: &[Record]) -> Vec<Figure> {
    let ours = |r: &&Record| r.options == "banded" || r.options == "batch";
    let error = |r: &Record| {
        let e = r.backward_error_componentwise;
        (r.segments, e, e)
    };
    records.iter().filter(ours).map(error).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(segments: usize, joint: Joint, options: &str, ns: f64, ratio: f64) -> Record {
        Record {
            segments,
            mass_ratio: 1e3,
            joints: segments + 1,
            joint_rows: joint.rows(),
            solver: options.to_owned(),
            options: options.to_owned(),
            cables: 1,
            ns_per_joint: ns,
            ns_per_joint_median: 2.0 * ns,
            ratio: Some(ratio),
            ratio_median: Some(ratio),
            samples: 9,
            backward_error: 1e-17,
            backward_error_componentwise: 2e-16,
            forward_error: 1e-13,
            error: None,
        }
    }

    fn find<'a>(targets: &'a [Target], what: &str) -> &'a Target {
        let found = targets.iter().find(|t| t.what.contains(what));
        found.unwrap_or_else(|| panic!("{what}: {targets:?}"))
    }

    #[test]
    fn the_worst_case_decides() {
        let five = Joint::Untwisted;
        let rows = [
            row(24, five, "banded", 22.0, 1.0),
            row(24, five, "faer:llt", 220.0, 10.0),
            row(24, five, "faer:ldlt", 440.0, 20.0),
            row(400, five, "banded", 18.0, 1.0),
            row(400, five, "faer:llt", 252.0, 14.0),
            row(400, Joint::Cosserat, "banded", 36.0, 1.0),
        ];
        let targets = targets(&rows);
        let one = &targets[0];
        assert_eq!((one.worst, one.best), (Some(22.0), Some(18.0)));
        assert_eq!((one.worst_median, one.segments), (Some(44.0), Some(24)));
        assert_eq!(one.reached, Some(true));
        // The best of faer, case by case.
        let faer = find(&targets, "faer");
        assert_eq!((faer.worst, faer.reached), (Some(10.0), Some(false)));
        let six = find(&targets, "6 rows");
        assert_eq!((six.worst, six.reached), (Some(2.0), Some(false)));
        assert_eq!(find(&targets, "backward").reached, Some(true));
        let absent = find(&targets, "dpbtrf");
        assert_eq!((absent.worst, absent.reached), (None, None));
    }

    #[test]
    fn a_failure_reaches_nothing() {
        let mut failed = row(24, Joint::Untwisted, "banded", f64::NAN, f64::NAN);
        failed.backward_error_componentwise = f64::NAN;
        let good = row(400, Joint::Untwisted, "banded", 1.0, 1.0);
        let targets = targets(&[failed, good]);
        assert_eq!(targets[0].reached, Some(false));
        assert_eq!(find(&targets, "backward").reached, Some(false));
        assert!(super::targets(&[]).iter().all(|t| t.reached.is_none()));
    }
}
