//! Contacts against closed formulas, forms and solvers against each other, heaps, saved runs, bad input.

use crate::testing::*;

mod blows;
mod momenta;
mod passing;
mod riding;
mod thrown;

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

#[test]
fn a_box_slides_down_an_incline_as_friction_lets_it() {
    for (mu, slope) in [(0.3, 0.4_f64), (0.5, 0.4), (0.0, 0.2), (1e6, 0.7)] {
        let mut scene = ground(slope, rough(mu));
        let start = tilt(slope) * Vector3::z() * 0.5;
        let i = add_box(&mut scene, start, 3.0, rough(mu));
        scene.bodies.orientation[i] = tilt(slope);
        let mut stepper = stepper(scene);
        run(&mut stepper, 60);
        let moved = stepper.scene().bodies.position[i] - start;
        let down = -moved.dot(&(tilt(slope) * Vector3::x()));
        let acceleration = (G * (slope.sin() - mu * slope.cos())).max(0.0);
        let off = (down - 0.5 * acceleration).abs();
        assert!(off < 1e-8, "{mu} {slope}: {down}");
    }
}

#[test]
fn a_sliding_box_stops_where_its_energy_is_spent() {
    let mut scene = ground(0.0, rough(0.3));
    let i = add_box(&mut scene, Vector3::z() * 0.5, 2.0, rough(0.3));
    scene.bodies.velocity[i].x = 2.0;
    let mut stepper = stepper(scene);
    run(&mut stepper, 120);
    let x = stepper.scene().bodies.position[i].x;
    let exact = 4.0 / (2.0 * 0.3 * G);
    assert!((x / exact - 1.0).abs() < 1e-4, "{x}, not {exact}");
    assert!(stepper.scene().bodies.velocity[i].norm() < 1e-8);
}

#[test]
fn a_blow_at_the_beginning_is_a_blow_and_no_acceleration() {
    let (speed, dt) = (2.0, 1.0 / 60.0);
    for e in [0.0, 0.5, 1.0] {
        let surface = bouncing(e, 0.0);
        let mut scene = ground(0.0, surface);
        let i = add_ball(&mut scene, Vector3::z() * 0.1, 0.1, surface);
        scene.bodies.velocity[i].z = -speed;
        let mut stepper = stepper(scene);
        run(&mut stepper, 1);
        // The position at the end of the step, and the velocity in its middle, of a flight that begins with the rebound. What
        // rests sinks in by the surface's compliance.
        let bodies = &stepper.scene().bodies;
        let flies = if e > 0.0 { 1.0 } else { 0.0 };
        let height = 0.1 + e * speed * dt - flies * 0.5 * G * dt * dt;
        let rate = e * speed - flies * 0.5 * G * dt;
        let off = (bodies.position[i].z - height).abs();
        assert!(off < 1e-7, "{e}: {} {height}", bodies.position[i].z);
        let off = (bodies.velocity[i].z - rate).abs();
        assert!(off < 1e-5, "{e}: {} {rate}", bodies.velocity[i].z);
    }
}

