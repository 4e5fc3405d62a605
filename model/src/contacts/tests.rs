//! Gaps and normals of all pairs of shapes against formulas.

use crate::testing::*;

use super::*;

/// How exact gaps, points and normals are in shapes of about 1 m.
pub(super) const EXACT: f64 = 1e-12;

pub(super) fn v(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

fn about(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * angle)
}

fn ball(radius: f64) -> Shape {
    Shape::Sphere { radius }
}

pub(super) fn cuboid(x: f64, y: f64, z: f64) -> Shape {
    let size = v(x, y, z);
    Shape::Cuboid { size }
}

fn capsule(length: f64, radius: f64) -> Shape {
    Shape::Capsule { length, radius }
}

fn cylinder(length: f64, radius: f64) -> Shape {
    Shape::Cylinder { length, radius }
}

type Placed = (Shape, Vector3<f64>, UnitQuaternion<f64>);

/// Two bodies with a shape each, in a frame that is turned and moved any way; a half-space is the world's.
fn scene(shapes: [Placed; 2], turn: &UnitQuaternion<f64>, shift: Vector3<f64>) -> Scene {
    let mut scene = Scene::new("two");
    for (i, (shape, position, orientation)) in shapes.into_iter().enumerate() {
        let (position, orientation) = (turn * position + shift, turn * orientation);
        let name = format!("shape-{i}");
        if shape == Shape::HalfSpace {
            scene.add_collider(Collider {
                position,
                orientation,
                ..Collider::new(name, None, shape)
            });
        } else {
            let body = Body::sphere(1.0, 1.0).at(position).turned(orientation);
            let body = scene.add_body(format!("body-{i}"), body);
            scene.add_collider(Collider::new(name, Some(body), shape));
        }
    }
    assert_eq!(scene.validate(), Ok(()));
    scene
}

pub(super) fn contacts(scene: &Scene) -> Vec<Contact> {
    let mut collisions = Collisions::new(scene);
    let found = collisions.find(scene, 0.0).expect("finite");
    found.to_vec()
}

/// A table of [`expect`]ations: two shapes, their normal, their gaps.
macro_rules! touch {
    ($($a:expr, $b:expr => $normal:expr, $gaps:expr);* $(;)?) => {
        $(expect([$a, $b], $normal, &$gaps);)*
    };
}

/// Checks that the shapes have contacts of these gaps, all with that normal, in both orders and in all frames.
fn expect(shapes: [Placed; 2], normal: Vector3<f64>, gaps: &[f64]) {
    let frames = [
        (UnitQuaternion::identity(), Vector3::zeros()),
        (about(v(0.6, 0.0, 0.8), 1.1), v(3.0, -2.0, 7.0)),
        (about(v(0.0, 1.0, 0.0), 3.1), v(0.0, 0.5, 0.0)),
    ];
    for (turn, shift) in frames {
        for order in [1.0, -1.0] {
            let ordered = if order > 0.0 {
                shapes
            } else {
                [shapes[1], shapes[0]]
            };
            let scene = scene(ordered, &turn, shift);
            let found = contacts(&scene);
            let mut got: Vec<f64> = found.iter().map(|c| c.gap).collect();
            got.sort_by(f64::total_cmp);
            let near = got.iter().zip(gaps).all(|(a, b)| (a - b).abs() < EXACT);
            let holds = got.len() == gaps.len() && near;
            assert!(holds, "{got:?} {gaps:?} {shapes:?}");
            for c in found {
                let off = (c.normal - turn * normal * order).norm();
                assert!(off < EXACT, "{off:e} {shapes:?}");
                let sideways = c.points[0] - c.points[1] - c.normal * c.gap;
                assert!(sideways.norm() < 1e-11, "{c:?}");
                let frame = &scene.colliders[0];
                let key = match frame.body {
                    Some(i) => scene.bodies.point_world(i, &c.key),
                    None => frame.position + frame.orientation * c.key,
                };
                assert!((key - c.points[0]).norm() < EXACT, "{c:?}");
            }
        }
    }
}

fn at(shape: Shape, x: f64, y: f64, z: f64) -> Placed {
    (shape, v(x, y, z), UnitQuaternion::identity())
}

