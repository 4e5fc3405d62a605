//! The results as tables, then what each failed run misses.

use super::{GAIN, Outcome, Results, SLACK, STRETCH, SWING, Swing};
use serde_json::{Value, json};
use std::fmt::Write;
use taut_output::row::{Row, is, number_of, text_of};
use taut_output::sheet::{self, Column, Sheet, Show, column};
use taut_output::table::ratio;

const WORST: Column = column("worst_step_ns", "worst").shown(Show::Time);

pub(super) const SHEETS: &[Sheet] = &[Sheet {
    list: "outcomes",
    columns: &[
        column("shock", "shock"),
        column("length", "L").unit("m"),
        column("ratio", "ratio").shown(Show::Ratio),
        column("swing", "verdict").shown(Show::Row(verdict)),
        column("error_m", "error")
            .unit("mm")
            .shown(Show::Digits(1e3)),
        column("uncertainty_m", "±")
            .unit("mm")
            .shown(Show::Digits(1e3)),
        column("gain", "energy").shown(Show::Row(gain)),
        column("excess_gap", "gap").shown(Show::Error(0)),
        column("redone", "redone"),
        column("implicit_substeps", "sub"),
        column("unconverged_substeps", "unconv."),
        column("solves", "solves"),
        column("max_solves", "most"),
        WORST,
    ],
    ..sheet::PLAIN
}];

const SUMMARY: Sheet = Sheet {
    columns: &[
        column("setting", "setting"),
        column("finite", "finite"),
        column("length", "length"),
        column("energy", "energy"),
        column("swing", "swing"),
        column("passes", "all four"),
        column("chaotic", "chaotic"),
        column("fails", "fail"),
        column("redone", "redone"),
        column("unconverged", "unconv."),
        column("solves", "solves").shown(Show::Fixed(2)),
        column("most", "most"),
        WORST,
    ],
    ..sheet::PLAIN
};

/// A row for each setting, then the first setting's outcomes one by one, then its failures. At most 120 columns.
pub(super) fn text(results: &Results) -> String {
    let settings: Vec<_> = results
        .outcomes
        .chunk_by(|a, b| a.setting == b.setting)
        .collect();
    let Some(first) = settings.first() else {
        return String::new();
    };
    let own = json!({ "outcomes": first });
    format!(
        "{} runs of {} s at Δt = 1/60 s for each setting, against the default scheme at Δt/{} (± what Δt/{} differs \
         from it)\n\n{}\n\
         length: elongation in the last second ≤ {STRETCH} × the reference's + {SLACK:.0e} L; energy: gained ≤ {} % of\nits \
         largest kinetic energy; swing: the load ends within {SWING} L, or 3 × ±, of the reference; chaotic: all but\nthe \
         swing, where ± exceeds {SWING} L; redone: steps; sub: implicit sub-steps, unconv.: not converged; solves: all\n\
         (above: a step); most: of a step; worst: step; gap: largest of the last second less that at rest, over a segment\n\n\
         Setting `{}`\n{}{}",
        first.len(),
        results.time,
        results.fineness[1],
        results.fineness[0],
        SUMMARY.of(&settings
            .iter()
            .map(|runs| summary(runs))
            .collect::<Vec<_>>()),
        100.0 * GAIN,
        first[0].setting,
        SHEETS[0].text(&own),
        failures(first)
    )
}

/// How many runs of a setting pass what, and what they cost together.
fn summary(runs: &[Outcome]) -> Value {
    let count = |of: &dyn Fn(&Outcome) -> bool| runs.iter().filter(|r| of(r)).count();
    let sum = |of: &dyn Fn(&Outcome) -> usize| runs.iter().map(of).sum::<usize>();
    let steps = sum(&|r| r.run.steps).max(1) as f64;
    let worst = runs.iter().filter_map(|r| r.worst_step_ns);
    json!({
        "setting": runs[0].setting,
        "finite": count(&|r| r.finite),
        "length": count(&|r| r.keeps_length),
        "energy": count(&|r| r.no_gain),
        "swing": count(&|r| r.swing == Swing::Right),
        "passes": count(&Outcome::passes),
        "chaotic": count(&|r| r.survives() && r.swing == Swing::Chaotic),
        "fails": count(&Outcome::fails),
        "redone": sum(&|r| r.run.redone),
        "unconverged": sum(&|r| r.run.unconverged_substeps),
        "solves": sum(&|r| r.run.solves) as f64 / steps,
        "most": runs.iter().map(|r| r.run.max_solves).max(),
        "worst_step_ns": worst.fold(f64::NAN, f64::max),
    })
}

