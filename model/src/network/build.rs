//! Lays out the networks: polylines of exact segments, then bodies and joints along them.

use std::f64::consts::{FRAC_PI_6, PI};

use nalgebra::{UnitQuaternion, Vector3};

use super::{Held, Network, NetworkParams, ResolvedNetwork};
use crate::body::Body;
use crate::cable::JointKind;
use crate::cable::strand::Strand;
use crate::constraint::{Constraint, Distance, RowLaw, Spherical};
use crate::error::SceneError;
use crate::frame::Frame;
use crate::material::Material;
use crate::scene::Scene;
use crate::seed;

/// Slope of what must not be taut between two points at the same height \[rad].
const SLOPE: f64 = FRAC_PI_6;

/// A scene at work.
struct Builder<'a> {
    params: &'a NetworkParams,
    network: ResolvedNetwork,
    strand: Strand,
    scene: Scene,
}

/// A stretch of cable: the number of its cable, its first and its last segment.
#[derive(Clone, Copy)]
struct Stretch {
    cable: usize,
    first: usize,
    last: usize,
}

impl NetworkParams {
    /// Builds the scene with unstrained cables. Bodies: the segments, cable by cable from the top; then what they
    /// hold. Constraints: those of the cables from the top, then the links, then what holds the load. Groups: one for
    /// each tree, one for all that closes loops ([`Scene::group_by_topology`]).
    ///
    /// # Errors
    /// As [`NetworkParams::resolve`].
    pub fn build(&self) -> Result<Scene, SceneError> {
        let mut scene = Scene::new(self.network.name());
        scene.gravity = Vector3::new(0.0, 0.0, -self.gravity);
        let network = self.resolve()?;
        let mut builder = Builder {
            params: self,
            network,
            strand: Strand::new(self.joint, network.stiffness, self.damping),
            scene,
        };
        match self.network {
            Network::Ring => builder.ring(),
            Network::Junction => builder.junction(),
            Network::Cranes => builder.cranes(),
            Network::Ladder => builder.ladder(),
            Network::Net => builder.net(),
        }
        let mut scene = builder.scene;
        let spins = &mut scene.bodies.angular_velocity;
        let rates = match self.network {
            Network::Net => &mut scene.bodies.velocity,
            Network::Ring => &mut spins[..self.segments],
            Network::Junction => &mut spins[..3 * self.segments],
            Network::Cranes => &mut spins[..2 * self.segments],
            Network::Ladder => &mut spins[..self.cables * self.segments],
        };
        seed::replace(rates, self.seed, self.seed_rate);
        scene.start_in_equilibrium = self.equilibrium;
        scene.group_by_topology();
        scene.validate()?;
        Ok(scene)
    }
}

