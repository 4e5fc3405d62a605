//! Report of an audit of claims: rows of checks by both readings, and the table of all solvers.

use super::{Audit, Finding, Solve};
use crate::hard::{together, worse};
use std::fmt::Write;
use taut_output::check::{Check, Verdict};
use taut_output::settings::distinct;
use taut_output::table::{error, text, wrapped};

/// How many claims of each solver are false, of how many: those of all that have none false are counted together.
fn counted(solves: &[Solve], wrong: impl Fn(&Solve) -> bool) -> Vec<(&str, usize, String)> {
    let backends = distinct(solves.iter().map(|s| s.backend.as_str()));
    let counts: Vec<(&str, usize, usize)> = backends
        .into_iter()
        .map(|backend| {
            let own = || solves.iter().filter(|s| s.backend == backend);
            let claims = own().filter(|s| s.is_claim()).count();
            (backend, own().filter(|s| wrong(s)).count(), claims)
        })
        .collect();
    let clean: usize = counts.iter().filter(|c| c.1 == 0).map(|c| c.2).sum();
    let text = |(backend, wrong, claims)| match wrong {
        0 => (backend, 0, format!("0 of {clean}")),
        _ => (backend, wrong, format!("{wrong} of {claims}")),
    };
    counts.into_iter().map(text).collect()
}

/// A row for each solver: no claim of it is false.
pub(super) fn checks(audit: &Audit) -> Vec<Check> {
    let solves = &audit.solves;
    let is_false = |s: &Solve| s.finding == Finding::False;
    let counts = counted(solves, is_false).into_iter();
    let rows = counts.map(|(backend, count, ours)| {
        let bar = "claims that are false; a claim: the tolerance is met, or the backward error is within 10⁻¹⁴";
        let reference = "no false claim".to_owned();
        let mut check = Check::within("", reference, ours, count as f64, 0.0).by(bar);
        let wrong = solves
            .iter()
            .filter(|s| s.backend == backend && is_false(s));
        if let Some(worst) = wrong.max_by(|a, b| a.over_claim.total_cmp(&b.over_claim)) {
            check.note = format!(
                "worst: {}, {:.1e} times what it claims (η = {:.1e}, ‖r‖/‖b‖ = {:.1e})",
                worst.place(),
                worst.over_claim,
                worst.backward_error,
                worst.residual
            );
            if let Some(change) = worst.next_change {
                let _ = write!(
                    check.note,
                    "; one more refinement changes x by {:.0} %: ",
                    100.0 * change
                );
                check.note.push_str(if change > 0.1 {
                    "the matrix is singular to rounding, which elimination without pivoting does not see"
                } else {
                    "it was not refined enough"
                });
            }
        }
        (backend.to_owned(), check)
    });
    let mut checks = together("claims", rows.collect());
    checks.extend(by_the_letter(solves));
    checks.extend(as_reported(solves));
    checks.push(everywhere(audit));
    checks.push(everyone(audit));
    checks
}

/// A row for each iteration: the residual that it reports of a solution that it claims is not below the true one. What is
/// not claimed may be the report of an earlier one of several solves, between which rows reached their bounds.
fn as_reported(solves: &[Solve]) -> Vec<Check> {
    let told = || {
        solves
            .iter()
            .filter(|s| s.is_claim() && s.over_told.is_some())
    };
    let size = |s: &Solve| s.over_told.unwrap_or(0.0);
    let rows = distinct(told().map(|s| s.backend.as_str())).into_iter();
    let rows = rows.filter_map(|backend| {
        let own = || told().filter(|s| s.backend == backend);
        let worst = own().max_by(|a, b| size(a).total_cmp(&size(b)))?;
        let said = worst.claimed_residual.unwrap_or(f64::NAN);
        let check = Check::within(
            "",
            "the true residual",
            format!("{said:.1e} where it is {:.1e}", worst.residual),
            size(worst),
            1.0,
        )
        .by("by how much ‖r‖ exceeds what the iteration reports of it, as a backward error over 10⁻¹⁴: the largest of \
             all claims")
        .noting(format!("{} claims; worst: {}", own().count(), worst.place()));
        Some((backend.to_owned(), check))
    });
    together("residuals as reported", rows.collect())
}

/// Every solver claims something: one that refuses all has no false claim either.
fn everyone(audit: &Audit) -> Check {
    let backends = distinct(audit.solves.iter().map(|s| s.backend.as_str()));
    let silent = |backend: &&str| {
        let mut own = audit.solves.iter().filter(|s| s.backend == *backend);
        !own.any(Solve::is_claim)
    };
    let none: Vec<&str> = backends.iter().copied().filter(|b| silent(b)).collect();
    let ours = format!("{} of {}", backends.len() - none.len(), backends.len());
    // An empty list of solvers must not pass.
    let missing = if backends.is_empty() {
        f64::INFINITY
    } else {
        none.len() as f64
    };
    Check::within("solvers that claim solutions", "all", ours, missing, 0.0)
        .by("those without a claim in any scene")
        .noting(none.join(", "))
}

