//! Loads on cables over sheaves: see [`ReevedParams`].
//!
//! ```text
//!  capstan    ___             tackle  ══╤═══╤══ locked sheaves   elevator   ( )  traction sheave, driven
//!            (   ) turns       winch ──( )─( )                              | |
//!            |   |                      | | | |                            car  counterweight
//!          load  counter               [ block ]                            |_( )_|  compensation rope, its sheave hangs
//! ```
//!
//! **Capstan**: it holds load : counter = k = e^(μθ), θ = π + 2π `turns`, and beyond slips with the acceleration
//! g (m₁ − k m₂)/(m₁ + k m₂). With a `wheel_inertia` the sheave turns on its axle.
//!
//! **Tackle**: a block in n falls over locked sheaves, the first fall from a winch, or from a free weight `counter_mass`.
//! Drawn up it needs the tension W/Σ k⁻ⁱ, i = 1 … n, lowered W/Σ kⁱ, with k = e^(πμ).
//!
//! **Elevator**: the sheave drives car and counterweight by friction alone, and slips upwards beyond the acceleration
//! g (k (m_w + m_s/2) − (m_c + m_s/2))/(k m_w + m_c), m_s being the mass of the compensation sheave, which hangs still.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};

use crate::body::Body;
use crate::constraint::{Hinge, MasslessCable, Motor, RowLaw, Sheave, Slider, Winch};
use crate::error::{SceneError, check};
use crate::frame::Frame;
use crate::params::{not_negative, params, representable, scenes};
use crate::scene::{Control, Scene};

/// Name of the control of the tackle's winch: the speed at which it hauls in \[m/s].
pub const HAUL_SPEED: &str = "haul_speed";
/// Name of the control of the elevator's sheave: the speed at which it lifts the car, without slip \[m/s].
pub const DRIVE_SPEED: &str = "drive_speed";

/// Most falls of a tackle.
const MAX_FALLS: usize = 64;

scenes! {
    /// Kind of path over sheaves.
    pub enum Reeved {
        /// Two weights over one sheave.
        Capstan = "capstan",
        /// A block and tackle.
        Tackle = "tackle",
        /// A car and its counterweight on a driven sheave.
        Elevator = "elevator",
    }
}

params! {
    /// Loads on massless cables over sheaves with friction: a capstan, a block and tackle, a traction elevator.
    ///
    /// Parameters in SI units; `None` stands for the default that the field names.
    pub struct ReevedParams, of reeved: Reeved {
        /// Mass of the load: the heavier weight, the block, the car \[kg].
        pub load_mass: f64 = 1000.0, representable, "> 0 kg, 1e-150 to 1e150";
        /// Mass at the other end \[kg]. Default: half the load of a capstan, 0.8 of it of an elevator; of a tackle none, its end
        /// runs to a winch.
        pub counter_mass: Option<f64> = None, representable, "> 0 kg, 1e-150 to 1e150";
        /// Radius of the sheaves \[m].
        pub radius: f64 = 0.25, representable, "> 0 m, 1e-150 to 1e150";
        /// Coefficient of friction of the cable on them; 0 lets it slide freely.
        pub friction: f64 = 0.1, not_negative, "≥ 0";
        /// Turns of the capstan besides the half one, whole. Only in `capstan`.
        pub turns: f64 = 0.0, not_negative, "≥ 0";
        /// Inertia of the sheave about its axle \[kg m²]; 0 locks it. Default: a capstan's is locked, an elevator's has 5 kg m².
        /// Not in `tackle`.
        pub wheel_inertia: Option<f64> = None, not_negative, "≥ 0 kg m²; 0 locks the sheave";
        /// Falls that the tackle's block hangs in, 1 to 64. Only in `tackle`.
        pub falls: usize = 4, |n| (1.0..=MAX_FALLS as f64).contains(&n), "1 to 64";
        /// Mass of the sheave that hangs in the elevator's compensation rope \[kg]; 0 leaves the rope out. Only in
        /// `elevator`.
        pub compensation_mass: f64 = 50.0, not_negative, "≥ 0 kg; 0 leaves the rope out";
        /// Length of the falls \[m].
        pub drop: f64 = 10.0, representable, "> 0 m, 1e-150 to 1e150";
        /// Axial stiffness of the cables \[N]; 0 for rigid ones.
        pub ea: f64 = 2e7, not_negative, "≥ 0 N; 0 is rigid";
        /// Damping time τ of the cables \[s].
        pub damping: f64 = 0.05, not_negative, "≥ 0 s";
        /// Acceleration of gravity along −z \[m/s²], ≥ 0.
        pub gravity: f64 = 9.81, not_negative, "≥ 0 m/s²";
    }
}

