//! The summary of a run, for people, and the lines of its steps, for spreadsheets.

use super::{Summary, load_error};
use std::fmt::Write;
use std::io;
use taut_measure::files;
use taut_measure::openings::Opening;
use taut_measure::trajectory::Sample;

/// How the run ended, in a line.
fn verdict(s: &Summary) -> String {
    match &s.failure {
        None if let Some(why) = s.stopped => format!(
            "none: stopped by {why} at t = {:.3} s",
            s.load_at_end.unwrap_or_default().0
        ),
        None if s.unconverged_steps > 0 => {
            let iterates = s
                .backend
                .parse()
                .is_ok_and(|b: taut_solver::Backend| b.is_iterative());
            let why = if iterates {
                "ran out of iterations: raise `iterations=`"
            } else {
                "have forces without a sure digit: their matrices are singular to rounding"
            };
            format!("stable, but {} steps {why}", s.unconverged_steps)
        }
        None if s.undecided_steps > 0 => format!(
            "stable, but {} steps left undecided which cables are slack, which motors at their limits, or which contacts \
             carry what, or had shapes sunk into each other",
            s.undecided_steps
        ),
        None if let Some(opening) = &s.unexplained_gap => format!(
            "stable, but `{}` was open by {:.1e} m more than its force explains at t = {:.3} s: smaller steps lessen it",
            opening.joint, opening.gap_m, opening.time
        ),
        None if s.planar => "stable, but exactly planar: `--set seed=1` disturbs it".to_owned(),
        None => "stable".to_owned(),
        Some(failure) => failure.to_string(),
    }
}

/// Line on contacts; `None` without any.
fn contacts(s: &Summary) -> Option<(&'static str, String)> {
    let c = s.contacts?;
    let split = match c.most_groups {
        0 => String::new(),
        groups => format!("; split into up to {groups} groups"),
    };
    let text = format!(
        "{} at the end, {} of them sliding; at most {}, {:.1e} m deep, complementarity {:.1e} ({:.1e} mm, {:.1e} N){split}",
        c.touching,
        c.sliding,
        c.most,
        c.deepest_m,
        c.complementarity,
        1e3 * c.residual_gap_m,
        c.residual_force_n
    );
    Some(("contacts", text))
}

/// How much of it the scene slept through, for people.
fn asleep(s: &Summary) -> Option<(&'static str, String)> {
    let asleep = s.steps_asleep?;
    Some(("asleep", format!("{asleep} of {} steps", s.steps)))
}

/// Line on energy from nowhere and on the sources of the rest.
fn energy_excess(s: &Summary) -> String {
    let Some(excess) = s.max_energy_excess else {
        return "not asked for".to_owned();
    };
    let Some(balance) = &s.balance else {
        return format!(
            "at most {excess:.1e} of the motion's own; the scene changed in the last step"
        );
    };
    let recovery = if balance.recovery > 1e-6 * balance.scale {
        format!(
            ", of contacts that undo overlaps {:.3e} J",
            balance.recovery
        )
    } else {
        String::new()
    };
    // Each change of the scene begins a new balance.
    let changes = s.resolved.map_or(0, |r| r.splits + r.merges) + s.events.len();
    let since = if changes > 0 {
        ", since the scene last changed"
    } else {
        ""
    };
    format!(
        "at most {excess:.1e} of the motion's own; work of drives {:.3e} J{recovery}{since}",
        balance.work
    )
}

/// The solver, and which it was where it was chosen.
fn solver(s: &Summary) -> String {
    match &s.chosen {
        Some(chosen) => format!("{}: {}", s.backend, chosen.backend),
        None => s.backend.clone(),
    }
}

/// Why it was chosen.
fn chosen(s: &Summary) -> Option<(&'static str, String)> {
    let chosen = s.chosen.as_ref()?;
    Some(("chosen", format!("for {}", chosen.reason)))
}

/// Line on the rules of cables; `None` without ruled segments.
fn resolved(s: &Summary) -> Option<(&'static str, String)> {
    let of = s.resolved.filter(|of| of.segments > 0)?;
    let energy = of.jump.kinetic + of.jump.gravity + of.elastic;
    let text = format!(
        "{} merges, {} splits; {} segments at the end; {energy:+.1e} J of energy by changes",
        of.merges, of.splits, of.segments
    );
    Some(("resolution", text))
}