fn verdict(row: &Row) -> String {
    if !is(row, "finite") {
        return "ENDS".to_owned();
    }
    let swing = text_of(row, "swing");
    let faults = [
        (!is(row, "keeps_length"), "LENGTH"),
        (!is(row, "no_gain"), "ENERGY"),
        (swing == "wrong", "SWING"),
        (swing == "chaotic", "chaotic"),
    ];
    let faults = faults.iter().filter(|(bad, _)| *bad).map(|(_, name)| *name);
    let faults: Vec<&str> = faults.collect();
    if faults.is_empty() {
        "pass".to_owned()
    } else {
        faults.join(" ")
    }
}

fn gain(row: &Row) -> String {
    number_of(row, "gain").map_or("-".to_owned(), percent)
}

/// Millimetres with about three digits.
fn millimetres(metres: f64) -> String {
    let mm = 1e3 * metres;
    match mm.abs() {
        x if x.is_nan() => "nan".to_owned(),
        x if x >= 1e6 => format!("{mm:.0e}"),
        x if x >= 100.0 => format!("{mm:.0}"),
        x if x >= 1.0 => format!("{mm:.1}"),
        x if x >= 0.001 => format!("{mm:.3}"),
        _ => format!("{mm:.0e}"),
    }
}

fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    if percent.abs() < 1000.0 {
        format!("{percent:+.2} %")
    } else {
        format!("{percent:+.0e} %")
    }
}

/// List of the failed runs with their faults.
fn failures(runs: &[Outcome]) -> String {
    let mut out = String::new();
    for r in runs.iter().filter(|r| r.fails()) {
        let mut faults = Vec::new();
        if let Some(failure) = &r.run.failure {
            faults.push(format!("ends at {:.2} s: {}", failure.time, failure.reason));
        } else {
            if !r.keeps_length {
                faults.push(format!(
                    "elongation {} mm (bar {} mm)",
                    millimetres(r.run.elongation),
                    millimetres(r.elongation_bar_m)
                ));
            }
            if !r.no_gain {
                faults.push(format!("gains {} of {:.1e} J", percent(r.gain), r.scale_j));
            }
            if r.swing == Swing::Wrong {
                faults.push(format!(
                    "{} mm from the reference ({:.1e} L)",
                    millimetres(r.error_m),
                    r.error_m / r.length
                ));
            }
        }
        let _ = writeln!(
            out,
            "  {}, L = {} m, ratio {}: {}",
            r.shock,
            r.length,
            ratio(r.ratio),
            faults.join("; ")
        );
    }
    if out.is_empty() {
        return "\nNo failure.\n".to_owned();
    }
    format!("\nFailures\n{out}")
}

#[cfg(test)]
mod tests {
    use super::super::{Config, Setting, Shock, run};
    use super::*;
    use crate::cases::Cases;

    #[test]
    fn the_table_fits_and_lists_every_failure() {
        let config = Config {
            settings: Setting::few(),
            shocks: vec![Shock::Kick { speed: 20.0 }, Shock::Drop],
            ratios: vec![1e2, 1e6],
            time: 0.2,
            fineness: [1, 2],
            cached: false,
            repeats: 1,
            ..Config::default()
        };
        let results = run(&config, &Cases::default()).unwrap();
        assert_eq!(results.outcomes.len(), 3 * 8);
        let text = taut_output::table::plain(&text(&results));
        let widest = text.lines().map(|l| l.chars().count()).max();
        assert!(widest <= Some(120), "{widest:?}\n{text}");
        let failures = results.outcomes[..8].iter().filter(|r| r.fails()).count();
        let listed = text.lines().filter(|l| l.contains(", L = ")).count();
        assert_eq!(listed, failures, "{text}");
        assert!(
            results.outcomes[..8]
                .iter()
                .all(|r| r.worst_step_ns.is_some())
        );
        assert_eq!(super::text(&super::super::Results::default()), "");
    }

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 1.2e-9, 4.5e-5, 0.0123, 0.5, 12.0, 1e9, f64::NAN].map(millimetres);
        assert_eq!(
            shown,
            [
                "0e0", "1e-6", "0.045", "12.3", "500", "12000", "1e12", "nan"
            ]
        );
        assert_eq!(
            [0.1234, -2.0, 1e3].map(percent),
            ["+12.34 %", "-200.00 %", "+1e5 %"]
        );
    }
}
