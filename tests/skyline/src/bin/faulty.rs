//! The program `taut` with a solver that does wrong, in one way for each of its options.

use std::sync::Arc;
use taut_skyline::Skyline;
use taut_solver::{
    AnalyzeReport, BlockPattern, Capabilities, Entry, FactorReport, Foreign, LinearSolver,
    SolveError, SolveReport, SymBlockMatrix,
};

const FAULTY: Foreign = Foreign {
    entry: Entry {
        rows: &[
            "faulty:nan",
            "faulty:claims",
            "faulty:less",
            "faulty:more",
            "faulty:forgets",
        ],
        ..Entry::new("faulty")
    },
    capabilities: Capabilities {
        indefinite: false,
        iterative: false,
    },
    create: |options| {
        Ok(Box::new(Faulty {
            inner: Skyline::default(),
            fault: options.to_owned(),
        }))
    },
};

/// The skyline solver with a fault of that name.
struct Faulty {
    inner: Skyline,
    fault: String,
}

impl LinearSolver for Faulty {
    fn name(&self) -> &'static str {
        "faulty"
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        self.inner.analyze(pattern)
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        match self.fault.as_str() {
            "forgets" => Err(SolveError::PatternChanged),
            _ => self.inner.factorize(a),
        }
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        let mut answer = vec![0.0; x.len()];
        let report = self.inner.solve(a, b, &mut answer)?;
        match self.fault.as_str() {
            "nan" => answer[0] = f64::NAN,
            "claims" => answer.iter_mut().for_each(|x| *x *= 1.001),
            "less" => answer.truncate(x.len() / 2),
            "more" => answer.push(0.0),
            _ => {}
        }
        for (r, value) in answer.into_iter().enumerate() {
            x[r] = value;
        }
        Ok(report)
    }
}

fn main() -> std::process::ExitCode {
    taut_bench::command_line(&[FAULTY])
}
