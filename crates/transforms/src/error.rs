use std::fmt;
use std::sync::Arc;

use slate_interfaces::FrameName;

/// Why a frame can't be looked up. Making one allocates nothing, as frames that are not there yet are daily life.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TransformError {
    /// Nobody has set a frame of that name, nor one in it.
    #[error("there is no frame `{frame}` yet")]
    UnknownFrame {
        /// The name, cut to what a frame's name may have.
        frame: FrameName,
    },
    /// The frames are in different trees.
    #[error(
        "`{source_frame}` is not connected to `{target}`: it is in the tree of `{source_root}`, and `{target}` in that of \
         `{target_root}`"
    )]
    NotConnected {
        /// The frame to look up in.
        target: Arc<str>,
        /// The frame to look up.
        source_frame: Arc<str>,
        /// The frame that the target's tree grows from.
        target_root: Arc<str>,
        /// The frame that the source's tree grows from.
        source_root: Arc<str>,
    },
    /// The time is after the last that is known of an edge.
    #[error("at {} s: the newest of `{parent}` -> `{child}` is {} s", Seconds(*.time), Seconds(*.newest))]
    TooNew {
        /// The edge's parent.
        parent: Arc<str>,
        /// The edge's child.
        child: Arc<str>,
        /// The time asked for, nanoseconds.
        time: u64,
        /// The newest there is, nanoseconds.
        newest: u64,
    },
    /// The time is before the first that is still known of an edge.
    #[error("at {} s: the oldest kept of `{parent}` -> `{child}` is {} s", Seconds(*.time), Seconds(*.oldest))]
    TooOld {
        /// The edge's parent.
        parent: Arc<str>,
        /// The edge's child.
        child: Arc<str>,
        /// The time asked for, nanoseconds.
        time: u64,
        /// The oldest there is, nanoseconds.
        oldest: u64,
    },
}

/// Why a frame can't be set; the tree stays as it is.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SetError {
    /// The name is empty or too long.
    #[error("`{name}` is no name of a frame: expected 1 to {limit} bytes without `/`")]
    Name {
        /// The name.
        name: String,
        /// How many bytes it may have.
        limit: usize,
    },
    /// A frame can't be its own parent.
    #[error("`{frame}` can't be its own parent")]
    OwnParent {
        /// The frame.
        frame: Arc<str>,
    },
    /// The parent is below the child.
    #[error("`{parent}` can't be the parent of `{child}`, as it is below it")]
    Cycle {
        /// The parent to be.
        parent: Arc<str>,
        /// The child to be.
        child: Arc<str>,
    },
    /// The tree is full.
    #[error("no room for the frame `{frame}`: the tree has {limit} frames, which is its limit")]
    TooManyFrames {
        /// The frame that has no place.
        frame: Arc<str>,
        /// How many frames there may be.
        limit: usize,
    },
    /// A number is not finite, or the rotation is no unit quaternion.
    #[error(
        "`{parent}` -> `{child}` is no transform: its numbers must be finite and its quaternion's length 1, which is {norm}"
    )]
    NoTransform {
        /// The parent.
        parent: Arc<str>,
        /// The child.
        child: Arc<str>,
        /// The length of the quaternion, as text.
        norm: String,
    },
    /// It comes too late to be of use.
    #[error("`{parent}` -> `{child}` at {} s comes too late: {} s is known", Seconds(*.time), Seconds(*.known))]
    TooLate {
        /// The parent.
        parent: Arc<str>,
        /// The child.
        child: Arc<str>,
        /// Its time, nanoseconds.
        time: u64,
        /// The oldest kept, or with another parent the newest, nanoseconds.
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
