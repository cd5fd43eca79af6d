//! Printing that survives a reader who leaves: `viscose run … | head` must neither end the run nor change its exit code.

/// A line on standard output.
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

/// Text on standard output, without an end of line.
macro_rules! say_on {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        _ = write!(std::io::stdout(), $($text)*);
    }};
}

/// A line on standard error.
macro_rules! tell {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        _ = writeln!(std::io::stderr(), $($text)*);
    }};
}

pub(crate) use {say, say_on, tell};
