//! Iterations and times to given errors as tables, then where iterations win.

use super::{Record, STUDY, Start};
use crate::study::question::*;

pub(super) fn scene(row: &Row) -> String {
    let size = number_of(row, "size").unwrap_or(f64::NAN);
    format!("{} {size}", text_of(row, "scene"))
}

/// The time of a row that got there.
pub(super) fn reached(row: &Row) -> Option<f64> {
    let iterations = number_of(row, "iterations").filter(|_| row["failure"].is_null());
    iterations.and(number_of(row, "ns"))
}

/// Iterations, time and the gain over the direct solver.
pub(super) fn cell(row: &Row) -> String {
    let iterations = number_of(row, "iterations");
    let us = number_of(row, "ns").map_or("-".to_owned(), |ns| digits(ns * 1e-3));
    let is_direct = row["start"].is_null();
    match (iterations, reached(row), number_of(row, "direct_ns")) {
        _ if !row["failure"].is_null() => "failed".to_owned(),
        (Some(refinements), Some(_), _) if is_direct => format!("r{refinements} {us}"),
        (Some(0.0), ..) => "guess".to_owned(),
        (Some(k), Some(ns), Some(direct)) => format!("{k}: {us} ×{}", digits(direct / ns)),
        (Some(k), Some(_), None) => format!("{k}: {us}"),
        _ if is_direct => "–".to_owned(),
        _ => format!("no ({:.0e})", number_of(row, "error").unwrap_or(f64::NAN)),
    }
}

/// Where an iterative solver wins, if anywhere, and what does not get there.
pub(super) fn conclusions(records: &[Record], limit: usize) -> String {
    let wins = verdicts(records).into_iter().map(|v| {
        let named = v.wins.first().or(v.nearest.as_ref());
        let at = |r: &Record| format!("{} {}, ratio {}", r.scene, r.size, ratio(r.mass_ratio));
        json!({
            "start": v.start,
            "target": v.target,
            "wins": format!("{} of {}", v.wins.len(), v.cases),
            "gain": named.and_then(Record::gain),
            "by": named.map(|r| &r.backend),
            "at": named.map(at),
        })
    });
    let wins: Vec<Value> = wins.collect();
    format!(
        "{}\nNot reached within {limit} iterations, of all cases\n{}",
        STUDY.sheet("wins").of(&wins),
        STUDY.sheet("unreached").of(&unreached(records))
    )
}

/// How many cases a solver does not get to each error in.
fn unreached(records: &[Record]) -> Vec<Value> {
    let iterative = || records.iter().filter(|r| r.start.is_some());
    let key = |r: &Record| (r.backend.clone(), r.start, r.target.to_bits());
    let mut keys = distinct(iterative().map(key));
    // From zero first, and the largest error.
    keys.sort_by_key(|(_, start, target)| {
        (*start != Some(Start::Cold), std::cmp::Reverse(*target))
    });
    let row = |k: &(String, Option<Start>, u64)| {
        let own = || iterative().filter(|r| key(r) == *k);
        let short = own().filter(|r| r.iterations.is_none()).count();
        let (backend, start, target) = k;
        let short = format!("{short} of {}", own().count());
        json!({ "backend": backend, "start": start, "target": f64::from_bits(*target), "short": short })
    };
    keys.iter().map(row).collect()
}

/// Result for one error and start: the cases where iterations win.
#[derive(Debug, Clone, PartialEq)]
struct Verdict {
    target: f64,
    start: Start,
    /// Cases whose start is not within the error already.
    cases: usize,
    /// Rows faster than the direct solver, the fastest of each case, the largest gain first.
    wins: Vec<Record>,
    /// The row that loses least if none wins.
    nearest: Option<Record>,
}

/// A verdict for each start and error.
fn verdicts(records: &[Record]) -> Vec<Verdict> {
    let mut targets: Vec<f64> = records.iter().map(|r| r.target).collect();
    targets.sort_by(|a, b| b.total_cmp(a));
    targets.dedup();
    let gain = |r: &Record| r.gain().unwrap_or(0.0);
    let mut verdicts = Vec::new();
    for start in Start::ALL {
        for &target in &targets {
            let of = |r: &&Record| r.start == Some(start) && r.target == target;
            let (mut fastest, mut cases) = (Vec::new(), 0);
            let scene = |r: &Record| (r.scene.clone(), r.size, r.mass_ratio.to_bits());
            for case in records.chunk_by(|a, b| scene(a) == scene(b)) {
                let own: Vec<&Record> = case.iter().filter(of).collect();
                cases += usize::from(own.iter().any(|r| r.iterations != Some(0)));
                let reached = own.into_iter().filter(|r| r.gain().is_some());
                fastest.extend(reached.max_by(|a, b| gain(a).total_cmp(&gain(b))).cloned());
            }
            fastest.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
            let (wins, others): (Vec<Record>, Vec<Record>) =
                fastest.into_iter().partition(|r| gain(r) > 1.0);
            let nearest = others.into_iter().next().filter(|_| wins.is_empty());
            verdicts.push(Verdict {
                target,
                start,
                cases,
                nearest,
                wins,
            });
        }
    }
    verdicts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::Cases;
    use crate::iterative::{Config, run};
    use crate::study::data;
    use std::time::Duration;
    use taut_model::Network;
    use taut_output::table::plain;

    #[test]
    fn the_tables_fit_into_120_columns_and_say_what_wins() {
        let config = Config {
            segments: vec![5],
            ratios: vec![1e5],
            networks: vec![(Network::Net, 3)],
            limit: 20,
            timing_budget: Duration::ZERO,
            ..Config::new(false)
        };
        let results = run(&config, &Cases::default()).unwrap();
        let rows = data(&results.records).unwrap();
        let text = STUDY.tables(&rows) + &conclusions(&results.records, config.limit);
        let text = plain(&text);
        let width = text.lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{width:?}\n{text}");
        for words in [
            "hoist 5, ratio 1e5,",
            "net 3, ratio 100,",
            "of 2",
            "Not reached within 20 iterations",
        ] {
            assert!(text.contains(words), "{words}\n{text}");
        }
    }

    #[test]
    fn a_verdict_counts_cases_and_names_the_fastest() {
        let row = |backend: &str, size: usize, ns: f64| Record {
            size,
            iterations: Some(1),
            ns: Some(ns),
            direct_ns: Some(100.0),
            backend: backend.to_owned(),
            start: Some(Start::Warm),
            target: 1e-2,
            ..Record::default()
        };
        let rows = [
            row("a", 1, 50.0),
            row("b", 1, 25.0),
            row("a", 2, 200.0),
            row("b", 2, 400.0),
        ];
        let all = verdicts(&rows);
        let warm = all.iter().find(|v| v.start == Start::Warm).unwrap();
        assert_eq!((warm.cases, warm.wins.len()), (2, 1));
        let found = (warm.wins[0].backend.as_str(), warm.wins[0].gain());
        assert_eq!(found, ("b", Some(4.0)));
        assert_eq!(warm.nearest, None);
        let losing = verdicts(&rows[2..]);
        let nearest = losing.iter().find_map(|v| v.nearest.clone()).unwrap();
        assert_eq!((nearest.backend.as_str(), nearest.gain()), ("a", Some(0.5)));
    }
}
