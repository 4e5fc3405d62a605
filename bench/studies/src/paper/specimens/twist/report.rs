//! The specimen beside theory and the paper's claims, at rest, in motion, and what bending leaks into the twist: checks,
//! tables, charts.

use super::buckling::{SLENDERNESS, buckling_torque, greenhill, turns};
use super::{FARTHEST, Held, Leak, Results, Row};
use crate::paper::specimens::{BAR, Joint, MATERIALS, SEGMENTS, largest};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use taut_output::check::{Check, Verdict};
use taut_output::plot::{Axis, Chart, Mark, Series};
use taut_output::table::{error, of_records, table, text};

pub(super) fn at_rest(rows: &[Row]) -> Vec<Check> {
    let mut checks = Vec::new();
    for (material, _) in MATERIALS {
        let of: Vec<&Row> = rows.iter().filter(|r| r.material == material).collect();
        if of.is_empty() {
            continue;
        }
        let farthest = largest(of.iter().map(|r| r.twist));
        for (what, reference, worst) in [
            (
                "angle of a joint",
                "T l/GJ",
                largest(of.iter().map(|r| r.angle_error)),
            ),
            (
                "the whole",
                "T L/GJ",
                largest(of.iter().map(|r| r.total_error)),
            ),
        ] {
            let case = format!("twist, {material}: {what}");
            let ours = format!("{worst:.1e} to {farthest:.1} rad");
            checks.push(Check::within(case, reference, ours, worst, BAR).by(
                "largest relative error over N, the three twist angles and 24 or more torques",
            ));
        }
    }
    checks
}

pub(super) fn in_motion(held: &[Held]) -> Vec<Check> {
    let mut checks = Vec::new();
    let exact = greenhill();
    let chain = buckling_torque(96, 1e12, 0.0);
    checks.push(
        Check::relative(
            "twist: Greenhill's torque of the chain, N = 96",
            [exact, chain],
            "YI/L",
            1e-2,
        )
        .noting(format!("{:.2} turns", turns(exact)))
        .by("linearised balance of the segments, both ends held in line, no tension"),
    );
    let cosserat = held.iter().find(|h| {
        let loose = h.tension == 0.0 && h.disturbed && h.segments == 24;
        loose && h.joint == Joint::Cosserat.name() && h.step == "paper"
    });
    // The quick set has no such row.
    if let Some(measured) = cosserat.map(|h| h.straight_to) {
        let verdict = Verdict::or_only_if((2.4 / measured).ln().abs() < 0.1);
        checks.push(Check::claim(
            "twist, steel, N = 24: unstable at",
            "2.4 turns",
            format!("straight to {measured:.2} turns (Cosserat joint, the paper's step)"),
            verdict,
            format!(
                "a rod without tension buckles, of any material and with any division: \
                 Greenhill's {:.2} turns between pinned ends, {:.2} clamped as here. \
                 The paper's number is of that size; but its ends are not described, \
                 and its 15 turns at N = 12 and 37 of rubber and nylon are beyond \
                 buckling: they went undisturbed, or briefly",
                turns(TAU),
                turns(exact)
            ),
        ));
    }
    let buckles = turns(buckling_torque(12, SLENDERNESS, 0.0));
    checks.push(Check::claim(
        "twist, steel, N = 12: stable to",
        "15 turns",
        format!("buckles at {buckles:.2} turns"),
        Verdict::or_only_if(buckles >= 15.0),
        "only an undisturbed, exactly straight specimen goes beyond the buckling torque",
    ));
    checks.extend(numerical_checks(held));
    let taut = held
        .iter()
        .filter(|h| h.tension > 1.0 && h.step == "stiffened");
    checks.extend(taut.map(|h| {
        let error = if h.straight {
            (h.turns_read * TAU / FARTHEST - 1.0).abs()
        } else {
            f64::NAN
        };
        Check::within(
            format!(
                "twist, steel, N = {}, P = {} T²/(4YI)",
                h.segments, h.tension
            ),
            format!("{FARTHEST} rad, straight"),
            format!("{:.3} turns, off axis {:.0e} m", h.turns_read, h.off_axis_m),
            error,
            1e-6,
        )
        .by(
            "linearly implicit step with geometric stiffness of weight 1, 1/60 s, \
             disturbed all the time: within 10⁻⁴ m of the axis over the ramp of 10 s \
             and 5 s more; relative error of the twist",
        )
        .noting(
            "the tension of a long rod; this step damps, and keeps twelve segments \
             straight at 0.6 of it too: it is no measure of where the rod itself \
             would buckle",
        )
    }));
    checks
}