fn turned(shape: Shape, position: Vector3<f64>, turn: UnitQuaternion<f64>) -> Placed {
    (shape, position, turn)
}

/// Overlap of the pairs below: shallow, so that no other direction is shorter.
const IN: f64 = -1e-4;
const QUARTER: f64 = std::f64::consts::FRAC_PI_2;

#[test]
fn balls_touch_in_one_point() {
    let z = v(0.0, 0.0, 1.0);
    let small = |height: f64| at(ball(0.25), 0.0, 0.0, height + IN);
    touch! {
        small(0.75), at(ball(0.5), 0.0, 0.0, 0.0) => z, [IN];
        small(0.75), at(cuboid(2.0, 3.0, 1.0), 0.3, 0.4, 0.0) => z, [IN];
        small(1.25), at(capsule(1.0, 0.5), 0.0, 0.0, 0.0) => z, [IN];
        small(0.75), at(cylinder(1.0, 0.5), 0.2, 0.1, 0.0) => z, [IN];
        small(0.25), at(Shape::HalfSpace, 4.0, 0.0, 0.0) => z, [IN];
    }
    // At an edge, a corner, the side and the rim: from there to the centre of the ball.
    let near = |edge: Vector3<f64>, n: Vector3<f64>| {
        let p = edge + n * (0.25 + IN);
        at(ball(0.25), p.x, p.y, p.z)
    };
    let slanted = v(0.0, 0.6, 0.8);
    touch! { near(v(0.3, 1.0, 0.5), slanted), at(cuboid(2.0, 2.0, 1.0), 0.0, 0.0, 0.0) => slanted, [IN] }
    let corner = v(2.0, 1.0, 2.0) / 3.0;
    touch! { near(v(1.0, 1.0, 0.5), corner), at(cuboid(2.0, 2.0, 1.0), 0.0, 0.0, 0.0) => corner, [IN] }
    let side = v(0.6, 0.8, 0.0);
    touch! {
        near(side * 0.5, side), at(cylinder(1.0, 0.5), 0.0, 0.0, 0.0) => side, [IN];
        near(v(0.0, 0.5, 0.5), slanted), at(cylinder(1.0, 0.5), 0.0, 0.0, 0.0) => slanted, [IN];
    }
}

#[test]
fn shapes_on_the_ground_touch_it_with_what_is_lowest() {
    let (z, ground) = (v(0.0, 0.0, 1.0), at(Shape::HalfSpace, 0.0, 0.0, 0.0));
    let lying = about(Vector3::x(), QUARTER);
    touch! {
        at(cuboid(2.0, 1.0, 0.5), 1.0, 2.0, 0.25 + IN), ground => z, [IN; 4];
        at(capsule(1.0, 0.1), 0.0, 0.0, 0.6 + IN), ground => z, [IN];
        turned(capsule(1.0, 0.1), v(0.0, 0.0, 0.1 + IN), lying), ground => z, [IN; 2];
        turned(cylinder(1.0, 0.1), v(0.0, 0.0, 0.1 + IN), lying), ground => z, [IN; 2];
        at(cylinder(1.0, 0.1), 0.0, 0.0, 0.5 + IN), ground => z, [IN; 8];
    }
    // Tilted: an edge, a corner, a point of the rim.
    let (sine, cosine) = 0.5_f64.sin_cos();
    let tilt = about(Vector3::x(), 0.5);
    let low = 0.5 * (1.0 * sine + 0.5 * cosine);
    touch! { turned(cuboid(2.0, 1.0, 0.5), v(0.0, 0.0, low + IN), tilt), ground => z, [IN; 2] }
    let low = 0.5 * cosine + 0.1 * sine;
    touch! { turned(cylinder(1.0, 0.1), v(0.0, 0.0, low + IN), tilt), ground => z, [IN] }
    let skew = about(Vector3::z(), 0.3) * about(Vector3::x(), 0.5) * about(Vector3::y(), 0.4);
    let rows = skew.to_rotation_matrix();
    let low = 0.5
        * rows
            .matrix()
            .row(2)
            .transpose()
            .abs()
            .dot(&v(2.0, 1.0, 0.5));
    touch! { turned(cuboid(2.0, 1.0, 0.5), v(0.0, 0.0, low + IN), skew), ground => z, [IN] }
}

