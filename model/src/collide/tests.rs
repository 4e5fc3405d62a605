use nalgebra::Quaternion;

use super::*;
use crate::testing::*;

#[test]
fn surfaces_that_meet_share_their_friction_and_add_their_compliances() {
    let ice = Surface {
        friction: 0.04,
        restitution: 0.5,
        compliance: 1e-8,
        damping: 0.0,
    };
    let rubber = Surface {
        friction: 1.0,
        restitution: 0.25,
        compliance: 3e-8,
        damping: 2e-3,
    };
    let both = ice.meet(&rubber);
    assert_eq!(both, rubber.meet(&ice));
    assert!((both.friction - 0.2).abs() < 1e-15);
    assert_eq!((both.restitution, both.damping), (0.5, 2e-3));
    assert!((both.compliance - 4e-8).abs() < 1e-22);
    let odd = ice.with(|s| s.friction = 0.3);
    assert_eq!(odd.meet(&odd).friction, 0.3);
    // −0 is 0: as a bound of friction its sign would count.
    let none = Surface {
        friction: -0.0,
        restitution: -0.0,
        compliance: -0.0,
        damping: -0.0,
    };
    let met = none.meet(&none);
    let numbers = [met.friction, met.restitution, met.compliance, met.damping];
    assert!(numbers.iter().all(|x| x.is_sign_positive()), "{met:?}");
    assert!(none.meet(&odd).friction.is_sign_positive());
}

/// A ball, a point mass and a static body with a shape each, and the ground.
fn yard() -> Scene {
    let mut scene = Scene::new("yard");
    let bodies = [Body::sphere(1.0, 1.0), Body::particle(1.0), Body::fixed()];
    for (name, body) in ["ball", "point", "base"].into_iter().zip(bodies) {
        let body = scene.add_body(name, body);
        let ball = Shape::Sphere { radius: 1.0 };
        scene.add_collider(Collider::new(format!("{name}'s"), Some(body), ball));
    }
    scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
    assert_eq!(scene.validate(), Ok(()));
    scene
}

fn says(change: impl FnOnce(&mut Scene), words: &str) {
    let mut scene = yard();
    change(&mut scene);
    let fault = scene.validate().expect_err(words).to_string();
    assert!(fault.contains(words), "{fault}");
    assert!(!fault.contains('\n'));
}

#[test]
fn faults_of_colliders() {
    says(|s| s.colliders[0].position.y = f64::NAN, "position is NaN");
    let long = UnitQuaternion::new_unchecked(Quaternion::new(1.0, 1.0, 0.0, 0.0));
    says(
        |s| s.colliders[0].orientation = long,
        "norm of the orientation is 1.41",
    );
    says(
        |s| s.colliders[0].body = Some(3),
        "collider `ball's` names the body `number 3`",
    );
    says(
        |s| s.colliders[0].name = "ground".into(),
        "two collider entries are called `ground`",
    );
    let point = "collider `point's` of body `point`: shape: would turn a point mass";
    says(|s| s.colliders[1].position.x = 0.1, point);
    let (length, radius) = (1.0, 1.0);
    says(
        |s| s.colliders[1].shape = Shape::Cylinder { length, radius },
        point,
    );
    // A point mass that nothing moves is turned by nothing.
    let mut held = yard();
    held.bodies.mobility[1] = Mobility::Static;
    held.colliders[1].position.x = 0.1;
    // What does not move may have a half-space, and a capsule no length.
    held.colliders[2].shape = Shape::HalfSpace;
    let (length, radius) = (0.0, 1.0);
    held.colliders[0].shape = Shape::Capsule { length, radius };
    assert_eq!(held.validate(), Ok(()));
}
