//! The charts of the main job's report.

use super::score::Scores;
use taut_output::notation::number;
use taut_output::plan::FLOOR;
use taut_output::plot::{Axis, Chart, Look, Mark, Series, Shape};
use taut_output::settings::distinct;
use taut_output::table::nanoseconds;
use taut_studies::ladder::{Extras, Pattern, Record, SceneKey, Step, Trace};

fn series(backend: &str, points: Vec<[f64; 2]>) -> Series {
    Series {
        look: Look::of_solver(backend),
        ..Series::new(backend, points, Mark::LineAndPoints)
    }
}

/// Work against precision: a step's time over the error of the multipliers, a curve for each solver over its iterations
/// and refinements; one chart for each scene.
pub(super) fn work_precision(records: &[Record]) -> Vec<Chart> {
    let scenes = distinct(records.iter().map(|r| (r.scene_key(), r.scene_title())));
    let chart = |(scene, title): (SceneKey<'_>, String)| {
        let own: Vec<&Record> = records
            .iter()
            .filter(|r| r.scene_key() == scene && r.error.is_none())
            .collect();
        let backends = distinct(own.iter().map(|r| r.backend.as_str()));
        let of = |backend: &str| {
            let mut points: Vec<[f64; 2]> = Vec::new();
            let mut notes: Vec<String> = Vec::new();
            // An iteration that has converged stands still, whatever its times.
            let mut add = |error: f64, ns: f64, r: &Record, refinements: usize| {
                // An infinite or undefined error must not be raised to the floor.
                if !error.is_finite() {
                    return;
                }
                let (error, time) = (error.max(FLOOR), ns * 1e-3);
                match points.last_mut() {
                    Some([last, least]) if *last == error => *least = least.min(time),
                    _ => {
                        points.push([error, time]);
                        notes.push(work_of(r, refinements));
                    }
                }
            };
            for r in own.iter().filter(|r| r.backend == backend) {
                if r.refinements > 0 && r.velocity_error.is_none() {
                    add(r.forward_error_unrefined, r.step_ns - r.refine_ns, r, 0);
                }
                add(r.step_error(), r.step_ns, r, r.refinements);
            }
            Series {
                notes,
                ..series(backend, points)
            }
        };
        Chart {
            title,
            x: Axis::log(if own.iter().any(|r| r.velocity_error.is_some()) {
                "relative error of the velocities (1)"
            } else {
                "relative error of the multipliers (1)"
            }),
            y: Axis::log("whole step (µs)"),
            series: backends.into_iter().map(of).collect(),
        }
    };
    scenes.into_iter().map(chart).collect()
}

/// Work behind a point: iterations a step, or refinements.
fn work_of(r: &Record, refinements: usize) -> String {
    if r.iterations > 0 {
        let used = number(r.iterations_used);
        return format!("{used} iterations a step of at most {}", r.iterations);
    }
    match refinements {
        1 => "1 refinement".to_owned(),
        n => format!("{n} refinements"),
    }
}

/// The performance profile of each error level.
pub(super) fn profiles(scores: &[Scores]) -> Vec<Chart> {
    let chart = |s: &Scores| {
        let lines =
            s.profiles()
                .into_iter()
                .zip(s.solved())
                .map(|((solver, points), (_, solved))| Series {
                    name: format!("{solver}: {solved} of {}", s.problems()),
                    mark: Mark::Stairs,
                    ..series(&solver, points)
                });
        Chart {
            title: format!("errors within {}", number(s.level)),
            x: Axis::log("cost over that of the best solver, τ (1)"),
            y: Axis {
                range: Some([-0.03, 1.05]),
                ..Axis::linear("share of the scenes (1)")
            },
            series: lines.collect(),
        }
    };
    scores.iter().map(chart).collect()
}

