//! Cable joint with stretch (3 rows), bend (2 rows) and twist (1 row).
//!
//! With the axes u (along the cable), v, w of each side, d = u_a × u_b, |d| = sin θ, c = u_a·u_b = cos θ, n = d/|d|:
//!
//! **Bend** about a ∈ {v_a, w_a}: β = (θ/sin θ) d·a: the components of the rotation vector θ n that takes u_a to u_b
//! on the shortest way. With ω_b alone moving, θ̇ = n·ω and ḋ = u_a × (ω × u_b) = c ω − (u_a·ω) u_b, so that
//!
//!   ∂β/∂ω_b = h (d·a) d + g (c a − (u_b·a) u_a),  g = θ/sin θ,  h = (1 − θ cot θ)/sin²θ
//!
//! β is smooth at θ = 0 (g = 1, h = 1/3: the row is a). At θ = π the axis n has no direction and g → ∞: the fold.
//!
//! **Twist** Ω = atan2(w_a·v_b − v_a·w_b, v_a·v_b + w_a·w_b) + 2πm: the twist part of the swing-twist decomposition of
//! the relative rotation. ∂Ω/∂ω_b = (u_a + u_b)/(1 + c): no contamination by bending. Singular at θ = π only. m makes
//! Ω follow its reference through many turns.
//!
//! φ̇ depends on ω_b − ω_a only, because both angles are unchanged when everything turns.
//!
//! **In quaternions** no square root is left. Let (x, y, z, w) be the rotation from a's axes to b's, in a's axes: x along u.
//! With t = y² + z² = sin²(θ/2), s = w² + x² = cos²(θ/2) and f = (θ/sin θ − 1)/t,
//!
//! ```text
//! c = s − t      d·v_a = 2 (w y − x z)      d·w_a = 2 (x y + w z)      u_b = c u_a + (d·w_a) v_a − (d·v_a) w_a
//! g = 1 + t f    h = (2 − c f)/(4 s)        1 + c = 2 s                Ω = 2 arctan(x/w) + 2πm
//! ```
//!
//! t and s keep their digits near θ = 0 and near the fold. [`BendTwist`] evaluates these lines, for one joint or for one in
//! each lane.

use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use taut_lanes::Lanes;
use taut_lanes::functions::{atan, lane_by_lane, over_sine};
use taut_lanes::vector::{Quaternion, Vec3, combine, scale_add};

use super::facts::{Facts, Parts, of_cable};
use super::{JointLaw, Rows, unwrap_angle};
use crate::body::Bodies;
use crate::frame::{Frame, Resolved};

/// Below this sine the fold θ = π is taken to have the bend axis v_a: everything stays finite there.
pub(super) const FOLD: f64 = 1e-14;

/// Limit of [`over_sine`]: the sine squared of half the bend angle.
const LARGEST_BEND: f64 = 0.25;

/// Limit of [`atan`]: the tangent of half the twist.
const LARGEST_TWIST: f64 = 0.209;

/// Cable joint that resists bending in both transverse directions, up to 6 rows: stretch, bend about v, bend about w,
/// twist.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cosserat {
    /// The two attachment frames.
    pub frames: [Frame; 2],
    /// Its rows, and their laws.
    pub law: JointLaw,
    /// Reference that unwraps the twist \[rad], within 0.01 rad of the twist of the last accepted
    /// step.
    pub twist_reference: f64,
}

impl Cosserat {
    /// A joint whose twist starts within half a turn of zero.
    #[must_use]
    pub fn new(frames: [Frame; 2], law: JointLaw) -> Self {
        Self {
            frames,
            law,
            twist_reference: 0.0,
        }
    }
}

/// Bends and twist of one joint, or of one in each lane.
pub(crate) struct BendTwist<V> {
    /// The bends about v_a and w_a, and the twist, unwrapped \[rad].
    pub(crate) angles: [V; 3],
    /// Components of the bends' gradients along v_a and w_a: v of the first, w of the first and v of the second, w of the
    /// second.
    bends: [V; 3],
    /// Components of the twist's gradient along v_a and w_a.
    twist: [V; 2],
}

