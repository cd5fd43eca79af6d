//! Output moments: the k-th is exactly k times the interval, so a resumed run meets the same ones.

/// A regular clock for frames or checkpoints.
#[derive(Clone, Debug, PartialEq)]
pub enum Clock {
    /// Every so many seconds of simulated time; the k-th moment is k times the interval.
    Every(f64),
    /// Every so many accepted steps.
    Steps(u64),
    /// At these moments [s], ascending.
    At(Vec<f64>),
    /// Never.
    Never,
}

impl Clock {
    /// The next moment after `done` ticks [s]; infinite for clocks that count steps.
    #[must_use]
    pub fn next_time(&self, done: u64) -> f64 {
        match self {
            Clock::Every(interval) => done as f64 * interval,
            Clock::At(times) => times.get(done as usize).copied().unwrap_or(f64::INFINITY),
            Clock::Steps(_) | Clock::Never => f64::INFINITY,
        }
    }

    /// Whether tick number `done` is due at this time and step.
    #[must_use]
    pub fn due(&self, done: u64, time: f64, step: u64) -> bool {
        match self {
            Clock::Steps(every) => step == 0 && done == 0 || step > 0 && step / every.max(&1) >= done.max(1),
            Clock::Every(_) | Clock::At(_) => {
                let next = self.next_time(done);
                time >= next - 1e-12 * next.abs()
            }
            Clock::Never => false,
        }
    }

    /// How many ticks are over at this time and step: where a clock stands after a tick was taken.
    #[must_use]
    pub fn ticks_after(&self, done: u64, time: f64, step: u64) -> u64 {
        let mut ticks = done;
        while self.due(ticks, time, step) {
            ticks += 1;
            if matches!(self, Clock::Every(interval) if *interval <= 0.0) {
                break;
            }
        }
        ticks
    }

    /// How many ticks there are from time zero to `end` [s], where it can be told before the run.
    #[must_use]
    pub fn count(&self, end: f64) -> Option<u64> {
        match self {
            Clock::Every(interval) if *interval > 0.0 => Some((end / interval * (1.0 + 1e-12)) as u64 + 1),
            Clock::At(times) => Some(times.iter().filter(|time| **time <= end).count() as u64),
            Clock::Never => Some(0),
            Clock::Every(_) | Clock::Steps(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_regular_clock_ticks_at_zero_and_at_multiples() {
        let clock = Clock::Every(0.1);
        assert!(clock.due(0, 0.0, 0));
        assert!(!clock.due(1, 0.05, 1));
        assert!(clock.due(3, 3.0 * 0.1, 9));
        assert_eq!(clock.ticks_after(1, 0.35, 9), 4);
        assert_eq!(clock.count(1.0), Some(11));
    }

    #[test]
    fn a_step_clock_counts_steps() {
        let clock = Clock::Steps(10);
        assert!(clock.due(0, 0.0, 0));
        assert!(!clock.due(1, 0.5, 9));
        assert!(clock.due(1, 0.6, 10));
        assert_eq!(clock.ticks_after(1, 0.6, 10), 2);
    }

    #[test]
    fn listed_moments_come_once_each() {
        let clock = Clock::At(vec![0.5, 0.7]);
        assert!(!clock.due(0, 0.4, 3));
        assert!(clock.due(0, 0.5, 4));
        assert_eq!(clock.next_time(1), 0.7);
        assert_eq!(clock.next_time(2), f64::INFINITY);
    }
}
