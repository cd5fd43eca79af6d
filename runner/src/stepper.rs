//! Chooses the step, retries with a smaller one, and gives up with a reason.
//!
//! Every active component states its stable step and why; the smallest wins and is recorded as the limiter. A rejected step
//! is taken back and halved, at most [`MAX_HALVINGS`] times in a row; then the run stops with the rejection.

use serde::{Deserialize, Serialize};

use crate::system::{Rejection, StepLimit, System};

/// Halvings in a row before a run stops.
pub const MAX_HALVINGS: u32 = 6;

/// How fast the step may grow again after a rejection.
const GROWTH: f64 = 1.25;

/// Names of limiters that belong to the control itself.
mod limiter {
    pub const FIXED: &str = "fixed";
    pub const MAXIMUM: &str = "maximum";
    pub const RETRY: &str = "retry";
    pub const CLOCK: &str = "output clock";
    pub const END: &str = "end";
}

/// How the scene wants its steps chosen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum StepControl {
    /// Always this step [s]; limits of components are reported but do not shorten it. Rejected steps are still halved.
    Fixed(f64),
    /// As large as the components allow.
    Adaptive {
        /// Largest step [s].
        max: f64,
        /// Smallest step [s] the control chooses by itself; halving after a rejection may go below.
        min: f64,
        /// Factor on the components' limits.
        safety: f64,
    },
    /// The steps that the system itself asks for, never cut for output. A rejected one ends the run: the system has done what
    /// it could by itself.
    Own,
}

/// The part of the control that must survive a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepperState {
    /// Simulated time [s].
    pub time: f64,
    /// Accepted steps.
    pub step: u64,
    /// Rejected steps so far.
    pub rejected: u64,
    /// Largest step allowed since the last rejection [s]; grows back with every accepted step, infinite when free.
    pub retry_cap: f64,
    /// In fixed stepping: whole steps done, so that times are multiples of the step to the last digit.
    pub whole_steps: u64,
    /// In fixed stepping: true between two whole steps (after a halving).
    pub between: bool,
}

impl Default for StepperState {
    fn default() -> StepperState {
        StepperState { time: 0.0, step: 0, rejected: 0, retry_cap: f64::INFINITY, whole_steps: 0, between: false }
    }
}

/// What an accepted step was like.
#[derive(Clone, Debug, PartialEq)]
pub struct Accepted {
    /// Step taken [s].
    pub dt: f64,
    /// What limited it.
    pub limiter: &'static str,
    /// Rejections before it was accepted.
    pub rejections: u32,
    /// The last of them.
    pub refused: Option<Rejection>,
}

/// A step that could not be taken even after halving.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// Time at which it was tried [s].
    pub time: f64,
    /// The last step tried [s].
    pub dt: f64,
    /// The last rejection.
    pub rejection: Rejection,
}

/// Steps a system.
#[derive(Clone, Debug)]
pub struct Stepper {
    control: StepControl,
    end: f64,
    /// The part that goes into checkpoints.
    pub state: StepperState,
}

/// Two times are the same for the control when they differ by less than this part of the larger.
const SAME_TIME: f64 = 1e-12;

impl Stepper {
    /// A stepper from time zero to `end` [s].
    #[must_use]
    pub fn new(control: StepControl, end: f64) -> Stepper {
        Stepper { control, end, state: StepperState::default() }
    }

    /// Whether the end is reached.
    #[must_use]
    pub fn done(&self) -> bool {
        self.state.time >= self.end * (1.0 - SAME_TIME)
    }

    /// The end time [s].
    #[must_use]
    pub fn end(&self) -> f64 {
        self.end
    }

