//! Answer of the main job. For each scene: the fastest solver within each error, the runner-up of
//! another family with its factor, and the iteration that comes furthest. In a sentence: which
//! solver to use.

use super::{LEVELS, LadderRow, STUDY};
use crate::study::question::*;

/// A row and what its step costs within a level \[ns].
type Placed<'a> = (&'a LadderRow, f64);

/// A level, the fastest within it, and the next.
type Outcome<'a> = (f64, [Option<Placed<'a>>; 2]);

/// Name and time of a solver, for the table.
fn shown(placed: Option<Placed<'_>>) -> Option<(String, String)> {
    placed.map(|(r, ns)| (name(r), nanoseconds(ns)))
}

fn scenes(records: &[LadderRow]) -> impl Iterator<Item = &[LadderRow]> {
    records.chunk_by(|a, b| a.scene_key() == b.scene_key())
}

/// A backend without its options and form: solvers of a family share their factorisation or their iteration.
fn family(r: &LadderRow) -> &str {
    let end = r.backend.find([':', '/']).unwrap_or(r.backend.len());
    &r.backend[..end]
}

fn fastest<'a>(rows: impl Iterator<Item = &'a LadderRow>, level: f64) -> Option<Placed<'a>> {
    let within = rows.filter_map(|r| Some((r, r.within(level)?.step_ns)));
    within.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The fastest of a scene within the level, and the fastest of another family.
fn places(scene: &[LadderRow], level: f64) -> [Option<Placed<'_>>; 2] {
    let first = fastest(scene.iter(), level);
    let next = first.and_then(|(winner, _)| {
        let others = scene.iter().filter(|r| family(r) != family(winner));
        fastest(others, level)
    });
    [first, next]
}

/// Best iteration: the fastest within the strictest level that any reaches, else the one with the
/// least error.
fn best_iteration(scene: &[LadderRow]) -> Option<Placed<'_>> {
    let iterations = || scene.iter().filter(|r| r.iterations > 0);
    let within = LEVELS.iter().rev();
    let within = within
        .filter_map(|level| fastest(iterations(), *level))
        .next();
    let least = || iterations().min_by(|a, b| a.step_error().total_cmp(&b.step_error()));
    within.or_else(|| least().map(|r| (r, r.step_ns.unwrap_or(f64::NAN))))
}

/// A solver, with the iterations that it took.
fn name(r: &LadderRow) -> String {
    if r.iterations == 0 {
        return r.backend.clone();
    }
    format!("{} {:.0}×", r.backend, r.iterations_used)
}

/// Levels that a row of the table is for.
fn levels(levels: &[f64]) -> String {
    match levels {
        [] => String::new(),
        [one] => format!("{one:.0e}"),
        [first, .., last] => format!("{first:.0e} … {last:.0e}"),
    }
}

/// The answer: a row for each scene and set of levels with the same outcome, and a sentence.
pub struct Answer {
    /// The table of the rows. What a row does not repeat or has none of is an empty text.
    pub sheet: &'static Sheet,
    /// A row for each scene and set of levels.
    pub rows: Value,
    pub advice: String,
}

impl Answer {
    pub fn of(records: &[LadderRow]) -> Self {
        let is_own = records.first().is_some_and(|r| r.segments.is_none());
        Self {
            sheet: STUDY.sheet(if is_own { "answer-own" } else { "answer" }),
            rows: scenes(records).flat_map(rows).collect(),
            advice: advice(records),
        }
    }
}

/// A value, or the empty text.
fn or_blank(value: Option<impl Into<Value>>) -> Value {
    value.map_or_else(|| "".into(), Into::into)
}