/// A step's time against the number of segments.
pub(super) fn sizes(extras: &Extras) -> Vec<Chart> {
    let backends = distinct(extras.sizes.iter().map(|s| s.backend.as_str()));
    let of = |backend: &str| {
        let own = extras.sizes.iter().filter(|s| s.backend == backend);
        let points = own.map(|s| [s.segments as f64, s.step_ns * 1e-3]);
        series(backend, points.collect())
    };
    one(Chart {
        title: "time of a step, load/segment 10³".to_owned(),
        x: Axis::log("segments (1)"),
        y: Axis::log("whole step (µs)"),
        series: backends.into_iter().map(of).collect(),
    })
}

/// Forward errors against mass ratio, without and with a refinement, and the condition of S.
pub(super) fn mass_ratios(extras: &Extras) -> Vec<Chart> {
    let errors = |refinements: usize, title: &str| {
        let rungs: Vec<_> = extras
            .ladder
            .iter()
            .filter(|r| r.refinements == refinements)
            .collect();
        let backends = distinct(rungs.iter().map(|r| r.backend.as_str()));
        let of = |backend: &str| {
            let own = rungs.iter().filter(|r| r.backend == backend);
            let own = own.filter(|r| r.forward_error.is_finite());
            let points = own.map(|r| [r.mass_ratio, r.forward_error.max(FLOOR)]);
            series(backend, points.collect())
        };
        Chart {
            title: title.to_owned(),
            x: Axis::log("load/segment mass ratio (1)"),
            y: Axis::log("relative error of the multipliers (1)"),
            series: backends.into_iter().map(of).collect(),
        }
    };
    let condition = Chart {
        title: "condition of S".to_owned(),
        x: Axis::log("load/segment mass ratio (1)"),
        y: Axis::log("‖S‖₁ ‖S⁻¹‖₁ (1)"),
        series: vec![Series::new(
            "24 segments",
            extras.conditions.clone(),
            Mark::LineAndPoints,
        )],
    };
    [
        condition,
        errors(0, "forward error, no refinement"),
        errors(1, "forward error, one refinement"),
    ]
    .into_iter()
    .filter(has_points)
    .collect()
}

/// Error of the motion against its cost, Δt along each curve.
pub(super) fn time_steps(extras: &Extras) -> Vec<Chart> {
    let point = |s: &Step, by_cost: bool| {
        let error = s.load_error_m.filter(|e| e.is_finite())?.max(FLOOR);
        Some(if by_cost {
            [error * 1e3, s.second_ns * 1e-6]
        } else {
            [s.dt * 1e3, error * 1e3]
        })
    };
    let by_scheme = || extras.steps.iter().filter(|s| s.backend.is_none());
    let schemes = distinct(by_scheme().map(|s| s.scheme.as_str()));
    let of = |by_cost: bool| {
        let line = |scheme: &&str| {
            let own = by_scheme().filter(|s| s.scheme == *scheme);
            let points = own.filter_map(|s| point(s, by_cost)).collect();
            Series::new(*scheme, points, Mark::LineAndPoints)
        };
        schemes.iter().map(line).collect()
    };
    let backends = distinct(extras.steps.iter().filter_map(|s| s.backend.as_deref()));
    let solver = |backend: &&str| {
        let own = extras.steps.iter();
        let own = own.filter(|s| s.backend.as_deref() == Some(*backend));
        series(backend, own.filter_map(|s| point(s, true)).collect())
    };
    let axes = |title: &str, series: Vec<Series>| Chart {
        title: title.to_owned(),
        x: Axis::log("largest error of the load's place (mm)"),
        y: Axis::log("median step × steps of a second (ms)"),
        series,
    };
    let charts = [
        axes(
            "work against precision of the motion: every solver, over Δt",
            backends.iter().map(solver).collect(),
        ),
        axes(
            "work against precision of the motion: schemes, over Δt",
            of(true),
        ),
        Chart {
            title: "order of the schemes".to_owned(),
            x: Axis::log("Δt (ms)"),
            y: Axis::log("largest error of the load's place (mm)"),
            series: of(false),
        }
        .with_orders(),
    ];
    charts.into_iter().filter(has_points).collect()
}