    /// Takes one step of at most the chosen length, not beyond `target` [s] (the next moment at which output is due).
    ///
    /// # Errors
    /// When the step was rejected [`MAX_HALVINGS`] + 1 times; the system is then back at its last accepted state.
    pub fn advance(&mut self, system: &mut dyn System, target: f64) -> Result<Accepted, Failure> {
        system.snapshot();
        let (mut dt, mut limiter) = self.choose(&system.step_limits(), target);
        let mut rejections = 0;
        let mut refused = None;
        loop {
            match system.advance(self.state.time, dt) {
                Ok(()) => {
                    self.accept(dt, rejections);
                    return Ok(Accepted { dt, limiter, rejections, refused });
                }
                Err(rejection) => {
                    system.restore();
                    self.state.rejected += 1;
                    rejections += 1;
                    if rejections > MAX_HALVINGS || self.control == StepControl::Own {
                        return Err(Failure { time: self.state.time, dt, rejection });
                    }
                    dt *= 0.5;
                    limiter = limiter::RETRY;
                    refused = Some(rejection);
                }
            }
        }
    }

    fn choose(&self, limits: &[StepLimit], target: f64) -> (f64, &'static str) {
        let now = self.state.time;
        let to_end = self.end - now;
        let (mut dt, mut limiter) = match self.control {
            StepControl::Fixed(step) if self.state.between => {
                ((self.state.whole_steps + 1) as f64 * step - now, limiter::RETRY)
            }
            StepControl::Fixed(step) => (step, limiter::FIXED),
            StepControl::Adaptive { max, min, safety } => limits.iter().fold((max, limiter::MAXIMUM), |best, limit| {
                let seconds = (limit.seconds * safety).max(min);
                if seconds < best.0 { (seconds, limit.reason) } else { best }
            }),
            StepControl::Own => {
                return limits.first().map_or((to_end, limiter::END), |limit| (limit.seconds, limit.reason));
            }
        };
        if self.state.retry_cap < dt {
            (dt, limiter) = (self.state.retry_cap, limiter::RETRY);
        }
        match self.control {
            StepControl::Fixed(_) => {
                if dt > to_end * (1.0 - SAME_TIME) {
                    (dt, limiter) = (to_end, limiter::END);
                }
            }
            StepControl::Adaptive { .. } => {
                let gap = (target - now).min(to_end);
                let name = if target < self.end { limiter::CLOCK } else { limiter::END };
                if dt >= gap * (1.0 - SAME_TIME) {
                    (dt, limiter) = (gap, name);
                } else if dt > 0.5 * gap {
                    (dt, limiter) = (0.5 * gap, name); // no sliver before the clock strikes
                }
            }
            StepControl::Own => {}
        }
        (dt, limiter)
    }

