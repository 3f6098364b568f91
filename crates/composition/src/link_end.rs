//! The end of a link in its module.

/// The end of a link in its module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LinkEnd {
    /// A port, by its place in the description.
    Port(usize),
    /// The switch.
    Enabled,
    /// The parameters.
    Params,
}
