use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use taut_integrator::{GeometricStiffness, Scheme, StepOptions, Stepper};
use taut_model::{
    Body, Constraint, Cosserat, Frame, JointLaw, RowLaw, Scene, Spherical, hanging_axes,
};
use taut_tests::Worst;

const DT: f64 = 1.0 / 60.0;
const OTHER: Scheme = Scheme::ThirdDifference {
    a: 0.75,
    gamma: -0.2,
};
const SCHEMES: [Scheme; 4] = [
    Scheme::LinearlyImplicit,
    Scheme::Spook,
    Scheme::THIRD_DIFFERENCE,
    OTHER,
];

fn options(scheme: Scheme, dt: f64) -> StepOptions {
    StepOptions {
        dt,
        scheme,
        stiffness: GeometricStiffness::Off,
        guard: None,
        ..StepOptions::default()
    }
}

/// The weights (p, q, s) of φ̄ = φ_n + Δt (p r_{n+1} − q r_n + s r_{n−1}), from the schemes' definitions.
fn weights(scheme: Scheme) -> [f64; 3] {
    match scheme {
        Scheme::LinearlyImplicit => [1.0, 0.0, 0.0],
        Scheme::Spook => [0.25, 0.25, 0.0],
        // φ + a (φ_{n+1} − 2φ_n + φ_{n−1}) + γ (φ_{n+1} − 3φ_n + 3φ_{n−1} − φ_{n−2}).
        Scheme::ThirdDifference { a, gamma } => [a + gamma, a + 2.0 * gamma, gamma],
        other => panic!("{other} has no weights here"),
    }
}

/// A mode with one coordinate: a body on a spring, and what is measured of it.
struct Mode {
    name: &'static str,
    /// m or I.
    inertia: f64,
    scene: fn(RowLaw) -> Scene,
    coordinate: fn(&Scene) -> f64,
}

const MODES: [Mode; 2] = [
    Mode {
        name: "stretch",
        inertia: 2.0,
        scene: ball,
        coordinate: |scene| scene.bodies.position[0].x,
    },
    Mode {
        name: "twist",
        inertia: 0.008,
        scene: twisted,
        coordinate: |scene| scene.bodies.orientation[0].scaled_axis().z,
    },
];

/// A ball of 2 kg held at its centre, 1 cm off.
fn ball(law: RowLaw) -> Scene {
    let mut scene = Scene::new("ball");
    let place = Vector3::new(0.01, 0.0, 0.0);
    let body = scene.add_body("ball", Body::sphere(0.1, 2.0).at(place));
    let frames = [
        Frame::world(Vector3::zeros()),
        Frame::body(body, Vector3::zeros()),
    ];
    let spring = Spherical {
        frames,
        stretch: law,
    };
    scene.add_constraint("spring", Constraint::Spherical(spring), 0);
    scene
}

/// The same ball, I = 0.4·2 kg·0.01 m², held by a cable joint that is twisted by 0.3 rad.
fn twisted(law: RowLaw) -> Scene {
    let mut scene = Scene::new("twisted");
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.3));
    let body = scene.add_body("ball", Body::sphere(0.1, 2.0).turned(turn));
    let frames = [
        Frame::world(Vector3::zeros()).with_axes(hanging_axes()),
        Frame::body(body, Vector3::zeros()).with_axes(hanging_axes()),
    ];
    let other = Some(RowLaw::new(1e-6, 0.0));
    let law = JointLaw {
        stretch: other,
        bend: other,
        twist: Some(law),
    };
    let joint = Cosserat::new(frames, law);
    scene.add_constraint("spring", Constraint::Cosserat(joint), 0);
    scene
}

fn record(scene: Scene, options: StepOptions, steps: usize, of: fn(&Scene) -> f64) -> Vec<f64> {
    let mut stepper = Stepper::new(scene, options).expect("sound");
    let mut x = vec![of(stepper.scene())];
    for _ in 0..steps {
        stepper.step().expect("stable");
        x.push(of(stepper.scene()));
    }
    x
}

/// Coefficients c of the recurrence x_{n+k} = Σ c_j x_{n+j} that fits the samples best.
fn recurrence(x: &[f64], k: usize) -> Vec<f64> {
    let rows = x.len() - k;
    // Decaying samples weigh alike.
    let scale = |i: usize| x[i..=i + k].iter().map(|x| x.abs()).fold(0.0, f64::max);
    let a = DMatrix::from_fn(rows, k, |i, j| x[i + j] / scale(i));
    let b = DVector::from_fn(rows, |i, _| x[i + k] / scale(i));
    let c = a.svd(true, true).solve(&b, 0.0).expect("a fit");
    c.iter().copied().collect()
}

/// Roots of z^k = Σ c_j z^j as (modulus, |phase|), the largest first.
fn roots(c: &[f64]) -> Vec<(f64, f64)> {
    let k = c.len();
    let companion = DMatrix::from_fn(k, k, |i, j| {
        if i + 1 == k {
            c[j]
        } else {
            f64::from(u8::from(j == i + 1))
        }
    });
    let z = companion.complex_eigenvalues();
    let mut roots: Vec<_> = z.iter().map(|z| (z.norm(), z.arg().abs())).collect();
    roots.sort_by(|a, b| b.partial_cmp(a).expect("finite"));
    roots
}