    fn accept(&mut self, dt: f64, rejections: u32) {
        let end = self.end;
        let state = &mut self.state;
        state.step += 1;
        state.retry_cap = if rejections > 0 { dt } else { state.retry_cap * GROWTH };
        let full = match self.control {
            StepControl::Fixed(step) => step,
            StepControl::Adaptive { max, .. } => max,
            StepControl::Own => 0.0,
        };
        if state.retry_cap >= full {
            state.retry_cap = f64::INFINITY;
        }
        state.time += dt;
        if let StepControl::Fixed(step) = self.control {
            let next = (state.whole_steps + 1) as f64 * step;
            state.between = state.time < next - SAME_TIME * next;
            if !state.between {
                state.whole_steps += 1;
                state.time = next;
            }
        }
        if (end - state.time).abs() <= SAME_TIME * end.abs() {
            state.time = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::frame::Frame;
    use crate::system::{Column, Element, RejectionReason, StateError};

    /// Counts time by itself and refuses steps above a threshold.
    struct Clockwork {
        time: f64,
        kept: f64,
        refuse_above: f64,
        limit: f64,
    }

    impl System for Clockwork {
        fn kind(&self) -> &'static str {
            "clockwork"
        }
        fn columns(&self) -> Vec<Column> {
            Vec::new()
        }
        fn row(&self, _: &mut Vec<f64>) {}
        fn step_limits(&self) -> Vec<StepLimit> {
            vec![StepLimit { seconds: self.limit, reason: "clockwork: wear" }]
        }
        fn snapshot(&mut self) {
            self.kept = self.time;
        }
        fn restore(&mut self) {
            self.time = self.kept;
        }
        fn advance(&mut self, _: f64, dt: f64) -> Result<(), Rejection> {
            self.time += dt;
            if dt > self.refuse_above {
                let element = Some(Element::StrandVertex { strand: 3, vertex: 7 });
                let reason = RejectionReason::NotConverged;
                return Err(Rejection { stage: "mixture", reason, element, detail: String::new() });
            }
            Ok(())
        }
        fn iterations(&self) -> usize {
            0
        }
        fn stage_seconds(&self) -> Vec<(&'static str, f64)> {
            Vec::new()
        }
        fn frame(&self, step: u64, time: f64) -> Frame {
            Frame { time, step, pieces: Vec::new() }
        }
        fn save(&self) -> Result<Vec<u8>, StateError> {
            Ok(Vec::new())
        }
        fn load(&mut self, _: &[u8]) -> Result<(), StateError> {
            Ok(())
        }
        fn summary(&self) -> serde_json::Map<String, serde_json::Value> {
            serde_json::Map::new()
        }
    }

    fn clockwork(refuse_above: f64, limit: f64) -> Clockwork {
        Clockwork { time: 0.0, kept: 0.0, refuse_above, limit }
    }

    #[test]
    fn fixed_steps_land_on_multiples_even_after_halving() {
        let mut system = clockwork(0.03, f64::INFINITY);
        let mut stepper = Stepper::new(StepControl::Fixed(0.1), 1.0);
        let mut times = Vec::new();
        while !stepper.done() {
            stepper.advance(&mut system, f64::INFINITY).unwrap();
            times.push(stepper.state.time);
        }
        assert_eq!(stepper.state.time, 1.0);
        assert!(stepper.state.rejected >= 2);
        for k in 1..=10 {
            assert!(times.contains(&(f64::from(k) * 0.1)), "no step ended at {k}/10");
        }
        assert!((system.time - 1.0).abs() < 1e-12);
    }

    #[test]
    fn adaptive_steps_meet_the_output_clock_and_name_the_limiter() {
        let mut system = clockwork(f64::INFINITY, 0.4);
        let mut stepper = Stepper::new(StepControl::Adaptive { max: 1.0, min: 0.0, safety: 0.5 }, 1.0);
        let first = stepper.advance(&mut system, 1.0).unwrap();
        assert_eq!((first.dt, first.limiter), (0.2, "clockwork: wear"));
        let second = stepper.advance(&mut system, 0.25).unwrap();
        assert_eq!(second.limiter, "output clock");
        assert_eq!(stepper.state.time, 0.25);
        while !stepper.done() {
            stepper.advance(&mut system, 1.0).unwrap();
        }
        assert_eq!(stepper.state.time, 1.0);
    }

    #[test]
    fn six_halvings_then_the_run_stops_with_the_rejection_and_the_old_state() {
        let mut system = clockwork(0.0, f64::INFINITY);
        let mut stepper = Stepper::new(StepControl::Fixed(0.64), 1.0);
        let failure = stepper.advance(&mut system, f64::INFINITY).unwrap_err();
        assert_eq!(system.time, 0.0);
        assert_eq!(stepper.state.rejected, u64::from(MAX_HALVINGS) + 1);
        assert!((failure.dt - 0.01).abs() < 1e-15);
        let text = failure.rejection.to_string();
        assert!(text.contains("mixture") && text.contains("strand 3, vertex 7"), "{text}");
    }

    #[test]
    fn after_a_rejection_the_step_grows_back() {
        let mut system = clockwork(0.3, f64::INFINITY);
        let mut stepper = Stepper::new(StepControl::Adaptive { max: 0.5, min: 0.0, safety: 1.0 }, 100.0);
        let first = stepper.advance(&mut system, f64::INFINITY).unwrap();
        assert_eq!((first.dt, first.limiter, first.rejections), (0.25, "retry", 1));
        system.refuse_above = f64::INFINITY;
        for _ in 0..8 {
            stepper.advance(&mut system, f64::INFINITY).unwrap();
        }
        assert_eq!(stepper.advance(&mut system, f64::INFINITY).unwrap().dt, 0.5);
    }
}
