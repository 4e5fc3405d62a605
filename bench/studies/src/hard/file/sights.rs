//! Quantities that are seen in each step of a run, by name: columns of `taut run`, and probes.

use super::CaseError;
use super::drive::numbered;
use super::probes::{PROBES, Probe, Seen};
use taut_integrator::Stepper;
use taut_measure::columns::{ColumnError, Columns};
use taut_measure::time_table::TimeTable;
use taut_measure::trajectory::Sample;
use taut_model::Scene;

/// A quantity that is seen in each step.
enum Sight<'a> {
    Probe(Probe),
    /// A column of the table beside the case.
    Beside(&'a TimeTable, usize),
    Column(usize),
}

/// Quantities in their order, and the columns among them.
pub(super) struct Sights<'a> {
    all: Vec<Sight<'a>>,
    columns: Columns,
}

impl<'a> Sights<'a> {
    /// Those with these names.
    pub(super) fn find(
        wanted: &[String],
        table: Option<&'a TimeTable>,
        stepper: &Stepper,
    ) -> Result<Self, CaseError> {
        let probe = |name: &str| PROBES.iter().find(|(known, ..)| *known == name);
        let mut columns = Vec::new();
        let mut all = Vec::new();
        for name in wanted {
            match (probe(name), table.zip(name.strip_prefix("file."))) {
                (Some(probe), _) => all.push(Sight::Probe(*probe)),
                (_, Some((table, name))) => {
                    let column = numbered("column", name, table.names.iter())?;
                    all.push(Sight::Beside(table, column));
                }
                (None, None) => {
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
                other => CaseError::message(other),
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
            Sight::Beside(table, k) => table.within(*k, stepper.time()),
            Sight::Column(k) => of_columns[*k].unwrap_or(f64::NAN),
        });
        values.collect()
    }
}

/// Angles of the cables about the sheaves with friction \[rad].
pub(super) fn wraps(scene: &Scene) -> Vec<f64> {
    (0..scene.capstans.len()).map(|i| scene.wrap(i)).collect()
}
