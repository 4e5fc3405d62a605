//! What the pages of the benchmarks beside the main job show: which columns of their rows stand on the axes of which
//! plot. A benchmark without plots has its tables alone.

use super::Other;
use super::plans::{PLAIN, Plan, Plot, error, linear, positive, texts};
use crate::plot::Mark;
use serde_json::Value;

/// The plot of work against precision, of which `taut report --picture` makes a file.
pub(super) const PRECISION: &str = "work-precision";

/// A benchmark.
struct Kind {
    /// Its name, as that of its file of rows.
    name: &'static str,
    title: &'static str,
    /// A list of its rows and a column that no other has, by which rows without a name are known. The list without a
    /// name is the data itself.
    mark: (&'static str, &'static str),
    plans: &'static [Plan],
}

const KINDS: &[Kind] = &[
    Kind {
        name: "accuracy",
        title: "error of whole motions against cost",
        mark: ("records", "horizontal_m"),
        plans: &[
            Plan {
                id: PRECISION,
                title: "Work against precision of the motion",
                text: "Along a curve: Δt. Lower left is better. A run that was lost is not shown. The cost is the \
                       wall-clock time of all steps of the run over its simulated time: of every phase of a step, \
                       which are linearisation, assembly, factorisation, solve, refinement and update, those that \
                       the guard takes back and redoes with their implicit sub-steps included; not of building the \
                       scene, nor of what is recorded of it. Runs share the machine with others.",
                list: "records",
                panels: &["segments", "mass_ratio", "joint", "drive"],
                series: &["setting"],
                x: error(
                    &["horizontal_m"],
                    "largest horizontal error of the load (m)",
                ),
                y: positive(
                    &["cost"],
                    "time of all steps of a simulated second (ms)",
                    1e3,
                ),
                only: &[("stable", &["yes"])],
                as_first: &["backend", "refinements", "iterations"],
                ..PLAIN
            },
            Plan {
                id: "orders",
                title: "Order of the default step",
                text: "Error against the time step, all else the same.",
                list: "records",
                panels: &["segments", "joint", "drive"],
                series: &["mass_ratio"],
                x: positive(&["dt"], "Δt (ms)", 1e3),
                y: error(
                    &["horizontal_m"],
                    "largest horizontal error of the load (m)",
                ),
                only: &[("stable", &["yes"])],
                as_first: &["setting", "backend", "refinements", "iterations"],
                least_places: 2,
                orders: true,
                ..PLAIN
            },
            Plan {
                id: "solvers",
                title: "Solvers",
                text: "The default step with every solver. Along a curve: iterations, or refinements.",
                list: "records",
                panels: &["segments", "mass_ratio"],
                x: error(
                    &["horizontal_m"],
                    "largest horizontal error of the load (m)",
                ),
                y: positive(&["step_ns"], "whole step (µs)", 1e-3),
                only: &[("stable", &["yes"])],
                as_first: &["setting", "dt", "joint", "drive"],
                least: 2,
                ..PLAIN
            },
        ],
    },
    Kind {
        name: "linear",
        title: "errors of the multipliers against mass ratio",
        mark: ("", "pose"),
        plans: &[Plan {
            id: "mass-ratios",
            title: "Error against mass ratio",
            text: "What forming S loses, about roundoff × mass ratio, refinement from the pieces brings back.",
            panels: &["pose", "segments", "refinements"],
            x: positive(&["mass_ratio"], "load/segment mass ratio (1)", 1.0),
            y: error(&["forward_error"], "relative error of the multipliers (1)"),
            ..PLAIN
        }],
    },
    Kind {
        name: "kernels",
        title: "factorisation and solve alone",
        mark: ("records", "ns_per_joint"),
        plans: &[
            Plan {
                id: PRECISION,
                title: "Work against precision",
                text: "Factorisation and solve of one system. Lower left is better.",
                list: "records",
                panels: &["joint_rows", "mass_ratio", "segments"],
                series: &["solver"],
                x: error(&["forward_error"], "relative error of the multipliers (1)"),
                y: positive(
                    &["ns_per_joint"],
                    "factorise and solve, per joint (ns)",
                    1.0,
                ),
                ..PLAIN
            },
            Plan {
                id: "sizes",
                title: "Time against elements",
                text: "A level line is a cost in proportion to the cable's elements.",
                list: "records",
                panels: &["joint_rows", "mass_ratio"],
                series: &["solver"],
                x: positive(&["segments"], "segments (1)", 1.0),
                y: positive(
                    &["ns_per_joint"],
                    "factorise and solve, per joint (ns)",
                    1.0,
                ),
                ..PLAIN
            },
        ],
    },
    Kind {
        name: "iterative",
        title: "time of iterations to an error",
        mark: ("", "target"),
        plans: &[Plan {
            id: PRECISION,
            title: "Work against precision",
            text: "Least time from the pieces to multipliers within the error, iterations from zero (cold) or from the \
                   step before (warm), beside the direct solver. Lower left is better.",
            panels: &["scene", "size", "mass_ratio", "start"],
            x: error(&["target"], "relative error of the multipliers (1)"),
            y: positive(&["ns"], "assembly, factorisation, solve (µs)", 1e-3),
            ..PLAIN
        }],
    },
    Kind {
        name: "scenes",
        title: "branches and loops",
        mark: ("records", "solve_ns_per_row"),
        plans: &[
            Plan {
                id: PRECISION,
                title: "Work against precision",
                text: "A step's time against the error of the multipliers against 32 digits. Along a curve: \
                       iterations. Lower left is better.",
                list: "records",
                panels: &["scene", "size", "mass_ratio"],
                x: error(&["forward_error"], "relative error of the multipliers (1)"),
                y: positive(&["step_ns"], "whole step (µs)", 1e-3),
                ..PLAIN
            },
            Plan {
                id: "sizes",
                title: "Time against size",
                text: "Of iterations those that converged, with the limit that costs least.",
                list: "records",
                only: &[("status", &["direct", "converged"])],
                panels: &["scene", "mass_ratio"],
                x: positive(&["rows"], "rows of S (1)", 1.0),
                y: positive(&["solve_ns"], "linear solve (µs)", 1e-3),
                lowest: true,
                ..PLAIN
            },
        ],
    },
    Kind {
        name: "matrix",
        title: "systems from files",
        mark: ("", "about"),
        plans: &[Plan {
            id: PRECISION,
            title: "Work against precision",
            text: "Factorisation and solve against the relative error of x. Along a curve: iterations. Lower left is \
                   better.",
            list: "records",
            panels: &["matrix"],
            x: error(&["forward_error"], "relative error of x (1)"),
            y: positive(
                &["factorize_ns", "solve_ns"],
                "factorise and solve (µs)",
                1e-3,
            ),
            ..PLAIN
        }],
    },
    Kind {
        name: "engines",
        title: "whole engines",
        mark: ("", "over_ours"),
        plans: &[Plan {
            id: PRECISION,
            title: "Work against precision",
            text: "What a frame costs against the largest error of the swinging load. Lower left is better.",
            panels: &["segments", "mass_ratio"],
            series: &["engine"],
            x: error(&["load_error"], "error of the load over the length (1)"),
            y: positive(&["frame_ns_min"], "a frame (µs)", 1e-3),
            mark: Mark::Points,
            ..PLAIN
        }],
    },
    Kind {
        name: "energy",
        title: "amplitude, energy and angular momentum over time",
        mark: ("bands", "first_band"),
        plans: &[
            Plan {
                id: "amplitude",
                title: "Amplitude of the swing",
                text: "By how much the load's swing has changed from its early to its late amplitude, over the same \
                       of a finer step: what the scheme does, apart from what the motion does by itself.",
                list: "swings",
                series: &["scheme", "stiffness"],
                x: positive(&["mass_ratio"], "load/segment mass ratio (1)", 1.0),
                y: error(
                    &["change_over_fine"],
                    "|change of the amplitude| over the finer step's (1)",
                ),
                ..PLAIN
            },
            Plan {
                id: "energy",
                title: "Energy over time",
                text: "Mean of each window of steps minus that of the first, over the largest kinetic energy of the \
                       first.",
                list: "bands",
                panels: &["segments", "mass_ratio"],
                series: &["scheme", "stiffness", "guarded"],
                x: linear(&["means_at"], "steps (10³)", 1e-3),
                y: linear(&["means"], "change of the energy (1)", 1.0),
                mark: Mark::Line,
                ..PLAIN
            },
            Plan {
                id: "momentum",
                title: "Angular momentum",
                text: "Of a free, taut, spinning cable about its centre of mass: nothing turns it, so it is to stay. \
                       A run that was lost is not shown.",
                list: "spins",
                series: &["scheme", "stiffness"],
                x: positive(&["dt"], "Δt (ms)", 1e3),
                y: error(&["drift"], "largest |L − L₀|/|L₀| (1)"),
                least_places: 2,
                orders: true,
                ..PLAIN
            },
        ],
    },
    Kind {
        name: "stability",
        title: "largest stable mass ratios",
        mark: ("", "stable_to"),
        plans: &[
            Plan {
                id: "largest",
                title: "Largest stable mass ratio",
                text: "Up to which every ratio of the grid is stable, each run by itself, against the weight α of \
                       the geometric stiffness (rel.: relative), a panel for each cable, number of segments and \
                       joint; without the guard. Where a point is missing not even the smallest ratio is stable; the \
                       highest points are where the grid ends. Those of the schemes stand beside each other.",
                panels: &["cable", "segments", "joint"],
                series: &["scheme"],
                x: texts(&["stiffness"], "geometric stiffness α (1)"),
                y: positive(&["stable_to"], "load/segment mass ratio (1)", 1.0),
                as_first: &["guarded", "planar"],
                least_places: 2,
                ..PLAIN
            },
            Plan {
                id: "segments",
                title: "Against the number of segments",
                text: "The same against the number of segments, without geometric stiffness and with the weights 0.4 \
                       and 0.5.",
                panels: &["cable", "joint"],
                series: &["scheme", "stiffness"],
                x: positive(&["segments"], "segments (1)", 1.0),
                y: positive(&["stable_to"], "load/segment mass ratio (1)", 1.0),
                only: &[("stiffness", &["off", "0.4", "0.5"])],
                as_first: &["guarded", "planar"],
                least_places: 2,
                ..PLAIN
            },
        ],
    },
    Kind {
        name: "shocks",
        title: "kicks, jerks and drops",
        mark: ("outcomes", "excess_gap"),
        plans: &[Plan {
            id: "errors",
            title: "Error after a shock",
            text: "Where the load is at the end, against a finer step. A run that was lost is not shown; the motion \
                   after some shocks is chaotic.",
            list: "outcomes",
            only: &[("finite", &["yes"])],
            panels: &["shock", "length"],
            series: &["setting"],
            x: positive(&["ratio"], "load/segment mass ratio (1)", 1.0),
            y: error(&["error_m"], "distance of the load from the reference (m)"),
            ..PLAIN
        }],
    },
];

fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}

/// What the page of that benchmark is called.
pub(super) fn title(name: &str) -> &'static str {
    match name {
        "bench" => "speed against error of sparse solvers on hoisting cables",
        "hard" => "hard cases with known answers",
        "paper" => "the paper's tables, figures and claims",
        name => kind(name).map_or("a benchmark", |kind| kind.title),
    }
}

/// The benchmark whose rows these are.
pub(super) fn name_of(rows: &Value) -> Option<&'static str> {
    let is = |kind: &&Kind| {
        let (list, column) = kind.mark;
        let list = if list.is_empty() {
            Some(rows)
        } else {
            rows.get(list)
        };
        let first = list.and_then(Value::as_array).and_then(|rows| rows.first());
        first.is_some_and(|row| row.get(column).is_some())
    };
    KINDS.iter().find(is).map(|kind| kind.name)
}

/// The plots of a benchmark that have something to show.
pub(super) fn plots(other: &Other) -> Vec<Plot> {
    let plans = kind(&other.name).map_or(&[][..], |kind| kind.plans);
    let plots = plans.iter().map(|plan| plan.plot(&other.rows));
    plots.filter(|plot| !plot.charts.is_empty()).collect()
}
