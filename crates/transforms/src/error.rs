use std::fmt;
use std::sync::Arc;

use slate_interfaces::FrameName;

/// Error of a lookup. Does not allocate, as lookups of missing frames are frequent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TransformError {
    /// Unknown frame.
    #[error("there is no frame `{frame}` yet")]
    UnknownFrame {
        /// Name, truncated to the length of frame names.
        frame: FrameName,
    },
    /// Frames in different trees.
    #[error(
        "`{source_frame}` is not connected to `{target}`: it is in the tree of `{source_root}`, and `{target}` in that of \
         `{target_root}`"
    )]
    NotConnected {
        /// Target frame.
        target: Arc<str>,
        /// Source frame.
        source_frame: Arc<str>,
        /// Root of the target's tree.
        target_root: Arc<str>,
        /// Root of the source's tree.
        source_root: Arc<str>,
    },
    /// Time after the newest of an edge.
    #[error("at {} s: the newest of `{parent}` -> `{child}` is {} s", Seconds(*.time), Seconds(*.newest))]
    TooNew {
        /// Parent of the edge.
        parent: Arc<str>,
        /// Child of the edge.
        child: Arc<str>,
        /// Requested time, nanoseconds.
        time: u64,
        /// Newest time, nanoseconds.
        newest: u64,
    },
    /// Time before the oldest of an edge.
    #[error("at {} s: the oldest kept of `{parent}` -> `{child}` is {} s", Seconds(*.time), Seconds(*.oldest))]
    TooOld {
        /// Parent of the edge.
        parent: Arc<str>,
        /// Child of the edge.
        child: Arc<str>,
        /// Requested time, nanoseconds.
        time: u64,
        /// Oldest time, nanoseconds.
        oldest: u64,
    },
}

/// Error of setting a frame; the tree is unchanged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SetError {
    /// Empty or too long name.
    #[error("`{name}` is not a name of a frame: expected 1 to {limit} bytes without `/`")]
    Name {
        /// Name.
        name: String,
        /// Maximum length, bytes.
        limit: usize,
    },
    /// Frame as its own parent.
    #[error("`{frame}` can't be its own parent")]
    OwnParent {
        /// Frame.
        frame: Arc<str>,
    },
    /// Parent below its child.
    #[error("`{parent}` can't be the parent of `{child}`, as it is below it")]
    Cycle {
        /// Intended parent.
        parent: Arc<str>,
        /// Intended child.
        child: Arc<str>,
    },
    /// Full tree.
    #[error("no room for the frame `{frame}`: the tree has {limit} frames, which is its limit")]
    TooManyFrames {
        /// Frame beyond the capacity.
        frame: Arc<str>,
        /// Maximum number of frames.
        limit: usize,
    },
    /// Number that is not finite, or rotation that is not a unit quaternion.
    #[error(
        "`{parent}` -> `{child}` is not a transform: its numbers must be finite and its quaternion's length 1, which is {norm}"
    )]
    NoTransform {
        /// Parent.
        parent: Arc<str>,
        /// Child.
        child: Arc<str>,
        /// Length of the quaternion, as text.
        norm: String,
    },
    /// Outdated transform.
    #[error("`{parent}` -> `{child}` at {} s is too late: {} s is known", Seconds(*.time), Seconds(*.known))]
    TooLate {
        /// Parent.
        parent: Arc<str>,
        /// Child.
        child: Arc<str>,
        /// Time of the transform, nanoseconds.
        time: u64,
        /// Oldest kept time, or the newest with another parent, nanoseconds.
        known: u64,
    },
}

/// Nanoseconds written as seconds, exactly.
struct Seconds(u64);

impl fmt::Display for Seconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (seconds, mut fraction, mut digits) = (self.0 / 1_000_000_000, self.0 % 1_000_000_000, 9);
        if fraction == 0 {
            return write!(f, "{seconds}");
        }
        while fraction % 10 == 0 {
            fraction /= 10;
            digits -= 1;
        }
        write!(f, "{seconds}.{fraction:0digits$}")
    }
}