/// The times of single steps beside the time that a frame has.
pub(super) fn trace(trace: &Trace) -> Vec<Chart> {
    let count = trace.step_ns.len();
    if count == 0 {
        return Vec::new();
    }
    let points = trace.step_ns.iter().enumerate();
    let points = points.map(|(i, ns)| [(i + 1) as f64 * trace.dt, ns * 1e-6]);
    let end = count as f64 * trace.dt;
    // Each of two lines that are near each other is seen through the dashes of the other.
    let level = |place: usize, name: String, ms: f64| Series {
        look: Some(Look::by_place(place)),
        ..Series::new(name, vec![[0.0, ms], [end, ms]], Mark::Line)
    };
    let frame = trace.dt * 1e3;
    let quantiles = trace.quantiles().into_iter().enumerate();
    let levels = quantiles
        .map(|(i, (name, ns))| level(i + 1, format!("{name} {}", nanoseconds(ns)), ns * 1e-6));
    let steps = Series {
        look: Some(Look::by_place(0)),
        ..Series::new("a step", points.collect(), Mark::Points)
    };
    // Not one of the percentiles: a line with its name at its end.
    let limit = Series::new(
        format!("Δt = {frame:.1} ms"),
        vec![[0.0, frame], [end, frame]],
        Mark::Guide,
    );
    let series = [steps, limit].into_iter().chain(levels).collect();
    one(Chart {
        title: "time of each step".to_owned(),
        x: Axis::linear("simulated time (s)"),
        y: Axis::log("wall-clock time of the step (ms)"),
        series,
    })
}

/// Energies over time.
pub(super) fn energies(extras: &Extras) -> Vec<Chart> {
    let lines = extras
        .energies
        .iter()
        .map(|e| Series::new(e.scheme.clone(), e.points.clone(), Mark::Line));
    one(Chart {
        title: "total energy of a swing from 0.3 rad, 24 segments, load/segment 10³".to_owned(),
        x: Axis::linear("simulated time (s)"),
        y: Axis::linear("change over the largest kinetic energy (1)"),
        series: lines.collect(),
    })
}

/// The blocks of S and of its factor, row 0 on top.
pub(super) fn patterns(extras: &Extras) -> Vec<Chart> {
    let chart = |p: &Pattern| {
        let places = |blocks: &[[usize; 2]]| -> Vec<[f64; 2]> {
            let place = |&[row, column]: &[usize; 2]| [column as f64, -(row as f64)];
            blocks.iter().map(place).collect()
        };
        let of = |name: String, blocks: &[[usize; 2]], place| Series {
            look: Some(Look {
                shape: Shape::Square,
                ..Look::by_place(place)
            }),
            ..Series::new(name, places(blocks), Mark::Points)
        };
        let end = p.blocks as f64;
        Chart {
            title: p.title.clone(),
            x: Axis {
                range: Some([-1.0, end]),
                ..Axis::linear("block column")
            },
            y: Axis {
                range: Some([-end, 1.0]),
                reversed: true,
                ..Axis::linear("block row")
            },
            series: vec![
                of(format!("S: {} blocks", p.matrix.len()), &p.matrix, 0),
                of(format!("fill of its factor: {}", p.fill.len()), &p.fill, 2),
            ],
        }
    };
    extras.patterns.iter().map(chart).collect()
}

fn has_points(chart: &Chart) -> bool {
    chart.series.iter().any(|s| !s.points.is_empty())
}

/// The chart, unless it is empty.
fn one(chart: Chart) -> Vec<Chart> {
    Some(chart).filter(has_points).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_studies::ladder::Rung;

    #[test]
    fn what_is_no_number_is_not_drawn_as_exact() {
        let rung = |forward_error| Rung {
            backend: "banded".to_owned(),
            mass_ratio: 1.0,
            refinements: 0,
            forward_error,
        };
        let extras = Extras {
            ladder: [1e-9, f64::NAN, 0.0].map(rung).to_vec(),
            ..Extras::default()
        };
        let charts = mass_ratios(&extras);
        let series = charts.iter().flat_map(|c| &c.series);
        let points: Vec<[f64; 2]> = series.flat_map(|s| s.points.clone()).collect();
        assert_eq!(points, [[1.0, 1e-9], [1.0, FLOOR]]);
    }
}
