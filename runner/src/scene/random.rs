//! Random numbers that depend only on what they are for: seed, group, strand, channel.
//!
//! No state and no order: adding a strand or a channel does not change the numbers of the others, and every platform
//! gives the same bits.

/// What a random number is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Radius of the strand.
    Radius = 1,
    /// Length of the strand.
    Length = 2,
    /// Size of its curl.
    Curl = 3,
    /// Turn of its curl.
    Phase = 4,
    /// Distance of its root from the centre of the disc.
    DiscRadius = 5,
    /// Angle of its root on the disc.
    DiscAngle = 6,
    /// Tilt of its direction.
    Tilt = 7,
    /// Azimuth of the tilt.
    Azimuth = 8,
}

/// The finaliser of splitmix64: a bijection of 64-bit numbers in which every input bit changes half of the output.
const fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// A number in `[0, 1)`, evenly distributed.
#[must_use]
pub fn uniform(seed: u64, group: usize, strand: usize, channel: Channel) -> f64 {
    let state = mix(seed);
    let state = mix(state ^ group as u64);
    let state = mix(state ^ strand as u64);
    let state = mix(state ^ channel as u64);
    #[allow(clippy::cast_precision_loss)] // 53 bits are exact
    let mantissa = (state >> 11) as f64;
    mantissa / 9_007_199_254_740_992.0
}

/// A factor in `[1 − spread, 1 + spread)`, evenly distributed.
#[must_use]
pub fn factor(spread: f64, seed: u64, group: usize, strand: usize, channel: Channel) -> f64 {
    1.0 + spread * (2.0 * uniform(seed, group, strand, channel) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_pinned() {
        // These must never change: scenes would change with them.
        assert_eq!(mix(0), 0xe220_a839_7b1d_cdaf); // published first output of splitmix64 with seed 0
        let first = uniform(7, 0, 0, Channel::Radius);
        assert_eq!(first, uniform(7, 0, 0, Channel::Radius));
        assert_ne!(first, uniform(7, 0, 0, Channel::Length));
        assert_ne!(first, uniform(7, 0, 1, Channel::Radius));
        assert_ne!(first, uniform(7, 1, 0, Channel::Radius));
        assert_ne!(first, uniform(8, 0, 0, Channel::Radius));
    }

    #[test]
    fn numbers_are_even() {
        let n = 10_000;
        let mut bins = [0usize; 10];
        let mut sum = 0.0;
        for strand in 0..n {
            let value = uniform(1, 2, strand, Channel::Phase);
            assert!((0.0..1.0).contains(&value));
            bins[(value * 10.0) as usize] += 1;
            sum += value;
        }
        // Mean of n even numbers: standard deviation 0.0029; five of them.
        assert!((sum / n as f64 - 0.5).abs() < 0.0145);
        assert!(bins.iter().all(|&count| (850..1150).contains(&count)), "{bins:?}");
    }
}
