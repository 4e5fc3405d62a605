//! The paper's tables, figures and claims, computed: what it prints beside what comes out here (\[SL §III, §VII, §VIII]).
//!
//! Each experiment is a module with a `Config` (whole and quick), a `run`, and records; it ends in an [outcome]: rows
//! of checks, tables for people, rows for programs, charts. The scan of the paper that the figures come from has lost
//! most exponents: where one was inferred, the row says so.
//!
//! [outcome]: taut_output::check::Outcome

pub mod chains;
pub mod claims;
mod pictures;
pub mod specimens;
mod study;
pub mod swing;
pub mod table1;
pub mod table2;
pub mod timing;

pub(crate) use study::STUDY;

use crate::checks::Experiment;

/// The tables, figures and claims of the paper that hold results, in its order. Its Figs 1 and 6–8 are drawings.
pub const EXPERIMENTS: [Experiment; 15] = [
    Experiment {
        name: "table1",
        title: "Table I: largest stable load/particle mass ratio of particle chains",
        run: table1::outcome,
    },
    Experiment {
        name: "fig2",
        title: "Fig. 2: distribution of stretch and bend, link chain (a)",
        run: |quick, progress| chains::distribution(chains::LINKS, "fig2", quick, progress),
    },
    Experiment {
        name: "fig3",
        title: "Fig. 3: distribution of stretch and bend, chain with regularised bending (e)",
        run: |quick, progress| chains::distribution(chains::BENDING, "fig3", quick, progress),
    },
    Experiment {
        name: "fig4",
        title: "Fig. 4: return maps of the stretch, chains (a) and (e)",
        run: chains::return_maps,
    },
    Experiment {
        name: "fig5",
        title: "Fig. 5: spectrum of the bend angle for three bending compliances",
        run: chains::spectra,
    },
    Experiment {
        name: "fig9",
        title: "Fig. 9: snapshots of bending and twisting",
        run: pictures::specimens,
    },
    Experiment {
        name: "fig10",
        title: "Fig. 10: pull",
        run: specimens::pull,
    },
    Experiment {
        name: "fig11",
        title: "Fig. 11: twist",
        run: specimens::twist,
    },
    Experiment {
        name: "fig12",
        title: "Fig. 12: bend",
        run: specimens::bend,
    },
    Experiment {
        name: "table2",
        title: "Table II: largest stable load/segment mass ratio of rigid-body cables",
        run: table2::outcome,
    },
    Experiment {
        name: "fig13",
        title: "Fig. 13: time a step over the number of elements",
        run: timing::outcome,
    },
    Experiment {
        name: "fig14",
        title: "Fig. 14: the gantry crane",
        run: pictures::gantry,
    },
    Experiment {
        name: "fig15",
        title: "Fig. 15: the load on the ground, the cable slack",
        run: pictures::landing,
    },
    Experiment {
        name: "fig16",
        title: "Fig. 16: energy of the swinging cable",
        run: swing::outcome,
    },
    Experiment {
        name: "claims",
        title: "The paper's claims in words",
        run: claims::outcome,
    },
];

pub fn named(name: &str) -> Result<Experiment, String> {
    let found = EXPERIMENTS.into_iter().find(|e| e.name == name);
    let names = || EXPERIMENTS.map(|e| e.name).join(", ");
    found.ok_or_else(|| format!("choose one of {}; the other figures are drawings", names()))
}