/// A body's centre.
fn centre(body: usize) -> Frame {
    Frame::body(body, Vector3::zeros())
}

fn xz(x: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, 0.0, z)
}

/// The points of a cable and their sheaves.
#[derive(Default)]
struct Way {
    frames: Vec<Frame>,
    sheaves: Vec<Option<Sheave>>,
}

impl Way {
    fn to(mut self, point: Frame) -> Self {
        self.frames.push(point);
        self.sheaves.push(None);
        self
    }

    /// Over a sheave, on which the cable goes on towards +x, or with `sense` −1 under it.
    fn over(mut self, hub: Frame, sense: f64, sheave: Sheave) -> Self {
        self.frames.push(hub.along(&(Vector3::y() * sense)));
        self.sheaves.push(Some(sheave));
        self
    }
}

impl ReevedParams {
    /// Builds the scene. Bodies: `load`, `counter` and `wheel` where there are; constraints: `rope` with its parts `rope-2` …,
    /// `axle`, `rail`, `compensation`. Controls: [`HAUL_SPEED`] of a tackle with a winch, [`DRIVE_SPEED`] of an elevator.
    ///
    /// # Errors
    /// Names the parameter that is out of range, and what it has to be.
    pub fn build(&self) -> Result<Scene, SceneError> {
        self.check_ranges()?;
        let mut scene = Scene::new(self.reeved.name());
        scene.gravity = xz(0.0, -self.gravity);
        match self.reeved {
            Reeved::Capstan => self.capstan(&mut scene)?,
            Reeved::Tackle => self.tackle(&mut scene)?,
            Reeved::Elevator => self.elevator(&mut scene)?,
        }
        scene.group_by_topology();
        scene.validate()?;
        Ok(scene)
    }

    fn check_ranges(&self) -> Result<(), SceneError> {
        self.check_each()?;
        let driven = self.reeved != Reeved::Elevator || self.inertia() > 0.0;
        let needs = "> 0 kg m² of an elevator, whose sheave turns";
        check("wheel_inertia", self.inertia(), driven, needs)?;
        let soft = self.reeved != Reeved::Tackle || self.friction == 0.0 || self.ea > 0.0;
        let needs = "> 0 N: the tensions of rigid falls that stick are undetermined";
        check("ea", self.ea, soft, needs)
    }

    fn inertia(&self) -> f64 {
        let is_elevator = self.reeved == Reeved::Elevator;
        self.wheel_inertia
            .unwrap_or(if is_elevator { 5.0 } else { 0.0 })
    }

    fn counter(&self) -> f64 {
        let is_elevator = self.reeved == Reeved::Elevator;
        let part = if is_elevator { 0.8 } else { 0.5 };
        self.counter_mass.unwrap_or(part * self.load_mass)
    }

    fn sheave(&self, turns: f64) -> Sheave {
        Sheave {
            friction: self.friction,
            turns,
            ..Sheave::new(self.radius)
        }
    }

    /// A massless cable of a length (m) along a way.
    fn reeve(
        &self,
        scene: &mut Scene,
        name: &str,
        way: Way,
        length: f64,
        winch: Option<Winch>,
    ) -> Result<usize, SceneError> {
        let compliance = if self.ea > 0.0 { length / self.ea } else { 0.0 };
        let law = RowLaw::new(compliance, self.damping);
        let cable = MasslessCable {
            sheaves: way.sheaves,
            winch,
            ..MasslessCable::new(way.frames, length, law)
        };
        Ok(scene.reeve(name, &cable, 0)?[0])
    }

    /// A wheel that turns about y through the origin of the world.
    fn wheel(&self, scene: &mut Scene, motor: Option<Motor>) -> (usize, usize) {
        let inertia = Matrix3::from_diagonal(&Vector3::repeat(self.inertia()));
        let mass = 2.0 * self.inertia() / (self.radius * self.radius);
        let wheel = scene.add_body("wheel", Body::new(mass, inertia));
        let frames = [Frame::world(Vector3::zeros()), centre(wheel)];
        let axle = Hinge {
            motor,
            ..Hinge::new(frames.map(|f| f.along(&Vector3::y())))
        };
        (wheel, scene.add_constraint("axle", axle, 0))
    }

    fn weight(&self, scene: &mut Scene, name: &str, mass: f64, x: f64) -> usize {
        scene.add_body(name, Body::particle(mass).at(xz(x, -self.drop)))
    }

