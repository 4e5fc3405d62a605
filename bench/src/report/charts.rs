//! The charts of the main job's report.

use super::score::Scores;
use taut_output::notation::number;
use taut_output::plan::FLOOR;
use taut_output::plot::{Axis, Chart, Look, Mark, Series, Shape};
use taut_output::settings::distinct;
use taut_output::table::nanoseconds;
use taut_studies::ladder::{Extras, LadderRow, Pattern, SceneKey, Trace};

fn series(backend: &str, points: Vec<[f64; 2]>) -> Series {
    Series {
        look: Look::of_solver(backend),
        ..Series::new(backend, points, Mark::LineAndPoints)
    }
}

/// Work against precision: a step's time over the error of the multipliers, a curve for each solver over its iterations
/// and refinements; one chart for each scene.
pub(super) fn work_precision(records: &[LadderRow]) -> Vec<Chart> {
    let scenes = distinct(records.iter().map(|r| (r.scene_key(), r.scene_title())));
    let chart = |(scene, title): (SceneKey<'_>, String)| {
        let own: Vec<&LadderRow> = records
            .iter()
            .filter(|r| r.scene_key() == scene && r.error.is_none())
            .collect();
        let backends = distinct(own.iter().map(|r| r.backend.as_str()));
        let of = |backend: &str| {
            let mut points: Vec<[f64; 2]> = Vec::new();
            let mut notes: Vec<String> = Vec::new();
            // An iteration that has converged stands still, whatever its times.
            let mut add = |error: f64, ns: f64, r: &LadderRow, refinements: usize| {
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
                let known = |x: Option<f64>| x.unwrap_or(f64::NAN);
                let whole = known(r.step_ns);
                if r.refinements > 0 && r.velocity_error.is_none() {
                    let unrefined = whole - known(r.refine_ns);
                    add(known(r.forward_error_unrefined), unrefined, r, 0);
                }
                add(r.step_error(), whole, r, r.refinements);
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
fn work_of(r: &LadderRow, refinements: usize) -> String {
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
    vec![Chart {
        title: "time of each step".to_owned(),
        x: Axis::linear("simulated time (s)"),
        y: Axis::log("wall-clock time of the step (ms)"),
        series,
    }]
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
