//! The results as text.

use super::{GAIN, Outcome, Results, SLACK, STRETCH, SWING, Swing};
use crate::table::{nanoseconds, ratio, text, wrapped as columns};
use std::fmt::Write;

/// A row for each setting, then the first setting's outcomes one by one, then its failures. At most 120 columns.
#[must_use]
pub fn table(results: &Results) -> String {
    let outcomes = &results.outcomes;
    let settings: Vec<_> = outcomes.chunk_by(|a, b| a.setting == b.setting).collect();
    let Some(first) = settings.first() else {
        return String::new();
    };
    let mut out = format!(
        "{} runs of {} s at Δt = 1/60 s for each setting, against the default scheme at Δt/{} (± what Δt/{} differs \
         from it)\n\n",
        first.len(),
        results.time,
        results.fineness[1],
        results.fineness[0],
    );
    out.push_str(&summary(&settings));
    let _ = writeln!(
        out,
        "\nlength: elongation in the last second ≤ {STRETCH} × the reference's + {SLACK:.0e} L; energy: gained ≤ {} % of\nits \
         largest kinetic energy; swing: the load ends within {SWING} L, or 3 × ±, of the reference; chaotic: all but\nthe \
         swing, where ± exceeds {SWING} L; redone: steps; sub: implicit sub-steps, unconv.: not converged; solves: all\n\
         (above: a step); most: of a step; worst: step; gap: largest of the last second less that at rest, over a segment",
        100.0 * GAIN,
    );
    let _ = writeln!(out, "\nSetting `{}`", first[0].setting);
    out.push_str(&details(first));
    out.push_str(&failures(first));
    out
}

fn summary(settings: &[&[Outcome]]) -> String {
    let mut t = columns(&[
        "setting", "finite", "length", "energy", "swing", "all four", "chaotic", "fail", "redone",
        "unconv.", "solves", "most", "worst",
    ]);
    for runs in settings {
        let count = |of: &dyn Fn(&Outcome) -> bool| runs.iter().filter(|r| of(r)).count();
        let sum = |of: &dyn Fn(&Outcome) -> usize| runs.iter().map(of).sum::<usize>();
        let steps = sum(&|r| r.run.steps).max(1) as f64;
        let worst = runs.iter().filter_map(|r| r.worst_step_ns);
        t.add_row([
            runs[0].setting.clone(),
            count(&|r| r.finite).to_string(),
            count(&|r| r.keeps_length).to_string(),
            count(&|r| r.no_gain).to_string(),
            count(&|r| r.swing == Swing::Right).to_string(),
            count(&Outcome::passes).to_string(),
            count(&|r| r.survives() && r.swing == Swing::Chaotic).to_string(),
            count(&Outcome::fails).to_string(),
            sum(&|r| r.run.redone).to_string(),
            sum(&|r| r.run.unconverged_substeps).to_string(),
            format!("{:.2}", sum(&|r| r.run.solves) as f64 / steps),
            runs.iter()
                .map(|r| r.run.max_solves)
                .max()
                .unwrap_or(0)
                .to_string(),
            nanoseconds(worst.fold(f64::NAN, f64::max)),
        ]);
    }
    text(&t)
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

/// A part in percent.
fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    if percent.abs() < 1000.0 {
        format!("{percent:+.2} %")
    } else {
        format!("{percent:+.0e} %")
    }
}

fn verdict(r: &Outcome) -> String {
    let mut faults = Vec::new();
    if !r.finite {
        return "ENDS".to_owned();
    }
    for (bad, name) in [
        (!r.keeps_length, "LENGTH"),
        (!r.no_gain, "ENERGY"),
        (r.swing == Swing::Wrong, "SWING"),
        (r.swing == Swing::Chaotic, "chaotic"),
    ] {
        if bad {
            faults.push(name);
        }
    }
    if faults.is_empty() {
        "pass".to_owned()
    } else {
        faults.join(" ")
    }
}

fn details(runs: &[Outcome]) -> String {
    let mut t = columns(&[
        "shock", "L m", "ratio", "verdict", "error mm", "± mm", "energy", "gap", "redone", "sub",
        "unconv.", "solves", "most", "worst",
    ]);
    let mut last = None;
    for r in runs {
        let name = if last == Some((r.shock, r.length)) {
            String::new()
        } else {
            r.shock.to_string()
        };
        last = Some((r.shock, r.length));
        t.add_row([
            name,
            r.length.to_string(),
            ratio(r.ratio),
            verdict(r),
            millimetres(r.error_m),
            millimetres(r.uncertainty_m),
            percent(r.gain),
            format!("{:.0e}", r.excess_gap),
            r.run.redone.to_string(),
            r.run.implicit_substeps.to_string(),
            r.run.unconverged_substeps.to_string(),
            r.run.solves.to_string(),
            r.run.max_solves.to_string(),
            nanoseconds(r.worst_step_ns.unwrap_or(f64::NAN)),
        ]);
    }
    text(&t)
}

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
        let results = run(&config, &indicatif::ProgressBar::hidden()).unwrap();
        assert_eq!(results.outcomes.len(), 3 * 8);
        let text = crate::table::plain(&table(&results));
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
        assert_eq!(super::table(&super::super::Results::default()), "");
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
