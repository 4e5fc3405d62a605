//! The main job's rows and its answer as text.

use super::{Answer, LadderRow, Results, STUDY, SceneNote};
use crate::study::question::*;

/// Functions that the tables of the main job name.
pub(super) const FUNCTIONS: Functions = &[
    ("per_joint", Text(per_joint)),
    ("held", Text(held)),
    ("levels", Text(levels)),
    ("counts", Holds(counts)),
];

/// True for a row to compare: the solver did not fail, ended by itself, and held the motion.
fn counts(row: &Row) -> bool {
    has_no_error(row) && has_ended(row) && number_of(row, "failure_time").is_none()
}

pub fn sheet_of(records: &[LadderRow]) -> &'static Sheet {
    match records.first() {
        Some(LadderRow { segments: None, .. }) => STUDY.sheet("rows-own"),
        _ => STUDY.sheet("rows"),
    }
}

fn per_joint(row: &Row) -> String {
    let joints = number_of(row, "joints").filter(|n| *n > 0.0);
    let time = number_of(row, "solve_ns").zip(joints);
    time.map_or("-".to_owned(), |(ns, n)| format!("{:.0}", ns / n))
}

fn held(row: &Row) -> String {
    match (
        number_of(row, "failure_time"),
        number_of(row, "simulated_s"),
    ) {
        (Some(end), _) => format!("{end:.2} s"),
        (None, Some(time)) => format!("≥{time} s"),
        (None, None) => String::new(),
    }
}

/// Exponents of the errors within which the row is the fastest: `-3 -6`.
fn levels(row: &Row) -> String {
    let levels = row.get("fastest_at").and_then(Value::as_array);
    let exponents = levels.into_iter().flatten().filter_map(Value::as_f64);
    let exponents: Vec<String> = exponents
        .map(|level| format!("{:.0}", level.log10()))
        .collect();
    exponents.join(" ")
}

/// All rows of the main job, a table for each scene, then what the solvers claimed.
pub(super) fn rows(results: &Results) -> String {
    let mut shown = data_of(&once(&results.records));
    for row in &mut shown {
        row["note"] = note(row, &results.scenes).unwrap_or_default().into();
    }
    sheet_of(&results.records).of(&shown) + &claims(&results.records)
}

/// Records as rows; of the levels at which they are the fastest the errors alone.
pub fn data_of(records: &[LadderRow]) -> Vec<Value> {
    let row = |r: &LadderRow| {
        let levels: Vec<f64> = r.fastest_at.iter().map(|f| f.level).collect();
        // A record can always be data.
        let mut row = data(r).unwrap_or_default();
        row["fastest_at"] = levels.into();
        row
    };
    records.iter().map(row).collect()
}

fn note(row: &Value, scenes: &[SceneNote]) -> Option<String> {
    let same = |n: &&SceneNote| {
        let segments = row["segments"].as_u64() == n.segments.map(|n| n as u64);
        segments && row["scene"] == n.scene && row["mass_ratio"] == n.mass_ratio
    };
    let note = scenes.iter().find(same)?;
    let verdict = note.failure.as_ref().map_or_else(
        || format!("stable for {} s", note.stability_s),
        |f| format!("unstable at {:.2} s", f.time),
    );
    let rate = 1.0 / note.reference_dt;
    let error = note.velocity_reference_error;
    let contacts = error.map(|e| format!("; velocities of the reference to {e:.1e}"));
    let contacts = contacts.unwrap_or_default();
    Some(format!(
        "the step itself is {verdict} (reference motion at Δt = 1/{rate:.0} s){contacts}"
    ))
}

/// Answer of the main job as a table and a sentence, with the omissions.
pub(super) fn answer(results: &Results) -> String {
    let Answer {
        sheet,
        rows,
        advice,
    } = Answer::of(&results.records);
    let mut sentence = table::wrapped(&[""; 0]);
    sentence.add_row([advice]);
    format!(
        "{}\n{}{}",
        sheet.text(&rows),
        table::text(&sentence),
        omissions(&results.omissions)
    )
}

/// The rows without the repetitions of an iteration that converged before an earlier limit.
fn once(records: &[LadderRow]) -> Vec<LadderRow> {
    let mut rows = records.to_vec();
    rows.dedup_by(|r, last| {
        let converged = last.iterations_used < last.iterations as f64;
        let same_time = r.step_ns.map(f64::to_bits) == last.step_ns.map(f64::to_bits);
        let same = r.backend == last.backend && r.scene_key() == last.scene_key();
        converged && same && same_time
    });
    rows
}

/// How often the solvers' own claims of a solution were true: those by the letter of their tolerance, those for rounding's
/// sake alone, those that are false. A failed row claims nothing; rows that are older than the counts are left out.
pub fn claim_rows(records: &[LadderRow]) -> Vec<Value> {
    let counts = |r: &LadderRow| match (r.claimed_converged.zip(r.verified_converged), &r.error) {
        (Some((claimed, verified)), _) => Some([
            Some(r.frames),
            Some(claimed),
            Some(verified),
            r.verified_to_rounding,
        ]),
        (None, Some(_)) => Some([Some(r.frames), Some(0), Some(0), Some(0)]),
        (None, None) => None,
    };
    let row = |backend: &str| {
        let own = records.iter().filter(|r| r.backend == backend);
        let sum = |a: Option<usize>, b| a.zip(b).map(|(a, b): (usize, usize)| a.saturating_add(b));
        let all = own.filter_map(counts);
        let all = all.reduce(|all, one| std::array::from_fn(|k| sum(all[k], one[k])))?;
        let [solves, claimed, verified, to_rounding] = all;
        let less = |a: Option<usize>, b| a.zip(b).map(|(a, b): (usize, usize)| a.saturating_sub(b));
        Some(json!({
            "backend": backend,
            "solves": solves,
            "claimed": claimed,
            "verified": verified,
            "rounded": less(to_rounding, verified),
            "false_ones": less(claimed, to_rounding),
        }))
    };
    let backends = distinct(records.iter().map(|r| r.backend.as_str()));
    backends.into_iter().filter_map(row).collect()
}

fn claims(records: &[LadderRow]) -> String {
    let claims = claim_rows(records);
    if claims.is_empty() {
        return String::new();
    }
    format!(
        "\nSolutions claimed by the solvers' own tests, and true by the extended-precision residual (frames);\n\
         rounding: only with a normwise backward error of 1e-14 allowed for\n{}",
        STUDY.sheet("claims").of(&claims)
    )
}
