//! Macros for stderr in the place of the standard library's.
//! Those panic when stderr can't be written, as on a full disk, and the exit code would then report a panic instead of
//! the result.

/// Prints like the standard macro, but output that can't be written is lost.
#[macro_export]
macro_rules! eprint {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        // Nowhere is left to complain.
        let _ = write!(std::io::stderr(), $($text)*);
    }};
}

/// Prints like the standard macro, but output that can't be written is lost.
#[macro_export]
macro_rules! eprintln {
    () => {
        $crate::eprint!("\n")
    };
    ($($text:tt)*) => {
        $crate::eprint!("{}\n", format_args!($($text)*))
    };
}
