//! Numbers as the original reader takes them from text: it skips blanks, reads as much as looks like a number, and
//! does not mind what follows.

/// A number read from the front of a text, and whether anything but blanks followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Read<T> {
    /// The number.
    pub value: T,
    /// Something stood behind it that the original reader does not see.
    pub trailing: bool,
}

/// A decimal number; `None` where the text does not begin with one, or it is too large for `f64`.
#[must_use]
pub fn number(text: &str) -> Option<Read<f64>> {
    let text = text.trim_start();
    let bytes = text.as_bytes();
    let mut at = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let digits = |from: usize| bytes[from.min(bytes.len())..].iter().take_while(|b| b.is_ascii_digit()).count();
    let whole = digits(at);
    at += whole;
    let mut fraction = 0;
    if bytes.get(at) == Some(&b'.') {
        fraction = digits(at + 1);
        at += 1 + fraction;
    }
    if whole + fraction == 0 {
        return None;
    }
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
        let exponent = digits(at + 1 + sign);
        if exponent > 0 {
            at += 1 + sign + exponent;
        }
    }
    let value: f64 = text[..at].parse().ok()?;
    value.is_finite().then(|| Read { value, trailing: !text[at..].trim().is_empty() })
}

/// A whole number; of `3.5` the original reader sees the 3.
#[must_use]
pub fn integer(text: &str) -> Option<Read<i64>> {
    let text = text.trim_start();
    let sign = usize::from(text.starts_with(['+', '-']));
    let digits = text.as_bytes()[sign..].iter().take_while(|b| b.is_ascii_digit()).count();
    if digits == 0 {
        return None;
    }
    let at = sign + digits;
    let value: i32 = text[..at].trim_start_matches('+').parse().ok()?;
    Some(Read { value: i64::from(value), trailing: !text[at..].trim().is_empty() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_from_the_front() {
        let read = |text| number(text).map(|read| (read.value, read.trailing));
        assert_eq!(read(" -80."), Some((-80.0, false)));
        assert_eq!(read(".5e1 "), Some((5.0, false)));
        assert_eq!(read("1e-9abc"), Some((1e-9, true)));
        assert_eq!(read("3 4"), Some((3.0, true)));
        assert_eq!(read("2e"), Some((2.0, true)));
        for nonsense in ["", "  ", "abc", "-", ".", "e5", "nan", "inf", "1e999", "-1e999"] {
            assert_eq!(read(nonsense), None, "{nonsense}");
        }
        let whole = |text| integer(text).map(|read| (read.value, read.trailing));
        assert_eq!(whole("+12"), Some((12, false)));
        assert_eq!(whole("3.5"), Some((3, true)));
        for nonsense in ["", "x", "-", "99999999999"] {
            assert_eq!(whole(nonsense), None, "{nonsense}");
        }
    }
}
