//! When each step of the grains happens: the program of the library as a table of times.

use granular::experiment::{MicrogelSettings, Segment, program};
use granular::preparation::schedule::Operation;

/// A stretch of equal steps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    /// Steps before it.
    before: u64,
    /// Time at its start [s].
    start: f64,
    /// Its step [s].
    dt: f64,
    /// Its number of steps.
    steps: u64,
}

/// All steps of a run with their times, from the random packing on.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    stretches: Vec<Stretch>,
    /// Steps before the measurement.
    pub prepared: u64,
    /// All steps of one sample.
    pub steps: u64,
    /// Time at the end [s].
    pub end: f64,
    /// Segments of the experiment.
    pub segments: Vec<Segment>,
    /// What happens, in words: one line per operation that takes no time or stretch of steps.
    pub lines: Vec<String>,
}

impl Schedule {
    /// The schedule of settings; it costs nothing, however large the sample.
    #[must_use]
    pub fn new(settings: &MicrogelSettings) -> Schedule {
        let (operations, segments) = program(settings);
        let mut stretches: Vec<Stretch> = Vec::new();
        let (mut before, mut start, mut prepared) = (0, 0.0, 0);
        let mut lines: Vec<String> = Vec::new();
        let mut relaxing = 0;
        for operation in &operations {
            let (steps, dt) = match operation {
                Operation::Run { steps, dt, .. } => (*steps, *dt),
                Operation::Drive(k) => (segments[*k].steps, segments[*k].dt),
                _ => (0, 0.0),
            };
            if let Operation::Run { .. } = operation {
                prepared = u64::saturating_add(before, steps);
                relaxing = u64::saturating_add(relaxing, steps);
            } else if !matches!(operation, Operation::Friction(_) | Operation::RemoveDrift) {
                if relaxing > 0 {
                    lines.push(format!("relax the grains: {relaxing} steps"));
                    relaxing = 0;
                }
                lines.push(match operation {
                    Operation::LinkAndCut => "link what touches, cut it into particles, remove links".to_owned(),
                    Operation::Plates(plates) => format!("plates: {plates:?}"),
                    Operation::Drive(k) => format!("segment {}: {steps} steps of {dt:.3e} s", k + 1),
                    _ => unreachable!("handled before"),
                });
            }
            if steps > 0 {
                stretches.push(Stretch { before, start, dt, steps });
                before = u64::saturating_add(before, steps); // absurd lengths are refused by the checks
                start += steps as f64 * dt;
            }
        }
        Schedule { stretches, prepared, steps: before, end: start, segments, lines }
    }

    /// Time after so many steps [s].
    #[must_use]
    pub fn time(&self, steps: u64) -> f64 {
        let k = self.stretches.partition_point(|stretch| stretch.before <= steps).saturating_sub(1);
        self.stretches.get(k).map_or(0.0, |stretch| {
            let inside = (steps - stretch.before).min(stretch.steps);
            if inside == stretch.steps && k + 1 == self.stretches.len() {
                self.end
            } else {
                stretch.start + inside as f64 * stretch.dt
            }
        })
    }

    /// The segment in which step number `step` (from 0) lies, counted from 1; 0 while the sample is prepared.
    #[must_use]
    pub fn phase(&self, step: u64) -> usize {
        let Some(mut left) = step.checked_sub(self.prepared) else { return 0 };
        for (k, segment) in self.segments.iter().enumerate() {
            if left < segment.steps {
                return k + 1;
            }
            left -= segment.steps;
        }
        self.segments.len()
    }
}

#[cfg(test)]
mod tests {
    use super::Schedule;
    use granular::experiment::MicrogelSettings;

    #[test]
    fn times_ascend_to_the_end_and_count_the_published_steps() {
        let published = MicrogelSettings { step_factor: 1.0, ..MicrogelSettings::default() };
        let schedule = Schedule::new(&published);
        assert_eq!(schedule.steps, 17364);
        assert_eq!((schedule.time(0), schedule.time(schedule.steps)), (0.0, schedule.end));
        let times: Vec<f64> = (0..=schedule.steps).map(|step| schedule.time(step)).collect();
        assert!(times.windows(2).all(|pair| pair[1] > pair[0]));
        assert_eq!((schedule.phase(0), schedule.phase(schedule.prepared), schedule.phase(schedule.steps)), (0, 1, 1));
    }
}
