//! Changes of a scene and its step that a ledger tries.

use super::Setup;
use std::fmt;
use taut_integrator::{Form, GeometricStiffness, Scheme, StepOptions};
use taut_measure::Choice;
use taut_measure::lean::{Leaner, Part};
use taut_model::{SceneError, SceneSource};

#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    Without(Part),
    /// So many times as many segments.
    Segments(f64),
    /// Segments that merge and split by rule.
    Ruled,
    NoStiffness,
    NoGuard,
    NoRefinement,
    Scheme(Scheme),
    /// So many times as many sub-steps.
    Substeps(f64),
    /// So many times as long a step.
    Step(usize),
    Solver(Choice),
}

pub(super) fn all(whole: &Setup) -> Vec<Change> {
    let mut all: Vec<Change> = Part::ALL.map(Change::Without).into();
    all.extend([0.5, 2.0].map(Change::Segments));
    all.push(Change::Ruled);
    all.extend([Change::NoStiffness, Change::NoGuard, Change::NoRefinement]);
    all.extend(Scheme::KINDS.map(Change::Scheme));
    all.extend([0.5, 2.0].map(Change::Substeps));
    all.push(Change::Step(2));
    let compiled = Choice::all().into_iter().filter(|c| c.check().is_ok());
    // The dense reference is too slow to run with.
    let fast = compiled.filter(|c| c.backend.name() != "dense");
    let own = Choice::of(&whole.options);
    all.extend(fast.filter(|choice| *choice != own).map(Change::Solver));
    all
}

impl Change {
    /// The change in words, and the option of `taut run` or the key of a scene that makes it.
    pub(super) fn described(&self, source: &SceneSource) -> (String, String) {
        let of_scene = |key: &str, value: &str| match (self, source) {
            (_, SceneSource::Explicit(text)) if !text.cable.is_empty() || key == "friction" => {
                format!("{key} = {value}")
            }
            (Self::Without(Part::Friction), SceneSource::Gantry(_)) => {
                format!("--set sheave_{key}={value}")
            }
            (Self::Without(Part::Friction), _) | (_, SceneSource::Hoist(_)) => {
                format!("--set {key}={value}")
            }
            _ => "--apply".into(),
        };
        let described = |what: &str, how: &str| (what.to_owned(), how.to_owned());
        match self {
            Self::Without(Part::Torsion) => described("no torsion", &of_scene("twist", "false")),
            Self::Without(Part::Bending) => described("no bending", &of_scene("bend", "false")),
            Self::Without(Part::Stretch) => described("no stretch: rigid", "--apply"),
            Self::Without(Part::Friction) => described("no friction", &of_scene("friction", "0")),
            Self::Without(Part::Contacts) => described("no contacts", "--apply"),
            Self::Without(_) => described("massless cables", "--apply"),
            Self::Segments(factor) => described(&format!("segments × {factor}"), "--apply"),
            Self::Ruled => described("segments by rule", "resolution = {}"),
            Self::NoStiffness => described("no geometric stiffness", "--stiffness off"),
            Self::NoGuard => described("no guard", "--guard off"),
            Self::NoRefinement => described("no refinement", "--refine 0"),
            Self::Scheme(scheme) => described(&scheme.to_string(), &format!("--scheme {scheme}")),
            Self::Substeps(factor) => described(&format!("sub-steps × {factor}"), "--substeps"),
            Self::Step(factor) => described(&format!("Δt × {factor}"), "--dt"),
            Self::Solver(choice) => described(&choice.family(), "--backend"),
        }
    }

    /// True if the motion exercised the omitted feature. The flags: shapes touched, cables gripped
    /// sheaves, the guard took a step back.
    pub(super) fn used(&self, [touched, gripped, guarded]: [bool; 3]) -> bool {
        match self {
            Self::Without(Part::Contacts) => touched,
            Self::Without(Part::Friction) => touched || gripped,
            Self::NoGuard => guarded,
            _ => true,
        }
    }

