//! H40: the ladder of mass ratios, from loads of one cable element to loads of 10¹⁰.
//!
//! First a chain of N particles whose last one is the load, without compliance, which has a formula for everything
//! ([`chain`]): conditions and sweeps of Gauss–Seidel, over joints and over groups, are predicted and measured,
//! iterations of conjugate gradient, as many as there are eigenvalues in exact arithmetic, are counted. Then the errors of every solver on the hanging and the bent hoist against
//! 32 digits, with and without the one refinement of the default step ([`crate::linear`] says what to expect), and a
//! minute of swing.

pub(super) mod chain;
mod single;
mod swing;

use crate::cases::Cases;
use crate::hard::numerics::extended_solution;
use crate::hard::{grid, together, worse};
use crate::linear::{self, Record};
use chain::{Chain, Row};
use indicatif::ProgressBar;
use rayon::prelude::*;
use single::{Single, in_single_precision, single};
use std::fmt::Write;
use swing::{Swing, swing};
use taut_ground::poses::Pose;
use taut_integrator::{Form, Stepper};
use taut_model::{HoistParams, Scene, SceneError};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};
use taut_output::settings::distinct;
use taut_output::table::{error, of_records};

/// Elements of the chain and of the hoists.
pub(super) const ELEMENTS: usize = 24;

/// Largest error of KKT forms that passes at every ratio.
pub(super) const KKT_BAR: f64 = 1e-13;

/// Unit roundoff u.
const ROUNDOFF: f64 = 0.5 * f64::EPSILON;

/// Relative bars of predicted conditions and sweeps.
const CONDITION_BAR: f64 = 1e-5;
const SWEEPS_BAR: f64 = 0.05;

/// Compliances over Δt² of the capped chains, and their mass ratio \[1/kg].
const CAPS: [f64; 3] = [1e-6, 1e-4, 1e-2];
const CAPPED_RATIO: f64 = 1e5;

fn ratios(quick: bool) -> Vec<f64> {
    let step = if quick { 5 } else { 1 };
    (0..=10).step_by(step).map(|k| 10_f64.powi(k)).collect()
}

/// The hoist of a ratio, of a material that bears it.
fn params(ratio: f64) -> Result<HoistParams, SceneError> {
    linear::Config::default().params(ELEMENTS, ratio)
}

/// Bent hoists over the ladder.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let of = |ratio: f64| {
        let mut scene = taut_ground::poses::hoist(&params(ratio)?, Pose::Bent)?;
        scene.name = format!("R = {ratio:.0e}");
        Ok(scene)
    };
    [1.0, 1e3, 1e5, 1e8, 1e10].into_iter().map(of).collect()
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let most_sweeps = if quick { 20_000 } else { 400_000 };
    let ratios = ratios(quick);
    let chains: Vec<Row> = ratios
        .par_iter()
        .map(|&ratio| chain::measure(&Chain::new(ELEMENTS, ratio, 0.0), most_sweeps))
        .collect::<Result<_, ExperimentError>>()?;
    let capped: Vec<Row> = CAPS
        .par_iter()
        .map(|&cap| chain::measure(&Chain::new(ELEMENTS, CAPPED_RATIO, cap), most_sweeps))
        .collect::<Result<_, ExperimentError>>()?;
    let config = linear::Config {
        segments: vec![ELEMENTS],
        poses: vec![Pose::Straight, Pose::Bent],
        refinements: vec![0, 1, 2],
        ratios: ratios.clone(),
        ..linear::Config::default()
    };
    let records = linear::run(&config, &Cases::default().shown_by(progress.clone()))?;
    let conditions: Vec<Condition> = ratios
        .par_iter()
        .flat_map(|&ratio| [Pose::Straight, Pose::Bent].map(|pose| (ratio, pose)))
        .map(|(ratio, pose)| condition(ratio, pose))
        .collect::<Result<_, ExperimentError>>()?;
    // All of the ladder, for where it ends is what is judged.
    let singles: Vec<Single> = self::ratios(false)
        .into_par_iter()
        .flat_map(|ratio| [Pose::Straight, Pose::Bent].map(|pose| (ratio, pose)))
        .map(|(ratio, pose)| single(ratio, pose))
        .collect::<Result<_, _>>()?;
    let swings: Vec<Swing> = ratios
        .par_iter()
        .map(|&r| swing(r))
        .collect::<Result<_, _>>()?;
    let mut checks = predicted(&chains, &capped);
    checks.extend(accurate(&records, &conditions));
    checks.extend(in_single_precision(&singles));
    checks.extend(swings.iter().flat_map(|s| [s.check(), s.energy()]));
    let mut out = chain_table(&chains, &capped);
    for refinements in [0, 1, 2] {
        let _ = writeln!(
            out,
            "\nErrors of the multipliers against 32 digits, larger of the poses, {refinements} refinements, over R"
        );
        out.push_str(&error_table(&records, &conditions, refinements, &ratios));
    }
    out.push('\n');
    Ok(Outcome {
        checks,
        text: out,
        ..Outcome::default()
    })
}