/// Every scene and every matrix has solutions that were looked at; scenes whose rows depend on each other, without
/// compliance, may be refused by all.
fn everywhere(audit: &Audit) -> Check {
    let solved = |s: &Solve| matches!(s.finding, Finding::True | Finding::Modest);
    let unsolved = |name: &&String| {
        let own = || audit.solves.iter().filter(|s| &s.scene == *name);
        let refused = own().count() > 0 && DEPENDENT.contains(&name.as_str());
        !(refused || own().any(solved))
    };
    let none: Vec<&str> = audit
        .audited
        .iter()
        .filter(unsolved)
        .map(String::as_str)
        .collect();
    let all = audit.audited.len();
    let ours = format!("{} of {all}", all - none.len());
    // Nothing audited is nothing verified.
    let missing = if all == 0 {
        f64::INFINITY
    } else {
        none.len() as f64
    };
    let refused = DEPENDENT.join(", ");
    Check::within(
        "scenes and matrices that were solved",
        "all",
        ours,
        missing,
        0.0,
    )
    .by("those without a solution by any solver")
    .noting(if none.is_empty() {
        format!("solved, or refused as they have to be: {refused}")
    } else {
        none.join(", ")
    })
}

/// Scenes without compliance and with dependent rows: they have no solution or several.
const DEPENDENT: [&str; 3] = [
    "H42 copies, ε = 0e0",
    "H42 four-bars, ε = 0e0",
    "H50 overstretched, ε = 0",
];

/// A row for each solver: no claim of it is false by the letter, or those that are have a residual at rounding.
fn by_the_letter(solves: &[Solve]) -> Vec<Check> {
    let counts = counted(solves, Solve::is_false_by_the_letter).into_iter();
    let rows = counts.map(|(backend, count, ours)| {
        let bar = "claims that are false by the letter: the residual of an iteration is above its tolerance, the \
                   backward error of a direct solver above 10⁻¹⁴";
        let reference = "no false claim".to_owned();
        let mut check = Check::within("", reference, ours, count as f64, 0.0).by(bar);
        let own = || solves.iter().filter(|s| s.backend == backend);
        let wrong = || own().filter(|s| s.is_false_by_the_letter());
        if let Some(worst) = wrong().max_by(|a, b| a.over_letter.total_cmp(&b.over_letter)) {
            check.note = format!(
                "worst: {}, {:.1e} times its tolerance (‖r‖/‖b‖ = {:.1e})",
                worst.place(),
                worst.over_letter,
                worst.residual
            );
            if wrong().all(|s| s.finding == Finding::True) {
                let most = wrong().map(|s| s.backward_error).fold(0.0, worse);
                check.verdict = Verdict::Limit;
                let _ = write!(
                    check.note,
                    "; of all these η ≤ {most:.0e}: the rounding of A and x alone leaves that much"
                );
            }
        }
        (backend.to_owned(), check)
    });
    together("claims, by the letter", rows.collect())
}

/// Claimed against verified, a row for each solver and variant; then what could not be followed.
pub(super) fn tables(audit: &Audit) -> String {
    let solves = &audit.solves;
    let scenes = distinct(solves.iter().map(|s| s.scene.as_str()));
    let mut out = format!(
        "Claimed against verified: {} solves in {} scenes and matrices of the hard cases; false by the letter: above\n\
         the tolerance, though at rounding. Largest residual of the claims over what was claimed; largest error of\n\
         their multipliers against 32 digits, and where.\n",
        solves.len(),
        scenes.len()
    );
    let mut t = wrapped(&[
        "solver", "claimed,", "claimed,", "by the", "not,", "honest", "refused", "residual",
        "error", "where",
    ]);
    t.add_row([
        "", "true", "false", "letter", "true", "failure", "", "/claim", "", "",
    ]);
    let keys = solves.iter();
    for (backend, variant) in distinct(keys.map(|s| (s.backend.as_str(), s.variant.as_str()))) {
        let own = solves
            .iter()
            .filter(|s| (s.backend.as_str(), s.variant.as_str()) == (backend, variant));
        let count = |f: Finding| own.clone().filter(|s| s.finding == f).count().to_string();
        let claims = own.clone().filter(|s| s.is_claim());
        let over = claims.clone().map(|s| s.over_claim).max_by(f64::total_cmp);
        let size = |s: &Solve| s.forward_error.unwrap_or(0.0);
        let worst = claims.max_by(|a, b| size(a).total_cmp(&size(b)));
        t.add_row([
            format!("{backend} {variant}").trim_end().to_owned(),
            count(Finding::True),
            count(Finding::False),
            own.clone()
                .filter(|s| s.is_false_by_the_letter())
                .count()
                .to_string(),
            count(Finding::Modest),
            count(Finding::Honest),
            count(Finding::Refused),
            error(over),
            error(worst.and_then(|s| s.forward_error)),
            worst.map_or_else(String::new, |s| format!("{} @{}", s.scene, s.step)),
        ]);
    }
    out.push_str(&text(&t));
    if !audit.ended.is_empty() {
        out.push_str("\nNot followed to the end\n");
        let mut list = wrapped(&[]);
        for ended in &audit.ended {
            list.add_row([ended]);
        }
        out.push_str(&text(&list));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_audit_of_nothing_has_failed() {
        let unsolved = Audit {
            audited: vec!["a scene".to_owned()],
            ..Audit::default()
        };
        for audit in [Audit::default(), unsolved] {
            let verdicts: Vec<Verdict> = checks(&audit).iter().map(|c| c.verdict).collect();
            assert_eq!(verdicts, [Verdict::Fail; 2], "{audit:?}");
        }
    }
}
