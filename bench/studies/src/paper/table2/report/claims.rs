//! Statements of the paper on solvers, starts and joints, beside the cells; its column at one
//! length.

use super::{PAPER, find, find_with, is_plain};
use crate::paper::table2::{Ends, ROWS, Record, Setting, Solver};
use taut_model::TwistDefinition;
use taut_output::check::{Check, Verdict};

/// Smallest and largest of the limits of a column, as text; and their logarithms.
fn range(records: &[Record], setting: Setting, solver: Solver) -> Option<(String, [f64; 2])> {
    let cells = || {
        ROWS.iter()
            .filter_map(|r| find(records, r, setting, solver))
    };
    let value = |r: &Record| r.stable.map_or(-1.0, f64::log10);
    let low = cells().min_by(|a, b| value(a).total_cmp(&value(b)))?;
    let high = cells().max_by(|a, b| value(a).total_cmp(&value(b)))?;
    let trimmed = |r: &Record| r.cell().trim_end_matches(['g', 't', 'x']).to_owned();
    Some((
        format!("10^({} … {})", trimmed(low), trimmed(high)),
        [value(low), value(high)],
    ))
}

pub(super) fn claims(records: &[Record]) -> Vec<Check> {
    let column = |setting, solver| range(records, setting, solver);
    let mut checks = Vec::new();
    checks.extend(
        [(20, 5.0), (3, 3.0)]
            .into_iter()
            .filter_map(|(n, decade)| enough(records, n, decade)),
    );
    let solvers = [Solver::Sweeps(20), Solver::Cg, Solver::Direct].map(|s| column(PAPER, s));
    if let [Some((_, swept)), Some((cg, c)), Some((direct, d))] = solvers {
        let note = format!(
            "the iterations of heavy ends already reach the limit of the cable itself; conjugate gradient {cg}. Beyond a \
             light top, where sweeps end at 10^{:.2}, both go on to the same limit",
            light_limit(records, Solver::Sweeps(20)).unwrap_or(f64::NAN)
        );
        let better = c[1] > swept[1] + 1.0 && d[1] > swept[1] + 1.0;
        let verdict = Verdict::or_only_if(better);
        checks.push(Check::claim(
            "direct solver, CG",
            "considerably more",
            direct,
            verdict,
            note,
        ));
    }
    let seeded = [TwistDefinition::Alternative, TwistDefinition::Ordinary]
        .map(|t| column(Setting::Seeded(t), Solver::Direct));
    if let [Some((alternative, [_, a])), Some((ordinary, [_, o]))] = seeded {
        let ours = ordinary;
        let note = "with 10⁻⁶ rad/s out of the plane: one bend angle resists one of two transverse directions; 10^<0 is \
                    unstable at ratio 1; ordinary twist here";
        let note = format!("{note}, alternative {alternative}");
        let holds = a >= 5.0 || o >= 5.0;
        checks.push(Check::claim(
            "paper's joint in space",
            "stable to 10⁵",
            ours,
            Verdict::of(holds),
            note,
        ));
    }
    let rows = || {
        ROWS.iter()
            .filter_map(|r| find(records, r, Setting::Stiffened, Solver::Direct))
    };
    let (lost, all) = (rows().filter(|r| !r.capped).count(), rows().count());
    if let Some((ours, _)) = column(Setting::Stiffened, Solver::Direct) {
        let by = "rows that fail below the largest ratio tried, direct, no guard";
        let case = "geometric stiffness, seeded";
        checks.push(
            Check::within(case, format!("none in {all} rows"), ours, lost as f64, 0.0).by(by),
        );
    }
    checks
}

/// Largest limit of the sweeps with a light top, paper's joint in the plane, as a logarithm.
fn light_limit(records: &[Record], solver: Solver) -> Option<f64> {
    let cells = ROWS.iter();
    let cells = cells.filter_map(|r| find_with(records, Ends::Light, r, PAPER, solver)?.limit());
    cells.reduce(f64::max)
}