#[test]
fn capsules_touch_in_two_points_where_they_are_parallel() {
    let z = v(0.0, 0.0, 1.0);
    let lying = |shape: Shape, height: f64, yaw: f64| {
        let turn = about(Vector3::z(), yaw) * about(Vector3::x(), QUARTER);
        turned(shape, v(0.1, 0.0, height), turn)
    };
    let (thin, thick) = (capsule(1.0, 0.1), capsule(3.0, 0.2));
    touch! {
        lying(thin, 0.3 + IN, 0.0), lying(thick, 0.0, 0.0) => z, [IN; 2];
        lying(thin, 0.3 + IN, 0.7), lying(thick, 0.0, 0.0) => z, [IN];
        lying(thin, 0.1 + IN, 0.4), at(cuboid(3.0, 3.0, 2.0), 0.0, 0.0, -1.0) => z, [IN; 2];
        lying(thin, 0.1 + IN, 0.4), at(cylinder(1.0, 2.0), 0.0, 0.0, -0.5) => z, [IN; 2];
        lying(thin, 0.3 + IN, 0.0), lying(cylinder(3.0, 0.2), 0.0, 0.0) => z, [IN; 2];
        lying(thin, 0.3 + IN, 0.8), lying(cylinder(3.0, 0.2), 0.0, 0.0) => z, [IN];
    }
    // Across an edge of a box that stands on it.
    let edge = turned(
        cuboid(2.0, 1.0, 1.0),
        v(0.0, 0.0, -(0.5_f64.sqrt())),
        about(Vector3::x(), 0.5 * QUARTER),
    );
    touch! {
        lying(thin, 0.1 + IN, 0.3), edge => z, [IN];
        lying(thin, 0.1 + IN, QUARTER), edge => z, [IN; 2];
    }
}

#[test]
fn boxes_and_cylinders_touch_with_their_faces_and_edges() {
    let (z, plate) = (v(0.0, 0.0, 1.0), at(cuboid(4.0, 4.0, 1.0), 0.0, 0.0, -0.5));
    let yaw = about(Vector3::z(), 0.3);
    let lying = about(Vector3::z(), 0.3) * about(Vector3::x(), QUARTER);
    touch! { turned(cuboid(2.0, 1.0, 0.5), v(0.3, 0.2, 0.25 + IN), yaw), plate => z, [IN; 4] }
    let twin = cuboid(1.0, 1.0, 1.0);
    let eighth = about(Vector3::z(), 0.5 * QUARTER);
    touch! {
        turned(twin, v(0.0, 0.0, 1.0 + IN), eighth), at(twin, 0.0, 0.0, 0.0) => z, [IN; 8];
        at(twin, 0.3, 0.4, 1.0 + IN), at(twin, 0.0, 0.0, 0.0) => z, [IN; 4];
        turned(cylinder(1.0, 0.1), v(0.0, 0.0, 0.1 + IN), lying), plate => z, [IN; 2];
        at(cylinder(1.0, 0.1), 0.0, 0.0, 0.5 + IN), plate => z, [IN; 8];
        at(cylinder(1.0, 0.1), 0.0, 0.0, 1.0 + IN), at(cylinder(1.0, 0.5), 0.1, 0.0, 0.0) => z, [IN; 8];
    }
    let drum = |height: f64, yaw: f64| {
        let turn = about(Vector3::z(), yaw) * about(Vector3::x(), QUARTER);
        turned(cylinder(1.0, 0.3), v(0.0, 0.0, height), turn)
    };
    touch! {
        drum(0.6 + IN, 0.0), drum(0.0, 0.0) => z, [IN; 2];
        drum(0.6 + IN, 1.0), drum(0.0, 0.0) => z, [IN];
    }
    // An edge across an edge, and across a drum.
    let edge = |height: f64, yaw: f64| {
        let turn = about(Vector3::z(), yaw) * about(Vector3::x(), 0.5 * QUARTER);
        turned(cuboid(2.0, 1.0, 1.0), v(0.0, 0.0, height), turn)
    };
    let half = 0.5_f64.sqrt();
    touch! {
        edge(2.0 * half + IN, 0.9), edge(0.0, 0.0) => z, [IN];
        edge(half + 0.3 + IN, 0.9), drum(0.0, 0.0) => z, [IN];
    }
}

