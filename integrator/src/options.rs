//! Options of a run: scheme, geometric stiffness, guard, time step, form and order of the linear
//! system, backend.

use crate::{Elimination, Sleep, StepError};
use std::fmt;
use std::str::FromStr;
use taut_solver::Backend;
use taut_solver::coulomb::ConeMethod;

/// Mean of past and future states at which the constraint forces are evaluated. It sets the order
/// of the step and its damping.
///
/// With the rates r = J v + ∂φ/∂t of the rows, all schemes are one formula,
///
/// ```text
/// ε λ = −(φ_n + Δt (p r_{n+1} − q r_n + s r_{n−1}) + τ r_{n+1})
/// ```
///
/// with the [`weights`](Self::weights) p, q, s. The velocity v_n belongs to the time t_n − Δt/2 in the two second-order
/// schemes. Rows with bounds, such as ropes that go slack, mix in the weights of the first scheme while they close.
///
/// All rows take one scheme. With the first one for the rows that measure angles, beside [`Spook`](Self::Spook), a load
/// moved aside by 0.5 m was off by 0.0402 mm for 0.0406 mm at mass ratio 10² (24 segments, τ = Δt/2, α = ½), and by the
/// same five digits at 10⁴ and 10⁶.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Scheme {
    /// (p, q, s) = (1, 0, 0): symplectic Euler with implicit constraint forces, \[SL (8)–(11)]. First order; damps each
    /// deformation mode ω by (1 + ω²Δt²)^(−1/2) a step.
    LinearlyImplicit,
    /// (¼, ¼, 0): the trapezoidal member of SPOOK (Lacoursière 2007). Second order; damps by τ only, and at ε = 0 needs
    /// τ of 2 to 3 Δt.
    Spook,
    /// (a + γ, a + 2γ, γ): φ is taken at φ_n + a δ²φ + γ δ³φ, with backward differences that end at t_{n+1}. Second
    /// order; damps the highest frequencies only. Stable for a > ¼, γ ≤ 0 and 1 − 4a − 8γ ≤ 0.
    ThirdDifference {
        /// Weight of the second difference.
        a: f64,
        /// Weight of the third difference.
        gamma: f64,
    },
}

/// Most weight of a difference, or of the geometric stiffness. Weights of some 10 already hold back all motion of a stiff
/// row; far larger ones overflow.
const MOST_WEIGHT: f64 = 100.0;

/// Weights of the rates with which a row is taken at φ_n + Δt (p r_{n+1} − q r_n + s r_{n−1}), without unit: see [`Scheme`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Weights {
    /// p, of the rate after the step.
    pub next: f64,
    /// q, of the rate before it.
    pub now: f64,
    /// s, of the rate a step earlier.
    pub before: f64,
}

impl Weights {
    /// Weight of the change of the rate in the step before, over that in this step.
    pub(crate) fn history(self) -> f64 {
        self.before / self.next
    }

    /// Excess resistance of a row to motion that alternates from step to step, over that of its own
    /// stiffness: for x_n = (−1)ⁿ, φ_n + Δt (p r_{n+1} − q r_n + s r_{n−1}) is −(2 (p + q + s) − 1)
    /// x_n.
    fn excess(self) -> f64 {
        2.0 * (self.next + self.now + self.before) - 1.0
    }
}

/// See [`Weights::excess`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Excess {
    /// Excess of angular rows.
    pub(crate) bends: f64,
    /// Excess of the geometric stiffness.
    pub(crate) tension: f64,
}

impl Excess {
    /// Excess of the weights of [`StepOptions::row_weights`].
    pub(crate) fn of(weights: &[Weights; 2]) -> Self {
        let [bends, tension] = weights.map(|w| w.excess().max(0.0));
        Self { bends, tension }
    }
}

impl Scheme {
    /// The third-difference scheme with its default weights: spectral radius 0.64 at infinite frequency.
    pub const THIRD_DIFFERENCE: Self = Self::ThirdDifference {
        a: 0.5,
        gamma: -0.1,
    };

    /// One of each kind, with default weights.
    pub const KINDS: [Self; 3] = [Self::LinearlyImplicit, Self::Spook, Self::THIRD_DIFFERENCE];

