//! One frame as a picture: what the page shows at first, without a browser.
//!
//! All that is seen are triangles of flat shade in perspective, of which the nearest is kept in each of [`FINE`]² samples of a
//! pixel. Segments and lines are as wide as some pixels at least; the dark stripe of a segment is fixed to it.

use crate::animation::{AROUND, NoFrames, surface};
use crate::layout::{Body, Shape, Solid};
use crate::place::{At, along};
use crate::read::{Part, Recording};
use nalgebra::{Isometry3, Point3, Vector3};
use std::io;

/// Width and height \[pixels].
const SIZE: [usize; 2] = [1200, 900];

/// Samples of a pixel across and down.
const FINE: usize = 3;

/// Distance of the picture from the eye, in heights of it.
const FOCUS: f64 = 1.1;

/// Least radius of segments and lines \[pixels].
const LEAST: f64 = 2.5;

/// Forces up to this share of the largest are not drawn.
const NEGLIGIBLE: f64 = 0.01;

/// Tensions up to this are rounding \[N].
const ROUNDING: f64 = 1e-6;

type Colour = [f64; 3];

const BACK: Colour = [255.0, 255.0, 255.0];
const SOLID: Colour = [185.0, 194.0, 204.0];
const LOAD: Colour = [142.0, 124.0, 195.0];
const GRID: Colour = [216.0, 216.0, 216.0];
const LINE: Colour = [92.0, 92.0, 92.0];
const STRIPE: Colour = [58.0, 64.0, 72.0];
const FORCE: Colour = [194.0, 24.0, 91.0];
const STOPS: [Colour; 5] = [
    [76.0, 111.0, 224.0],
    [42.0, 165.0, 184.0],
    [108.0, 194.0, 74.0],
    [240.0, 180.0, 41.0],
    [228.0, 87.0, 46.0],
];

/// A frame as a PNG file, and the tensions that its colours reach from and to \[N], where there are any.
#[derive(Debug, Clone, PartialEq)]
pub struct Still {
    /// The file.
    pub png: Vec<u8>,
    /// Time of the frame \[s].
    pub time: f64,
    /// Least and largest tension of the whole recording \[N].
    pub tensions: Option<[f64; 2]>,
}

/// The last frame at a time (s) or before it, or else the first.
pub fn still(recording: &Recording, time: f64) -> io::Result<Still> {
    let places = recording
        .parts
        .iter()
        .flat_map(|p| (0..p.times.len()).map(move |k| (p, k)));
    let before = places
        .take_while(|(p, k)| p.times[*k] <= time + 1e-9)
        .last();
    let first = recording.parts.first().map(|part| (part, 0));
    let (part, frame) = before.or(first).ok_or_else(|| io::Error::other(NoFrames))?;
    let tensions = tensions(recording);
    let mut view = View::of(part, frame);
    draw(&mut view, part, frame, tensions);
    forces(&mut view, part, frame, recording.header.gravity.into());
    let png = view.encoded()?;
    let time = part.times[frame];
    Ok(Still {
        png,
        time,
        tensions,
    })
}

/// Least and largest tension of segments and lines over the recording \[N].
fn tensions(recording: &Recording) -> Option<[f64; 2]> {
    let of = |part: &Part| {
        let layout = &part.layout;
        let segments = layout.bodies.iter().flat_map(|body| body.loads[0].clone());
        let lines = layout.lines.iter().filter_map(|line| line.tension);
        let all: Vec<usize> = segments.chain(lines).collect();
        let frames = 0..part.times.len();
        let values = frames.flat_map(|k| all.iter().map(move |c| (k, *c)));
        let finite = values
            .map(|(k, c)| part.value(k, c))
            .filter(|x| x.is_finite());
        finite.fold(None, |range: Option<[f64; 2]>, x| {
            let [low, high] = range.unwrap_or([x, x]);
            Some([low.min(x), high.max(x)])
        })
    };
    let parts = recording.parts.iter().filter_map(of);
    let range = parts.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
    range.filter(|[low, high]| low.abs().max(high.abs()) > ROUNDING)
}

