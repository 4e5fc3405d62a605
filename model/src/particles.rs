//! Particle chains: point masses on a string of links, the models of \[SL §III].
//!
//! The chain starts at the world's origin. N links of equal length d hold N particles; the last particle is the load.
//! The models differ in how they stabilise a heavy load: see [`ChainModel`].

use nalgebra::Vector3;

use crate::body::Body;
use crate::cable::MAX_SEGMENTS;
use crate::constraint::{BendDefinition, Constraint, Distance, LinkBend, MasslessCable, RowLaw};
use crate::error::SceneError;
use crate::frame::Frame;
use crate::params::{check_count, not_negative, params, representable, scenes};
use crate::scene::Scene;
use crate::seed;

scenes! {
    /// Rows of a chain besides its links: models (a) to (e) of \[SL §III, Fig. 1], and (f), which holds
    /// in space too.
    pub enum ChainModel {
        /// (a) Nothing.
        Links = "particles-a",
        /// (b) A massless cable through all particles: one row on the total length.
        MasslessCable = "particles-b",
        /// (c) Load enforcement: a link of the whole length from the anchor to the load.
        LoadEnforcement = "particles-c",
        /// (d) As (b), with the last link left out.
        Truncated = "particles-d",
        /// (e) Angles between neighbouring links: holds in exactly planar motion.
        BendAngle = "particles-e",
        /// (f) Bend vectors between neighbouring links, in both transverse directions.
        BendVector = "particles-f",
    }
}

impl ChainModel {
    /// Compliance that the added rows have by default, of \[SL, Table I]: 10⁻⁹ m/N, 10⁻⁴ rad/(N m).
    #[must_use]
    pub fn default_compliance(self) -> f64 {
        match self {
            Self::BendAngle | Self::BendVector => 1e-4,
            _ => 1e-9,
        }
    }
}

params! {
    /// A chain of particles and links.
    ///
    /// Parameters in SI units. The defaults are those of \[SL, Table I], with a load well below the largest that is stable
    /// there. As text, the model is the scene's name.
    pub struct ParticleChainParams, of model: ChainModel {
        /// Number N of particles, with the load, and of links: 1 to 10 million.
        pub particles: usize = 5, |n| n >= 1.0, "at least 1";
        /// Length d of a link at rest \[m].
        pub spacing: f64 = 1.0, representable, "> 0 m, 1e-150 to 1e150";
        /// Mass of a particle \[kg].
        pub mass: f64 = 1.0, representable, "> 0 kg, 1e-150 to 1e150";
        /// Mass of the last particle \[kg].
        pub load_mass: f64 = 10.0, representable, "> 0 kg, 1e-150 to 1e150";
        /// Compliance ε of a link \[m/N], ≥ 0; 0 is rigid.
        pub compliance: f64 = 1e-8, not_negative, "≥ 0 m/N; 0 is rigid";
        /// Compliance of the rows that the model adds, ≥ 0: of the total length or of the link to the load \[m/N], of
        /// bending \[rad/(N m)]. Default: [`ChainModel::default_compliance`]. Not in `particles-a`.
        pub added_compliance: Option<f64> = None, not_negative, "≥ 0 m/N or rad/(N m); 0 is rigid";
        /// Damping time τ of all rows \[s].
        pub damping: f64 = 0.0, not_negative, "≥ 0 s";
        /// Acceleration of gravity along −z \[m/s²], ≥ 0.
        pub gravity: f64 = 10.0, not_negative, "≥ 0 m/s²";
        /// Transverse rows of the links, for time steppers that set their compliance ([`Distance`]).
        /// They carry the links' tension only: that of the cable of (b) and (d) and of the enforcing
        /// link of (c) has none.
        pub transverse: bool = false;
        /// `true` starts the chain along +x, `false` hanging along −z.
        pub horizontal: bool = true;
        /// Seed of random velocities of the particles above the load; 0 is none.
        pub seed: u64 = 0;
        /// Bound of each component of the random velocities \[m/s].
        pub seed_velocity: f64 = 1e-6, not_negative, "≥ 0 m/s";
    }
}

impl ParticleChainParams {
    /// Builds the scene with unstrained links, at rest but for the random velocities. Bodies: the particles from the
    /// anchor, the load last. Constraints: the links from the anchor, `link-1` on, side a nearer to the anchor, each
    /// followed by the bending at its upper end (`bend-1` between the first two); last what the model adds as a whole
    /// (`cable`, `enforcement`). Groups: what acts on the load is 1 (when there is more), the others 0.
    ///
    /// # Errors
    /// Names the parameter that is out of range, and what it has to be.
    pub fn build(&self) -> Result<Scene, SceneError> {
        check_count("particles", self.particles, MAX_SEGMENTS)?;
        self.check_each()?;
        let mut scene = Scene::new(self.model.name());
        scene.gravity = Vector3::new(0.0, 0.0, -self.gravity);
        let along = if self.horizontal {
            Vector3::x()
        } else {
            -Vector3::z()
        };
        let last = self.particles - 1;
        for i in 0..self.particles {
            let (name, mass) = if i == last {
                ("load".to_owned(), self.load_mass)
            } else {
                (format!("particle-{}", i + 1), self.mass)
            };
            let place = along * (self.spacing * (i + 1) as f64);
            scene.add_body(name, Body::particle(mass).at(place));
        }
        scene.load = Some(last);
        self.add_constraints(&mut scene);
        let speeds = &mut scene.bodies.velocity[..last];
        seed::replace(speeds, self.seed, self.seed_velocity);
        scene.validate()?;
        Ok(scene)
    }

