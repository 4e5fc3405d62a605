//! The settings that are compared.

use taut_integrator::{GeometricStiffness, Guard, Scheme, StepOptions};

/// Options of the step under a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub name: String,
    pub options: StepOptions,
}

fn setting(name: &str, options: StepOptions) -> Setting {
    Setting {
        name: name.to_owned(),
        options,
    }
}

/// The scheme's own geometric stiffness, guarded.
fn scheme(scheme: Scheme) -> StepOptions {
    StepOptions {
        scheme,
        stiffness: GeometricStiffness::inertia(scheme.default_alpha()),
        ..StepOptions::default()
    }
}

fn third(a: f64, gamma: f64) -> StepOptions {
    scheme(Scheme::ThirdDifference { a, gamma })
}

fn unguarded(options: StepOptions) -> StepOptions {
    StepOptions {
        guard: None,
        ..options
    }
}

fn guard(change: impl FnOnce(&mut Guard)) -> StepOptions {
    let mut guard = Guard::default();
    change(&mut guard);
    StepOptions {
        guard: Some(guard),
        ..StepOptions::default()
    }
}

impl Setting {
    /// The default: guarded, third differences.
    #[must_use]
    pub fn default_step() -> Self {
        setting("default", StepOptions::default())
    }

    /// The default without its guard, and the paper's step.
    #[must_use]
    pub fn few() -> Vec<Self> {
        vec![
            Self::default_step(),
            setting("default, no guard", unguarded(StepOptions::default())),
            setting("paper", StepOptions::paper()),
        ]
    }

    /// The default, other schemes with and without guard, other guards.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let euler = Scheme::LinearlyImplicit;
        let mut settings = Self::few();
        settings.extend([
            setting("weights 0.75, -0.2", third(0.75, -0.2)),
            setting("weights 0.3, -0.02", third(0.3, -0.02)),
            setting("spook", scheme(Scheme::Spook)),
            setting("spook, no guard", unguarded(scheme(Scheme::Spook))),
            setting("implicit", scheme(euler)),
            setting("implicit, no guard", unguarded(scheme(euler))),
            setting("guard tolerance 0.001", guard(|g| g.tolerance = 0.001)),
            setting("guard tolerance 0.02", guard(|g| g.tolerance = 0.02)),
            setting("guard substeps 4", guard(|g| g.substeps = 4)),
            setting("guard halvings 2", guard(|g| g.halvings = 2)),
            setting("guard hold 0", guard(|g| g.hold = 0)),
            setting("guard hold 8", guard(|g| g.hold = 8)),
        ]);
        settings
    }
}