fn hue(x: f64, range: Option<[f64; 2]>) -> Colour {
    let (Some([low, high]), true) = (range, x.is_finite()) else {
        return SOLID;
    };
    let share = if high > low {
        (x - low) / (high - low)
    } else {
        0.0
    };
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let k = (place as usize).min(STOPS.len() - 2);
    [0, 1, 2].map(|i| STOPS[k][i] + (place - k as f64) * (STOPS[k + 1][i] - STOPS[k][i]))
}

/// An eye, and what it sees.
struct View {
    target: At,
    /// Across, up and towards the eye.
    axes: [Vector3<f64>; 3],
    distance: f64,
    size: f64,
    /// Depth and colour of each sample.
    depth: Vec<f64>,
    colour: Vec<Colour>,
}

impl View {
    /// View that holds everything of a frame.
    fn of(part: &Part, frame: usize) -> Self {
        let layout = &part.layout;
        let (mut low, mut high) = (
            Vector3::repeat(f64::INFINITY),
            Vector3::repeat(f64::NEG_INFINITY),
        );
        let mut see = |at: At| {
            if at.iter().all(|x| x.is_finite()) {
                (low, high) = (low.inf(&at.coords), high.sup(&at.coords));
            }
        };
        for body in 0..layout.bodies.len() {
            see(part.position(frame, body).into());
        }
        let points = layout.lines.iter().flat_map(|line| &line.points);
        points
            .chain(&layout.anchors)
            .for_each(|point| see(part.point(frame, point)));
        let size = (high - low).norm();
        let size = if size.is_finite() { size.max(0.5) } else { 1.0 };
        let ((sy, cy), (sp, cp)) = ((-1.1_f64).sin_cos(), 0.25_f64.sin_cos());
        let samples = SIZE[0] * SIZE[1] * FINE * FINE;
        Self {
            target: if low.x <= high.x {
                nalgebra::center(&low.into(), &high.into())
            } else {
                At::origin()
            },
            axes: [
                Vector3::new(-sy, cy, 0.0),
                Vector3::new(-sp * cy, -sp * sy, cp),
                Vector3::new(cp * cy, cp * sy, sp),
            ],
            distance: 1.4 * size,
            size,
            depth: vec![f64::INFINITY; samples],
            colour: vec![BACK; samples],
        }
    }

    /// Metres of a pixel at the target.
    fn pixel(&self) -> f64 {
        self.distance / (FOCUS * SIZE[1] as f64)
    }

    /// Where a point is in samples, and how far away.
    fn seen(&self, at: &At) -> [f64; 3] {
        let d = at - self.target;
        let [x, y, z] = [0, 1, 2].map(|k| self.axes[k].dot(&d));
        let depth = self.distance - z;
        let scale = FOCUS * (SIZE[1] * FINE) as f64 / depth;
        let middle = [0, 1].map(|k| 0.5 * (SIZE[k] * FINE) as f64);
        [middle[0] + x * scale, middle[1] - y * scale, depth]
    }