/// How far the formulas hold.
fn predicted(chains: &[Row], capped: &[Row]) -> Vec<Check> {
    let worst = |rows: &[Row], of: fn(&Row) -> f64| rows.iter().map(of).fold(0.0, worse);

    let condition = worst(chains, |r| {
        (r.condition / r.predicted_condition - 1.0).abs()
    });
    let sweeps = worst(chains, |r| (r.sweeps / r.predicted_sweeps - 1.0).abs());
    let multipliers = worst(chains, |r| r.multipliers_error);
    let over_groups = worst(chains, |r| {
        (r.group_sweeps / r.predicted_group_sweeps - 1.0).abs()
    });
    let mut checks = vec![
        Check::off(
            "chain: condition",
            "4 N R + 2 N (N − 1)",
            condition,
            "",
            CONDITION_BAR,
        )
        .by("largest relative deviation over R; S has rounded 1 + 1/R"),
        Check::off(
            "chain: Gauss-Seidel",
            "ln 10⁶ / (−2 ln cos θ)",
            sweeps,
            "",
            SWEEPS_BAR,
        )
        .by("largest relative deviation over R of the sweeps to 10⁻⁶")
        .noting(counted(chains, |r| r.extrapolated)),
        Check::off(
            "chain: Gauss-Seidel over groups",
            "ρ = R/(R + 1)",
            over_groups,
            "",
            SWEEPS_BAR,
        )
        .by("largest relative deviation over R of the sweeps to 10⁻⁶")
        .noting(counted(chains, |r| r.groups_extrapolated)),
        Check::off("chain: multipliers", "λᵢ = g Σ m", multipliers, "", KKT_BAR)
            .by("32 digits against the formula, relative"),
    ];
    checks.push(finite_termination(chains));
    checks.push(eigenvalues(chains));
    for r in capped {
        checks.push(Check::relative(
            format!("chain: R = 1e5, ε/Δt² = {:.0e}", r.cap),
            [r.predicted_condition, r.condition],
            "",
            CAP_BAR,
        )
            .by("condition against 1/(1/κ₀ + σ/4): both limits are exact, between them it is a mean"),
        );
        let by =
            "sweeps to 10⁻⁶ against what is left of the slowest mode, from its rate and its share";
        for (name, both) in [
            ("Gauss-Seidel", [r.predicted_sweeps, r.sweeps]),
            (
                "Gauss-Seidel over groups",
                [r.predicted_group_sweeps, r.group_sweeps],
            ),
        ] {
            let case = format!("chain: R = 1e5, ε/Δt² = {:.0e}: {name}", r.cap);
            checks.push(Check::relative(case, both, "sweeps", SWEEPS_BAR).by(by));
        }
    }
    checks
}

