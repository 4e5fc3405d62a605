//! The tension that a constraint's multipliers are.

use nalgebra::Vector3;

use super::{Constraint, JointLaw};
use crate::body::Bodies;

impl Constraint {
    /// Tension \[N] of the multipliers `lambda` (one a row, N and N m) with the bodies where they are at time `t` (s);
    /// negative where it pushes. A pull on side a towards b is positive: λ is the force on a.
    ///
    /// | kind | tension |
    /// |---|---|
    /// | link, massless cable | −λ of the length row; that of all spans of a cable |
    /// | cable joint with bend rows | λ of the stretch rows along the mean of the axes u of both sides |
    /// | ball joint, cable joint without bend rows | their size ‖λ‖: a free axis is no direction |
    /// | lock, hinge, slider, bending of links, cable joint without stretch rows | none |
    ///
    /// # Panics
    /// When `lambda` is shorter than the rows or a frame names a body that is not there.
    #[must_use]
    pub fn tension(&self, bodies: &Bodies, t: f64, lambda: &[f64]) -> Option<f64> {
        let along = |law: &JointLaw| {
            law.stretch?;
            let force = Vector3::from_column_slice(&lambda[..3]);
            let axes = self.frames().iter().map(|f| f.resolve(bodies, t).u());
            let axis = axes.sum::<Vector3<f64>>();
            // Axes that point at each other have no mean.
            Some(match axis.try_normalize(1e-9) {
                Some(axis) if law.bend.is_some() => force.dot(&axis),
                _ => force.norm(),
            })
        };
        match self {
            // Not −0 where it is slack.
            Self::Distance(_) | Self::MasslessCable(_) => Some(0.0 - lambda[0]),
            Self::Spherical(_) => Some(Vector3::from_column_slice(&lambda[..3]).norm()),
            Self::Paper(c) => along(&c.law),
            Self::Cosserat(c) => along(&c.law),
            Self::Lock(_) | Self::Hinge(_) | Self::Slider(_) | Self::LinkBend(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::constraint::{Constraint, Cosserat, JointLaw, RowLaw};
    use crate::{Body, Frame, HoistParams, Scene};
    use nalgebra::{UnitQuaternion, Vector3};

    /// φ/ε of every joint of the hanging cable is its tension, whatever the joint's kind.
    #[test]
    fn a_hanging_cable_carries_what_is_below() {
        for anchor in [crate::End::Spherical, crate::End::Clamped] {
            let params = HoistParams {
                anchor,
                ..HoistParams::default()
            };
            let scene = params.hanging_equilibrium().expect("builds");
            let mut rows = crate::Linearized::new(&scene);
            rows.update(&scene, 0.0);
            for (j, constraint) in scene.constraints.iter().enumerate() {
                let lambda: Vec<_> = rows
                    .row_range(j)
                    .map(|r| -rows.phi[r] / rows.compliance[r])
                    .collect();
                let tension = constraint.tension(&scene.bodies, 0.0, &lambda);
                let weight = 9.81 * (1000.0 + (24 - j) as f64);
                assert!((tension.expect("a cable") / weight - 1.0).abs() < 1e-10);
            }
        }
    }

    /// A joint that bends has its tension along the mean of its axes, and one bent freely the size of its force.
    #[test]
    fn a_bent_joint_pulls_along_its_mean_axis() {
        let mut scene = Scene::new("bent");
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * 0.4);
        scene.add_body("rod", Body::rod(1.0, 0.1, 1.0).turned(turn));
        let frames = [
            Frame::world(Vector3::zeros()),
            Frame::body(0, Vector3::zeros()),
        ];
        let law = |bend| JointLaw {
            stretch: Some(RowLaw::RIGID),
            bend,
            twist: None,
        };
        let bent = UnitQuaternion::from_scaled_axis(Vector3::y() * 0.2) * -Vector3::z();
        let lambda: [f64; 5] = [-8.0 * bent.x, 0.0, -8.0 * bent.z, 0.0, 0.0];
        let stiff = Constraint::Cosserat(Cosserat::new(frames, law(Some(RowLaw::RIGID))));
        let free = Constraint::Cosserat(Cosserat::new(frames, law(None)));
        let tension = |c: &Constraint| c.tension(&scene.bodies, 0.0, &lambda);
        assert!((tension(&stiff).expect("a cable") + 8.0).abs() < 1e-14);
        assert!((tension(&free).expect("a cable") - 8.0).abs() < 1e-14);
        let none = Constraint::Cosserat(Cosserat::new(frames, JointLaw::default()));
        assert_eq!(tension(&none), None);
    }
}