impl<V: Lanes> BendTwist<V> {
    /// From the rotation of b's axes as a's see them, `seen`; the twist is unwrapped to `reference`. Either sign of the
    /// quaternion is the same rotation.
    #[inline(always)]
    pub(crate) fn new(seen: &Quaternion<V>, reference: V) -> Self {
        let Swing {
            seen: [x, y, z, w],
            t,
            f,
        } = Swing::new(seen);
        let s = w.mul_add(w, x * x);
        let (x2, w2) = (x + x, w + w);
        let (along_v, along_w) = (x2.neg_mul_add(z, w2 * y), x2.mul_add(y, w2 * z));
        let Factors { g, h, c, mean } = Factors::new(t, s, f);
        let (hv, hw, straight) = (h * along_v, h * along_w, g * c);
        Self {
            angles: [g * along_v, g * along_w, twist(x, w, reference)],
            bends: [
                hv.mul_add(along_v, straight),
                hv * along_w,
                hw.mul_add(along_w, straight),
            ],
            twist: [mean * along_w, -(mean * along_v)],
        }
    }

    /// The gradients on ω_b, for side a's axes in the world frame; those on ω_a are the negatives. As u_b·v_a = d·w_a and
    /// u_b·w_a = −d·v_a, the bends' components along u_a are −β_w and β_v.
    #[inline(always)]
    pub(crate) fn gradients(&self, [u, v, w]: &[Vec3<V>; 3]) -> [Vec3<V>; 3] {
        let ([beta_v, beta_w, _], [vv, vw, ww], [tv, tw]) = (self.angles, self.bends, self.twist);
        let axes = [*v, *w, *u];
        [
            combine(&axes, &[vv, vw, -beta_w]),
            combine(&axes, &[vw, ww, beta_v]),
            scale_add(w, tw, &scale_add(v, tv, u)),
        ]
    }
}

impl BendTwist<f64> {
    /// Bends and twist of one joint, between two frames in the world.
    pub(super) fn of_frames(a: &Resolved, b: &Resolved, reference: f64) -> Self {
        Self::new(&quaternion(&(a.axes.transpose() * b.axes)), reference)
    }
}

/// The columns of side a's axes.
pub(super) fn columns(axes: &Matrix3<f64>) -> [Vec3<f64>; 3] {
    axes.data.0
}

/// The factors of the bends and of their gradients.
pub(super) struct Factors<V> {
    pub(super) g: V,
    pub(super) h: V,
    /// cos θ.
    pub(super) c: V,
    /// 1/(1 + c).
    mean: V,
}

impl<V: Lanes> Factors<V> {
    /// From t = sin²(θ/2), s = cos²(θ/2) and f = (θ/sin θ − 1)/t.
    #[inline(always)]
    fn new(t: V, s: V, f: V) -> Self {
        let (one, half) = (V::splat(1.0), V::splat(0.5));
        let (c, mean) = (s - t, half / s);
        Self {
            g: f.mul_add(t, one),
            h: mean * f.neg_mul_add(half * c, one),
            c,
            mean,
        }
    }
}

impl Factors<f64> {
    /// Between two directions; at the fold as of a sine of [`FOLD`].
    pub(super) fn between(a: &Vector3<f64>, b: &Vector3<f64>) -> Self {
        let t = 0.25 * (a - b).norm_squared();
        // 4 t s = sin²θ, of the same rounding as a × b, which g multiplies.
        let s = if t < 0.5 {
            1.0 - t
        } else {
            0.25 * a.cross(b).norm_squared().max(FOLD * FOLD) / t
        };
        Self::new(t, s, over_any_sine(t, s))
    }
}

/// (θ/sin θ − 1)/t from t = sin²(θ/2) and s = cos²(θ/2).
fn over_any_sine(t: f64, s: f64) -> f64 {
    if t < LARGEST_BEND {
        return over_sine(t);
    }
    let (sine, cosine) = (t.sqrt(), s.sqrt());
    (sine.atan2(cosine) / (sine * cosine) - 1.0) / t
}

/// The bend of a relative rotation.
struct Swing<V> {
    /// The rotation, away from the fold itself.
    seen: Quaternion<V>,
    /// sin²(θ/2).
    t: V,
    /// (θ/sin θ − 1)/t.
    f: V,
}