#[test]
fn a_pushed_ball_slides_and_then_rolls() {
    let mut scene = ground(0.0, rough(0.3));
    let i = add_ball(&mut scene, Vector3::z() * 0.2, 0.2, rough(0.3));
    scene.bodies.velocity[i].x = 3.0;
    let mut stepper = stepper(scene);
    run(&mut stepper, 60);
    let speed = stepper.scene().bodies.velocity[i].x;
    assert!((speed - 15.0 / 7.0).abs() < 1e-9, "{speed}");
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

/// A load of `mass` on a massless cable that hangs from 10 m, over the ground at 0.
fn hung(mass: f64, length: f64) -> Scene {
    let mut scene = ground(0.0, rough(0.5));
    let load = add_box(&mut scene, Vector3::z() * 0.5, mass, rough(0.5));
    scene.load = Some(load);
    let top = Frame::world(Vector3::z() * 10.0);
    let hook = Frame::body(load, Vector3::z() * 0.5);
    let cable = MasslessCable::new(vec![top, hook], length, RowLaw::new(1e-6, 0.01));
    scene.add_constraint("rope", cable, 0);
    scene
}

#[test]
fn what_the_rope_leaves_of_a_load_the_ground_carries() {
    let weight = 1e5 * G;
    // Four corners, each as soft as two surfaces.
    let sag = |carried: f64| 2.0 * Surface::default().compliance * carried / 4.0;
    // The rope is 1 mm short, or 1 mm long and slack.
    for (length, short) in [(8.999, 1e-3), (9.001, 0.0)] {
        let mut stepper = stepper(hung(1e5, length));
        run(&mut stepper, 120);
        let carried: f64 = stepper.contacts().map(|c| c.force.z.abs()).sum();
        let pulled = -stepper.multipliers()[0] / stepper.options().dt;
        let tension = if short > 0.0 {
            (short + sag(carried)) / 1e-6
        } else {
            0.0
        };
        let off = (pulled - tension).abs();
        assert!(off <= 1e-5 * tension, "{pulled}, not {tension}");
        let off = ((carried + pulled) / weight - 1.0).abs();
        assert!(off < 1e-10, "{carried} {pulled}");
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

#[test]
fn shapes_that_begin_inside_each_other_come_apart_slowly() {
    let mut scene = ground(0.0, rough(0.5));
    let a = add_box(&mut scene, Vector3::z() * 0.3, 1.0, rough(0.5));
    let b = add_box(&mut scene, Vector3::new(0.1, 0.0, 0.6), 1e6, rough(0.5));
    let mut stepper = stepper(scene);
    for _ in 0..120 {
        stepper.step().unwrap();
        for i in [a, b] {
            let speed = stepper.scene().bodies.velocity[i].norm();
            assert!(speed < 5.0, "{speed}");
        }
    }
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
fn a_soft_floor_carries_what_lies_on_it_in_steps_of_any_length() {
    let mass = 200.0;
    for (compliance, damping) in [(1e-10, 0.0), (1e-6, 0.01), (1e-4, 0.05)] {
        let surface = rough(0.3).with(|s| (s.compliance, s.damping) = (compliance, damping));
        for substeps in [1, 8, 32] {
            let mut scene = ground(0.0, surface);
            let body = Body::sphere(0.5, mass).at(Vector3::z() * 0.5);
            let i = add(&mut scene, body, Shape::Sphere { radius: 0.5 }, rough(0.3));
            let options = StepOptions::default().with(|o| o.substeps = substeps);
            let mut stepper = Stepper::new(scene, options).unwrap();
            run(&mut stepper, 600);
            let sag = 0.5 - stepper.scene().bodies.position[i].z;
            let exact = (compliance + rough(0.3).compliance) * mass * G;
            let holds = (sag - exact).abs() <= 0.01 * exact + 1e-7;
            assert!(holds, "{compliance} {substeps}: {sag}, not {exact}");
        }
    }
}

#[test]
fn rows_of_balls_gain_no_energy_whichever_of_them_touch() {
    for e in [0.5, 0.9, 1.0] {
        for (balls, gap) in [(3, 0.0), (5, 0.0), (6, 0.0), (5, 1e-3), (4, 0.03)] {
            let surface = bouncing(e, 0.0);
            let mut scene = Scene::new("row");
            for k in 0..balls {
                let x = if k == 0 {
                    0.0
                } else {
                    0.5 + (0.2 + gap) * k as f64
                };
                add_ball(&mut scene, Vector3::x() * x, 0.1, surface);
            }
            scene.bodies.velocity[0].x = 3.0;
            let mut stepper = stepper(scene);
            let mut before = 4.5;
            for _ in 0..60 {
                run(&mut stepper, 1);
                let velocity = &stepper.scene().bodies.velocity;
                let energy: f64 = velocity.iter().map(|v| 0.5 * v.norm_squared()).sum();
                let momentum: f64 = velocity.iter().map(|v| v.x).sum();
                // The tolerance covers the energy that the springs of the surfaces give back.
                let holds = energy <= before * (1.0 + 1e-5);
                assert!(holds, "{e} {balls} {gap}: {before} to {energy}");
                assert!((momentum - 3.0).abs() < 1e-9, "{momentum}");
                before = energy;
            }
            assert!(before > 0.3 * e * e * 4.5, "{e} {balls} {gap}: {before}");
        }
    }
}

/// A surface yields by 10⁻¹⁰ m/N: a body too heavy for that, and what regularisation alone holds, is told.
#[test]
fn what_its_surface_cannot_decide_is_told() {
    for (masses, sideways, told) in [
        (&[1e5][..], 2.0, false),
        (&[1e8], 2.0, false),
        (&[1e9], 2.0, true),
        (&[1e12], 2.0, true),
        (&[1.0, 1e5], 0.0, false),
        (&[1.0, 1e12], 0.0, true),
    ] {
        let mut scene = ground(0.0, rough(0.5));
        scene.gravity.x = sideways;
        for (k, mass) in masses.iter().enumerate() {
            let at = Vector3::z() * (0.5 + k as f64);
            add_box(&mut scene, at, *mass, rough(0.5));
        }
        let mut stepper = stepper(scene);
        let undecided: usize = (0..120).map(|_| stepper.step().unwrap().undecided).sum();
        assert_eq!(undecided > 0, told, "{masses:?}: {undecided}");
    }
}
