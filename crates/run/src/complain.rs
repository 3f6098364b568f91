//! What goes to stderr, in the place of the standard library's macros: those panic when stderr can't be written, as on a full
//! disk, and the exit code would then tell of a panic and not of what has happened.

/// As the standard library's, but what can't be written is lost.
#[macro_export]
macro_rules! eprint {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        // Nowhere is left to complain.
        let _ = write!(std::io::stderr(), $($text)*);
    }};
}

/// As the standard library's, but what can't be written is lost.
#[macro_export]
macro_rules! eprintln {
    () => {
        $crate::eprint!("\n")
    };
    ($($text:tt)*) => {
        $crate::eprint!("{}\n", format_args!($($text)*))
    };
}
