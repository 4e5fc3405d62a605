//! Scenes beyond one cable: branches, rings, nets and ladders of bodies with joints halfway between them.

use crate::prelude::*;
use crate::scenes::joint;

/// Distance between neighbours \[m].
const STEP: f64 = 0.5;

/// Bodies at points (m), each a rod or a sphere of some mass, with a joint of `kind` at the middle of each pair, and one
/// to the world at each of the bodies `anchored`. Poses have gaps of millimetres, and all move.
pub fn graph(
    kind: &str,
    points: &[Vector3<f64>],
    pairs: &[(usize, usize)],
    anchored: &[usize],
) -> Scene {
    let mut random = Random::new(5);
    let mut scene = Scene::new("graph");
    scene.gravity = Vector3::new(0.0, 0.0, -9.81);
    for (i, point) in points.iter().enumerate() {
        let mass = random.log_uniform(0.5, 50.0);
        let body = match i % 3 {
            0 => Body::sphere(0.1, mass),
            _ => Body::rod(STEP, 0.05, mass),
        };
        let body = body.at(point + random.vector(1e-3));
        let mut body = body.turned(random.rotation(1e-2));
        body.velocity = random.vector(0.1);
        body.angular_velocity = random.vector(0.1);
        scene.add_body(format!("body-{i}"), body);
    }
    let add = |scene: &mut Scene, name: String, frames: [Frame; 2]| {
        scene.add_constraint(name, joint(kind, frames, 1e-6, 1e-3, 0.01), 0);
    };
    for &i in anchored {
        let frames = [Frame::world(points[i]), centre(i)];
        add(&mut scene, format!("anchor-{i}"), frames);
    }
    for &(a, b) in pairs {
        let half = 0.5 * (points[b] - points[a]);
        let frames = [Frame::body(a, half), Frame::body(b, -half)];
        add(&mut scene, format!("joint-{a}-{b}"), frames);
    }
    scene.group_by_topology();
    scene
}

fn at(x: usize, y: usize, z: usize) -> Vector3<f64> {
    Vector3::new(x as f64, y as f64, -(z as f64)) * STEP
}

/// Body 0 with so many arms of `length` bodies each; the ends of all arms but the last are anchored.
pub fn star(kind: &str, arms: usize, length: usize) -> Scene {
    let mut points = vec![Vector3::zeros()];
    let (mut pairs, mut anchored) = (Vec::new(), Vec::new());
    for arm in 0..arms {
        let turn = std::f64::consts::TAU * arm as f64 / arms as f64;
        for k in 1..=length {
            let before = if k == 1 { 0 } else { points.len() - 1 };
            pairs.push((before, points.len()));
            points.push(Vector3::new(turn.cos(), 0.0, turn.sin()) * (STEP * k as f64));
        }
        anchored.push(points.len() - 1);
    }
    anchored.pop();
    graph(kind, &points, &pairs, &anchored)
}

/// Rings of `length` bodies each, all through body 0, which is anchored.
pub fn rings(kind: &str, count: usize, length: usize) -> Scene {
    let mut points = vec![Vector3::zeros()];
    let mut pairs = Vec::new();
    let radius = STEP * length as f64 / std::f64::consts::TAU;
    for ring in 0..count {
        let away = std::f64::consts::TAU * ring as f64 / count as f64;
        let first = points.len();
        for k in 1..length {
            let turn = std::f64::consts::TAU * k as f64 / length as f64;
            let (out, along) = (radius * (1.0 - turn.cos()), radius * turn.sin());
            points.push(Vector3::new(away.cos() * out, away.sin() * out, along));
            pairs.push((if k == 1 { 0 } else { points.len() - 2 }, points.len() - 1));
        }
        pairs.push((points.len() - 1, 0));
        let found = points.len() - first;
        assert!(found >= 2, "a ring has three bodies at least");
    }
    graph(kind, &points, &pairs, &[0])
}

/// A net of n × n bodies, row by row, held at two corners.
pub fn net(kind: &str, n: usize) -> Scene {
    let mut pairs = Vec::new();
    for i in 0..n * n {
        pairs.extend((i % n > 0).then(|| (i - 1, i)));
        pairs.extend((i >= n).then(|| (i - n, i)));
    }
    let points: Vec<_> = (0..n * n).map(|i| at(i % n, 0, i / n)).collect();
    graph(kind, &points, &pairs, &[0, n - 1])
}

/// Cables of `length` bodies side by side, hung from their upper ends, one after the other, then the rungs that join
/// neighbours at each height.
pub fn ladder(kind: &str, cables: usize, length: usize) -> Scene {
    let points = (0..cables * length).map(|i| at(i / length, 0, i % length));
    let points: Vec<_> = points.collect();
    let below = (0..points.len()).filter(|i| i % length > 0);
    let rungs = (length..points.len()).map(|i| (i - length, i));
    let pairs: Vec<_> = below.map(|i| (i - 1, i)).chain(rungs).collect();
    let upper: Vec<_> = (0..points.len()).step_by(length).collect();
    graph(kind, &points, &pairs, &upper)
}

/// A tree of so many bodies, each tied to a random one of those before it, listed in random order.
pub fn tree(kind: &str, bodies: usize, seed: u64) -> Scene {
    let mut random = Random::new(seed);
    let mut label: Vec<usize> = (0..bodies).collect();
    for i in (1..bodies).rev() {
        label.swap(i, random.below(i + 1));
    }
    let mut points = vec![Vector3::zeros(); bodies];
    let mut pairs = Vec::new();
    for i in 1..bodies {
        // Among the last few: branches of some length, and no body with very many joints.
        let parent = i - 1 - random.below(i.min(4));
        points[label[i]] = points[label[parent]] + random.vector(1.0).normalize() * STEP;
        pairs.push((label[parent], label[i]));
    }
    for i in (1..pairs.len()).rev() {
        pairs.swap(i, random.below(i + 1));
    }
    graph(kind, &points, &pairs, &label[..1])
}

/// Two cables and a body that nothing holds, in one scene.
pub fn parts(kind: &str) -> Scene {
    let points: Vec<_> = (0..9).map(|i| at(i % 3, i / 3, 0)).collect();
    // Body 4 is alone.
    let pairs = [(0, 1), (6, 7), (1, 2), (7, 8), (2, 5), (8, 3)];
    graph(kind, &points, &pairs, &[0, 6])
}