    /// Weights (p, q, s) of its rows.
    #[must_use]
    pub fn weights(self) -> Weights {
        let (next, now, before) = match self {
            Self::LinearlyImplicit => (1.0, 0.0, 0.0),
            Self::Spook => (0.25, 0.25, 0.0),
            Self::ThirdDifference { a, gamma } => (a + gamma, a + 2.0 * gamma, gamma),
        };
        Weights { next, now, before }
    }

    /// Weights of the geometric stiffness as inertia with α: α δ²x with the scheme's own filter, (α, α (1 + s/p), α s/p).
    #[must_use]
    pub fn tension_weights(self, alpha: f64) -> Weights {
        let history = self.weights().history();
        Weights {
            next: alpha,
            now: alpha * (1.0 + history),
            before: alpha * history,
        }
    }

    /// True if the velocities belong to half a step before the positions.
    #[must_use]
    pub fn is_staggered(self) -> bool {
        !matches!(self, Self::LinearlyImplicit)
    }

    /// The weight α that the geometric stiffness has by default: that of the rows in [`Scheme::ThirdDifference`], ½
    /// elsewhere, since the tension that it is made of is one step old and ¼ is the limit.
    #[must_use]
    pub fn default_alpha(self) -> f64 {
        match self {
            Self::ThirdDifference { a, gamma } => a + gamma,
            _ => 0.5,
        }
    }

    fn validate(self) -> Result<(), StepError> {
        let Self::ThirdDifference { a, gamma } = self else {
            return Ok(());
        };
        let range = a > 0.25 && a <= MOST_WEIGHT;
        check("a", a, range, "above 1/4 and at most 100")?;
        // The Nyquist root of a mode with frequency → ∞ must not grow: a + 2γ ≥ ¼.
        let stable = gamma <= 0.0 && 1.0 - 4.0 * a - 8.0 * gamma <= 0.0;
        check(
            "gamma",
            gamma,
            stable,
            "between (1 − 4 a)/8 and 0: the step is unstable elsewhere",
        )
    }
}

impl Default for Scheme {
    fn default() -> Self {
        Self::THIRD_DIFFERENCE
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LinearlyImplicit => f.write_str("linearly-implicit"),
            Self::Spook => f.write_str("spook"),
            &Self::THIRD_DIFFERENCE => f.write_str("third-difference"),
            Self::ThirdDifference { a, gamma } => {
                write!(f, "third-difference:a={a}:gamma={gamma}")
            }
        }
    }
}

/// How the geometric stiffness K acts: the change with rotation of the stretch rows' lever arms and of the twist moments'
/// axes, which the step would else treat explicitly (\[T], \[A] of the crate's documentation). Rotational inertia becomes I + α Δt² K.
///
/// Another form, on the angular velocity relative to that of the chord from end to end of a cable, is not offered: with α = ½ a load
/// moved aside by 0.5 m was off by 0.14 mm for 0.04 mm at mass ratio 10² (24 segments), and as far as here at 10⁴ and 10⁶.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum GeometricStiffness {
    /// No such term: the paper. Δt² times tension over a segment's mass × length is then limited.
    Off,
    /// On the change of the angular velocity, with the scheme's own filter: damps nothing but what the scheme damps.
    Inertia {
        /// Weight α > 0; ¼ is the limit of stability.
        alpha: f64,
    },
}

impl GeometricStiffness {
    /// α; 0 for [`GeometricStiffness::Off`].
    #[must_use]
    pub fn alpha(self) -> f64 {
        match self {
            Self::Off => 0.0,
            Self::Inertia { alpha } => alpha,
        }
    }

    /// The inertia form with weight `alpha`, off for 0.
    #[must_use]
    pub fn inertia(alpha: f64) -> Self {
        if alpha == 0.0 {
            Self::Off
        } else {
            Self::Inertia { alpha }
        }
    }

    fn validate(self) -> Result<(), StepError> {
        let (alpha, off) = (self.alpha(), self == Self::Off);
        let sound = off || (alpha > 0.0 && alpha <= MOST_WEIGHT);
        check("alpha", alpha, sound, "above 0 and at most 100, or off")
    }
}

