//! Lays out the gantry, unstrained.

use nalgebra::Vector3;
use std::f64::consts::PI;

use super::{GantryParams, HOIST_SPEED, ResolvedGantry, TROLLEY_SPEED};
use crate::body::Body;
use crate::cable::strand::Strand;
use crate::constraint::{Constraint, MasslessCable, Motor, RowLaw, Sheave, Slider, Winch};
use crate::error::SceneError;
use crate::frame::{Frame, axes_along};
use crate::scene::{Control, Drive, Scene};
use crate::seed;

/// Numbers of the bodies, cables and constraints that have one place in every gantry.
const CRANE: usize = 0;
const TROLLEY: usize = 1;
const HOOK: usize = 2;
const CABLE: usize = 0;
const RAIL: usize = 0;

impl GantryParams {
    /// Builds the scene. Bodies: `crane`, `trolley`, `hook`, `segment-1` …, `load`. Constraints: `rail`, `rope-1`,
    /// `rope-2`, `top`, `joint-1` …, `bottom`. Controls: those of
    /// [`Controls`](super::Controls), or one for each rope.
    ///
    /// # Errors
    /// As [`GantryParams::resolve`].
    pub fn build(&self) -> Result<Scene, SceneError> {
        let gantry = self.resolve()?;
        let mut scene = Scene::new("gantry");
        scene.gravity = Vector3::new(0.0, 0.0, -self.gravity);
        self.add_bodies(&mut scene, &gantry);
        self.add_rail(&mut scene);
        let mut ropes = [0; 2];
        for (i, side) in [1.0, -1.0].into_iter().enumerate() {
            // The winch is at the first part.
            let parts = scene.reeve(&format!("rope-{}", i + 1), &self.rope(side), 0)?;
            ropes[i] = parts[0];
        }
        self.join_cable(&mut scene, &gantry);
        self.add_controls(&mut scene, ropes);
        let spins = &mut scene.bodies.angular_velocity[HOOK + 1..HOOK + 1 + self.segments];
        seed::replace(spins, self.seed, self.seed_rate);
        scene.start_in_equilibrium = self.equilibrium;
        scene.group_by_topology();
        scene.validate()?;
        Ok(scene)
    }

    fn add_bodies(&self, scene: &mut Scene, gantry: &ResolvedGantry) {
        let at = |depth: f64| Vector3::new(0.0, 0.0, -depth);
        let [x, y] = self.rope_spread;
        let height = self.hook_height;
        let trolley = Vector3::new(2.0 * x, 1.5 * y, 0.5 * y);
        let hook = Vector3::new(1.5 * x, 1.2 * y, height);
        scene.add_body("crane", Body::fixed());
        scene.add_body("trolley", Body::cuboid(trolley, gantry.trolley_mass));
        let block = Body::cuboid(hook, gantry.hook_mass);
        scene.add_body("hook", block.at(at(self.drop + 0.5 * height)));
        let (top, l) = (self.drop + height, gantry.segment_length);
        let rods = (0..self.segments).map(|i| {
            let rod = Body::rod(l, gantry.radius, self.segment_mass);
            rod.at(at(top + l * (i as f64 + 0.5)))
        });
        Strand::begin(scene, "cable");
        Strand::add_segments(scene, CABLE, "segment", rods);
        let edge = Vector3::repeat(gantry.load_edge);
        let cube = Body::cuboid(edge, gantry.load_mass);
        let depth = top + self.cable_length + gantry.load_offset;
        scene.load = Some(scene.add_body("load", cube.at(at(depth))));
    }

    fn add_rail(&self, scene: &mut Scene) {
        let along = axes_along(&Vector3::x()).unwrap_or_else(crate::frame::hanging_axes);
        let frames = [CRANE, TROLLEY].map(|b| Frame::body(b, Vector3::zeros()).with_axes(along));
        let law = RowLaw::new(0.0, self.damping);
        let rail = Slider {
            rotation: law,
            across: law,
            motor: Some(Motor {
                force_limit: self.trolley_force.unwrap_or(f64::INFINITY),
                ..Motor::speed(0.0)
            }),
            ..Slider::new(frames)
        };
        scene.add_constraint("rail", Constraint::Slider(rail), 0);
    }

