//! Swings, bands of energy and spins as tables.

use super::{Config, MOVE, MOVE_TIME, band};
use serde_json::Value;
use taut_output::row::{Row, number_of};
use taut_output::sheet::{self, Column, Sheet, Show, column};

const RATIO: Column = column("mass_ratio", "ratio").shown(Show::Error(0));
const SCHEME: Column = column("scheme", "scheme");
const STIFFNESS: Column = column("stiffness", "K");
const RATE: Column = column("dt", "1/Δt").shown(Show::Row(rate));
const LOST: Column = column("failure_time", "lost at")
    .unit("s")
    .shown(Show::Fixed(2));

fn rate(row: &Row) -> String {
    number_of(row, "dt").map_or(String::new(), |dt| format!("{:.0}", 1.0 / dt))
}

const fn plain_error(key: &'static str, heading: &'static str) -> Column {
    column(key, heading).shown(Show::Error(1))
}

pub(super) const SHEETS: &[Sheet] = &[
    Sheet {
        list: "swings",
        columns: &[
            RATIO,
            SCHEME,
            STIFFNESS,
            RATE,
            column("amplitudes_early_m", "early")
                .unit("m")
                .shown(Show::Fixed(6)),
            column("amplitudes_late_m", "late")
                .unit("m")
                .shown(Show::Fixed(6)),
            column("amplitudes_late_m", "change").shown(Show::Row(change)),
            plain_error("change_over_fine", "vs fine"),
            column("redone", "redone"),
            LOST,
        ],
        ..sheet::PLAIN
    },
    Sheet {
        list: "bands",
        columns: &[
            RATIO,
            column("segments", "N"),
            SCHEME,
            STIFFNESS,
            column("guarded", "guard"),
            column("seeded", "seeded"),
            plain_error("first_band", "band, first"),
            plain_error("last_band", "last"),
            plain_error("drift", "drift"),
            column("redone", "redone"),
            LOST,
        ],
        ..sheet::PLAIN
    },
    Sheet {
        list: "spins",
        columns: &[
            SCHEME,
            STIFFNESS,
            RATE,
            plain_error("drift", "|ΔL|/|L|"),
            column("order", "order").shown(Show::Fixed(2)),
            LOST,
        ],
        ..sheet::PLAIN
    },
];

/// By how much the amplitude has changed, over the early one.
fn change(row: &Row) -> String {
    let [early, late] =
        ["early", "late"].map(|when| number_of(row, &format!("amplitudes_{when}_m")));
    let change = early.zip(late).map(|(early, late)| late / early - 1.0);
    change.map_or("-".to_owned(), |change| format!("{change:.1e}"))
}

/// The three tables, each below what it holds.
#[must_use]
pub fn text_tables(data: &Value, config: &Config) -> String {
    let [early, late] = config.moments;
    let [swings, bands, spins] = [0, 1, 2].map(|i| SHEETS[i].text(data));
    format!(
        "Swing amplitude of the load, fitted to two periods from {early} s and from {late} s on; anchor moved by {MOVE} m\n\
         in {MOVE_TIME} s, guard on. `vs fine` is the change over that of the default scheme with 1/{} of the time step.\n\
         {swings}\n\
         Energy over {} steps at Δt = 1/{:.0} s, over the swing's energy: width of the band in its first and last {} s,\n\
         drift of its middle (last tenth against first tenth).\n\
         {bands}\n\
         Angular momentum of a free, taut, spinning cable about its centre of mass: largest |ΔL|/|L| over {} s, and its\n\
         order in Δt against the row above.\n\
         {spins}",
        config.finer,
        config.steps,
        1.0 / config.dt,
        band::WINDOW as f64 * config.dt,
        config.spin_time
    )
}