impl<V: Lanes> Swing<V> {
    #[inline(always)]
    fn new(seen: &Quaternion<V>) -> Self {
        let t = sine_squared(seen);
        if bends_little(seen) {
            return Self {
                seen: *seen,
                t,
                f: over_sine(t),
            };
        }
        let [x, y, z, w, f] = lane_by_lane(seen, bend_far);
        let seen = [x, y, z, w];
        Self { seen, t, f }
    }
}

/// True if the joints bend by less than π/3, where a polynomial gives the sine.
#[inline(always)]
pub(crate) fn bends_little<V: Lanes>(seen: &Quaternion<V>) -> bool {
    sine_squared(seen).all_below(V::splat(LARGEST_BEND))
}

/// sin²(θ/2).
#[inline(always)]
fn sine_squared<V: Lanes>(seen: &Quaternion<V>) -> V {
    seen[2].mul_add(seen[2], seen[1] * seen[1])
}

/// The quaternion, moved off the fold to a sine of [`FOLD`] about v_a, and f, of a joint that may bend by any angle.
#[cold]
fn bend_far([x, y, z, w]: [f64; 4]) -> [f64; 5] {
    let t = sine_squared(&[x, y, z, w]);
    let s = w * w + x * x;
    if t > 0.5 && 4.0 * t * s < FOLD * FOLD {
        let half = 0.5 * FOLD / t;
        let s = 0.25 * FOLD * FOLD / t;
        return [-half * z, y, z, half * y, over_any_sine(t, s)];
    }
    [x, y, z, w, over_any_sine(t, s)]
}

/// Ω = 2 arctan(x/w), unwrapped to `reference` \[rad].
#[inline(always)]
fn twist<V: Lanes>(x: V, w: V, reference: V) -> V {
    let tangent = x / w;
    if tangent.abs().all_below(V::splat(LARGEST_TWIST)) {
        let half = atan(tangent);
        let twist = half + half;
        if (reference - twist).abs().all_below(V::splat(PI)) {
            return twist;
        }
    }
    let [twist] = lane_by_lane(&[x, w, reference], twist_far);
    twist
}

/// [`twist`] of a joint that may be twisted by any angle.
#[cold]
fn twist_far([x, w, reference]: [f64; 3]) -> [f64; 1] {
    let tangent = x / w;
    let half = if tangent.abs() < LARGEST_TWIST {
        atan(tangent)
    } else {
        x.atan2(w)
    };
    [unwrap_angle(2.0 * half, reference)]
}

/// The unit quaternion \[x, y, z, w] of the rotation matrix `r`, w ≥ 0, its largest component taken from the diagonal, so
/// that no digits are lost anywhere.
pub(super) fn quaternion(r: &Matrix3<f64>) -> Quaternion<f64> {
    let axial = Vector3::new(
        r[(2, 1)] - r[(1, 2)],
        r[(0, 2)] - r[(2, 0)],
        r[(1, 0)] - r[(0, 1)],
    );
    let trace = r.trace();
    let largest = r.diagonal().imax();
    // Up to a common positive factor.
    let (w, imaginary) = if trace >= r[(largest, largest)] {
        (1.0 + trace, axial)
    } else {
        let mut q = (r + r.transpose()).column(largest).into_owned();
        q[largest] = 1.0 + 2.0 * r[(largest, largest)] - trace;
        let w = axial[largest];
        if w < 0.0 { (-w, -q) } else { (w, q) }
    };
    let scale = 1.0 / (imaginary.norm_squared() + w * w).sqrt();
    [
        imaginary.x * scale,
        imaginary.y * scale,
        imaginary.z * scale,
        w * scale,
    ]
}

impl Facts for Cosserat {
    fn parts(&self) -> Parts {
        self.law.parts(2)
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let [a, b] = rows.resolve(&self.frames, bodies, t);
        if self.law.stretch.is_some() {
            rows.stretch(&a, &b);
        }
        rows.bend_twist(&a, &b, &self.law, self.twist_reference);
    }

    of_cable!();