#[test]
fn rims_touch_edges_and_each_other_near_the_point_where_they_cross() {
    // The rim of a cylinder that is tilted about x is lowest at a point, which stands on the ridge of a roof along x.
    let tilt = 0.6_f64;
    let low = 0.5 * tilt.cos() + 0.3 * tilt.sin();
    let point = v(0.0, 0.5 * tilt.sin() - 0.3 * tilt.cos(), -low);
    let lifted = -point + v(0.0, 0.0, IN);
    let barrel = turned(cylinder(1.0, 0.3), lifted, about(Vector3::x(), tilt));
    let turn = about(Vector3::x(), 0.5 * QUARTER);
    let roof = turned(cuboid(2.0, 1.0, 1.0), v(0.0, 0.0, -(0.5_f64.sqrt())), turn);
    // A second barrel, upside down under the first and turned about z: rim to rim.
    let under = about(Vector3::z(), 1.2) * about(Vector3::x(), 2.0 * QUARTER);
    let other = turned(
        cylinder(1.0, 0.3),
        under * -point,
        under * about(Vector3::x(), tilt),
    );
    for below in [roof, other] {
        let turn = &UnitQuaternion::identity();
        let pair = scene([barrel, below], turn, Vector3::zeros());
        let found = contacts(&pair);
        assert!(!found.is_empty());
        for c in found {
            // Straight up they overlap by this much, and by less along the normal.
            assert!((IN..0.0).contains(&c.gap), "{c:?}");
            // As long as the chord that the overlap cuts off.
            assert!(c.points.iter().all(|p| p.norm() < 2e-2), "{c:?}");
            assert!(c.normal.z > 0.5, "{c:?}");
        }
    }
}

#[test]
fn a_box_that_rocks_on_a_disc_stands_on_its_face() {
    let places = |axis: Vector3<f64>, angle: f64| {
        let disc = at(cylinder(0.3, 0.4), 0.0, 0.0, 0.15);
        let above = v(0.03, 0.0, 0.5 - 5e-5);
        let turn = UnitQuaternion::identity();
        let scene = scene(
            [
                disc,
                turned(cuboid(0.8, 0.7, 0.4), above, about(axis, angle)),
            ],
            &turn,
            v(0.0, 0.0, 0.0),
        );
        contacts(&scene)
    };
    for axis in [v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0), v(0.6, -0.8, 0.0)] {
        for angle in [-2e-4, -3e-5, 1e-6, 2e-5, 1e-4] {
            let found = places(axis, angle);
            assert!(found.len() >= 8, "{axis:?} {angle}: {}", found.len());
            let tilted = found.iter().map(|c| c.normal.z.abs()).fold(1.0, f64::min);
            assert!(tilted > 1.0 - 1e-6, "{axis:?} {angle}: {tilted}");
        }
    }
}

#[test]
fn a_capsule_over_the_edge_of_a_face_keeps_its_line_while_it_rocks() {
    let (long, radius) = (1.1, 0.15);
    for carrier in [cuboid(0.9, 0.6, 0.5), cylinder(0.5, 0.45)] {
        for angle in [-1e-4, -5e-6, 0.0, 3e-6, 4e-5] {
            let lies = about(v(0.0, 1.0, 0.0), QUARTER + angle);
            let above = v(0.02, 0.01, 0.25 + radius - 2e-5);
            let shapes = [
                turned(capsule(long, radius), above, lies),
                at(carrier, 0.0, 0.0, 0.0),
            ];
            let scene = scene(shapes, &about(v(0.0, 0.0, 1.0), 0.3), v(1.0, 0.0, 2.0));
            let mut collisions = Collisions::new(&scene);
            let found = collisions.find(&scene, 1e-3).expect("finite");
            assert_eq!(found.len(), 2, "{angle} {found:?}");
            for contact in found {
                assert!(contact.normal.z > 1.0 - 1e-12, "{angle} {contact:?}");
            }
        }
    }
}