impl Builder<'_> {
    fn length(&self) -> f64 {
        self.network.segment_length
    }

    fn upper(&self, segment: usize) -> Frame {
        self.strand.ends(segment, self.length())[0]
    }

    fn lower(&self, segment: usize) -> Frame {
        self.strand.ends(segment, self.length())[1]
    }

    /// A straight cable: its [segments](Self::segments), joined.
    fn cable(
        &mut self,
        name: &str,
        from: Vector3<f64>,
        along: Vector3<f64>,
        count: usize,
    ) -> Stretch {
        let cable = Strand::begin(&mut self.scene, name);
        let stretch = self.segments(cable, name, [from, along], count);
        self.join_all(name, stretch);
        stretch
    }

    /// `count` segments in a straight line from a point along a unit vector.
    fn segments(
        &mut self,
        cable: usize,
        name: &str,
        [from, along]: [Vector3<f64>; 2],
        count: usize,
    ) -> Stretch {
        let l = self.length();
        let (radius, mass) = (self.network.radius, self.params.segment_mass);
        // The rotation about y that takes −z to `along`; exact for a cable straight down.
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * (-along.x).atan2(-along.z));
        let first = self.scene.bodies.len();
        let rods = (0..count).map(|i| {
            let centre = from + along * (l * (i as f64 + 0.5));
            Body::rod(l, radius, mass).at(centre).turned(turn)
        });
        Strand::add_segments(&mut self.scene, cable, name, rods);
        let last = first + count - 1;
        Stretch { cable, first, last }
    }

    /// Joins the segments of a stretch to each other.
    fn join_all(&mut self, name: &str, Stretch { cable, first, last }: Stretch) {
        let (joints, l) = (format!("{name}-joint"), self.length());
        self.strand
            .join_segments(&mut self.scene, cable, &joints, first..last + 1, l);
    }

    /// The inner joint between the lower end of `a` and the upper end of `b`.
    fn join(&mut self, cable: usize, name: String, a: usize, b: usize) {
        let joint = (self.params.joint, [self.lower(a), self.upper(b)]);
        let l = self.length();
        self.strand.join(&mut self.scene, cable, name, joint, l);
    }

    /// A ball joint at the end of a cable.
    fn end(&mut self, cable: usize, name: impl Into<String>, a: Frame, b: Frame) {
        let joint = (JointKind::Spherical, [a, b]);
        let half = 0.5 * self.length();
        self.strand.join(&mut self.scene, cable, name, joint, half);
    }

    /// Hangs the start of a stretch of cable from a point of the world.
    fn anchor(&mut self, of: Stretch, name: impl Into<String>, at: Vector3<f64>) {
        let upper = self.upper(of.first);
        self.end(of.cable, name, Frame::world(at), upper);
    }

    /// Ties a body to the end of a stretch of cable, at its point `lever`.
    fn tie(&mut self, of: Stretch, name: impl Into<String>, body: usize, lever: Vector3<f64>) {
        let lower = self.lower(of.last);
        self.end(of.cable, name, lower, Frame::body(body, lever));
    }

    /// The load: a solid steel sphere that hangs at its centre.
    fn load(&mut self, at: Vector3<f64>) -> usize {
        let mass = self.network.load_mass;
        let radius = (0.75 * mass / (PI * Material::STEEL.density)).cbrt();
        let load = self
            .scene
            .add_body("load", Body::sphere(radius, mass).at(at));
        self.scene.load = Some(load);
        load
    }

    /// The load: a beam from `left` to `right`, at the same height.
    fn beam(&mut self, left: Vector3<f64>, right: Vector3<f64>) -> usize {
        let width = right.x - left.x;
        let mass = self.network.load_mass;
        let side = (mass / (Material::STEEL.density * width)).sqrt();
        let beam = Body::cuboid(Vector3::new(width, side, side), mass);
        let load = self.scene.add_body("load", beam.at(0.5 * (left + right)));
        self.scene.load = Some(load);
        load
    }

    /// One cable along the straight sides of a closed polygon, its joints from end to end; the last one closes the loop.
    fn polygon(&mut self, corners: &[Vector3<f64>], counts: &[usize]) -> Vec<Stretch> {
        let cable = Strand::begin(&mut self.scene, "ring");
        let next = corners.iter().cycle().skip(1);
        let lines = (corners.iter().zip(next)).map(|(from, to)| [*from, (to - from).normalize()]);
        let side_name = |k: usize| format!("side-{}", k + 1);
        let sides: Vec<Stretch> = (lines.zip(counts).enumerate())
            .map(|(k, (line, &count))| self.segments(cable, &side_name(k), line, count))
            .collect();
        for (k, &side) in sides.iter().enumerate() {
            if k > 0 {
                self.join(cable, format!("corner-{k}"), sides[k - 1].last, side.first);
            }
            self.join_all(&side_name(k), side);
        }
        let last = sides[sides.len() - 1].last;
        self.join(cable, "closing".to_owned(), last, sides[0].first);
        sides
    }

    fn ring(&mut self) {
        let (n, l) = (self.params.segments, self.length());
        let length = |count: usize| l * count as f64;
        if self.params.points == 1 {
            // Two sides of about the same length, each with a corner outwards.
            let right = [n / 4, n / 2 - n / 4];
            let left_all = n - n / 2;
            let left = [left_all / 2, left_all - left_all / 2];
            let bottom = Vector3::new(0.0, 0.0, -0.9 * length(n / 2));
            let top = Vector3::zeros();
            let east = apex(top, bottom, length(right[0]), length(right[1]), 1.0);
            let west = apex(top, bottom, length(left[1]), length(left[0]), -1.0);
            let corners = [top, east, bottom, west];
            let counts = [right[0], right[1], left[0], left[1]];
            let sides = self.polygon(&corners, &counts);
            self.anchor(sides[0], "anchor", top);
            let load = self.load(bottom);
            self.tie(sides[1], "load", load, Vector3::zeros());
            return;
        }
        // A V between the two points, and a large one with the load.
        let half = ((n as f64 / 8.0).round() as usize).max(1);
        let right = (n - 2 * half) / 2;
        let left = n - 2 * half - right;
        let span = length(half) * SLOPE.cos();
        let west = Vector3::new(-span, 0.0, 0.0);
        let east = Vector3::new(span, 0.0, 0.0);
        let sag = Vector3::new(0.0, 0.0, -length(half) * SLOPE.sin());
        let bottom = apex(east, west, length(right), length(left), 1.0);
        let corners = [west, sag, east, bottom];
        let sides = self.polygon(&corners, &[half, half, right, left]);
        self.anchor(sides[0], "anchor-left", west);
        self.anchor(sides[2], "anchor-right", east);
        let load = self.load(bottom);
        self.tie(sides[2], "load", load, Vector3::zeros());
    }

    fn junction(&mut self) {
        let n = self.params.segments;
        let whole = self.length() * n as f64;
        let (sine, cosine) = SLOPE.sin_cos();
        let radius = 0.1 * self.length();
        let hub_at = Vector3::new(0.0, 0.0, -(whole + radius) * cosine);
        let mut tops = Vec::new();
        for (name, side) in [("left", -1.0), ("right", 1.0)] {
            let top = Vector3::new(side * (whole + radius) * sine, 0.0, 0.0);
            let along = Vector3::new(-side * sine, 0.0, -cosine);
            let cable = self.cable(name, top, along, n);
            self.anchor(cable, format!("anchor-{name}"), top);
            tops.push((name, cable, -along * radius));
        }
        let foot = Vector3::new(0.0, 0.0, -radius);
        let below = self.cable("below", hub_at + foot, -Vector3::z(), n);
        let hub = Body::sphere(radius, self.params.segment_mass).at(hub_at);
        let hub = self.scene.add_body("hub", hub);
        for (name, cable, lever) in tops {
            self.tie(cable, format!("hub-{name}"), hub, lever);
        }
        let upper = self.upper(below.first);
        self.end(below.cable, "hub-below", Frame::body(hub, foot), upper);
        let load = self.load(hub_at + foot - Vector3::z() * whole);
        self.tie(below, "load", load, Vector3::zeros());
    }

    fn cranes(&mut self) {
        let n = self.params.segments;
        let whole = self.length() * n as f64;
        let (sine, cosine) = (0.1, 0.99_f64.sqrt());
        let width = 0.3 * whole;
        let mut feet = Vec::new();
        for (name, side) in [("left", -1.0), ("right", 1.0)] {
            let foot = Vector3::new(side * 0.5 * width, 0.0, -whole * cosine);
            let top = Vector3::new(side * (0.5 * width + whole * sine), 0.0, 0.0);
            let along = Vector3::new(-side * sine, 0.0, -cosine);
            let cable = self.cable(name, top, along, n);
            self.anchor(cable, format!("crane-{name}"), top);
            feet.push((name, cable, foot));
        }
        let beam = self.beam(feet[0].2, feet[1].2);
        for (name, cable, foot) in feet {
            let lever = foot - self.scene.bodies.position[beam];
            self.tie(cable, format!("load-{name}"), beam, lever);
        }
    }

    fn ladder(&mut self) {
        let (n, k) = (self.params.segments, self.params.cables);
        let spacing = self.params.spacing;
        let whole = self.length() * n as f64;
        let top = |j: usize| {
            let x = spacing * (j as f64 - 0.5 * (k - 1) as f64);
            Vector3::new(x, 0.0, 0.0)
        };
        let mut cables = Vec::new();
        for j in 0..k {
            let name = format!("cable-{}", j + 1);
            let cable = self.cable(&name, top(j), -Vector3::z(), n);
            self.anchor(cable, format!("{name}-anchor"), top(j));
            cables.push(cable);
        }
        let every = self.params.rung_every;
        for below in (every..n).step_by(every) {
            for j in 1..k {
                let [a, b] = [cables[j - 1], cables[j]].map(|cable| cable.first + below);
                let frames = [self.upper(a), self.upper(b)];
                let rung = self.link(frames, spacing, false);
                self.scene
                    .add_constraint(format!("rung-{below}-{j}"), rung, 0);
            }
        }
        let down = -Vector3::z() * whole;
        let beam = self.beam(top(0) + down, top(k - 1) + down);
        for (j, cable) in cables.into_iter().enumerate() {
            let lever = top(j) + down - self.scene.bodies.position[beam];
            self.tie(cable, format!("load-{}", j + 1), beam, lever);
        }
    }

    /// A link of the cable's axial stiffness.
    fn link(&self, frames: [Frame; 2], length: f64, transverse: bool) -> Constraint {
        let compliance = length / self.network.stiffness.ea;
        Constraint::Distance(Distance {
            frames,
            length,
            law: RowLaw::new(compliance, self.params.damping),
            transverse,
        })
    }

    fn net(&mut self) {
        let (rows, columns, l) = (self.params.rows, self.params.columns, self.length());
        let slope = match self.params.held {
            Held::Edge => 0.0,
            Held::Corners => SLOPE,
        };
        let down = Vector3::new(0.0, 0.0, -l);
        // The upper edge: down to the middle and up again, with a level link in between where their number is odd.
        let links = columns - 1;
        let mut edge = vec![Vector3::zeros()];
        for j in 0..links {
            let side = f64::from((2 * j + 1).cmp(&links) as i8);
            let fall = slope * side;
            edge.push(edge[j] + Vector3::new(l * fall.cos(), 0.0, l * fall.sin()));
        }
        for i in 0..rows {
            for (j, top) in edge.iter().enumerate() {
                let last = i + 1 == rows;
                let mass = if last {
                    self.network.load_mass
                } else {
                    self.params.segment_mass
                };
                let node = Body::particle(mass).at(top + down * i as f64);
                let index = self.scene.add_body(format!("node-{i}-{j}"), node);
                if last && j == columns / 2 {
                    self.scene.load = Some(index);
                }
            }
        }
        let node = |i: usize, j: usize| Frame::body(i * columns + j, Vector3::zeros());
        for (j, top) in edge.iter().enumerate() {
            if self.params.held == Held::Edge || j == 0 || j == links {
                // Half a link of cable between the world and the node.
                let stretch = self.strand.law(0.5 * l).stretch.unwrap_or_default();
                let frames = [Frame::world(*top), node(0, j)];
                let anchor = Constraint::Spherical(Spherical { frames, stretch });
                self.scene.add_constraint(format!("anchor-{j}"), anchor, 0);
            }
        }
        for i in 0..rows {
            for j in 0..columns {
                if i > 0 {
                    let link = self.link([node(i - 1, j), node(i, j)], l, true);
                    self.scene.add_constraint(format!("down-{i}-{j}"), link, 0);
                }
                if j > 0 {
                    let link = self.link([node(i, j - 1), node(i, j)], l, true);
                    self.scene
                        .add_constraint(format!("across-{i}-{j}"), link, 0);
                }
            }
        }
    }
}

/// The corner of a triangle over the side from `p` to `q`, at the distances `a` from `p` and `b` from `q`. With `side` 1
/// it lies where a quarter turn from x towards z takes the direction of that side, with −1 opposite.
fn apex(p: Vector3<f64>, q: Vector3<f64>, a: f64, b: f64, side: f64) -> Vector3<f64> {
    let base = q - p;
    let c = base.norm();
    let along = base / c;
    let foot = (a * a - b * b + c * c) / (2.0 * c);
    let height = ((a - foot) * (a + foot)).max(0.0).sqrt();
    // `along` turned by a right angle in the plane of x and z.
    let across = Vector3::new(-along.z, 0.0, along.x);
    p + along * foot + across * (side * height)
}
