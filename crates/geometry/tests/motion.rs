//! Scripts: velocity is the derivative of the pose, and pose depends on time alone.

use geometry::motion::{Interpolation, Key, Movement, Pivot};
use geometry::{Ease, Motion, MovingSolid, Shape, Surface, Vector3};
use proptest::prelude::*;

fn vector(size: f64) -> impl Strategy<Value = Vector3> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0f64].prop_map(move |v| Vector3::from(v) * size)
}

fn during() -> impl Strategy<Value = (f64, f64)> {
    (0.0..1.5f64, 0.3..2.0f64).prop_map(|(start, length)| (start, start + length))
}

fn about() -> impl Strategy<Value = Pivot> {
    prop_oneof![Just(Pivot::Center), vector(2.0).prop_map(Pivot::Point)]
}

fn ease() -> impl Strategy<Value = Ease> {
    prop_oneof![
        (0..Ease::PLAIN.len()).prop_map(|i| Ease::PLAIN[i]),
        (0.05..0.5f64).prop_map(|ramp| Ease::Trapezoid { ramp })
    ]
}

fn movement() -> impl Strategy<Value = Movement> {
    let interpolation =
        prop_oneof![Just(Interpolation::Linear), Just(Interpolation::Cubic), Just(Interpolation::Smoothstep)];
    let key = (0.2..1.0f64, vector(1.0), vector(2.5), 0.5..2.0f64);
    prop_oneof![
        (vector(3.0), during(), ease()).prop_map(|(by, during, ease)| Movement::Translate { by, during, ease }),
        (vector(1.0), -9.0..9.0f64, during(), about(), ease()).prop_map(|(axis, angle, during, about, ease)| {
            Movement::Rotate { axis: axis + Vector3::new(0.0, 2.0, 0.0), angle, during, about, ease }
        }),
        (0.3..3.0f64, during(), about(), ease()).prop_map(|(factor, during, about, ease)| Movement::Scale {
            factor,
            during,
            about,
            ease
        }),
        (vector(1.0), 0.2..3.0f64, -3.0..3.0f64, during()).prop_map(|(amplitude, frequency, phase, during)| {
            Movement::Oscillate { amplitude, frequency, phase, during }
        }),
        (proptest::collection::vec(key, 1..5), interpolation, about()).prop_map(|(list, interpolation, about)| {
            let mut time = -0.2;
            let keys = list.into_iter().map(|(gap, translation, rotation, scale)| {
                time += gap;
                Key { time, translation, rotation, scale }
            });
            Movement::Keyframes { keys: keys.collect(), interpolation, about }
        }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn velocity_is_the_derivative_of_the_pose(movements in proptest::collection::vec(movement(), 1..5), center in vector(1.0),
                                              body in vector(2.0), time in -0.5..4.0f64) {
        let motion = Motion { movements };
        motion.check().unwrap();
        let h = 1e-5;
        prop_assume!(motion.corner_times().iter().all(|t| (t - time).abs() > 2.0 * h));
        // A trapezoid or two-piece curve has corners of acceleration inside: the tolerance is of first order in h there.
        let (pose, field) = motion.evaluate(&center, time);
        let at = |t: f64| motion.pose(&center, t).apply(&body);
        let difference = (at(time + h) - at(time - h)) / (2.0 * h);
        let velocity = field.at(&pose.apply(&body));
        prop_assert!((difference - velocity).norm() < 5e-3 * (1.0 + velocity.norm()), "{difference} {velocity}");
        let smooth = motion.movements.iter().all(|m| !matches!(m, Movement::Translate { ease, .. } | Movement::Rotate { ease, .. } | Movement::Scale { ease, .. }
            if matches!(ease, Ease::Trapezoid { .. } | Ease::QuadraticInOut | Ease::CubicInOut)));
        if smooth {
            prop_assert!((difference - velocity).norm() < 1e-6 * (1.0 + velocity.norm()), "{difference} {velocity}");
        }
        // The inverse finds the same point again.
        prop_assert!((pose.apply_inverse(&pose.apply(&body)) - body).norm() < 1e-12);
    }

    #[test]
    fn solids_keep_exact_distance_and_displacement(movements in proptest::collection::vec(movement(), 0..4), body in vector(3.0),
                                                   from in 0.0..3.0f64, step in 0.0..1.0f64) {
        let shape = Shape::Capsule { from: Vector3::new(-0.5, 0.0, 0.1), to: Vector3::new(0.7, 0.2, 0.0), radius: 0.2 };
        let solid = MovingSolid::new(shape.clone(), Motion { movements }, Surface::default()).unwrap();
        let (a, b) = (solid.at(from), solid.at(from + step));
        let (start, end) = (a.pose().apply(&body), b.pose().apply(&body));
        prop_assert!((a.signed_distance(&start) - shape.signed_distance(&body) * a.pose().scale).abs() < 1e-12);
        prop_assert!((start + solid.displacement(&start, from, from + step) - end).norm() < 1e-12 * (1.0 + end.norm()));
        let sample = b.sample(&end);
        prop_assert!((sample.normal.norm() - 1.0).abs() < 1e-12);
        prop_assert!(b.signed_distance(&(end - sample.normal * sample.distance)).abs() < 1e-11);
        if sample.distance <= 0.0 {
            prop_assert!(b.bounds().unwrap().inflated(1e-12).contains(&end));
        }
    }
}

#[test]
fn scripts_read_as_written_and_end_where_they_say() {
    let text = "[
        Translate(by: [10, 0, 0], during: (0, 0.25)),
        Translate(by: (-20, 0, 0), during: (0.25, 0.75), ease: Smoothstep),
        Rotate(axis: [0, 1, 0], angle: 1.5707963267948966, during: (0, 1), about: Point((0, 0, 0))),
        Scale(factor: 2, during: (0, 1)),
        Oscillate(amplitude: (0, 1, 0), frequency: 2, during: (0, 1.125)),
        Keyframes(keys: [(time: 0), (time: 1, translation: (0, 0, 3), rotation: (0, 0, 12.566370614359172))], interpolation: Cubic),
    ]";
    let motion: Motion = ron::from_str(text).unwrap();
    motion.check().unwrap();
    assert_eq!(ron::from_str::<Motion>(&ron::to_string(&motion).unwrap()).unwrap(), motion);
    let (pose, field) = motion.evaluate(&Vector3::zeros(), 5.0);
    assert!(field.linear.norm() + field.angular.norm() + field.growth.abs() < 1e-12);
    assert_eq!(pose.scale, 2.0);
    // (-10, 0, 0) turned by a quarter about y, then the swing's last place and the keyframe shift; size about its own centre.
    assert!((pose.apply(&Vector3::zeros()) - Vector3::new(0.0, 1.0, 13.0)).norm() < 1e-12, "{pose:?}");
    assert!(ron::from_str::<Motion>("[Translate(to: (1, 0, 0), during: (0, 1))]").is_err());
    let centimetres = motion.with_length_unit(0.01);
    assert!((centimetres.pose(&Vector3::zeros(), 5.0).translation - pose.translation * 0.01).norm() < 1e-15);
}

#[test]
fn wrong_scripts_are_refused() {
    for (text, needle) in [
        ("[Translate(by: (1, 0, 0), during: (1, 1))]", "end after the start"),
        ("[Translate(by: (1, 0, 0), during: (0, inf))]", "finite times"),
        ("[Rotate(axis: (0, 0, 0), angle: 1, during: (0, 1))]", "`axis`"),
        ("[Translate(by: (0, 1, 0), during: (0, 1)), Scale(factor: 0, during: (0, 1))]", "movement 1: `factor`"),
        ("[Keyframes(keys: [])]", "at least one key"),
        ("[Keyframes(keys: [(time: 1), (time: 1)])]", "rising"),
        ("[Translate(by: (1, 0, 0), during: (0, 1), ease: Trapezoid(ramp: 0.7))]", "`ramp`"),
        ("[Oscillate(amplitude: (1, 0, 0), frequency: NaN, during: (0, 1))]", "finite"),
    ] {
        let error = ron::from_str::<Motion>(text).unwrap().check().unwrap_err().to_string();
        assert!(error.contains(needle), "{text}: {error}");
    }
}
