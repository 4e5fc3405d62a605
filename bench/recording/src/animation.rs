//! A recording as animated glTF 2.0: each body a node that moves, in metres and seconds, y up.
//!
//! Bodies and spans that come and go have the scale zero while they are not there. Colours are of kinds, not of loads, for
//! which the format has no animation.

use crate::layout::{Point, Shape, Solid};
use crate::place::{At, along};
use crate::read::{Part, Recording};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Corners of a circle.
pub(crate) const AROUND: usize = 16;

/// Thickness of lines and points, over the size of the scene.
const THIN: f64 = 0.002;

/// Materials, with their colours.
const MATERIALS: [(&str, [f64; 4]); 4] = [
    ("body", [0.48, 0.53, 0.6, 1.0]),
    ("load", [0.45, 0.36, 0.66, 1.0]),
    ("cable", [0.85, 0.45, 0.12, 1.0]),
    ("world", [0.6, 0.62, 0.6, 1.0]),
];
const BODY: usize = 0;
const LOAD: usize = 1;
const CABLE: usize = 2;
const WORLD: usize = 3;

/// A recording has no frame, so that nothing moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the recording has no frame to be shown: record a run that makes a step")]
pub struct NoFrames;

/// A frame: its part and its number there.
type PartFrame<'a> = (&'a Part, usize);

/// Parts of the file while it is built.
#[derive(Default)]
struct Asset {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    /// Meshes by shape and material.
    made: HashMap<String, usize>,
    nodes: Vec<Value>,
    roots: Vec<usize>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
    /// Accessor of the times.
    times: usize,
    /// Radius of lines, and half of an edge of the ground \[m].
    thin: f64,
    wide: f64,
}