    /// The point number `i` of the chain: the anchor, then the particles.
    fn point(i: usize) -> Frame {
        match i {
            0 => Frame::world(Vector3::zeros()),
            i => Frame::body(i - 1, Vector3::zeros()),
        }
    }

    fn add_constraints(&self, scene: &mut Scene) {
        let n = self.particles;
        let added = self
            .added_compliance
            .unwrap_or(self.model.default_compliance());
        let law = RowLaw::new(added, self.damping);
        let group = |i: usize| u32::from(i == n && n > 1);
        let whole = self.spacing * n as f64;
        let link = |ends: [usize; 2], length, law, transverse| {
            Constraint::Distance(Distance {
                frames: ends.map(Self::point),
                length,
                law,
                transverse,
            })
        };
        for i in 1..=n {
            if i < n || self.model != ChainModel::Truncated {
                let law = RowLaw::new(self.compliance, self.damping);
                let link = link([i - 1, i], self.spacing, law, self.transverse);
                scene.add_constraint(format!("link-{i}"), link, group(i));
            }
            let definition = match self.model {
                ChainModel::BendAngle => BendDefinition::Angle,
                ChainModel::BendVector => BendDefinition::Vector,
                _ => continue,
            };
            if i > 1 {
                let bend = LinkBend {
                    frames: [i - 2, i - 1, i].map(Self::point),
                    law,
                    definition,
                };
                let name = format!("bend-{}", i - 1);
                scene.add_constraint(name, Constraint::LinkBend(bend), group(i));
            }
        }
        match self.model {
            ChainModel::MasslessCable | ChainModel::Truncated => {
                let cable = MasslessCable {
                    // As in the paper, a row like the others: it pushes too.
                    tension_only: false,
                    ..MasslessCable::new((0..=n).map(Self::point).collect(), whole, law)
                };
                scene.add_constraint("cable", Constraint::MasslessCable(cable), group(n));
            }
            ChainModel::LoadEnforcement => {
                scene.add_constraint("enforcement", link([0, n], whole, law, false), group(n));
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::With;
    use crate::{Linearized, check_jacobian};

    #[test]
    fn models_have_the_rows_of_the_paper() {
        let names = |model, particles| -> Vec<String> {
            let params = ParticleChainParams::default()
                .with(|p| (p.model, p.particles) = (model, particles));
            let mut scene = params.build().expect("builds");
            let lin = Linearized::at(&scene, 0.0);
            assert!(lin.phi.iter().all(|phi| *phi == 0.0));
            // A straight chain has no direction to bend in.
            for (i, x) in scene.bodies.position.iter_mut().enumerate() {
                *x += Vector3::new(0.1, 0.2, -0.3) * (i * i) as f64;
            }
            for i in 0..scene.constraints.len() {
                assert!(check_jacobian(&scene, i).max < 1e-9, "{model:?} {i}");
            }
            scene.constraint_names
        };
        let links = ["link-1", "link-2", "link-3"];
        let with = |more: &[&'static str]| [&links[..], more].concat();
        assert_eq!(names(ChainModel::Links, 3), links);
        assert_eq!(names(ChainModel::MasslessCable, 3), with(&["cable"]));
        let enforced = names(ChainModel::LoadEnforcement, 3);
        assert_eq!(enforced, with(&["enforcement"]));
        let truncated = names(ChainModel::Truncated, 3);
        assert_eq!(truncated, ["link-1", "link-2", "cable"]);
        for model in [ChainModel::BendAngle, ChainModel::BendVector] {
            let bent = ["link-1", "link-2", "bend-1", "link-3", "bend-2"];
            assert_eq!(names(model, 3), bent);
        }
        for model in ChainModel::ALL {
            assert!(!names(model, 1).is_empty());
        }
    }

    #[test]
    fn added_rows_have_their_own_compliance() {
        let build = |model, added_compliance| {
            let params = ParticleChainParams::default()
                .with(|p| (p.model, p.added_compliance) = (model, added_compliance));
            let scene = params.build().expect("builds");
            let last = scene.constraints.last().expect("there are rows");
            (last.row(0).1.compliance, scene.groups)
        };
        let groups = vec![0, 0, 0, 0, 0, 0, 0, 1, 1];
        assert_eq!(build(ChainModel::BendAngle, None), (1e-4, groups));
        let groups = vec![0, 0, 0, 0, 1, 1];
        let found = build(ChainModel::LoadEnforcement, Some(1e-12));
        assert_eq!(found, (1e-12, groups));
    }

    #[test]
    fn hanging_chains_with_transverse_rows_keep_exact_zeros() {
        let params = ParticleChainParams::default()
            .with(|p| (p.particles, p.spacing, p.horizontal) = (7, 0.1, false))
            .with(|p| p.transverse = true);
        let scene = params.build().expect("builds");
        let lin = Linearized::at(&scene, 0.0);
        assert_eq!((lin.rows(), lin.transverse.len()), (21, 7));
        for (s, slot) in lin.slots.iter().enumerate() {
            let sign = [1.0, -1.0][usize::from(slot.body == slot.constraint)];
            let rows = [[0.0, 0.0, sign], [sign, 0.0, 0.0], [0.0, sign, 0.0]];
            for (row, direction) in lin.block(s).chunks_exact(6).zip(rows) {
                assert_eq!((&row[..3], &row[3..]), (&direction[..], &[0.0; 3][..]));
            }
        }
    }
}