impl fmt::Display for GeometricStiffness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Off => f.write_str("off"),
            Self::Inertia { alpha } => write!(f, "{alpha}"),
        }
    }
}

/// Watches over the linearisation: where a step's gaps φ(q⁺) disagree with what the linear step predicted, it is taken
/// back and redone in parts, or in implicit sub-steps with Newton passes.
///
/// A disagreement δ is compared with the longer lever arm r of its constraint: δ/r ≈ θ²/2 for a segment that turns by θ.
///
/// In the shortest sub-steps a Newton step is halved, at most four times, until the incremental potential is less than
/// before it. Those that do not converge are counted in
/// [`StepReport::unconverged_substeps`](crate::StepReport::unconverged_substeps); where they gain energy the velocities of
/// all bodies shrink. With these defaults a step solves 103 linear systems at most, two more at the start, and more where
/// rows reach their bounds.
///
/// Where turns at the beginning of the step explain the disagreement, in scenes without cables, limits of force and shapes that
/// touch, the step is made of 2 to 32 steps of the scheme, which resolve them, and not of implicit ones, which brake them.
///
/// A step in which a stiff rope is caught or thrown slack, its drive jumps, or what hangs on elastic joints bounces, is taken
/// back, too, and made of 32 to 256 steps of the scheme ([`StepReport::divided`](crate::StepReport::divided)): with 32 about 34
/// times the solves of one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Guard {
    /// Largest disagreement over lever arm that a step may have, > 0, without unit.
    #[cfg_attr(feature = "serde", serde(with = "taut_model::unlimited"))]
    pub tolerance: f64,
    /// Steps (sub-steps of the options) after the redone one that go the same way at once, so that the shock's ringing is
    /// damped too.
    pub hold: usize,
    /// Sub-steps that the redone step starts with, ≥ 1; each is halved where its Newton passes do not converge.
    pub substeps: usize,
    /// Newton passes (solves) of a sub-step at most, ≥ 1.
    pub passes: usize,
    /// Halvings of a sub-step at most.
    pub halvings: u32,
}

impl Default for Guard {
    fn default() -> Self {
        Self {
            tolerance: 0.005,
            hold: 1,
            substeps: 1,
            passes: 6,
            halvings: 3,
        }
    }
}

impl Guard {
    fn validate(self) -> Result<(), StepError> {
        let Self {
            tolerance,
            substeps,
            passes,
            halvings,
            ..
        } = self;
        check(
            "guard.tolerance",
            tolerance,
            tolerance > 0.0,
            "a number > 0",
        )?;
        let range = |field, value: usize, most: usize| {
            let allowed = "between 1 and 1000";
            check(field, value as f64, (1..=most).contains(&value), allowed)
        };
        range("guard.substeps", substeps, 1000)?;
        range("guard.passes", passes, 1000)?;
        check(
            "guard.halvings",
            f64::from(halvings),
            halvings <= 20,
            "at most 20",
        )
    }
}

/// Form of the linear system for the multipliers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Form {
    /// The Schur complement S = J M⁻¹ Jᵀ + Σ, symmetric positive definite, [SL (11)]. Forming it loses about
    /// roundoff × mass ratio of relative accuracy; one refinement from the system's data brings it back.
    #[default]
    Schur,
    /// The symmetric KKT matrix [M Jᵀ; J −Σ], quasi-definite, [SL (10)].
    Kkt,
}

impl fmt::Display for Form {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Schur => "schur",
            Self::Kkt => "kkt",
        })
    }
}

/// An unknown name, or a known one with options that it does not have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownName {
    /// Kind of name: `"scheme"`, `"form"`, `"stiffness"`, `"elimination"`.
    pub what: &'static str,
    /// The name given.
    pub name: String,
    /// The names that there are.
    pub known: String,
}

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "unknown {} `{}`: choose one of {}",
            self.what, self.name, self.known
        )
    }
}

impl std::error::Error for UnknownName {}

impl FromStr for Scheme {
    type Err = UnknownName;