/// Conjugate gradient, plain and scaled, ends after as many iterations as there are eigenvalues, at every ratio.
fn finite_termination(chains: &[Row]) -> Check {
    let counts = chains.iter().flat_map(|r| [r.cg, r.cg_jacobi]);
    // One that did not end has no count.
    let most = counts
        .map(|n| n.map_or(f64::INFINITY, |n| n as f64))
        .fold(0.0, worse);
    Check::within(
        "chain: conjugate gradient",
        format!("at most N = {ELEMENTS}"),
        most.to_string(),
        most,
        ELEMENTS as f64,
    )
    .by("most iterations to 10⁻⁶ of the multipliers over R, none and jacobi")
}

/// The groups' blocks as preconditioner leave three eigenvalues, at every ratio.
fn eigenvalues(chains: &[Row]) -> Check {
    let counts = chains.iter().map(|r| r.cg_group);
    let most = counts
        .map(|n| n.map_or(f64::INFINITY, |n| n as f64))
        .fold(0.0, worse);
    Check::within(
        "chain: conjugate gradient by groups",
        "at most 3",
        format!("{most}"),
        most,
        3.0,
    )
    .by("most iterations to 10⁻⁶ of the multipliers over R; the load's link is a group of its own")
}

/// At how many ratios the sweeps were made, and at which they are extrapolated.
fn counted(chains: &[Row], extrapolated: fn(&Row) -> bool) -> String {
    let others: Vec<String> = chains
        .iter()
        .filter(|r| extrapolated(r))
        .map(|r| format!("{:.0e}", r.ratio))
        .collect();
    let counted = format!(
        "counted at {} of {} ratios",
        chains.len() - others.len(),
        chains.len()
    );
    if others.is_empty() {
        return counted;
    }
    format!(
        "{counted}, at the others ({}) extrapolated from the rate that the last half of the sweeps made had",
        others.join(", ")
    )
}

/// Relative bar of a capped condition.
const CAP_BAR: f64 = 0.1;

/// Direct solvers against the bars: S 10 u R, unrefined and as the step refines it; KKT forms, as the step refines them,
/// 10⁻¹³.
fn accurate(records: &[Record], conditions: &[Condition]) -> Vec<Check> {
    let direct = || records.iter().filter(|r| r.direct);
    let backends = distinct(direct().map(|r| r.backend.as_str()));
    let over = |backend: &str, refinements: usize, bar: fn(f64) -> f64| {
        let own = direct().filter(move |r| r.backend == backend && r.refinements == refinements);
        own.max_by(|a, b| {
            let size = |r: &Record| r.forward_error.abs() / bar(r.mass_ratio);
            size(a).total_cmp(&size(b))
        })
        .map(|r| {
            let relative = r.forward_error / bar(r.mass_ratio);
            let ours = format!(
                "{:.1e} at R = {:.0e}, {}",
                r.forward_error, r.mass_ratio, r.pose
            );
            let mut check = Check::within("", "", ours, relative, 1.0);
            check.note = r.error.clone().unwrap_or_default();
            (backend.to_owned(), check)
        })
    };
    let group = |case: &str, kkt: bool, refinements: usize, bar: fn(f64) -> f64, said: &str| {
        let own = backends.iter().filter(|b| b.ends_with("/kkt") == kkt);
        let rows = own.filter_map(|b| over(b, refinements, bar)).map(|(b, c)| {
            let c = Check {
                reference: said.to_owned(),
                ..c.by(
                    "error of the multipliers against 32 digits over the bar, the largest over R",
                )
            };
            (b, c)
        });
        together(case, rows.collect())
    };
    let formed = |ratio: f64| 10.0 * ROUNDOFF * ratio.max(1.0);
    let exact = |_: f64| KKT_BAR;
    let mut checks = group("S, unrefined", false, 0, formed, "10 u R");
    for check in checks.iter_mut().filter(|c| c.verdict == Verdict::Fail) {
        explain(check, records, conditions);
    }
    checks.extend(group("S, 1 refinement", false, 1, formed, "10 u R"));
    let mut kkt = group("KKT, 1 refinement", true, 1, exact, "1e-13");
    for check in kkt.iter_mut().filter(|c| c.verdict == Verdict::Fail) {
        square(check, records);
    }
    checks.extend(kkt);
    checks
}

