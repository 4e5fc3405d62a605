//! Which solver is the best over all scenes: performance profiles and shifted geometric means.
//!
//! A problem is a scene of the main job and an error level; a solver solves it where one of its rows is within the level,
//! at the cost of the cheapest of these. The *performance profile* (Dolan, Moré 2002) of a solver is the share of
//! problems that it solves within τ times the best solver's cost, as a function of τ. The *shifted geometric mean* of its
//! costs is exp(mean ln(t + s)) − s, s = 1 µs; a problem that it does not solve counts as ten times the most expensive
//! solution of it.

use taut_studies::ladder::{LEVELS, LadderRow, SceneKey};

/// Shift of the geometric mean \[ns].
const SHIFT: f64 = 1e3;

/// Cost of an unsolved problem over that of its most expensive solution.
const PENALTY: f64 = 10.0;

/// Costs of all solvers on the problems of one error level.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scores {
    /// Relative error of the multipliers and of the elongation.
    pub(super) level: f64,
    /// Solvers in the order of their rows, with their cost of each problem \[ns]; `None` where it is not solved.
    pub(super) costs: Vec<(String, Vec<Option<f64>>)>,
}

/// The scores at every level.
pub(super) fn scores(records: &[LadderRow]) -> Vec<Scores> {
    LEVELS.map(|level| Scores::new(records, level)).to_vec()
}

impl Scores {
    fn new(records: &[LadderRow], level: f64) -> Self {
        let mut scenes = Vec::new();
        let mut solvers: Vec<&str> = Vec::new();
        for r in records {
            if !scenes.contains(&r.scene_key()) {
                scenes.push(r.scene_key());
            }
            if !solvers.contains(&r.backend.as_str()) {
                solvers.push(&r.backend);
            }
        }
        let cost = |solver: &str, at: SceneKey<'_>| {
            let own = records
                .iter()
                .filter(|r| r.backend == solver && r.scene_key() == at);
            let costs = own.filter_map(|r| r.within(level)).map(|f| f.step_ns);
            costs.min_by(f64::total_cmp)
        };
        let costs = solvers.iter().map(|&solver| {
            let costs = scenes.iter().map(|&at| cost(solver, at)).collect();
            (solver.to_owned(), costs)
        });
        Self {
            level,
            costs: costs.collect(),
        }
    }

    /// Costs of a problem that are known.
    fn of_problem(&self, problem: usize) -> impl Iterator<Item = f64> + '_ {
        self.costs.iter().filter_map(move |(_, c)| c[problem])
    }

    pub(super) fn problems(&self) -> usize {
        self.costs.first().map_or(0, |(_, c)| c.len())
    }

    /// How many problems each solver solves.
    pub(super) fn solved(&self) -> impl Iterator<Item = (&str, usize)> {
        let count = |costs: &[Option<f64>]| costs.iter().flatten().count();
        self.costs
            .iter()
            .map(move |(name, costs)| (name.as_str(), count(costs)))
    }

    /// The profile of each solver: steps (τ, share of the problems), ascending; one that solves none stays at zero.
    pub(super) fn profiles(&self) -> Vec<(String, Vec<[f64; 2]>)> {
        let best: Vec<f64> = (0..self.problems())
            .map(|p| self.of_problem(p).fold(f64::INFINITY, f64::min))
            .collect();
        let ratios = |costs: &[Option<f64>]| {
            let known = costs.iter().zip(&best).filter_map(|(c, b)| Some((*c)? / b));
            let mut ratios: Vec<f64> = known.collect();
            ratios.sort_by(f64::total_cmp);
            ratios
        };
        let all: Vec<(String, Vec<f64>)> = self
            .costs
            .iter()
            .map(|(name, costs)| (name.clone(), ratios(costs)))
            .collect();
        let last = all.iter().filter_map(|(_, r)| r.last());
        let last = 1.2 * last.copied().fold(1.0, f64::max);
        let steps = |ratios: &[f64]| {
            let mut share = 0.0;
            if ratios.is_empty() {
                return vec![[1.0, share], [last, share]];
            }
            let mut points = Vec::new();
            for (k, &ratio) in ratios.iter().enumerate() {
                points.push([ratio, share]);
                share = (k + 1) as f64 / self.problems() as f64;
                points.push([ratio, share]);
            }
            points.push([last, share]);
            points
        };
        all.iter().map(|(n, r)| (n.clone(), steps(r))).collect()
    }

    /// (solver, problems solved, shifted geometric mean \[ns]), the best first. Problems that none solves are left out.
    pub(super) fn means(&self) -> Vec<(String, usize, f64)> {
        let solvable: Vec<(usize, f64)> = (0..self.problems())
            .map(|p| (p, self.of_problem(p).fold(0.0, f64::max)))
            .filter(|(_, worst)| *worst > 0.0)
            .collect();
        let mean = |costs: &[Option<f64>]| {
            let logs = solvable
                .iter()
                .map(|&(p, worst)| (costs[p].unwrap_or(PENALTY * worst) + SHIFT).ln());
            (logs.sum::<f64>() / solvable.len() as f64).exp() - SHIFT
        };
        let means = self.solved().zip(&self.costs);
        let mut means: Vec<_> = means
            .map(|((name, solved), (_, costs))| (name.to_owned(), solved, mean(costs)))
            .collect();
        means.sort_by(|a, b| a.2.total_cmp(&b.2));
        means
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three solvers on three problems; none solves the last, and one none at all.
    fn scores() -> Scores {
        Scores {
            level: 1e-6,
            costs: vec![
                ("a".to_owned(), vec![Some(1e3), Some(8e3), None]),
                ("b".to_owned(), vec![Some(2e3), None, None]),
                ("c".to_owned(), vec![None, None, None]),
            ],
        }
    }

    #[test]
    fn profiles_rise_to_the_share_that_is_solved() {
        let profiles = scores().profiles();
        assert_eq!(profiles[0].1.first(), Some(&[1.0, 0.0]));
        assert_eq!(profiles[0].1.last(), Some(&[2.4, 2.0 / 3.0]));
        assert_eq!(profiles[1].1[..2], [[2.0, 0.0], [2.0, 1.0 / 3.0]]);
        assert_eq!(profiles[2].1, [[1.0, 0.0], [2.4, 0.0]]);
        let scores = scores();
        assert!(scores.solved().eq([("a", 2), ("b", 1), ("c", 0)]));
    }

    #[test]
    fn means_count_what_is_not_solved() {
        let means = scores().means();
        assert_eq!((means[0].0.as_str(), means[0].1), ("a", 2));
        assert!((means[0].2 - ((2e3_f64 * 9e3).sqrt() - 1e3)).abs() < 1e-6);
        assert!((means[1].2 - ((3e3_f64 * 81e3).sqrt() - 1e3)).abs() < 1e-6);
    }
}