    /// `linearly-implicit`, `spook`, `third-difference[:a=A][:gamma=G]`.
    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let unknown = || UnknownName {
            what: "scheme",
            name: text.to_owned(),
            known: "linearly-implicit, spook, third-difference[:a=A][:gamma=G]".to_owned(),
        };
        let (name, options) = text.split_once(':').unwrap_or((text, ""));
        let options = options.split(':').filter(|o| !o.is_empty());
        let mut scheme = Self::KINDS
            .into_iter()
            .find(|s| s.to_string() == name)
            .ok_or_else(unknown)?;
        for option in options {
            let (key, value) = option.split_once('=').ok_or_else(unknown)?;
            let value: f64 = value.parse().map_err(|_| unknown())?;
            match (&mut scheme, key) {
                (Self::ThirdDifference { a, .. }, "a") => *a = value,
                (Self::ThirdDifference { gamma, .. }, "gamma") => *gamma = value,
                _ => return Err(unknown()),
            }
        }
        Ok(scheme)
    }
}

impl FromStr for GeometricStiffness {
    type Err = UnknownName;

    /// `off` or a weight α.
    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let unknown = |_| UnknownName {
            what: "stiffness",
            name: text.to_owned(),
            known: "off, a weight such as 0.4".to_owned(),
        };
        if text == "off" {
            return Ok(Self::Off);
        }
        Ok(Self::inertia(text.parse().map_err(unknown)?))
    }
}

impl FromStr for Form {
    type Err = UnknownName;
    fn from_str(name: &str) -> Result<Self, UnknownName> {
        [Self::Schur, Self::Kkt]
            .into_iter()
            .find(|f| f.to_string() == name)
            .ok_or_else(|| UnknownName {
                what: "form",
                name: name.to_owned(),
                known: "schur, kkt".to_owned(),
            })
    }
}

/// Options of a [`crate::Stepper`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct StepOptions {
    /// Time step Δt > 0 \[s].
    pub dt: f64,
    /// Equal sub-steps that each step is made of, ≥ 1: each is a whole step of the scheme with Δt/`substeps`.
    pub substeps: usize,
    /// The scheme.
    pub scheme: Scheme,
    /// The geometric stiffness.
    pub stiffness: GeometricStiffness,
    /// Repeats steps whose linearisation fails; `None` accepts every step.
    pub guard: Option<Guard>,
    /// The linear system.
    pub form: Form,
    /// The order of the constraints in it.
    pub elimination: Elimination,
    /// The solver.
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_forms::text"))]
    pub backend: Backend,
    /// Refinement sweeps after the solve: from the system's data M, J, Σ for [`Form::Schur`], with b − A x for [`Form::Kkt`].
    pub refinements: usize,
    /// Starts iterative backends from the last step's multipliers; else from zero.
    pub warm_start: bool,
    /// Method for the impulses of contacts.
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_forms::text", default))]
    pub contacts: ConeMethod,
    /// Largest energy from nowhere, relative to the motion's own
    /// ([`EnergyBalance::excess`](crate::EnergyBalance)), > 0: more is [`StepError::EnergyGain`].
    /// The balance costs some passes over rows and bodies a step. `None` disables it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub energy_tolerance: Option<f64>,
    /// Steps k ≥ 2 that one step of the coarse run covers, which estimates the error of the load
    /// ([`StepReport::error`](crate::StepReport::error)). It costs about 1/k of the time of a step.
    /// `None` disables it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub estimate: Option<usize>,
    /// Sleep of a scene at rest, whose steps then cost no solve; `None` keeps it awake.
    #[cfg_attr(feature = "serde", serde(default))]
    pub sleep: Option<Sleep>,
}

impl Default for StepOptions {
    /// 1/60 s, the third-difference scheme with geometric stiffness and guard, the Schur complement, the first backend
    /// compiled in, one refinement.
    fn default() -> Self {
        let backend = Backend::preferred().unwrap_or(Backend::Banded);
        let scheme = Scheme::default();
        Self {
            dt: 1.0 / 60.0,
            substeps: 1,
            scheme,
            stiffness: GeometricStiffness::inertia(scheme.default_alpha()),
            guard: Some(Guard::default()),
            form: Form::default(),
            elimination: Elimination::default(),
            refinements: usize::from(!backend.is_iterative()),
            backend,
            warm_start: true,
            contacts: ConeMethod::default(),
            energy_tolerance: None,
            estimate: None,
            sleep: None,
        }
    }
}