/// Why one refinement is not enough, in the figures of the same solver with none and with two. No more than that: an
/// error within twice the square, of a solver that two refinements bring within the bar, is a limit.
fn square(check: &mut Check, records: &[Record]) {
    let worst = |refinements: usize| {
        let own = records.iter().filter(|r| {
            r.refinements == refinements && check.case.ends_with(&format!(": {}", r.backend))
        });
        own.map(|r| r.forward_error).fold(0.0, worse)
    };
    let (none, one, two) = (worst(0), worst(1), worst(2));
    if one <= 2.0 * none * none && two <= KKT_BAR {
        check.verdict = Verdict::Limit;
    }
    let _ = write!(
        check.note,
        "a refinement leaves the square of what it begins with, {none:.1e}² = {:.1e}: without pivoting S is formed on \
         the way, and has lost its u R; two refinements leave {two:.1e}",
        none * none
    );
}

/// 10 u R leaves out the part of the condition that has no R in it. What a stable solver leaves of S, whose entries are
/// rounded when it is formed, is a multiple of u κ(S), S scaled to a diagonal of 1, which
/// elimination without pivoting does not notice: within u κ of each hoist's own S a miss is none of the solver's,
/// and from the ratio on where R outweighs that part the bar has to hold.
fn explain(check: &mut Check, records: &[Record], conditions: &[Condition]) {
    let unrefined = |r: &&Record| r.direct && r.refinements == 0 && !r.backend.ends_with("/kkt");
    let own = records
        .iter()
        .filter(unrefined)
        .filter(|r| check.case.ends_with(&format!(": {}", r.backend)));
    let of = |r: &Record| {
        let here = |c: &&Condition| c.ratio == r.mass_ratio && c.pose == r.pose;
        conditions
            .iter()
            .find(here)
            .map_or(f64::NAN, |c| c.condition)
    };
    let of_stable = |r: &Record| r.forward_error / (ROUNDOFF * of(r));
    let stable = own.clone().map(of_stable).fold(0.0, worse);
    let heavy = |r: &&Record| r.mass_ratio >= HEAVY;
    let of_bar = |r: &Record| r.forward_error / (10.0 * ROUNDOFF * r.mass_ratio);
    let worst = own.clone().filter(heavy).map(of_bar).fold(0.0, worse);
    if stable <= 1.0 && worst <= 1.0 {
        check.verdict = Verdict::Limit;
    }
    let light = conditions.iter().filter(|c| c.ratio == 1.0);
    let light = light.map(|c| c.condition).fold(0.0, worse);
    let _ = write!(
        check.note,
        "the bar has R for κ, and κ of S with a diagonal of 1 is {light:.1e} at R = 1: at all ratios the error is at most {stable:.1e} of u κ, \
         from R = {HEAVY:.0e} on at most {worst:.1e} of the bar; the default step refines"
    );
}

/// The ratio from which on R outweighs the length in the condition.
const HEAVY: f64 = 1e3;

/// The condition of a hoist's S.
#[derive(Debug, Clone, PartialEq)]
struct Condition {
    ratio: f64,
    pose: Pose,
    /// ‖S‖∞ ‖S⁻¹‖∞ of S scaled to a diagonal of 1.
    condition: f64,
}