/// Checks of the numerical limits, beside the physical one.
fn numerical_checks(held: &[Held]) -> Vec<Check> {
    let list = |of: &dyn Fn(&Held) -> bool| {
        let of = held.iter().filter(|h| of(h));
        let all: Vec<String> = of
            .map(|h| format!("{} at 1/{:.0} s: {:.2}", h.step, 1.0 / h.dt, h.straight_to))
            .collect();
        all.join("; ")
    };
    let loose = |h: &Held| h.tension == 0.0 && h.disturbed && h.segments == 24;
    let cosserat = |h: &Held| loose(h) && h.joint == Joint::Cosserat.name();
    let default = held.iter().find(|h| cosserat(h) && h.step == "default");
    let paper = held
        .iter()
        .find(|h| loose(h) && h.joint == Joint::Ordinary.name());
    let mut checks = Vec::new();
    if let Some(h) = default {
        let limit = turns(buckling_torque(24, SLENDERNESS, 0.0));
        checks.push(Check::claim(
            "twist: default step, no tension, N = 24",
            format!("straight to {limit:.2} turns (buckling)"),
            format!("straight to {:.2} turns", h.straight_to),
            Verdict::either(
                h.straight_to > 0.95 * limit,
                [Verdict::Pass, Verdict::Limit],
            ),
            format!(
                "the turning of the joints' torques is explicit, and the third \
                 difference leaves a reserve of 4a + 8γ − 1 = 0.2 of the implicit \
                 stiffness against it, the linearly implicit step 1; the geometric \
                 stiffness holds what is beyond it. Straight up to, in turns: {}",
                list(&cosserat)
            ),
        ));
    }
    if let Some(h) = paper {
        checks.push(Check::claim(
            "twist: the paper's joint, disturbed, N = 24",
            "stable to 2.4 turns",
            format!("straight to {:.2} turns", h.straight_to),
            Verdict::of(h.straight_to >= 2.4),
            "its single bend row resists one transverse direction only: disturbed \
             out of a plane it is lost without any twist; undisturbed and exactly \
             straight it goes to 37 turns",
        ));
    }
    if let Some(h) = held.iter().find(|h| h.tension > 1.0 && h.step == "paper") {
        checks.push(Check::claim(
            "twist: tension under the paper's step",
            "keeps a steel specimen straight",
            format!("straight to {:.2} turns", h.straight_to),
            Verdict::either(h.straight, [Verdict::Holds, Verdict::Limit]),
            "without geometric stiffness the tension itself is beyond the step's limit at 1/60 s",
        ));
    }
    checks
}

pub(super) fn of_leaks(leaks: &[Leak]) -> Vec<Check> {
    let cosserat = largest(leaks.iter().map(|l| l.cosserat.abs()));
    let share = largest(leaks.iter().map(|l| l.alternative.abs() / l.theta));
    let ordinary = largest(leaks.iter().map(|l| l.ordinary.abs() / l.theta));
    vec![
        Check::off(
            "twist: bending in the Cosserat twist",
            "none",
            cosserat,
            "rad",
            1e-14,
        ),
        Check::claim(
            "twist: bending in the alternative angle",
            "measures bending too, Ω + θ",
            format!("up to {share:.3} θ"),
            Verdict::either(share > 0.5, [Verdict::HoldsOnlyIf, Verdict::DoesNotHold]),
            "bend axes across v: the angle between v_a and v_b is the whole bend \
             about w, none about v",
        ),
        Check::claim(
            "twist: bending in the ordinary angle",
            "no bending",
            format!("up to {ordinary:.3} θ"),
            Verdict::or_only_if(ordinary < 1e-9),
            "exact for bends about v or w; in between it reads second order in θ",
        ),
    ]
}