/// The recording as glTF: binary, or as JSON with its numbers in base64.
pub fn animation(recording: &Recording, binary: bool) -> Result<Vec<u8>, NoFrames> {
    let [start, _] = recording.span().ok_or(NoFrames)?;
    let (mut places, mut times): (Vec<PartFrame<'_>>, Vec<f32>) = (Vec::new(), Vec::new());
    for part in &recording.parts {
        for (frame, time) in part.times.iter().enumerate() {
            let time = (time - start) as f32;
            // The format wants them to ascend.
            if times.last().is_none_or(|last| time > *last) {
                times.push(time);
                places.push((part, frame));
            }
        }
    }
    let size = size(&places);
    let mut asset = Asset {
        thin: THIN * size,
        wide: size,
        ..Asset::default()
    };
    asset.times = asset.numbers(&times, "SCALAR", 1);
    asset.world(&places);
    asset.bodies(&places);
    asset.lines(&places);
    Ok(asset.finish(&recording.header.scene, binary))
}

/// Diagonal of the box that all bodies move in \[m].
fn size(places: &[PartFrame<'_>]) -> f64 {
    let (mut low, mut high) = (
        Vector3::repeat(f64::INFINITY),
        Vector3::repeat(f64::NEG_INFINITY),
    );
    for (part, frame) in places.iter().step_by(1 + places.len() / 100) {
        for body in 0..part.layout.bodies.len() {
            let at = Vector3::from(part.position(*frame, body));
            (low, high) = (low.inf(&at), high.sup(&at));
        }
    }
    let size = (high - low).norm();
    if size.is_finite() { size.max(1.0) } else { 1.0 }
}

/// A turn as the format has it, scalar last.
fn turned(turn: &UnitQuaternion<f64>) -> [f32; 4] {
    [turn.i, turn.j, turn.k, turn.w].map(|x| x as f32)
}

impl Asset {
    fn view(&mut self, from: usize) -> usize {
        let length = self.bytes.len() - from;
        self.views
            .push(json!({ "buffer": 0, "byteOffset": from, "byteLength": length }));
        self.views.len() - 1
    }

    /// An accessor of vectors of so many numbers.
    fn numbers(&mut self, numbers: &[f32], kind: &str, width: usize) -> usize {
        let from = self.bytes.len();
        // glTF has no infinities or NaN.
        let finite = |x: &f32| if x.is_finite() { *x } else { 0.0 };
        let numbers: Vec<f32> = numbers.iter().map(finite).collect();
        self.bytes
            .extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        let view = self.view(from);
        let bound = |worse: fn(f32, f32) -> f32| -> Vec<f32> {
            let of = |k: usize| numbers.iter().skip(k).step_by(width).copied().reduce(worse);
            (0..width).filter_map(of).collect()
        };
        self.accessors.push(json!({
            "bufferView": view, "componentType": 5126, "count": numbers.len() / width, "type": kind,
            "min": bound(f32::min), "max": bound(f32::max),
        }));
        self.accessors.len() - 1
    }

    /// The mesh of a shape; none of the ground on a body.
    fn mesh(&mut self, shape: &Shape, material: usize) -> usize {
        let key = format!("{shape:?} {material}");
        if let Some(mesh) = self.made.get(&key) {
            return *mesh;
        }
        let (points, triangles) = surface(shape, self.thin, self.wide);
        let numbers: Vec<f32> = points.iter().flatten().map(|x| *x as f32).collect();
        let position = self.numbers(&numbers, "VEC3", 3);
        let from = self.bytes.len();
        let corners = triangles.iter().flatten();
        self.bytes
            .extend(corners.flat_map(|k| (*k as u32).to_le_bytes()));
        let view = self.view(from);
        self.accessors.push(json!({
            "bufferView": view, "componentType": 5125, "count": 3 * triangles.len(), "type": "SCALAR",
        }));
        let indices = self.accessors.len() - 1;
        self.meshes.push(json!({ "primitives": [{
            "attributes": { "POSITION": position }, "indices": indices, "material": material,
        }] }));
        self.made.insert(key, self.meshes.len() - 1);
        self.meshes.len() - 1
    }

    fn node(&mut self, pose: &Isometry3<f64>, mesh: usize) -> usize {
        let at: [f64; 3] = pose.translation.vector.into();
        self.nodes
            .push(json!({ "mesh": mesh, "translation": at, "rotation": turned(&pose.rotation) }));
        self.nodes.len() - 1
    }

    fn animate(
        &mut self,
        node: usize,
        path: &str,
        values: &[f32],
        width: usize,
        interpolation: &str,
    ) {
        let kind = if width == 4 { "VEC4" } else { "VEC3" };
        let output = self.numbers(values, kind, width);
        self.samplers
            .push(json!({ "input": self.times, "output": output, "interpolation": interpolation }));
        let sampler = self.samplers.len() - 1;
        self.channels
            .push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
    }

    /// Adds the static shapes of the world.
    fn world(&mut self, places: &[PartFrame<'_>]) {
        for solid in places
            .first()
            .map_or(&[][..], |(part, _)| &part.layout.world)
        {
            let mesh = self.mesh(&solid.shape, WORLD);
            let node = self.node(&solid.pose(), mesh);
            self.roots.push(node);
        }
    }

    /// A node for each name that a body has.
    fn bodies(&mut self, places: &[PartFrame<'_>]) {
        let mut names: HashMap<&str, Vec<Option<usize>>> = HashMap::new();
        let mut order = Vec::new();
        for (k, (part, _)) in places.iter().enumerate() {
            for (i, body) in part.layout.bodies.iter().enumerate() {
                let numbers = names.entry(&body.name).or_insert_with(|| {
                    order.push(body.name.as_str());
                    vec![None; places.len()]
                });
                numbers[k] = Some(i);
            }
        }
        for name in order {
            self.body(places, name, &names[name]);
        }
    }

    /// A body with its solids as of the first frame that has it, by its numbers in the frames.
    fn body(&mut self, places: &[PartFrame<'_>], name: &str, numbers: &[Option<usize>]) {
        let mut known = places.iter().zip(numbers);
        let Some((part, number)) = known.find_map(|((part, _), i)| Some((*part, (*i)?))) else {
            return;
        };
        let is_load = part.layout.load == Some(number);
        let is_segment = part
            .layout
            .cables
            .iter()
            .any(|c| c.bodies.contains(&number));
        let material = match (is_load, is_segment) {
            (true, _) => LOAD,
            (_, true) => CABLE,
            _ => BODY,
        };
        let mut children = Vec::new();
        let solids = part.layout.bodies[number].solids.iter().enumerate();
        for (k, solid) in solids.filter(|(_, s)| s.shape != Shape::Ground) {
            let mesh = self.mesh(&solid.shape, material);
            let child = self.node(&solid.pose(), mesh);
            children.push(child);
            self.stretch(places, numbers, (k, solid), child);
        }
        let points = part.layout.lines.iter().flat_map(|line| &line.points);
        for point in points.filter(|p| p.body == Some(number)) {
            children.extend(self.sheave(point, material));
        }
        let mut node = json!({ "name": name });
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        self.nodes.push(node);
        let node = self.nodes.len() - 1;
        self.roots.push(node);
        self.moves(places, numbers, node);
    }

    /// A wheel on a body.
    fn sheave(&mut self, point: &Point, material: usize) -> Option<usize> {
        let sheave = point.sheave.as_ref()?;
        let [v, w] = sheave.axes.map(|a| Vector3::from(a).cast::<f64>());
        let at = Vector3::from(point.at).cast::<f64>();
        let shape = Shape::Cylinder {
            length: (2.0 * self.thin) as f32,
            radius: sheave.radius,
        };
        let mesh = self.mesh(&shape, material);
        Some(self.node(&Isometry3::from_parts(at.into(), along(&v.cross(&w))), mesh))
    }

    /// The motion of a body; without a size where it is not there.
    fn moves(&mut self, places: &[PartFrame<'_>], numbers: &[Option<usize>], node: usize) {
        let (mut at, mut turns, mut there) = (Vec::new(), Vec::new(), Vec::new());
        let mut last = Isometry3::identity();
        for ((part, frame), number) in places.iter().zip(numbers) {
            if number.is_some() {
                last = part.pose(*frame, *number);
            }
            at.extend(last.translation.vector.iter().map(|x| *x as f32));
            turns.extend(turned(&last.rotation));
            there.extend([f32::from(u8::from(number.is_some())); 3]);
        }
        self.animate(node, "translation", &at, 3, "LINEAR");
        self.animate(node, "rotation", &turns, 4, "LINEAR");
        if there.contains(&0.0) {
            self.animate(node, "scale", &there, 3, "STEP");
        }
    }

    /// Scales what has another length in another frame, against that of its mesh.
    fn stretch(
        &mut self,
        places: &[PartFrame<'_>],
        numbers: &[Option<usize>],
        (k, solid): (usize, &Solid),
        node: usize,
    ) {
        let length = |solid: &Solid| match solid.shape {
            Shape::Capsule { length, .. } => f64::from(length),
            _ => 1.0,
        };
        let own = length(solid);
        let of = |((part, frame), number): (&PartFrame<'_>, &Option<usize>)| {
            let solid = part.layout.bodies[(*number)?].solids.get(k)?;
            let now = part.stretch(*frame, solid) * length(solid) / own;
            now.is_finite().then_some(now)
        };
        let all: Vec<f64> = places
            .iter()
            .zip(numbers)
            .map(|pair| of(pair).unwrap_or(1.0))
            .collect();
        if all.iter().any(|s| (s - 1.0).abs() > 1e-6) {
            let scales: Vec<f32> = all.iter().flat_map(|s| [1.0, 1.0, *s as f32]).collect();
            self.animate(node, "scale", &scales, 3, "LINEAR");
        }
    }

    /// A thin cylinder for each span of a massless cable or link.
    fn lines(&mut self, places: &[PartFrame<'_>]) {
        let mut spans: HashMap<(&str, usize), Vec<Option<[At; 2]>>> = HashMap::new();
        let mut order = Vec::new();
        for (k, (part, frame)) in places.iter().enumerate() {
            for line in &part.layout.lines {
                for (from, ends) in part.spans(*frame, line) {
                    let key = (line.name.as_str(), from);
                    let all = spans.entry(key).or_insert_with(|| {
                        order.push(key);
                        vec![None; places.len()]
                    });
                    all[k] = Some(ends);
                }
            }
        }
        for (name, from) in order {
            let (mut at, mut turns, mut scales) = (Vec::new(), Vec::new(), Vec::new());
            let mut last = [At::origin(), At::new(0.0, 0.0, 1.0)];
            for ends in &spans[&(name, from)] {
                last = ends.unwrap_or(last);
                let [a, b] = last;
                let middle = nalgebra::center(&a, &b);
                at.extend(middle.iter().map(|x| *x as f32));
                turns.extend(turned(&along(&(b - a))));
                let there = f32::from(u8::from(ends.is_some()));
                scales.extend([there, there, there * (b - a).norm() as f32]);
            }
            let shape = Shape::Cylinder {
                length: 1.0,
                radius: self.thin as f32,
            };
            let mesh = self.mesh(&shape, CABLE);
            self.nodes
                .push(json!({ "name": format!("{name} from point {from}"), "mesh": mesh }));
            let node = self.nodes.len() - 1;
            self.roots.push(node);
            self.animate(node, "translation", &at, 3, "LINEAR");
            self.animate(node, "rotation", &turns, 4, "LINEAR");
            self.animate(node, "scale", &scales, 3, "LINEAR");
        }
    }

    fn finish(mut self, scene: &str, binary: bool) -> Vec<u8> {
        // Up is z here and y there.
        let up = turned(&UnitQuaternion::from_scaled_axis(Vector3::x() * -0.5 * PI));
        self.nodes
            .push(json!({ "name": scene, "children": self.roots, "rotation": up }));
        let material = |(name, colour): (&str, [f64; 4])| {
            let surface =
                json!({ "baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.8 });
            json!({ "name": name, "pbrMetallicRoughness": surface })
        };
        let mut buffer = json!({ "byteLength": self.bytes.len() });
        if !binary {
            let data = STANDARD.encode(&self.bytes);
            buffer["uri"] = json!(format!("data:application/octet-stream;base64,{data}"));
        }
        let whole = json!({
            "asset": { "version": "2.0", "generator": format!("taut {}", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "name": scene, "nodes": [self.nodes.len() - 1] }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": MATERIALS.map(material),
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [buffer],
            "animations": [{ "name": "run", "samplers": self.samplers, "channels": self.channels }],
        });
        let mut text = whole.to_string().into_bytes();
        if !binary {
            return text;
        }
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + self.bytes.len();
        let mut file = b"glTF".to_vec();
        let mut word = |n: usize| (n as u32).to_le_bytes();
        file.extend([2, length, text.len()].map(&mut word).concat());
        file.extend(b"JSON");
        file.extend(&text);
        file.extend(word(self.bytes.len()));
        file.extend(b"BIN\0");
        file.extend(&self.bytes);
        file
    }
}

type Surface = (Vec<[f64; 3]>, Vec<[usize; 3]>);

/// Corners and triangles of a shape, seen from outside in the positive sense.
pub(crate) fn surface(shape: &Shape, thin: f64, wide: f64) -> Surface {
    let arc = |from: f64, to: f64, radius: f64, at: f64| {
        let angles = (0..=4).map(move |k| from + (to - from) * f64::from(k) / 4.0);
        angles.map(move |a| [radius * a.cos(), at + radius * a.sin()])
    };
    let half = 0.5 * PI;
    match *shape {
        Shape::Sphere { radius } => {
            let radius = f64::from(radius);
            let profile = arc(-half, 0.0, radius, 0.0).chain(arc(0.0, half, radius, 0.0));
            revolved(&profile.collect::<Vec<_>>())
        }
        Shape::Capsule { length, radius } => {
            let (radius, end) = (f64::from(radius), 0.5 * f64::from(length));
            let profile = arc(-half, 0.0, radius, -end).chain(arc(0.0, half, radius, end));
            revolved(&profile.collect::<Vec<_>>())
        }
        Shape::Cylinder { length, radius } => {
            let (radius, end) = (f64::from(radius), 0.5 * f64::from(length));
            revolved(&[[0.0, -end], [radius, -end], [radius, end], [0.0, end]])
        }
        Shape::Box { size } => cuboid(size.map(f64::from)),
        Shape::Ground => {
            let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
            let corners = corners.map(|[x, y]| [wide * x, wide * y, 0.0]);
            (corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
        }
        Shape::Point => cuboid([4.0 * thin; 3]),
    }
}

fn cuboid(size: [f64; 3]) -> Surface {
    let corner = |k: usize| {
        [0, 1, 2].map(|i| {
            if k >> i & 1 == 1 {
                0.5 * size[i]
            } else {
                -0.5 * size[i]
            }
        })
    };
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = faces
        .iter()
        .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    ((0..8).map(corner).collect(), triangles.collect())
}

/// A profile, of distance from the axis and height, upwards and turned about z.
fn revolved(profile: &[[f64; 2]]) -> Surface {
    let points = profile.iter().flat_map(|[r, z]| {
        (0..AROUND).map(move |k| {
            let (sine, cosine) = (TAU * k as f64 / AROUND as f64).sin_cos();
            [r * cosine, r * sine, *z]
        })
    });
    let mut triangles = Vec::new();
    for ring in 1..profile.len() {
        for k in 0..AROUND {
            let [a, b] = [k, (k + 1) % AROUND].map(|k| (ring - 1) * AROUND + k);
            let [c, d] = [a, b].map(|below| below + AROUND);
            // Triangles at the axis have no area.
            if profile[ring - 1][0] > 0.0 {
                triangles.push([a, b, d]);
            }
            if profile[ring][0] > 0.0 {
                triangles.push([a, d, c]);
            }
        }
    }
    (points.collect(), triangles)
}