/// The condition of S of a hoist, its inverse column by column in 32 digits.
fn condition(ratio: f64, pose: Pose) -> Result<Condition, ExperimentError> {
    let scene = taut_ground::poses::hoist(&params(ratio)?, pose)?;
    let mut stepper = Stepper::new(scene, linear::Config::default().step)?;
    // Which linearises.
    stepper.reference_multipliers()?;
    let (s, _) = stepper.assembled(Form::Schur)?;
    let n = s.dim();
    // Rows of metres stand beside rows of radians: the scaling removes the units.
    let scale: Vec<f64> = (0..n).map(|i| s.get(i, i).sqrt().recip()).collect();
    let mut rows = vec![0.0; n];
    s.for_each_lower(|r, c, a| {
        let size = (scale[r] * a * scale[c]).abs();
        rows[r] += size;
        if r != c {
            rows[c] += size;
        }
    });
    let mut sums = vec![0.0; n];
    for column in 0..n {
        let mut unit = vec![0.0; n];
        unit[column] = 1.0;
        let inverse = extended_solution(&s, &unit)?;
        for ((sum, x), d) in sums.iter_mut().zip(inverse).zip(&scale) {
            *sum += (x / (d * scale[column])).abs();
        }
    }
    Ok(Condition {
        ratio,
        pose,
        condition: [rows, sums]
            .into_iter()
            .map(|sums| sums.into_iter().fold(0.0, worse))
            .product(),
    })
}

fn chain_table(chains: &[Row], capped: &[Row]) -> String {
    let mut out = format!(
        "Chain of {ELEMENTS} particles, R: load/element; κ in the ∞-norm; sweeps of Gauss-Seidel and iterations of\n\
         CG to 10⁻⁶ of the multipliers from zero, ~: extrapolated from the rate measured over the sweeps made\n"
    );
    let count = |n: Option<usize>| n.map_or_else(|| "-".to_owned(), |n| n.to_string());
    let mark = |extrapolated| if extrapolated { "~" } else { "" };
    let t = of_records(
        chains.iter().chain(capped),
        &[
            ("R", &|r| format!("{:.0e}", r.ratio)),
            ("load/cable", &|r| {
                format!("{:.1e}", r.ratio / (ELEMENTS - 1) as f64)
            }),
            ("ε/Δt²", &|r| format!("{:.0e}", r.cap)),
            ("κ formula", &|r| format!("{:.3e}", r.predicted_condition)),
            ("κ", &|r| format!("{:.3e}", r.condition)),
            ("sweeps formula", &|r| format!("{:.2e}", r.predicted_sweeps)),
            ("sweeps", &|r| {
                format!("{}{:.2e}", mark(r.extrapolated), r.sweeps)
            }),
            ("groups formula", &|r| {
                format!("{:.2e}", r.predicted_group_sweeps)
            }),
            ("groups", &|r| {
                format!("{}{:.2e}", mark(r.groups_extrapolated), r.group_sweeps)
            }),
            ("CG", &|r| count(r.cg)),
            ("jacobi", &|r| count(r.cg_jacobi)),
            ("group", &|r| count(r.cg_group)),
        ],
    );
    out.push_str(&t);
    out
}

fn error_table(
    records: &[Record],
    conditions: &[Condition],
    refinements: usize,
    ratios: &[f64],
) -> String {
    let heads: Vec<String> = ratios.iter().map(|r| format!("{r:.0e}")).collect();
    let own = || records.iter().filter(|r| r.refinements == refinements);
    let shown = own().filter(|r| r.direct || refinements == 0);
    let backends = distinct(shown.map(|r| r.backend.as_str()));
    let of_s = |ratio: &f64| {
        let here = conditions.iter().filter(|c| c.ratio == *ratio);
        error(Some(here.map(|c| c.condition).fold(0.0, worse)))
    };
    let mut rows = vec![(
        "κ∞ of S, scaled".to_owned(),
        ratios.iter().map(of_s).collect(),
    )];
    for backend in backends {
        let of_backend = |ratio: &f64| {
            let here = own().filter(|r| r.backend == backend && r.mass_ratio == *ratio);
            error(here.map(|r| r.forward_error.abs()).max_by(f64::total_cmp))
        };
        rows.push((backend.to_owned(), ratios.iter().map(of_backend).collect()));
    }
    grid("solver", &heads, rows)
}