impl StepOptions {
    /// The paper's step, \[SL (8)–(11)]: linearly implicit, without geometric stiffness, without guard.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            scheme: Scheme::LinearlyImplicit,
            stiffness: GeometricStiffness::Off,
            guard: None,
            ..Self::default()
        }
    }

    /// Weights of the scheme's rows, and of transverse rows: these are the geometric stiffness of links, and take its weight α
    /// with the scheme's filter.
    pub(crate) fn row_weights(&self, stiffness: GeometricStiffness) -> [Weights; 2] {
        let alpha = stiffness.alpha();
        let transverse = if alpha > 0.0 {
            self.scheme.tension_weights(alpha)
        } else {
            // Soft rows do nothing with any weight but 0.
            Scheme::LinearlyImplicit.weights()
        };
        [self.scheme.weights(), transverse]
    }

    /// Checks what the type system does not.
    pub(crate) fn validate(&self) -> Result<(), StepError> {
        let positive = self.dt > 0.0 && self.dt.is_finite();
        check(
            "dt",
            self.dt,
            positive,
            "a positive finite number of seconds",
        )?;
        let count = self.substeps as f64;
        let some = (1..=MAX_SUBSTEPS).contains(&self.substeps);
        check("substeps", count, some, "between 1 and a million")?;
        self.scheme.validate()?;
        self.stiffness.validate()?;
        self.guard.map_or(Ok(()), Guard::validate)?;
        if let ConeMethod::GaussSeidel { sweeps, .. } = self.contacts {
            let some = sweeps <= MAX_SWEEPS;
            check("contacts.sweeps", sweeps as f64, some, "at most 100000")?;
        }
        self.sleep.map_or(Ok(()), Sleep::validate)?;
        let tolerance = self.energy_tolerance.unwrap_or(1.0);
        let sound = tolerance > 0.0 && tolerance.is_finite();
        check("energy_tolerance", tolerance, sound, "a finite number > 0")?;
        let every = self.estimate.unwrap_or(2);
        let some = (2..=1000).contains(&every);
        check("estimate", every as f64, some, "between 2 and 1000 steps")?;
        if self.form == Form::Kkt && !self.backend.accepts_indefinite() {
            return Err(self.not_accepted());
        }
        Ok(())
    }

    /// The error of a backend that does not take the form.
    pub(crate) fn not_accepted(&self) -> StepError {
        StepError::FormNotAccepted {
            backend: self.backend.to_string(),
            form: self.form,
        }
    }
}

const MAX_SUBSTEPS: usize = 1_000_000;

/// Most sweeps over contacts that a step may ask for.
const MAX_SWEEPS: usize = 100_000;

