//! A straight cable of rigid rods along −z, and the modes of such a line that have formulas.
//!
//! Joints between rods stand for a rod's length l of cable, those at held ends for half of it. Along the axis and
//! about it this is the chain of masses m and springs k, held through 2k, on which u_j = sin((j − ½)θ) with
//!
//! ```text
//! ω = 2 √(k/m) sin ½θ,    free end: θ = (2n − 1)π/(2N),    end mass M: (M/m) sin θ tan Nθ = 1
//! ```
//!
//! exactly, where the continuum has (2n − 1)π/2 and β tan β = N m/M for β = Nθ.

use crate::hard::special::root;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};
use taut_model::{Body, Constraint, Cosserat, Frame, RowLaw, Scene, Spherical, Stiffness};

/// How an end of the line is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hold {
    /// Not at all.
    Free,
    /// A ball joint to the world.
    Pinned,
    /// A joint to the world that holds direction and twist.
    Clamped,
    /// Clamped to the centre of the load.
    Load,
}

/// A straight line.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Line {
    /// Number N of rods.
    pub(super) segments: usize,
    /// Length without the gaps that tension opens \[m].
    pub(super) length: f64,
    /// Mass and inertia of a rod.
    pub(super) rod: Body,
    /// Stiffness of the cable.
    pub(super) stiffness: Stiffness,
    /// The joints bend and twist elastically; otherwise they are ball joints.
    pub(super) bends: bool,
    /// Tension \[N].
    pub(super) tension: f64,
    /// Upper and lower end.
    pub(super) ends: [Hold; 2],
    /// The load, where the lower end holds one.
    pub(super) load: Option<Body>,
}

impl Line {
    /// Length of a rod \[m].
    pub(super) fn segment(&self) -> f64 {
        self.length / self.segments as f64
    }

    /// The scene, without gravity, at rest. Bodies: rods from above, a load last. Constraints: from above.
    pub(super) fn scene(&self, name: &str) -> Scene {
        let mut scene = Scene::new(name);
        let l = self.segment();
        let half = Vector3::new(0.0, 0.0, 0.5 * l);
        let gap = |length: f64| Vector3::z() * (length / self.stiffness.ea * self.tension);
        let joint = |scene: &mut Scene, frames: [Frame; 2], length: f64, bends: bool| {
            let law = self.stiffness.joint_law(length, 0.0);
            let joint = if bends {
                Constraint::Cosserat(Cosserat::new(frames, law))
            } else {
                Constraint::Spherical(Spherical {
                    frames,
                    stretch: law.stretch.unwrap_or(RowLaw::RIGID),
                })
            };
            let number = scene.constraints.len();
            scene.add_constraint(format!("joint-{number}"), joint, 0);
        };
        let mut end = Vector3::zeros();
        if self.ends[0] != Hold::Free {
            let frames = [Frame::world(end), Frame::body(0, half)];
            joint(&mut scene, frames, 0.5 * l, self.ends[0] == Hold::Clamped);
            end -= gap(0.5 * l);
        }
        for i in 0..self.segments {
            if i > 0 {
                end -= gap(l);
                let frames = [Frame::body(i - 1, -half), Frame::body(i, half)];
                joint(&mut scene, frames, l, self.bends);
            }
            scene.add_body(format!("rod-{}", i + 1), self.rod.at(end - half));
            end -= half * 2.0;
        }
        let last = Frame::body(self.segments - 1, -half);
        end -= gap(0.5 * l);
        let held = match self.ends[1] {
            Hold::Free => return scene,
            Hold::Pinned | Hold::Clamped => Frame::world(end),
            Hold::Load => {
                let body = self.load.unwrap_or_else(Body::fixed);
                let load = scene.add_body("load", body.at(end));
                scene.load = Some(load);
                Frame::body(load, Vector3::zeros())
            }
        };
        let bends = self.ends[1] != Hold::Pinned;
        joint(&mut scene, [last, held], 0.5 * l, bends);
        scene
    }
}

/// θ of mode `number`, from 1, of N = `segments` masses with a free end.
pub(super) fn free_end(segments: usize, number: usize) -> f64 {
    (2 * number - 1) as f64 * PI / (2 * segments) as f64
}

/// θ of the first mode of N = `segments` masses with an end mass, the masses together `ratio` times it.
pub(in crate::hard) fn end_mass(segments: usize, ratio: f64) -> f64 {
    let n = segments as f64;
    let mismatch = |theta: f64| n / ratio * theta.sin() * (n * theta).sin() - (n * theta).cos();
    root(mismatch, 0.0, FRAC_PI_2 / n)
}

/// β of β tan β = `ratio`, 0 < β < ½π.
pub(in crate::hard) fn end_mass_continuum(ratio: f64) -> f64 {
    root(|b| b * b.sin() - ratio * b.cos(), 0.0, FRAC_PI_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn end_masses_as_printed() {
        for (ratio, digits) in [
            (1.0, 0.8603335890),
            (0.1, 0.3110528482),
            (1e-3, 0.0316175071),
        ] {
            assert!((end_mass_continuum(ratio) - digits).abs() < 1e-10);
            let discrete = end_mass(400, ratio) * 400.0;
            assert!((discrete / digits - 1.0).abs() < 1e-5, "{discrete}");
        }
        // One mass m on 2k, and M behind another 2k: det(K − ω²M) = 0.
        let (theta, ratio) = (end_mass(1, 0.5), 0.5);
        let square = (2.0 * (0.5 * theta).sin()).powi(2);
        let end = 1.0 / ratio;
        let determinant = (4.0 - square) * (2.0 - end * square) - 4.0;
        assert!(determinant.abs() < 1e-13, "{determinant}");
    }

    #[test]
    fn a_taut_line_is_in_equilibrium() {
        let line = Line {
            segments: 3,
            length: 3.0,
            rod: Body::rod(1.0, 0.01, 2.0),
            stiffness: Stiffness {
                ea: 1e6,
                ei: 1.0,
                gj: 1.0,
            },
            bends: false,
            tension: 500.0,
            ends: [Hold::Pinned, Hold::Pinned],
            load: None,
        };
        let scene = line.scene("line");
        let mut rows = taut_model::Linearized::new(&scene);
        rows.update(&scene, 0.0);
        for c in 0..4 {
            let z = rows.row_range(c).start + 2;
            assert!((rows.phi[z] / rows.compliance[z] - 500.0).abs() < 1e-6);
        }
    }
}
