//! Runs a kernel compiled for AVX2 where the machine has it. No fused multiply-add is enabled, so both paths give the same bits.

/// Calls `kernel`, compiled with 256-bit vectors where the machine has them.
///
/// Everything that should profit must be inlined into `kernel`.
#[inline]
pub fn vectorised<R>(kernel: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn wide<R>(kernel: impl FnOnce() -> R) -> R {
            kernel()
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the line above has found that the processor has AVX2, the only feature that `wide` requires.
            return unsafe { wide(kernel) };
        }
    }
    kernel()
}
