//! Forward errors over mass ratios, a table for each cable.

use super::{error, mark_least, ratio, table, text};
use crate::ladder::Omission;
use crate::linear::{BAR, BAR_RATIO, Record, Verdict, verdicts};
use std::fmt::Write;

/// Most ratios that fit side by side.
const COLUMNS: usize = 5;

/// A table for each number of segments and pose, then how far the direct solvers keep the bar, then what was left out.
#[must_use]
pub fn linear(records: &[Record], omissions: &[Omission]) -> String {
    let mut out = String::new();
    let columns = columns(records);
    for cable in records.chunk_by(|a, b| (a.segments, a.pose) == (b.segments, b.pose)) {
        let _ = writeln!(out, "\n{}, {} segments", cable[0].pose, cable[0].segments);
        out.push_str(&errors(cable, &columns));
    }
    out.push_str(&bar(&verdicts(records)));
    out.push_str(&super::omissions(omissions));
    out
}

/// The ratios shown: all that were measured, or some of them at even distances, the first and the last among them.
fn columns(records: &[Record]) -> Vec<f64> {
    let mut ratios: Vec<f64> = records.iter().map(|r| r.mass_ratio).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.dedup();
    let last = ratios.len().saturating_sub(1);
    if last < COLUMNS {
        return ratios;
    }
    let place = |i: usize| (i * last + COLUMNS / 2 - 1) / (COLUMNS - 1);
    (0..COLUMNS).map(|i| ratios[place(i)]).collect()
}

/// Rows: solvers; columns: ratios with the errors of all refinements.
fn errors(cable: &[Record], ratios: &[f64]) -> String {
    let mut header = vec!["solver".to_owned()];
    header.extend(ratios.iter().map(|r| ratio(*r)));
    let mut t = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    let first = cable.iter().map(|r| r.mass_ratio).next();
    let of_first = cable.iter().filter(|r| Some(r.mass_ratio) == first);
    let mut solvers: Vec<&Record> = of_first.collect();
    solvers.dedup_by_key(|r| &r.options);
    let own = |ratio: f64, solver: &Record| {
        let options = solver.options.clone();
        let own = move |r: &&Record| r.mass_ratio == ratio && r.options == options;
        cable.iter().filter(own)
    };
    for solver in &solvers {
        let mut row = vec![solver.backend.clone()];
        row.extend(ratios.iter().map(|ratio| {
            let errors = own(*ratio, solver).map(|r| match r.error {
                Some(_) => "failed".to_owned(),
                None => format!("{:.0e}", r.forward_error),
            });
            errors.collect::<Vec<_>>().join(" ")
        }));
        t.add_row(row);
    }
    for (i, ratio) in ratios.iter().enumerate() {
        let refined = |solver: &&Record| {
            let last = own(*ratio, solver).max_by_key(|r| r.refinements);
            let last = last.filter(|r| r.error.is_none());
            ((), last.map(|r| r.forward_error))
        };
        mark_least(
            &mut t,
            1 + i,
            &solvers.iter().map(refined).collect::<Vec<_>>(),
        );
    }
    text(&t)
}

/// Which direct solvers keep the bar.
fn bar(verdicts: &[Verdict]) -> String {
    if verdicts.is_empty() {
        return String::new();
    }
    let missed: Vec<&str> = verdicts
        .iter()
        .filter(|v| !v.holds())
        .map(|v| v.backend.as_str())
        .collect();
    let who = if missed.is_empty() {
        format!("all {} direct solvers", verdicts.len())
    } else {
        let (held, all) = (verdicts.len() - missed.len(), verdicts.len());
        format!(
            "{held} of {all} direct solvers, not with\n{}",
            missed.join(", ")
        )
    };
    let mut t = table(&["solver", "kept up to", "largest", "at ratio", "cable"]);
    for Verdict {
        backend,
        limit,
        worst,
    } in verdicts
    {
        t.add_row([
            backend.clone(),
            limit.map_or("nowhere".to_owned(), ratio),
            error(worst.error.is_none().then_some(worst.forward_error)),
            ratio(worst.mass_ratio),
            format!("{}, {} segments", worst.pose, worst.segments),
        ]);
    }
    format!(
        "\nOne refinement, ratios up to {BAR_RATIO:.0e}: errors of at most {BAR:.0e} with {who}\n{}",
        text(&t)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{Config, run};
    use crate::table::plain;
    use indicatif::ProgressBar;

    #[test]
    fn the_widest_table_fits_into_120_columns() {
        let config = Config {
            segments: vec![3],
            ..Config::default()
        };
        let records = run(&config, &ProgressBar::hidden()).unwrap();
        assert_eq!(columns(&records), [1.0, 1e3, 1e6, 1e9, 1e12]);
        let text = plain(&linear(&records, &config.omissions()));
        let width = text.lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{width:?}\n{text}");
        assert!(text.contains("straight, 3 segments") && text.contains("bent, 3 segments"));
    }
}