    fn update_winding(&mut self, bodies: &Bodies, t: f64) -> bool {
        let [a, b] = self.frames.map(|frame| frame.resolve(bodies, t));
        self.twist_reference = BendTwist::of_frames(&a, &b, self.twist_reference).angles[2];
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::testing::{LAW, Poses, Sample, assert_rows, bent, phi};
    use crate::linearized::update_windings;
    use crate::testing::*;
    use std::f64::consts::{PI, TAU};

    impl Sample for Cosserat {
        fn sample(frames: [Frame; 2]) -> Self {
            let all = JointLaw {
                stretch: Some(LAW),
                bend: Some(LAW),
                twist: Some(LAW),
            };
            Self::new(frames, all)
        }
    }

    fn joint(frames: [Frame; 2]) -> Constraint {
        Cosserat::sample(frames).into()
    }

    #[test]
    fn jacobian_at_random_poses() {
        let relative = |p: &mut Poses| bent(1.5 + 1.4 * p.number(), &p.across(), 3.0 * p.number());
        assert_rows("cosserat random", relative, joint);
    }

    #[test]
    fn the_fold_itself_is_finite() {
        let mut poses = Poses::new(5);
        for axis in [Vector3::y(), Vector3::z()] {
            let relative = UnitQuaternion::from_scaled_axis(axis * PI);
            let scene = poses.pair(&relative, joint);
            let lin = crate::Linearized::at(&scene, 0.0);
            assert!(lin.phi.iter().all(|v| v.is_finite()));
            assert!((0..lin.slots.len()).all(|s| lin.block(s).iter().all(|j| j.is_finite())));
            assert!((lin.phi[3].hypot(lin.phi[4]) - PI).abs() < 1e-12);
        }
    }

    #[test]
    fn bend_and_twist_are_the_swing_and_the_twist() {
        let mut poses = Poses::new(11);
        for theta in [0.0, 1e-9, 1e-3, 0.3, 1.5, 2.5, PI - 1e-3] {
            let (n, omega) = (poses.across(), 3.0 * poses.number());
            let scene = poses.pair(&bent(theta, &n, omega), joint);
            let phi = phi(&scene);
            let tolerance = 1e-14 * (1.0 + 1.0 / (PI - theta));
            for (found, exact) in phi[3..].iter().zip([theta * n.y, theta * n.z, omega]) {
                let off = (found - exact).abs();
                assert!(off < tolerance, "{found} {exact} at {theta}");
            }
        }
    }

    #[test]
    fn twist_follows_37_turns_bent_or_not() {
        for theta in [0.0, 0.4, 2.6] {
            let mut poses = Poses::new(13);
            let n = poses.across();
            let pair = |turn: f64| Poses::new(17).pair(&bent(theta, &n, turn), joint);
            let mut scene = pair(0.0);
            for sign in [1.0, -1.0] {
                for k in 1..=37 * 5 {
                    let turn = sign * TAU / 5.0 * f64::from(k);
                    scene.bodies = pair(turn).bodies;
                    update_windings(&mut scene, 0.0);
                    assert!((phi(&scene)[5] - turn).abs() < 1e-12, "turn {turn}");
                }
                let error = crate::check_jacobian(&scene, 0).max;
                println!("cosserat θ = {theta}, 37 turns {error:.1e}");
                assert!(error < 1e-9, "{error:e}");
                for k in (0..37 * 5).rev() {
                    scene.bodies = pair(sign * TAU / 5.0 * f64::from(k)).bodies;
                    update_windings(&mut scene, 0.0);
                }
                assert!(phi(&scene)[5].abs() < 1e-12);
            }
        }
    }

    #[test]
    fn rows_are_optional() {
        let bend = RowLaw::new(2.0, 0.0);
        let law = JointLaw::default().with(|p| p.bend = Some(bend));
        let make = |frames| Constraint::Cosserat(Cosserat::new(frames, law));
        let mut poses = Poses::new(19);
        let scene = poses.pair(&bent(0.5, &Vector3::y(), 0.1), make);
        let c = &scene.constraints[0];
        assert_eq!((c.rows(), c.row(1)), (2, (RowKind::Bend, bend)));
        assert!(!c.has_stretch_rows());
        assert!((phi(&scene)[0] - 0.5).abs() < 1e-14);
        assert!(crate::check_jacobian(&scene, 0).max < 1e-9);
    }
}
