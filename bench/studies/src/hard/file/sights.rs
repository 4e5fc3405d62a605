//! Quantities that are seen in each step of a run, by name: columns of `taut run`, and probes.

use super::CaseError;
use super::probes::{PROBES, Probe, Seen};
use taut_ground::columns::{ColumnError, Columns};
use taut_ground::trajectory::Sample;
use taut_integrator::Stepper;
use taut_model::Scene;

/// A quantity that is seen in each step.
enum Sight {
    Probe(Probe),
    /// One of the columns.
    Column(usize),
}

/// Quantities in their order, and the columns among them.
pub(super) struct Sights {
    all: Vec<Sight>,
    columns: Columns,
}

impl Sights {
    /// Those with these names.
    pub(super) fn find(wanted: &[String], stepper: &Stepper) -> Result<Self, CaseError> {
        let probe = |name: &str| PROBES.iter().find(|(known, ..)| *known == name);
        let mut columns = Vec::new();
        let mut all = Vec::new();
        for name in wanted {
            match probe(name) {
                Some(probe) => all.push(Sight::Probe(*probe)),
                None => {
                    all.push(Sight::Column(columns.len()));
                    columns.push(name.clone());
                }
            }
        }
        let columns = Columns::find(&columns, stepper).map_err(|e| {
            let probes = PROBES.iter().map(|(name, ..)| *name);
            match &e {
                ColumnError::UnknownColumn { name, known } => {
                    let known = known.iter().map(String::as_str);
                    CaseError::unknown("probe", name, known.chain(probes))
                }
                ColumnError::UnknownName {
                    name,
                    bodies,
                    constraints,
                    ..
                } => {
                    let known = bodies.iter().chain(constraints).map(String::as_str);
                    CaseError::unknown("body, joint or cable", name, known)
                }
                ColumnError::UnknownQuantity {
                    quantity, known, ..
                } => CaseError::unknown("quantity", quantity, known.iter().copied()),
                other => CaseError::Told {
                    message: other.to_string(),
                },
            }
        })?;
        Ok(Self { all, columns })
    }

    /// What is seen of a step, or at the beginning.
    pub(super) fn look(&self, seen: &Seen<'_>) -> Vec<f64> {
        let stepper = seen.stepper;
        let report = seen.report.filter(|_| !self.columns.headings().is_empty());
        let of_columns: Vec<_> = match report {
            None => self.columns.at_start(stepper).collect(),
            Some(report) => self
                .columns
                .values(stepper, &Sample::after(stepper, report))
                .collect(),
        };
        let values = self.all.iter().map(|sight| match sight {
            Sight::Probe((.., of)) => of(seen),
            Sight::Column(k) => of_columns[*k].unwrap_or(f64::NAN),
        });
        values.collect()
    }
}

/// Angles of the cables about the sheaves with friction \[rad].
pub(super) fn wraps(scene: &Scene) -> Vec<f64> {
    (0..scene.capstans.len()).map(|i| scene.wrap(i)).collect()
}
