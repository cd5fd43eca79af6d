//! The same bits for any thread count and across a resume.

use super::{build, pair_settings};
use crate::generate::{YarnGroup, YarnShape};
use crate::settings::Integrator;
use crate::{YarnSettings, YarnState, YarnSystem};

fn ball() -> YarnSettings {
    let shape = YarnShape::HairBall { center: vec![0.5; 3], radius: 0.12, count: 100, length: 0.3, curl: 0.1, seed: 3 };
    YarnSettings {
        yarns: vec![YarnGroup { velocity: vec![0.1, -0.4, 0.0], ..YarnGroup::new(shape) }],
        gravity: vec![0.0, -9.8, 0.0],
        ..pair_settings::<3>(0.0)
    }
}

fn after(settings: &YarnSettings, threads: usize, steps: usize) -> YarnState<3> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
        let mut system: YarnSystem<3> = build(settings);
        for _ in 0..steps {
            assert!(system.model().len() > 3000, "large enough for the work to be shared out");
            system.advance(8e-5).unwrap();
        }
        system.state().clone()
    })
}

#[test]
fn thread_count_changes_no_bit() {
    let explicit = ball();
    let mut implicit = ball();
    implicit.step.integrator = Integrator::Implicit(Default::default());
    for (settings, steps) in [(explicit, 10), (implicit, 1)] {
        let one = after(&settings, 1, steps);
        assert!(one == after(&settings, 2, steps));
        assert!(one == after(&settings, 4, steps));
    }
}

#[test]
fn resumed_run_gives_the_same_bytes() {
    let settings = pair_settings::<3>(2.0);
    let mut whole: YarnSystem<3> = build(&settings);
    for _ in 0..40 {
        whole.advance(8e-5).unwrap();
    }
    let saved = serde_json::to_string(whole.state()).unwrap();
    for _ in 0..40 {
        whole.advance(8e-5).unwrap();
    }
    let mut resumed: YarnSystem<3> = build(&settings);
    resumed.set_state(serde_json::from_str(&saved).unwrap()).unwrap();
    for _ in 0..40 {
        resumed.advance(8e-5).unwrap();
    }
    assert!(whole.state() == resumed.state());
    let mut wrong: YarnState<3> = serde_json::from_str(&saved).unwrap();
    wrong.position.pop();
    assert!(resumed.set_state(wrong).is_err());
}

#[test]
fn settings_survive_a_text_file() {
    let settings = ball();
    let text = serde_json::to_string(&settings).unwrap();
    assert_eq!(serde_json::from_str::<YarnSettings>(&text).unwrap(), settings);
    assert!(serde_json::from_str::<YarnSettings>(r#"{"cel": 0.1}"#).is_err());
}