/// Check that `n` sweeps suffice up to 10^`decade` in every row whose cable holds that with a
/// direct solver.
pub(in crate::paper) fn enough(records: &[Record], n: usize, decade: f64) -> Option<Check> {
    let cells = || {
        let both = |r| {
            let swept = find(records, r, PAPER, Solver::Sweeps(n))?;
            Some((swept, find(records, r, PAPER, Solver::Direct)?))
        };
        ROWS.iter().filter_map(both)
    };
    let reaches = |r: &Record| r.stable.is_some_and(|s| s.log10() >= decade - 1e-9);
    let able = cells().filter(|(_, direct)| reaches(direct)).count();
    let kept = cells()
        .filter(|(swept, direct)| reaches(direct) && reaches(swept))
        .count();
    let light = light_limit(records, Solver::Sweeps(n));
    let lost = light.map_or_else(String::new, |l| {
        format!(", where {n} sweeps end at 10^{l:.2}")
    });
    let verdict = match (kept, able) {
        (_, 0) => Verdict::NotYet,
        (0, _) => Verdict::DoesNotHold,
        (kept, able) if kept < able => Verdict::HoldsOnlyIf,
        _ if light.is_some_and(|l| l < decade) => Verdict::HoldsOnlyIf,
        _ => Verdict::Holds,
    };
    let note = format!(
        "both end segments are as heavy as the load and the cable with its load is one group: the paper's scene. A sweep \
         then leaves half of the anchor's error at any ratio. Not with a light top and the load's joint apart{lost}"
    );
    Some(Check::claim(
        format!("{n} iterations"),
        format!("enough for 10^{decade:.0}"),
        format!("in {kept} of the {able} rows whose cable holds it"),
        verdict,
        note,
    ))
}

pub(super) fn lengths(records: &[Record]) -> Vec<Check> {
    let mut checks = Vec::new();
    let warm: Vec<String> = records
        .iter()
        .filter(|r| r.solver.ends_with("warm start"))
        .map(|r| {
            let sweeps = r.solver.split_whitespace().nth(1).unwrap_or_default();
            format!("N {}, {sweeps}: 10^{}", r.segments, r.cell())
        })
        .collect();
    if !warm.is_empty() {
        let note = format!(
            "{}. All other rows start from the groups' own solutions, as Algorithm 1 does: the last step's multipliers keep \
             the error that the sweeps leave, and add to it",
            warm.join("; ")
        );
        // Row by row: the same cable and number of sweeps from the groups' own solutions.
        let gain = |warm: &Record| {
            let name = warm.solver.replace(", warm start", "");
            let cold = records.iter().find(|r| {
                is_plain(r)
                    && r.solver == name
                    && r.setting == warm.setting
                    && (r.young, r.zeta, r.segments) == (warm.young, warm.zeta, warm.segments)
            });
            let decade = |r: &Record| r.stable.map_or(0.0, f64::log10);
            cold.map(|cold| decade(warm) - decade(cold))
        };
        let cells = records.iter().filter(|r| r.solver.ends_with("warm start"));
        let gains: Vec<f64> = cells.filter_map(gain).collect();
        let worst = gains.iter().copied().fold(f64::INFINITY, f64::min);
        let verdict = Verdict::either(worst >= 0.0, [Verdict::Pass, Verdict::Limit]);
        let ours = format!("at worst {worst:+.2} decades");
        checks.push(Check::claim(
            "start from last multipliers",
            "as good a start",
            ours,
            verdict,
            note,
        ));
    }
    let direct = |r: &&Record| !is_plain(r) && r.solver == Solver::Direct.to_string();
    let fitted: Vec<&Record> = records.iter().filter(direct).collect();
    if let Some(first) = fitted.first() {
        let errors = fitted
            .iter()
            .filter_map(|r| Some((r.limit()? - r.paper.log10()).abs()));
        let worst = errors.fold(0.0, f64::max);
        let lengths = ROWS.map(|r| r.euler_length());
        let (low, high) = lengths
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(a, b), &l| (a.min(l), b.max(l)));
        let ours = format!("{:.2} m ({low:.1} … {high:.1} m)", first.length);
        let note = "at that length Euler's load is the column within the factor between 24 and 6 segments; but the run \
                    stays stable far beyond Euler's load at the soft end, where inertia holds the segments: the limit goes as \
                    the root of Y/ζ there";
        let check =
            Check::within("one length for all", "the paper's M/m", ours, worst, 0.5).published();
        checks.push(check.by("largest distance of the direct limits from the paper's ratios at that length, decades").noting(note));
    }
    checks
}