/// Times of a step and of its phases, without the first step, which may allocate.
fn times(s: &Summary) -> [String; 2] {
    let ns = taut_output::table::nanoseconds;
    if s.steps < 2 {
        return [(); 2].map(|()| {
            "not measured: the first step, which may allocate, does not count".to_owned()
        });
    }
    let phases = s.phases_ns.iter();
    let phases: Vec<_> = phases
        .map(|(name, t)| format!("{name} {}", ns(*t)))
        .collect();
    let step = format!(
        "median {}, min {}, max {}",
        ns(s.step_ns.median),
        ns(s.step_ns.min),
        ns(s.step_ns.max)
    );
    [step, phases.join(", ")]
}

/// The summary for people.
pub fn text(s: &Summary) -> String {
    let mut out = String::new();
    let (_, last) = s.load_at_end.unwrap_or_default();
    let [step_time, phases] = times(s);
    let tension = match (s.load_tension, s.max_load_tension) {
        (Some(end), Some(most)) => {
            format!("{end:.4e} N at the end, at most {most:.4e} N, in what holds the load tightest")
        }
        _ => "none: no joint, link or cable holds it".to_owned(),
    };
    let gap = match &s.largest_gap {
        Some(Opening { joint, time, .. }) => format!(
            "{:.3e} m, of `{joint}` at t = {time:.3} s: open or stretched",
            s.max_violation_m
        ),
        None => format!("{:.3e} m", s.max_violation_m),
    };
    let rows = [
        ("scene", s.scene.clone()),
        (
            "solver",
            format!(
                "{} ({} form, {} order, {} refinement{})",
                solver(s),
                s.form,
                s.elimination,
                s.refinements,
                if s.refinements == 1 { "" } else { "s" }
            ),
        ),
        (
            "steps",
            format!(
                "{} of {:.6} s{}, {}, geometric stiffness {}",
                s.steps,
                s.dt,
                match s.substeps {
                    1 => String::new(),
                    count => format!(" in {count} sub-steps"),
                },
                s.scheme,
                s.stiffness
            ),
        ),
        (
            "guard",
            match s.guard {
                None => "off".to_owned(),
                Some(_) => format!(
                    "{} steps redone, {} implicit sub-steps, at most {} solves a step",
                    s.redone_steps, s.implicit_substeps, s.most_solves
                ),
            },
        ),
        ("verdict", verdict(s)),
        (
            "load at the end",
            format!("({:.6}, {:.6}, {:.6}) m", last[0], last[1], last[2]),
        ),
        (
            "energy",
            format!(
                "{:.6e} J → {:.6e} J",
                s.energy.start.total(),
                s.energy.end.total()
            ),
        ),
        ("energy excess", energy_excess(s)),
        ("load tension", tension),
        ("largest gap", gap),
        ("step time", step_time),
        ("phases", phases),
    ];
    let paths = s.paths.iter();
    let paths = paths.map(|(cable, path)| {
        let text = format!("`{cable}` {path:.6} m at the start, with what lies on sheaves");
        ("path", text)
    });
    let notes = s.notes.iter().map(|note| ("note", note.clone()));
    let events = s.events.iter().zip(&s.event_forces);
    let events = events.map(|((time, name), force)| {
        let force = force.map_or_else(String::new, |f| format!(", at {f:.4e} N"));
        ("event", format!("t = {time:.4} s: {name}{force}"))
    });
    let of_some = [
        chosen(s),
        load_error::summary(s),
        asleep(s),
        resolved(s),
        contacts(s),
    ];
    for (name, value) in rows
        .into_iter()
        .chain(of_some.into_iter().flatten())
        .chain(paths)
        .chain(events)
        .chain(notes)
    {
        let _ = writeln!(out, "{name:>16}  {}", files::line(&value));
    }
    out
}

/// Heading of the lines of [`csv_line`].
pub const CSV_HEADING: &str = "time_s,load_x_m,load_y_m,load_z_m,kinetic_J,gravity_J,elastic_J,max_gap_m,iterations,step_ns,load_tension_N\n";

/// The line of a step, for spreadsheets and plots.
pub fn csv_line(out: &mut dyn io::Write, s: &Sample) -> io::Result<()> {
    let (x, e) = (s.load, s.energy);
    let ns = s.phases.total().as_nanos();
    write!(
        out,
        "{},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{},{ns},",
        s.time, x.x, x.y, x.z, e.kinetic, e.gravity, e.elastic, s.violation, s.iterations
    )?;
    match s.load_tension {
        Some(tension) => writeln!(out, "{tension:e}"),
        None => writeln!(out),
    }
}
