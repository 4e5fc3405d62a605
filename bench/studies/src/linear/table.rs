//! Forward errors over mass ratios as tables, and how far the direct solvers keep the bar.

use super::{BAR, BAR_RATIO, Verdict};
use taut_output::row::{Row, has_no_error, number_of, text_of};
use taut_output::sheet::{self, Across, Sheet, Show, column};
use taut_output::table::ratio;

pub(super) const SHEETS: &[Sheet] = &[Sheet {
    shared: &[column("pose", "{}"), column("segments", "{} segments")],
    columns: &[column("options", "solver").shown(Show::Row(backend))],
    across: Some(Across {
        by: &[column("mass_ratio", "{}").shown(Show::Ratio)],
        cells: &[sheet::error("forward_error", "").shown(Show::Error(0))],
        several: true,
        most: 5,
    }),
    counts: has_no_error,
    ..sheet::PLAIN
}];

/// The solver without its limit of iterations, which all have.
fn backend(row: &Row) -> String {
    text_of(row, "backend").to_owned()
}

const BARS: Sheet = Sheet {
    columns: &[
        column("backend", "solver"),
        column("limit", "kept up to").shown(Show::Row(kept)),
        column("worst_forward_error", "largest").shown(Show::Error(1)),
        column("worst_mass_ratio", "at ratio").shown(Show::Ratio),
        column("worst_pose", "pose"),
        column("worst_segments", "segments"),
    ],
    ..sheet::PLAIN
};

fn kept(row: &Row) -> String {
    number_of(row, "limit").map_or("nowhere".to_owned(), ratio)
}

/// Which direct solvers keep the bar.
pub(super) fn bars(verdicts: &[Verdict]) -> String {
    if verdicts.is_empty() {
        return String::new();
    }
    let missed = verdicts.iter().filter(|v| !v.holds());
    let missed: Vec<&str> = missed.map(|v| v.backend.as_str()).collect();
    let all = verdicts.len();
    let who = if missed.is_empty() {
        format!("all {all} direct solvers")
    } else {
        let held = all - missed.len();
        format!(
            "{held} of {all} direct solvers, not with\n{}",
            missed.join(", ")
        )
    };
    format!(
        "\nOne refinement, ratios up to {BAR_RATIO:.0e}: errors of at most {BAR:.0e} with {who}\n{}",
        BARS.of(&verdicts)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::Cases;
    use crate::linear::{Config, run};
    use crate::study::data;
    use taut_output::table::plain;

    #[test]
    fn the_widest_table_fits_into_120_columns() {
        let config = Config {
            segments: vec![3],
            ..Config::default()
        };
        let records = run(&config, &Cases::default()).unwrap();
        let text = plain(&SHEETS[0].text(&data(&records).unwrap()));
        let heading = text.lines().find(|l| l.contains("solver")).unwrap();
        let ratios: Vec<&str> = heading.split_whitespace().skip(1).collect();
        assert_eq!(ratios, ["1", "1000", "1e6", "1e9", "1e12"]);
        let width = text.lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{width:?}\n{text}");
        assert!(text.contains("straight, 3 segments") && text.contains("bent, 3 segments"));
    }
}
