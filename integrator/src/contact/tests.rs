//! Contacts: forms and solvers against each other, heaps, groups, bad input.

use crate::testing::*;

mod blows;
mod momenta;

const G: f64 = 9.81;

pub(crate) fn rough(friction: f64) -> Surface {
    Surface::default().with(|s| s.friction = friction)
}

pub(crate) fn bouncing(restitution: f64, friction: f64) -> Surface {
    rough(friction).with(|s| s.restitution = restitution)
}

fn tilt(slope: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -slope)
}

/// A plane through the origin that rises by `slope` (rad) in the direction of x.
pub(crate) fn ground(slope: f64, surface: Surface) -> Scene {
    let mut scene = on_earth("ground");
    scene.add_collider(Collider {
        orientation: tilt(slope),
        surface,
        ..Collider::new("ground", None, Shape::HalfSpace)
    });
    scene
}

/// A body with a shape.
pub(crate) fn add(scene: &mut Scene, body: Body, shape: Shape, surface: Surface) -> usize {
    let name = format!("body-{}", scene.bodies.len());
    let i = scene.add_body(&name, body);
    scene.add_collider(Collider::new(name, Some(i), shape).with(|p| p.surface = surface));
    i
}

fn block(size: Vector3<f64>, mass: f64) -> (Body, Shape) {
    (Body::cuboid(size, mass), Shape::Cuboid { size })
}

fn sphere(radius: f64, mass: f64) -> (Body, Shape) {
    (Body::sphere(radius, mass), Shape::Sphere { radius })
}

fn cylinder(length: f64, radius: f64, mass: f64) -> (Body, Shape) {
    let shape = Shape::Cylinder { length, radius };
    (Body::rod(length, radius, mass), shape)
}

/// A capsule of that length between its middles, with the inertia of a rod of its `whole` length.
fn capsule(whole: f64, [length, radius]: [f64; 2], mass: f64) -> (Body, Shape) {
    let shape = Shape::Capsule { length, radius };
    (Body::rod(whole, radius, mass), shape)
}

/// A cube of 1 m.
pub(crate) fn add_box(scene: &mut Scene, at: Vector3<f64>, mass: f64, surface: Surface) -> usize {
    let size = Vector3::repeat(1.0);
    let body = Body::cuboid(size, mass).at(at);
    add(scene, body, Shape::Cuboid { size }, surface)
}

pub(crate) fn add_ball(
    scene: &mut Scene,
    at: Vector3<f64>,
    radius: f64,
    surface: Surface,
) -> usize {
    let body = Body::sphere(radius, 1.0).at(at);
    add(scene, body, Shape::Sphere { radius }, surface)
}

fn options(rate: f64) -> StepOptions {
    StepOptions::default().with(|o| o.dt = 1.0 / rate)
}

fn stepper(scene: Scene) -> Stepper {
    Stepper::new(scene, StepOptions::default()).expect("a sound scene")
}

/// Steps that leave nothing undecided.
fn run(stepper: &mut Stepper, steps: usize) {
    for _ in 0..steps {
        let report = stepper.step().expect("a step");
        assert_eq!(report.undecided, 0, "{report:?}");
        assert!(report.contacts.complementarity <= 1e-10, "{report:?}");
        assert!(report.contacts.cone <= 1e-10, "{report:?}");
    }
}

/// A hoist that has come loose, above the ground and drifting, with balls for segments.
fn fallen(options: StepOptions) -> Stepper {
    let params = HoistParams::default().with(|p| (p.segments, p.mass_ratio) = (24, 1e3));
    let mut scene = params.hanging_equilibrium().unwrap();
    let load = scene.load.unwrap();
    scene.add_collider(Collider {
        position: scene.bodies.position[load] - Vector3::z() * 0.35,
        ..Collider::new("ground", None, Shape::HalfSpace)
    });
    for i in scene.dynamic_bodies().collect::<Vec<_>>() {
        let radius = if i == load { 0.3 } else { 0.02 };
        let name = scene.body_names[i].clone();
        scene.add_collider(Collider::new(name, Some(i), Shape::Sphere { radius }));
        scene.bodies.velocity[i].x += 0.2;
    }
    let mut stepper = Stepper::new(scene, options).unwrap();
    let loosen = |edit: &mut crate::Edit| {
        let anchor = edit.constraint("anchor")?;
        edit.remove_constraint(anchor)
    };
    stepper.change(loosen).unwrap();
    stepper
}