    fn triangle(&mut self, corners: &[At; 3], colour: Colour) {
        let seen = [0, 1, 2].map(|k| self.seen(&corners[k]));
        let near = 0.02 * self.distance;
        if !seen.iter().flatten().all(|x| x.is_finite()) || seen.iter().any(|p| p[2] < near) {
            return;
        }
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let normal = normal.try_normalize(0.0).unwrap_or_default();
        let light = 0.8 + 0.12 * normal.z + 0.08 * normal.dot(&self.axes[2]).abs();
        let shade = colour.map(|c| (c * light).clamp(0.0, 255.0));
        let [a, b, c] = seen;
        let across = |p: [f64; 3], q: [f64; 3], x: f64, y: f64| {
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
        };
        let area = across(a, b, c[0], c[1]);
        if area == 0.0 {
            return;
        }
        let range = |k: usize| {
            let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            let end = SIZE[k] * FINE;
            (low.floor().max(0.0) as usize).min(end)..((high + 1.0).max(0.0) as usize).min(end)
        };
        for row in range(1) {
            for column in range(0) {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                let [u, v, w] =
                    [across(b, c, x, y), across(c, a, x, y), across(a, b, x, y)].map(|s| s / area);
                if u < 0.0 || v < 0.0 || w < 0.0 {
                    continue;
                }
                // Inverse depths are linear on the picture.
                let depth = 1.0 / (u / a[2] + v / b[2] + w / c[2]);
                let place = row * SIZE[0] * FINE + column;
                if depth < self.depth[place] {
                    (self.depth[place], self.colour[place]) = (depth, shade);
                }
            }
        }
    }

    /// A shape in a pose; a segment has its stripe.
    fn shape(&mut self, shape: &Shape, pose: &Isometry3<f64>, colour: Colour, striped: bool) {
        let (points, triangles) = surface(shape, 0.002 * self.size, self.size);
        let points: Vec<At> = points.iter().map(|p| pose * Point3::from(*p)).collect();
        for corners in triangles {
            let stripe = striped && corners[0] % AROUND == 0;
            let own = if stripe { STRIPE } else { colour };
            self.triangle(&corners.map(|k| points[k]), own);
        }
    }

    fn line(&mut self, [a, b]: [At; 2], radius: f64, colour: Colour) {
        let along = along(&(b - a));
        let shape = Shape::Cylinder {
            length: (b - a).norm() as f32,
            radius: radius as f32,
        };
        let middle = nalgebra::center(&a, &b).coords;
        self.shape(
            &shape,
            &Isometry3::from_parts(middle.into(), along),
            colour,
            false,
        );
    }

    fn arrow(&mut self, from: At, force: Vector3<f64>) {
        let wide = 1.6 * self.pixel();
        let (tip, head) = (from + force, (8.0 * self.pixel()).min(0.5 * force.norm()));
        let neck = tip - force.normalize() * head;
        self.line([from, neck], wide, FORCE);
        let axes = nalgebra::UnitQuaternion::from(along(&force));
        let around = |k: usize| {
            let (sine, cosine) = (std::f64::consts::TAU * k as f64 / AROUND as f64).sin_cos();
            neck + axes * Vector3::new(cosine, sine, 0.0) * (3.0 * wide)
        };
        (0..AROUND).for_each(|k| self.triangle(&[around(k), around(k + 1), tip], FORCE));
    }

    fn encoded(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::with_capacity(3 * SIZE[0] * SIZE[1]);
        for row in 0..SIZE[1] {
            for column in 0..SIZE[0] {
                let mut sum = [0.0; 3];
                for sample in 0..FINE * FINE {
                    let (down, across) =
                        (FINE * row + sample / FINE, FINE * column + sample % FINE);
                    let colour = self.colour[down * SIZE[0] * FINE + across];
                    sum.iter_mut().zip(colour).for_each(|(sum, c)| *sum += c);
                }
                bytes.extend(sum.map(|s| (s / (FINE * FINE) as f64).round() as u8));
            }
        }
        let mut png = Vec::new();
        let mut encoder = png::Encoder::new(&mut png, SIZE[0] as u32, SIZE[1] as u32);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        writer.write_image_data(&bytes).map_err(io::Error::other)?;
        writer.finish().map_err(io::Error::other)?;
        Ok(png)
    }
}

