//! Arrays that grow with the liquid: by an eighth beyond what is needed, not twofold, because they are most of the memory of a run.

/// Room for `n` entries.
pub(crate) fn room<T>(array: &mut Vec<T>, n: usize) {
    if n > array.capacity() {
        array.reserve_exact(n + n / 8 - array.len());
    }
}

/// `array.resize(n, value)` with [`room`].
pub(crate) fn resize<T: Clone>(array: &mut Vec<T>, n: usize, value: T) {
    room(array, n);
    array.resize(n, value);
}