#[test]
fn a_fallen_cable_lies_the_same_by_all_forms_and_solvers() {
    let compiled = Backend::all().into_iter();
    let direct = compiled.filter(|b| b.is_compiled() && !b.is_iterative());
    let mut places: Vec<(String, Vec<Vector3<f64>>)> = Vec::new();
    for backend in direct {
        for form in [Form::Schur, Form::Kkt] {
            let options =
                StepOptions::default().with(|o| (o.form, o.backend) = (form, backend.clone()));
            if options.validate().is_err() {
                continue;
            }
            let mut stepper = fallen(options);
            let mut touched = 0;
            for _ in 0..180 {
                let report = stepper.step().unwrap();
                assert_eq!(report.undecided, 0, "{report:?}");
                touched = touched.max(report.contacts.touching);
            }
            assert!(touched > 3, "{touched}");
            let place = stepper.scene().bodies.position.clone();
            places.push((format!("{backend} {form}"), place));
        }
    }
    let (_, first) = &places[0];
    for (name, place) in &places {
        for (a, b) in first.iter().zip(place) {
            assert!((a - b).norm() < 1e-8, "{name}: {a} {b}");
        }
    }
}

#[test]
fn shapes_that_are_far_apart_change_nothing() {
    let build = || {
        let ends = [Vector3::zeros(), Vector3::x() * 3.0];
        let mut scene = on_earth("far");
        let ends = ends.map(|end| CableEnd::Pinned(Frame::world(end)));
        let cable = Cable::round("rope", &Material::STEEL, 0.01, ends);
        scene.add_cable(&cable).unwrap();
        scene
    };
    let mut with = build();
    with.add_collider(Collider {
        position: Vector3::z() * -1e3,
        ..Collider::new("ground", None, Shape::HalfSpace)
    });
    let shape = Shape::Sphere { radius: 0.01 };
    with.add_collider(Collider::new("ball", Some(3), shape));
    let [mut with, mut without] = [with, build()].map(stepper);
    run(&mut with, 30);
    run(&mut without, 30);
    assert_eq!(with.scene().bodies, without.scene().bodies);
    let energies: [Energy; 2] = [with.energy(), without.energy()];
    assert_eq!(energies[0], energies[1]);
}

/// A body of so many shapes.
#[test]
fn more_contacts_than_are_solved_are_refused_by_name() {
    let mut scene = ground(0.0, rough(0.5));
    let body = scene.add_body("hedgehog", Body::sphere(1.0, 1.0).at(Vector3::z() * 0.1));
    let spines = 20_001;
    for k in 0..spines {
        let shape = Shape::Sphere { radius: 0.1 };
        scene.add_collider(Collider {
            position: Vector3::x() * (0.3 * k as f64),
            ..Collider::new(format!("spine-{k}"), Some(body), shape)
        });
    }
    let error = stepper(scene).step().expect_err("too many");
    let refused =
        matches!(error, StepError::TooManyContacts { contacts, .. } if contacts == spines);
    assert!(refused, "{error}");
}

/// One column, 204 contacts: the sum of the weights on the ground, at rest.
#[test]
fn a_column_that_is_split_into_groups_stands() {
    let mut scene = ground(0.0, rough(0.5));
    for k in 0..51 {
        let at = Vector3::z() * (0.5 + f64::from(k));
        add_box(&mut scene, at, 1.0, rough(0.5));
    }
    let mut stepper = stepper(scene);
    for _ in 0..5 {
        let report = stepper.step().unwrap();
        let what = format!("{report:?}");
        assert_eq!((report.contacts.groups, report.undecided), (3, 0), "{what}");
    }
    let grounded = stepper.contacts().filter(|c| c.bodies.contains(&None));
    let carried: f64 = grounded.map(|c| c.force.z.abs()).sum();
    assert!((carried / (51.0 * G) - 1.0).abs() < 1e-4, "{carried}");
}

#[test]
fn a_body_that_is_added_in_a_run_stands_on_the_ground() {
    let mut scene = ground(0.0, rough(0.3));
    add_ball(&mut scene, Vector3::new(3.0, 0.0, 0.1), 0.1, rough(0.3));
    let mut stepper = stepper(scene);
    run(&mut stepper, 10);
    let crate_ = stepper
        .change(|edit| {
            let size = Vector3::repeat(1.0);
            let body = Body::cuboid(size, 100.0).at(Vector3::z() * 0.6);
            let body = edit.add_body("crate", body);
            let number = edit.body_index(body)?;
            let shape = Shape::Cuboid { size };
            edit.add_collider(Collider::new("crate", Some(number), shape));
            Ok(body)
        })
        .unwrap();
    run(&mut stepper, 120);
    let height = stepper.scene().bodies.position[stepper.body_index(crate_).unwrap()].z;
    assert!((height - 0.5).abs() < 1e-5, "{height}");
}