/// The recurrence of a mode with Ω = ω Δt and θ = τ/Δt:
/// x_{n+1} − 2x_n + x_{n−1} + Ω² [φ̄ + θ (x_{n+1} − x_n)] = 0 with Δt r_n = x_n − x_{n−1}.
fn law(scheme: Scheme, omega: f64, theta: f64) -> Vec<f64> {
    let [p, q, s] = weights(scheme);
    let w = omega * omega;
    let lead = 1.0 + w * (p + theta);
    let now = -2.0 + w * (1.0 - p - q - theta);
    let before = 1.0 + w * (q + s);
    let first = -w * s;
    let all = [first, before, now].map(|c| -c / lead);
    all[usize::from(s == 0.0)..].to_vec()
}

/// H33: in each step a deformation mode is multiplied by the roots of the scheme's characteristic polynomial; for the
/// linearly implicit scheme the modulus is (1 + Ω²)^(−1/2) and the phase arctan Ω.
#[test]
fn deformation_modes_are_damped_by_the_law_of_the_scheme() {
    let mut worst = Worst::default();
    for mode in MODES {
        for scheme in SCHEMES {
            for omega in [0.05, 0.2, 1.0, 3.0, 10.0] {
                for theta in [0.0, 0.5] {
                    let compliance = DT * DT / (mode.inertia * omega * omega);
                    let scene = (mode.scene)(RowLaw::new(compliance, theta * DT));
                    let x = record(scene, options(scheme, DT), 16, mode.coordinate);
                    let expected = law(scheme, omega, theta);
                    // The first steps have no past to look back on, and what has decayed is rounding.
                    let first = if expected.len() == 3 { 3 } else { 1 };
                    let last = x.iter().rposition(|y| y.abs() > 1e-6 * x[0]);
                    let lasting = &x[first..=last.expect("the start lasts")];
                    let found = roots(&recurrence(lasting, expected.len()));
                    let expected = roots(&expected);
                    let place = format!("{}, {scheme}, Ω = {omega}, τ = {theta} Δt", mode.name);
                    worst.see((found[0].0 / expected[0].0 - 1.0).abs(), &place);
                    if scheme == Scheme::LinearlyImplicit && theta == 0.0 {
                        let exact = (1.0 + omega * omega).powf(-0.5);
                        worst.see((found[0].0 / exact - 1.0).abs(), &place);
                        worst.see((found[0].1 - omega.atan()).abs(), &place);
                    }
                    if scheme == Scheme::Spook && theta == 0.0 {
                        worst.see((found[0].0 - 1.0).abs(), &place);
                    }
                }
            }
        }
    }
    worst.expect_measured("modulus of the roots", 1.2e-12);
}

/// H34: a rigid row closes its gap by φ̄ + τ r_{n+1} = 0, a recurrence of the gaps alone, whatever the inertia: for the
/// linearly implicit scheme φ⁺ = φ/(1 + Δt/τ).
#[test]
fn gaps_close_by_the_law_of_the_scheme() {
    let mut worst = Worst::default();
    for scheme in SCHEMES {
        for theta in [1.0, 2.5, 20.0] {
            let scene = ball(RowLaw::new(0.0, theta * DT));
            let x = record(scene, options(scheme, DT), 40, |s| s.bodies.position[0].x);
            let [p, q, s] = weights(scheme);
            let d = p + theta;
            for n in 3..x.len() - 1 {
                let next = ((d - 1.0 + q) * x[n] - (q + s) * x[n - 1] + s * x[n - 2]) / d;
                let place = format!("{scheme}, τ = {theta} Δt, step {n}");
                worst.see((x[n + 1] - next).abs() / x[0], place);
            }
        }
    }
    worst.expect_measured("gap against its recurrence", 1.7e-16);
}

/// H34: as Δt → 0 every scheme closes a gap exponentially with the time τ. Their rates have power series in Δt/τ
/// (1 − Δt/2τ … for the linearly implicit one), which four time steps extrapolate.
#[test]
fn gaps_close_exponentially_with_their_time() {
    let tau = 0.1;
    let mut worst = Worst::default();
    for scheme in SCHEMES {
        let steps = [50.0, 100.0, 200.0, 400.0].map(|n| tau / n);
        let mut rates = steps.map(|dt| {
            let scene = ball(RowLaw::new(0.0, tau));
            let count = (2.0 * tau / dt).round() as usize;
            let x = record(scene, options(scheme, dt), count, |s| {
                s.bodies.position[0].x
            });
            let half = count / 2;
            tau * (x[half] / x[count]).ln() / ((count - half) as f64 * dt)
        });
        // Neville's scheme towards Δt = 0.
        for level in 1..rates.len() {
            for i in (level..rates.len()).rev() {
                let factor = steps[i - level] / steps[i];
                rates[i] += (rates[i] - rates[i - 1]) / (factor - 1.0);
            }
        }
        worst.see((rates[3] - 1.0).abs(), scheme);
    }
    worst.expect_measured("rate of closing, times τ", 1.1e-8);
}
