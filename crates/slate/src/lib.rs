//! The facade that users depend on.