/// Polygons that stand for rims are inside them: a box would sink in, and be thrown out where the next corner is found.
#[test]
fn a_box_that_tips_over_a_rim_stands_on_the_rim_itself() {
    const DEEP: f64 = 1e-4;
    let half = v(0.3, 0.25, 0.2);
    for (radius, out) in [(3.0, 0.0), (3.0, 0.2), (0.9, -0.05), (0.45, 0.1)] {
        for (place, yaw, tilt) in [(0.0, 0.3, 2e-3), (0.7, 1.2, 0.02), (2.5, -0.4, 0.3)] {
            let tips = about(v(-f64::sin(place), f64::cos(place), 0.0), tilt);
            let turn = tips * about(v(0.0, 0.0, 1.0), yaw);
            let centre = v(f64::cos(place), f64::sin(place), 0.0) * (radius + out);
            let rim = (0..40_000).map(|k| {
                let angle = f64::from(k) * std::f64::consts::TAU / 4e4;
                turn.inverse() * (v(angle.cos(), angle.sin(), 0.0) * radius - centre)
            });
            let over = rim.filter(|p| p.x.abs() <= half.x && p.y.abs() <= half.y);
            let deepest = over.map(|p| p.z + half.z).fold(f64::NEG_INFINITY, f64::max);
            let centre = centre + turn * v(0.0, 0.0, deepest - DEEP);
            let shapes = [
                (cuboid(0.6, 0.5, 0.4), centre, turn),
                at(cylinder(0.2, radius), 0.0, 0.0, -0.1),
            ];
            for shapes in [shapes, [shapes[1], shapes[0]]] {
                let found = contacts(&scene(shapes, &turn, v(1.0, 2.0, 3.0)));
                let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
                let off = (least + DEEP).abs();
                assert!(off < 0.02 * DEEP, "{radius} {out} {place} {tilt}: {least}");
            }
        }
    }
}

/// Else the point that carries it goes round with the tilt, which it drives.
#[test]
fn a_disc_that_hardly_tilts_stands_on_the_same_corners() {
    let disc = cylinder(0.2, 0.35);
    for axis in [v(0.83, 0.55, 0.0), v(-0.1, 0.99, 0.0)] {
        let found = |angle: f64| {
            let place = turned(disc, v(0.0, 0.0, 0.1), about(axis.normalize(), angle));
            let plane = at(Shape::HalfSpace, 0.0, 0.0, 0.0);
            let turn = UnitQuaternion::identity();
            contacts(&scene([plane, place], &turn, v(0.0, 0.0, 0.0)))
        };
        for angle in [1e-6, 6e-5] {
            assert_eq!(found(angle).len(), 8, "{angle}");
        }
        let angle = 2e-3_f64;
        let lowest = 0.1 - (0.1 * angle.cos() + 0.35 * angle.sin());
        let gaps = found(angle).into_iter().map(|c| c.gap);
        let least = gaps.fold(f64::INFINITY, f64::min);
        assert!((least - lowest).abs() < EXACT, "{least} {lowest}");
    }
}

#[test]
fn deep_overlaps_come_apart_on_the_shortest_way() {
    let z = v(0.0, 0.0, 1.0);
    touch! {
        at(cuboid(1.0, 1.0, 1.0), 0.0, 0.0, 0.3), at(cuboid(3.0, 3.0, 2.0), 0.0, 0.0, 0.0) => z, [-1.2; 4];
        at(ball(0.1), 0.1, 0.0, 0.3), at(cuboid(3.0, 3.0, 1.0), 0.0, 0.0, 0.0) => z, [-0.3];
        at(ball(0.1), 0.3, 0.0, 0.0), at(cylinder(2.0, 0.5), 0.0, 0.0, 0.0) => Vector3::x(), [-0.3];
    }
    for shape in [
        ball(1.0),
        cuboid(1.0, 2.0, 3.0),
        cylinder(3.0, 0.5),
        capsule(1.0, 0.5),
        cylinder(1.0, 1.0),
    ] {
        let found = contacts(&scene(
            [at(shape, 0.0, 0.0, 0.0); 2],
            &UnitQuaternion::identity(),
            Vector3::zeros(),
        ));
        let least = shape.dimensions()[0];
        assert!((found[0].gap + least).abs() < EXACT, "{found:?}");
    }
}