pub(super) fn tables(results: &Results) -> String {
    let mut rest = table(&["at rest", "N", "joint angle error", "total error", "to rad"]);
    for group in results
        .rows
        .chunk_by(|a, b| (&a.material, a.segments, &a.joint) == (&b.material, b.segments, &b.joint))
    {
        let Some(last) = group.last().filter(|r| r.material == MATERIALS[2].0) else {
            continue;
        };
        rest.add_row([
            format!("{}, {}", last.material, last.joint),
            last.segments.to_string(),
            error(Some(largest(group.iter().map(|r| r.angle_error)))),
            error(Some(largest(group.iter().map(|r| r.total_error)))),
            format!("{:.1}", last.twist),
        ]);
    }
    let mut limits = table(&[
        "Greenhill's turns, ends held",
        "N = 3",
        "6",
        "12",
        "24",
        "rod",
    ]);
    let mut cells = vec!["chain of segments".to_owned()];
    cells.extend(SEGMENTS.map(|n| format!("{:.2}", turns(buckling_torque(n, SLENDERNESS, 0.0)))));
    cells.push(format!("{:.2}", turns(greenhill())));
    limits.add_row(cells);
    let end = |h: &Held| match (h.straight, h.lost) {
        (true, _) => "straight",
        (_, true) => "lost",
        _ => "wavers",
    };
    let motion = of_records(
        &results.held,
        &[
            ("steel in motion", &|h| h.joint.clone()),
            ("N", &|h| h.segments.to_string()),
            ("step", &|h| h.step.clone()),
            ("1/Δt Hz", &|h| format!("{:.0}", 1.0 / h.dt)),
            ("4YI P/T²", &|h| format!("{}", h.tension)),
            ("disturbed", &|h| {
                if h.disturbed { "yes" } else { "no" }.to_owned()
            }),
            ("straight to", &|h| format!("{:.2}", h.straight_to)),
            ("to turn", &|h| format!("{:.2}", h.turns)),
            ("at s", &|h| format!("{:.1}", h.time_s)),
            ("", &|h| end(h).to_owned()),
            ("off axis", &|h| format!("{:.0e}", h.off_axis_m)),
            ("redone", &|h| h.redone.to_string()),
        ],
    );
    let leak = of_records(
        &results.leaks,
        &[
            ("bent by θ", &|l| format!("{}", l.theta)),
            ("axis from v", &|l| {
                format!("{:.0}°", l.direction_rad.to_degrees())
            }),
            ("cosserat", &|l| format!("{:.1e}", l.cosserat)),
            ("ordinary", &|l| format!("{:.6}", l.ordinary)),
            ("alternative", &|l| format!("{:.6}", l.alternative)),
        ],
    );
    let motion = format!(
        "disturbed: by 0.01 N sideways; straight to: last turn within 1e-4 m of \
         the axis; lost: 1e-2 m off it or a joint\nopen; wavers: neither; \
         redone: steps that the guard took back; stiffened: linearly implicit, \
         geometric stiffness of\nweight 1; P: tension, T: torque\n{motion}"
    );
    let parts = [text(&rest), text(&limits), motion, leak];
    parts.join("\n")
}

pub(super) fn chart_at_rest(rows: &[Row]) -> Chart {
    let line = vec![[0.0, 0.0], [FARTHEST, FARTHEST]];
    let mut series = vec![Series::new("theory", line, Mark::Line)];
    for n in SEGMENTS {
        let of = rows
            .iter()
            .filter(|r| r.segments == n && r.joint == Joint::Cosserat.name());
        let points = of.map(|r| [r.twist, r.twist_theory]).collect();
        series.push(Series::new(format!("N = {n}"), points, Mark::Points));
    }
    Chart {
        title: "Twist at rest".to_owned(),
        x: Axis::linear("Ω (rad)"),
        y: Axis::linear("T L/GJ (rad)"),
        series,
    }
}

pub(super) fn chart_of_leaks(leaks: &[Leak]) -> Chart {
    let mut series = Vec::new();
    for direction in [0.0, FRAC_PI_4, FRAC_PI_2] {
        let of: Vec<&Leak> = leaks
            .iter()
            .filter(|l| l.direction_rad == direction)
            .collect();
        let degrees = direction.to_degrees();
        for (name, reading) in [
            ("ordinary", (|l| l.ordinary.abs()) as fn(&Leak) -> f64),
            ("alternative", |l| l.alternative.abs()),
        ] {
            let points: Vec<[f64; 2]> = of.iter().map(|l| [l.theta, reading(l)]).collect();
            if points.iter().any(|p| p[1] > 1e-9) {
                let name = format!("{name}, bent {degrees:.0}° from v");
                series.push(Series::new(name, points, Mark::LineAndPoints));
            }
        }
    }
    Chart {
        title: "Bending in the twist angle".to_owned(),
        x: Axis::log("θ (rad)"),
        y: Axis::log("|Ω| (rad)"),
        series,
    }
}