fn draw(view: &mut View, part: &Part, frame: usize, tensions: Option<[f64; 2]>) {
    let layout = &part.layout;
    for solid in &layout.world {
        if solid.shape == Shape::Ground {
            grid(view, solid);
        } else {
            view.shape(&solid.shape, &solid.pose(), GRID, false);
        }
    }
    for (i, body) in layout.bodies.iter().enumerate() {
        let there = part.pose(frame, Some(i));
        let plain = if layout.load == Some(i) { LOAD } else { SOLID };
        let tension = mean(part, frame, body);
        for solid in body.solids.iter().filter(|s| s.shape != Shape::Ground) {
            match solid.shape {
                Shape::Capsule { length, radius } => {
                    let shape = Shape::Capsule {
                        length: (f64::from(length) * part.stretch(frame, solid)) as f32,
                        radius: f64::from(radius).max(LEAST * view.pixel()) as f32,
                    };
                    let colour = tension.map_or(plain, |x| hue(x, tensions));
                    view.shape(&shape, &(there * solid.pose()), colour, true);
                }
                shape => view.shape(&shape, &(there * solid.pose()), plain, false),
            }
        }
    }
    for line in &layout.lines {
        let tension = line.tension.map_or(f64::NAN, |c| part.value(frame, c));
        let colour = if tension.is_finite() {
            hue(tension, tensions)
        } else {
            LINE
        };
        for (_, ends) in part.spans(frame, line) {
            view.line(ends, 0.6 * LEAST * view.pixel(), colour);
        }
        for (point, sheave) in line
            .points
            .iter()
            .filter_map(|p| Some((p, p.sheave.as_ref()?)))
        {
            let [v, w] = sheave.axes.map(|a| Vector3::from(a).cast::<f64>());
            let turn = part.pose(frame, point.body).rotation * along(&v.cross(&w));
            let pose = Isometry3::from_parts(part.point(frame, point).coords.into(), turn);
            let shape = Shape::Cylinder {
                length: (4.0 * view.pixel()) as f32,
                radius: sheave.radius,
            };
            view.shape(&shape, &pose, SOLID, false);
        }
    }
}

/// Mean tension of the joints of a segment \[N].
fn mean(part: &Part, frame: usize, body: &Body) -> Option<f64> {
    let all = body.loads[0].iter().map(|c| part.value(frame, *c));
    let all: Vec<f64> = all.filter(|x| x.is_finite()).collect();
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

/// Lines on the ground below what is looked at.
fn grid(view: &mut View, ground: &Solid) {
    let pose = ground.pose();
    let middle = pose.inverse() * view.target;
    let step = 10_f64.powf((view.size / 8.0).log10().round());
    let snapped = [middle.x, middle.y].map(|x| (x / step).round() * step);
    for k in -10..=10 {
        let [off, end] = [f64::from(k) * step, 10.0 * step];
        for along in [0, 1] {
            let ends = [-end, end].map(|far| {
                let mut at = At::new(snapped[0], snapped[1], 0.0);
                at[along] += far;
                at[1 - along] += off;
                pose * at
            });
            view.line(ends, 0.5 * view.pixel(), GRID);
        }
    }
}

/// Arrows of the load's weight and of what contacts carry.
fn forces(view: &mut View, part: &Part, frame: usize, gravity: Vector3<f64>) {
    let mut all: Vec<(At, Vector3<f64>)> = Vec::new();
    if let Some(load) = part.layout.load {
        let weight = gravity * f64::from(part.layout.bodies[load].mass);
        all.push((part.position(frame, load).into(), weight));
    }
    for contact in part.contacts(frame) {
        let [at, force] = [contact.point, contact.force].map(|x| Vector3::from(x).cast::<f64>());
        // On the body, where the world is the first side.
        let side = if contact.bodies[0].is_none() {
            -1.0
        } else {
            1.0
        };
        all.push((at.into(), force * side));
    }
    let most = all
        .iter()
        .map(|(_, force)| force.norm())
        .fold(0.0, f64::max);
    for (at, force) in all {
        if force.norm() > NEGLIGIBLE * most && most.is_finite() {
            view.arrow(at, force * (0.18 * view.size / most));
        }
    }
}