fn rows(scene: &[LadderRow]) -> Vec<Value> {
    let outcomes: Vec<Outcome<'_>> = LEVELS.iter().map(|l| (*l, places(scene, *l))).collect();
    let alike = |a: &Outcome<'_>, b: &Outcome<'_>| a.1.map(shown) == b.1.map(shown);
    let row = |(place, same): (usize, &[Outcome<'_>])| {
        let head = (place == 0).then_some(&scene[0]);
        let [first, next] = same[0].1;
        let within: Vec<f64> = same.iter().map(|(level, _)| *level).collect();
        let iteration = best_iteration(scene).filter(|_| place == 0);
        json!({
            "scene": or_blank(head.map(|r| r.scene.as_str())),
            "segments": or_blank(head.and_then(|r| r.segments)),
            "mass_ratio": or_blank(head.map(|r| r.mass_ratio)),
            "within": levels(&within),
            "fastest": first.map_or("none".to_owned(), |(r, _)| name(r)),
            "step_ns": or_blank(first.map(|(_, ns)| ns)),
            "next": or_blank(next.map(|(r, _)| name(r))),
            "times": or_blank(first.zip(next).map(|((_, a), (_, b))| b / a)),
            "iteration": or_blank(iteration.map(|(r, _)| name(r))),
            "iteration_ns": or_blank(iteration.map(|(_, ns)| ns)),
            "iteration_error": or_blank(iteration.map(|(r, _)| r.step_error())),
        })
    };
    outcomes.chunk_by(alike).enumerate().map(row).collect()
}

/// Which solver to use: who is the fastest how often, by how much, and whether an iteration ever is.
fn advice(records: &[LadderRow]) -> String {
    let problems = scenes(records).flat_map(|scene| LEVELS.map(|level| places(scene, level)));
    let problems: Vec<_> = problems.collect();
    let solved: Vec<Placed<'_>> = problems.iter().filter_map(|[first, _]| *first).collect();
    let mut wins: Vec<(&str, usize)> = Vec::new();
    for (r, _) in &solved {
        match wins.iter_mut().find(|(name, _)| *name == r.backend) {
            Some((_, count)) => *count += 1,
            None => wins.push((&r.backend, 1)),
        }
    }
    wins.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let all = problems.len();
    let Some((best, count)) = wins.first() else {
        return "No solver is within any of the errors.".to_owned();
    };
    let mut factors: Vec<f64> = problems
        .iter()
        .filter_map(|[first, next]| {
            let ((winner, a), (_, b)) = (*first).zip(*next)?;
            (winner.backend == *best).then_some(b / a)
        })
        .collect();
    factors.sort_by(f64::total_cmp);
    let mut text =
        format!("Use `{best}`: the fastest in {count} of {all} combinations of scene and error");
    if let (Some(least), Some(most)) = (factors.first(), factors.last()) {
        text += &ahead(*least, *most);
    }
    let others = wins
        .iter()
        .skip(1)
        .map(|(name, n)| format!("`{name}` in {n}"));
    let others = others.collect::<Vec<_>>().join(", ");
    if !others.is_empty() {
        text += &format!("; {others}");
    }
    let iterations = solved.iter().filter(|(r, _)| r.iterations > 0).count();
    text + &match iterations {
        0 => ". No iteration is the fastest anywhere.".to_owned(),
        n => format!(". An iteration is the fastest in {n}."),
    }
}

/// By how much the next family is slower, at the least and at the most.
fn ahead(least: f64, most: f64) -> String {
    let [least, most] = [least, most].map(|factor| format!("{factor:.1}"));
    if most == "1.0" {
        return ", on a par with the next family".to_owned();
    }
    let factors = match least.as_str() {
        "1.0" => format!("up to {most}"),
        _ if least == most => most,
        _ => format!("{least} to {most}"),
    };
    format!(", {factors} times as fast as the next family")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ladder::Fastest;

    #[test]
    fn a_tie_is_called_one() {
        for (factors, words) in [
            ([1.0, 1.04], "on a par with the next family"),
            ([1.0, 3.0], "up to 3.0 times as fast"),
            ([1.12, 1.14], ", 1.1 times as fast"),
            ([2.0, 5.0], "2.0 to 5.0 times as fast"),
        ] {
            let text = ahead(factors[0], factors[1]);
            assert!(text.contains(words), "{text}");
        }
    }

    /// A row with an error and a time that are the same refined and unrefined.
    fn row(ratio: f64, backend: &str, iterations: usize, ns: f64, error: f64) -> LadderRow {
        let value = serde_json::json!({ "scene": "hoist", "segments": 24, "mass_ratio": ratio, "backend": backend,
            "options": backend, "iterations": iterations, "iterations_used": iterations, "dt": 0.0, "refinements": 0,
            "step_ns": ns, "step_ns_min": ns, "solve_ns": ns, "refine_ns": 0.0, "backward_error": error,
            "forward_error": error, "forward_error_unrefined": error,
            "elongation_error": error, "stable": true, "simulated_s": 1.0, "frames": 1,
            "fastest_at": Vec::<Fastest>::new() });
        serde_json::from_value(value).expect("a row")
    }

    #[test]
    fn the_next_is_of_another_family_and_levels_with_the_same_outcome_are_one_row() {
        let rows = [
            row(1.0, "banded", 0, 4e3, 1e-12),
            row(1.0, "banded/kkt", 0, 5e3, 1e-12),
            row(1.0, "faer:ldlt", 0, 2e4, 1e-12),
            row(1.0, "cg:group", 7, 8e3, 1e-7),
            row(10.0, "banded", 0, 4e3, f64::NAN),
            row(10.0, "cg:group", 7, 8e3, 1e-2),
        ];
        let Answer {
            sheet,
            rows,
            advice,
        } = Answer::of(&rows);
        let expected = [
            "| 24 | 1 | 1e-3 … 1e-6 | banded | 4.00 µs | cg:group 7× | 2.0 | cg:group 7× | 8.00 µs | 1.0e-7 |",
            "|  |  | 1e-10 | banded | 4.00 µs | faer:ldlt | 5.0 |  |  |  |",
            "| 24 | 10 | 1e-3 … 1e-10 | none |  |  |  | cg:group 7× | 8.00 µs | 1.0e-2 |",
        ];
        let table = sheet.markdown(&rows);
        assert!(table.lines().skip(2).eq(expected), "{table}");
        assert!(
            advice.starts_with("Use `banded`: the fastest in 3 of 6 combinations of scene and error, 2.0 to 5.0 times"),
            "{advice}"
        );
    }

    /// Without a hoist's elongation the multipliers decide, and the scene stands by its name.
    #[test]
    fn another_scene_is_answered_by_its_name() {
        let own = |scene: &str, backend: &str, ns: f64| LadderRow {
            scene: scene.to_owned(),
            segments: None,
            elongation_error: None,
            ..row(1234.5678, backend, 0, ns, 1e-12)
        };
        let rows = [
            own("gantry", "banded", 4e3),
            own("gantry", "faer:ldlt", 8e3),
            own("mast.toml", "banded", 5e3),
        ];
        let Answer { sheet, rows, .. } = Answer::of(&rows);
        let expected = [
            "| scene | ratio | within | fastest | step | next | times | best iteration | step | error |",
            "| gantry | 1235 | 1e-3 … 1e-10 | banded | 4.00 µs | faer:ldlt | 2.0 |  |  |  |",
            "| mast.toml | 1235 | 1e-3 … 1e-10 | banded | 5.00 µs |  |  |  |  |  |",
        ];
        let table = sheet.markdown(&rows);
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!([lines[0], lines[2], lines[3]], expected, "{table}");
    }

    #[test]
    fn nothing_within_any_error_is_told() {
        let advice = Answer::of(&[row(1.0, "cg:none", 1, 1e3, 0.5)]).advice;
        assert_eq!(advice, "No solver is within any of the errors.");
    }
}
