//! Numbers that look random and depend on nothing but what they are asked for: the same on any machine, thread count and restart.

/// Mixes words into one (the finaliser of SplitMix64 over a running sum).
#[inline]
#[must_use]
pub fn hash(words: &[u64]) -> u64 {
    let mut state = 0x9E37_79B9_7F4A_7C15u64;
    for &w in words {
        state = mix(state.wrapping_add(w).wrapping_add(0x9E37_79B9_7F4A_7C15));
    }
    state
}

#[inline]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// A number in `[0, 1)` for the given words.
#[inline]
#[must_use]
pub fn uniform(words: &[u64]) -> f64 {
    (hash(words) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_spread_and_fixed() {
        let n = 10_000u64;
        let values: Vec<f64> = (0..n).map(|i| uniform(&[7, i])).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n as f64;
        assert!((mean - 0.5).abs() < 0.01 && (variance - 1.0 / 12.0).abs() < 0.002);
        assert_ne!(hash(&[1, 2]), hash(&[2, 1]));
    }
}