pub(crate) fn check(
    field: &'static str,
    value: f64,
    sound: bool,
    allowed: &'static str,
) -> Result<(), StepError> {
    if sound {
        return Ok(());
    }
    Err(StepError::InvalidOption {
        field,
        value,
        allowed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::With;

    #[test]
    fn texts_round_trip() {
        let other = Scheme::ThirdDifference {
            a: 0.75,
            gamma: -0.2,
        };
        for scheme in Scheme::KINDS.into_iter().chain([other]) {
            assert_eq!(scheme.to_string().parse(), Ok(scheme));
        }
        for stiffness in [
            GeometricStiffness::Off,
            GeometricStiffness::Inertia { alpha: 0.4 },
        ] {
            assert_eq!(stiffness.to_string().parse(), Ok(stiffness));
        }
        for bad in [
            "spook:a=1",
            "third-difference:a",
            "third-difference:b=1",
            "euler",
        ] {
            assert!(bad.parse::<Scheme>().is_err(), "{bad}");
        }
        let error = "relative:0.5".parse::<GeometricStiffness>().unwrap_err();
        assert_eq!(error.known, "off, a weight such as 0.4");
        for elimination in Elimination::ALL {
            assert_eq!(elimination.to_string().parse(), Ok(elimination));
        }
        let error = "band".parse::<Elimination>().unwrap_err().to_string();
        let expected = "unknown elimination `band`: choose one of auto, scene, minimum-degree";
        assert_eq!(error, expected);
    }

    #[test]
    fn options_out_of_range_are_named() {
        let field = |options: &StepOptions| match options.validate() {
            Err(StepError::InvalidOption { field, .. }) => field,
            other => panic!("{other:?}"),
        };
        let d = StepOptions::default;
        for dt in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let options = StepOptions { dt, ..d() };
            assert_eq!(field(&options), "dt");
            let words = options.validate().unwrap_err().to_string();
            assert!(words.contains("positive finite number of seconds"));
        }
        for alpha in [-0.1, f64::NAN, f64::INFINITY] {
            let stiffness = GeometricStiffness::Inertia { alpha };
            assert_eq!(field(&StepOptions { stiffness, ..d() }), "alpha");
        }
        let third = |a, gamma| d().with(|o| o.scheme = Scheme::ThirdDifference { a, gamma });
        assert_eq!(field(&third(0.25, 0.0)), "a");
        assert_eq!(field(&third(f64::NAN, 0.0)), "a");
        assert_eq!(field(&third(0.5, 0.1)), "gamma");
        assert_eq!(field(&third(0.5, -0.2)), "gamma");
        assert_eq!(field(&third(0.5, f64::NAN)), "gamma");
        assert_eq!(field(&StepOptions { substeps: 0, ..d() }), "substeps");
        let contacts = ConeMethod::GaussSeidel {
            sweeps: usize::MAX,
            tolerance: 0.0,
        };
        assert_eq!(field(&StepOptions { contacts, ..d() }), "contacts.sweeps");
        let guard = |guard| d().with(|o| o.guard = Some(guard));
        let g = Guard::default;
        let found = field(&guard(g().with(|g| g.tolerance = f64::NAN)));
        assert_eq!(found, "guard.tolerance");
        assert_eq!(field(&guard(Guard { passes: 0, ..g() })), "guard.passes");
        assert!(d().validate().is_ok() && StepOptions::paper().validate().is_ok());
    }

    /// Roots of (z³ − 2z² + z) + Ω²[z² + a(z³ − 2z² + z) + γ(z − 1)³]: none outside the unit circle for any Ω where the
    /// weights are accepted, and some just beyond the limits.
    #[test]
    fn accepted_weights_are_stable_at_every_frequency() {
        let growth = |a: f64, gamma: f64| {
            let mut worst = 0.0_f64;
            for k in -40..=40 {
                let w = 10.0_f64.powf(f64::from(k) / 8.0);
                let c3 = 1.0 + w * (a + gamma);
                let c2 = -2.0 + w * (1.0 - 2.0 * a - 3.0 * gamma);
                let c1 = 1.0 + w * (a + 3.0 * gamma);
                let c0 = -w * gamma;
                let companion = nalgebra::Matrix3::new(
                    -c2 / c3,
                    -c1 / c3,
                    -c0 / c3,
                    1.0,
                    0.0,
                    0.0,
                    0.0,
                    1.0,
                    0.0,
                );
                let radius = companion.complex_eigenvalues();
                let radius = radius.map(nalgebra::Complex::norm).max();
                worst = worst.max(radius);
            }
            worst
        };
        for (a, gamma) in [
            (0.5, -0.1),
            (0.75, -0.2),
            (0.3, -0.02),
            (0.6, -0.15),
            (1.0, -0.3),
        ] {
            let scheme = Scheme::ThirdDifference { a, gamma };
            assert!(scheme.validate().is_ok(), "{scheme}");
            assert!(growth(a, gamma) < 1.0 + 1e-9, "{scheme}");
        }
        assert!(growth(0.5, -0.14) > 1.0 + 1e-3);
        assert!(growth(0.5, 0.05) > 1.0 + 1e-3);
    }
}