    /// True if the ledger lists the change but never takes it into the lean scene.
    pub(super) fn is_told_only(&self) -> bool {
        match self {
            Self::Solver(choice) => choice.backend.is_iterative(),
            Self::Step(_) => true,
            _ => false,
        }
    }

    /// True if the change would undo another one.
    pub(super) fn replaces(&self, other: &Self) -> bool {
        match self {
            Self::Solver(_) => matches!(other, Self::Solver(_)),
            Self::Scheme(_) => matches!(other, Self::Scheme(_)),
            _ => false,
        }
    }

    /// The changed setup; `None` where nothing is changed.
    pub(super) fn apply(&self, setup: &Setup) -> Result<Option<Setup>, SceneError> {
        let source = match self {
            Self::Without(part) => setup.source.without(*part)?,
            Self::Segments(factor) => setup.source.with_segments(*factor)?,
            Self::Ruled => setup.source.with_resolution()?,
            _ => {
                let options = self.options(&setup.options);
                let changed = options != setup.options;
                return Ok(changed.then(|| Setup {
                    source: setup.source.clone(),
                    options,
                }));
            }
        };
        Ok(source.map(|source| Setup {
            source,
            options: setup.options.clone(),
        }))
    }

    fn options(&self, of: &StepOptions) -> StepOptions {
        let mut options = of.clone();
        match self {
            Self::NoStiffness => options.stiffness = GeometricStiffness::Off,
            Self::NoGuard => options.guard = None,
            Self::NoRefinement => options.refinements = 0,
            Self::Scheme(scheme) => {
                if options.stiffness != GeometricStiffness::Off && *scheme != options.scheme {
                    options.stiffness = GeometricStiffness::inertia(scheme.default_alpha());
                }
                options.scheme = *scheme;
            }
            Self::Substeps(factor) => {
                // Half of one is one.
                let count = options.substeps as f64 * factor;
                options.substeps = (count.round() as usize).max(1);
            }
            Self::Step(factor) => options.dt *= *factor as f64,
            Self::Solver(choice) => {
                let own = choice.options(options.dt);
                options.form = choice.form;
                options.backend = own.backend;
                if of.refinements > 0 || of.backend.is_iterative() {
                    options.refinements = own.refinements;
                }
            }
            Self::Without(_) | Self::Segments(_) | Self::Ruled => {}
        }
        options
    }
}

/// The options of `taut run` that step a scene so, those that differ from the default.
pub fn flags(options: &StepOptions) -> String {
    let default = StepOptions::default();
    let choice = Choice::of(options);
    let StepOptions {
        refinements: refine,
        scheme,
        stiffness,
        substeps,
        elimination,
        contacts,
        dt,
        ..
    } = options;
    let is_own = options.backend == default.backend && options.form == Form::default();
    let usual = choice.options(*dt).refinements;
    let own = GeometricStiffness::inertia(scheme.default_alpha());
    let guard = options.guard.as_ref();
    let guard = guard.map_or("off".into(), |guard| guard.tolerance.to_string());
    // True for what is as usual, the option, its value.
    let flags: [(bool, &str, &dyn fmt::Display); 9] = [
        (is_own, "backend", &choice),
        (*refine == usual, "refine", refine),
        (*scheme == default.scheme, "scheme", scheme),
        (*stiffness == own, "stiffness", stiffness),
        (options.guard == default.guard, "guard", &guard),
        (*substeps == 1, "substeps", substeps),
        (
            *elimination == default.elimination,
            "elimination",
            elimination,
        ),
        (*contacts == default.contacts, "contacts", contacts),
        (*dt == default.dt, "dt", dt),
    ];
    let differing = flags.iter().filter(|(is_usual, ..)| !is_usual);
    let texts: Vec<String> = differing
        .map(|(_, flag, value)| format!("--{flag} {value}"))
        .collect();
    texts.join(" ")
}
