//! The experiments on the hanging cable: the same functions that the tables of `taut static` come from.

use taut_studies::statics::iterations_needed;
use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;
const SEGMENTS: usize = 6;
const LEVELS: [f64; 3] = [1e-3, 1e-6, 1e-9];

fn params(segments: usize, mass_ratio: f64) -> HoistParams {
    HoistParams::default().with(|p| (p.segments, p.mass_ratio) = (segments, mass_ratio))
}

/// Iterations needed for each level; `None` beyond `limit`.
fn needed(choice: &Choice, ratio: f64, warm_start: bool, limit: usize) -> Vec<Option<usize>> {
    let options = choice.options(DT).with(|o| o.warm_start = warm_start);
    let (params, family) = (params(SEGMENTS, ratio), choice.family());
    let rows = iterations_needed(&params, &options, &family, &LEVELS, limit).expect("stable");
    for (row, level) in rows.iter().zip(LEVELS) {
        let ours = (row.level, row.warm_start, row.limit);
        assert_eq!(ours, (level, warm_start, limit));
    }
    let found: Vec<_> = rows.iter().map(|row| row.iterations).collect();
    println!("{family}, ratio {ratio:e}, warm {warm_start}: {found:?}");
    found
}

fn choice(name: &str) -> Option<Choice> {
    let choice: Choice = name.parse().expect("a known name");
    compiled_iterative()
        .iter()
        .find(|c| c.family() == choice.family())
        .cloned()
}

/// Conjugate gradient converges all at once, after as many iterations as S has distinct eigenvalues along the cable:
/// one for each of the 7 joints, whatever the mass ratio and the level. With the groups solved exactly only their
/// coupling is left: 3.
#[test]
fn conjugate_gradient_needs_the_same_iterations_at_every_mass_ratio() {
    for (name, expected) in [("cg:none", 7), ("cg:jacobi", 7), ("cg:group", 3)] {
        let Some(choice) = choice(name) else {
            continue;
        };
        for ratio in [10.0, 1e3, 1e5] {
            for warm_start in [true, false] {
                let found = needed(&choice, ratio, warm_start, 100);
                assert_eq!(found, [Some(expected); 3], "{name}, ratio {ratio:e}");
            }
        }
    }
}

/// A limit that is too small is reported as such, not as an answer.
#[test]
fn levels_beyond_the_limit_have_no_answer() {
    if let Some(choice) = choice("gauss-seidel:joints") {
        assert_eq!(needed(&choice, 1e5, false, 50), [None; 3]);
    }
}