    fn capstan(&self, scene: &mut Scene) -> Result<(), SceneError> {
        let counter = self.weight(scene, "counter", self.counter(), -self.radius);
        let load = self.weight(scene, "load", self.load_mass, self.radius);
        scene.load = Some(load);
        let hub = if self.inertia() > 0.0 {
            centre(self.wheel(scene, None).0)
        } else {
            Frame::world(Vector3::zeros())
        };
        let way = Way::default()
            .to(centre(counter))
            .over(hub, 1.0, self.sheave(self.turns))
            .to(centre(load));
        let length = 2.0 * self.drop + self.radius * (PI + TAU * self.turns.floor());
        self.reeve(scene, "rope", way, length, None).map(|_| ())
    }

    /// The falls stand 2 r apart about the origin, the first one that of the winch or the weight.
    fn tackle(&self, scene: &mut Scene) -> Result<(), SceneError> {
        let (r, n) = (self.radius, self.falls);
        let x = |fall: usize| r * (2.0 * fall as f64 - n as f64);
        let edge = r * Vector3::new(2.0 * n as f64, 1.0, 1.0);
        let block = Body::cuboid(edge, self.load_mass).at(xz(0.0, -self.drop));
        let block = scene.add_body("load", block);
        scene.load = Some(block);
        let rail = [Frame::world(Vector3::zeros()), centre(block)];
        let rail = Slider::new(rail.map(|f| f.along(&Vector3::z())));
        scene.add_constraint("rail", rail, 0);
        let half = 0.5 * self.drop;
        let end = match self.counter_mass {
            Some(mass) => {
                let weight = scene.add_body("counter", Body::particle(mass).at(xz(x(0), -half)));
                centre(weight)
            }
            None => Frame::world(xz(x(0), -half)),
        };
        let mut way = Way::default().to(end);
        for fall in 0..n {
            let hub = xz(x(fall) + r, 0.0);
            way = if fall % 2 == 0 {
                way.over(Frame::world(hub), 1.0, self.sheave(0.0))
            } else {
                way.over(Frame::body(block, hub), -1.0, self.sheave(0.0))
            };
        }
        let last = xz(x(n), 0.0);
        let way = way.to(if n % 2 == 0 {
            Frame::world(last)
        } else {
            Frame::body(block, last)
        });
        let length = half + n as f64 * (self.drop + PI * r);
        let winch = self.counter_mass.is_none().then(Winch::new);
        let rope = self.reeve(scene, "rope", way, length, winch)?;
        if winch.is_some() {
            scene.controls.push(Control::of(HAUL_SPEED, rope, -1.0));
        }
        Ok(())
    }

    fn elevator(&self, scene: &mut Scene) -> Result<(), SceneError> {
        let r = self.radius;
        let counter = self.weight(scene, "counter", self.counter(), -r);
        let car = self.weight(scene, "load", self.load_mass, r);
        scene.load = Some(car);
        let (wheel, axle) = self.wheel(scene, Some(Motor::speed(0.0)));
        let way = Way::default()
            .to(centre(counter))
            .over(centre(wheel), 1.0, self.sheave(0.0))
            .to(centre(car));
        self.reeve(scene, "rope", way, 2.0 * self.drop + PI * r, None)?;
        if self.compensation_mass > 0.0 {
            let depth = xz(0.0, -2.0 * self.drop);
            let size = Vector3::new(2.0 * r, 0.1 * r, 2.0 * r);
            let hanging = Body::cuboid(size, self.compensation_mass).at(depth);
            let hanging = scene.add_body("compensation", hanging);
            let frames = [Frame::world(depth), centre(hanging)];
            let rail = Slider::new(frames.map(|f| f.along(&Vector3::z())));
            scene.add_constraint("rail", rail, 0);
            let sheave = Sheave::new(r);
            let way = Way::default()
                .to(centre(counter))
                .over(centre(hanging), -1.0, sheave)
                .to(centre(car));
            self.reeve(scene, "compensation", way, 2.0 * self.drop + PI * r, None)?;
        }
        let drive = Control::of(DRIVE_SPEED, axle, -1.0 / r);
        scene.controls.push(drive);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Linearized;
    use crate::testing::With;

    #[test]
    fn the_geometry_is_closed() {
        for reeved in Reeved::ALL {
            for (falls, counter_mass, wheel_inertia) in
                [(1, None, 1.0), (4, Some(10.0), 2.0), (7, None, 5.0)]
            {
                let params = ReevedParams::new(reeved)
                    .with(|p| (p.falls, p.counter_mass) = (falls, counter_mass))
                    .with(|p| (p.wheel_inertia, p.turns) = (Some(wheel_inertia), 2.0));
                let scene = params.build().expect("builds");
                let lin = Linearized::at(&scene, 0.0);
                let all_hold = lin.phi.iter().all(|phi| phi.abs() < 1e-12);
                assert!(all_hold, "{}: {:?}", scene.name, lin.phi);
            }
        }
    }
}