    /// The hoist cable at y = ½ `side` `rope_spread.y`.
    fn rope(&self, side: f64) -> MasslessCable {
        let top = Vector3::new(0.0, 0.0, 0.5 * self.hook_height);
        let mut frames = Vec::with_capacity(2 * self.parts);
        let mut sheaves = Vec::new();
        for (k, offset) in self.falls(side).enumerate() {
            let ends = [
                Frame::body(TROLLEY, offset),
                Frame::body(HOOK, offset + top),
            ];
            // Down and up in turns.
            let [first, second] = if k % 2 == 0 { [0, 1] } else { [1, 0] };
            if !self.sheaves {
                frames.extend([ends[first], ends[second]]);
                continue;
            }
            if k == 0 {
                frames.push(ends[first]);
                sheaves.push(None);
            }
            if k + 1 == self.parts {
                frames.push(ends[second]);
                sheaves.push(None);
                continue;
            }
            // Under a sheave of the hook against y, over one of the trolley about y.
            let mut hub = ends[second];
            hub.point.x += self.sheave_radius();
            frames.push(hub.along(&(Vector3::y() * if second == 1 { -1.0 } else { 1.0 })));
            sheaves.push(Some(Sheave {
                friction: self.sheave_friction,
                ..Sheave::new(self.sheave_radius())
            }));
        }
        let length = self.rope_length(self.drop);
        let compliance = if self.rope_ea > 0.0 {
            length / self.rope_ea
        } else {
            0.0
        };
        MasslessCable {
            winch: Some(Winch {
                force_limit: self.winch_force.unwrap_or(f64::INFINITY),
                brake_limit: self.winch_force.unwrap_or(f64::INFINITY),
                shortest: self.rope_length(self.least_drop),
                ..Winch::new()
            }),
            sheaves,
            ..MasslessCable::new(frames, length, RowLaw::new(compliance, self.damping))
        }
    }

    /// Length of a hoist cable whose falls are `drop` (m) long each, with what lies along trolley and hook \[m].
    fn rope_length(&self, drop: f64) -> f64 {
        let along = if self.sheaves {
            (self.parts - 1) as f64 * PI * self.sheave_radius()
        } else {
            self.rope_spread[0]
        };
        self.parts as f64 * drop + along
    }

    /// Half the distance of two falls \[m].
    fn sheave_radius(&self) -> f64 {
        0.5 * self.rope_spread[0] / (self.parts - 1) as f64
    }

    fn join_cable(&self, scene: &mut Scene, gantry: &ResolvedGantry) {
        let l = gantry.segment_length;
        let strand = Strand::new(self.joint, gantry.stiffness, self.damping);
        let held = self.attachment.joint(self.joint);
        let (first, load) = (HOOK + 1, HOOK + 1 + self.segments);
        let below = Vector3::new(0.0, 0.0, -0.5 * self.hook_height);
        let top = [Frame::body(HOOK, below), strand.ends(first, l)[0]];
        strand.join(scene, CABLE, "top", (held, top), 0.5 * l);
        strand.join_segments(scene, CABLE, "joint", first..load, l);
        let above = Vector3::new(0.0, 0.0, gantry.load_offset);
        let bottom = [strand.ends(load - 1, l)[1], Frame::body(load, above)];
        strand.join(scene, CABLE, "bottom", (held, bottom), 0.5 * l);
    }

    fn add_controls(&self, scene: &mut Scene, ropes: [usize; 2]) {
        // Hauling in all falls at once lifts the hook by one fall's share.
        let lift = -(self.parts as f64);
        scene.controls.push(Control::of(TROLLEY_SPEED, RAIL, 1.0));
        if self.separate_ropes {
            let named = ["rope_1_speed", "rope_2_speed"].into_iter().zip(ropes);
            let each = named.map(|(name, rope)| Control::of(name, rope, lift));
            scene.controls.extend(each);
            return;
        }
        let drives = ropes.map(|constraint| Drive {
            constraint,
            gain: lift,
        });
        scene.controls.push(Control {
            name: HOIST_SPEED.to_owned(),
            drives: drives.to_vec(),
        });
    }
}
