//! Synchronization points at which other threads join the main loop and each other.
//!
//! A point has a hierarchical name such as `/stage/act/start`. An [emit](Emitter::emit) wakes all threads that
//! [wait](Point::wait) for it or for a point above it: `/stage/act`, `/stage`, `/`. Emits are counted, and a waiter
//! passes the last count that it saw; so a late waiter detects the emit, and no wake-up is lost. An emit allocates
//! nothing, locks nothing, and makes a system call only for threads that sleep.
//!
//! ```
//! use slate_engine::synchronization::{Count, Synchronization};
//! use std::time::Duration;
//!
//! let synchronization = Synchronization::default();
//! let start = synchronization.emitter("/stage/act/start", "main loop")?;
//! let stages = synchronization.point("/stage")?;
//!
//! start.emit();
//! // It is over already, and found nevertheless.
//! let seen = stages.wait(Count::ZERO, Duration::from_secs(1))?;
//! let error = stages.wait(seen, Duration::from_millis(1)).unwrap_err();
//! assert_eq!(error.to_string(), "nothing was emitted at `/stage` within 1ms");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod emitter;
mod member;
mod point;
mod waiter_slots;

use std::sync::{Arc, PoisonError};

pub use emitter::Emitter;
pub use point::{Count, Late, Mark, Point, TimedOut};

use member::Member;
use slate_sorted::SortedMap;
use sync::{AtomicBool, Mutex, Ordering};

/// Atomics and locks of the standard library, or those of a checker.
mod sync {
    #[cfg(feature = "shuttle")]
    pub(super) use shuttle::sync::{
        Mutex, MutexGuard,
        atomic::{AtomicBool, AtomicU64, Ordering},
    };
    #[cfg(not(feature = "shuttle"))]
    pub(super) use std::sync::{
        Mutex, MutexGuard,
        atomic::{AtomicBool, AtomicU64, Ordering},
    };
}

/// Maximum length of a name, bytes.
const NAME_LIMIT: usize = 128;
/// Maximum number of parts of a name.
/// An emit touches a point for each.
const DEPTH_LIMIT: usize = 8;
/// Maximum number of points; they stay as long as the agent.
const POINT_LIMIT: usize = 4096;

/// Reason why a point does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PointError {
    /// Invalid name of a point.
    #[error(
        "`{name}` is not a name of a synchronization point: expected up to {DEPTH_LIMIT} parts of letters, digits, `_`, `-` \
         and `.`, each after a `/`, such as `/stage/act/start`"
    )]
    Name {
        /// Name.
        name: String,
    },
    /// Limit of the number of points.
    #[error("no room for the synchronization point `{name}`: there are {POINT_LIMIT}, which is the limit")]
    TooMany {
        /// Name.
        name: String,
    },
}

/// All synchronization points of an agent.
#[derive(Debug, Default)]
pub struct Synchronization {
    points: Mutex<Points>,
    /// True once any point was requested: a frequent emitter then need not check each.
    requested: AtomicBool,
}

#[derive(Debug, Default)]
struct Points {
    by_name: SortedMap<Arc<str>, Arc<Point>>,
    /// Emitters that ever were.
    emitters: u64,
}

impl Synchronization {
    /// Returns the point of that name; makes it and those above it on demand.
    ///
    /// # Errors
    /// When it is not a name of a point, or there are too many.
    pub fn point(&self, name: &str) -> Result<Arc<Point>, PointError> {
        let mut points = self.points.lock().unwrap_or_else(PoisonError::into_inner);
        let point = points.get(name)?;
        let above = name.trim_end_matches('/');
        let is_below = |other: &str| other.strip_prefix(above).is_some_and(|rest| rest.starts_with('/'));
        points.by_name.iter().filter(|(other, _)| is_below(other)).for_each(|(_, point)| point.request());
        point.request();
        self.requested.store(true, Ordering::Relaxed);
        Ok(point)
    }

    /// Returns true if any point was ever requested.
    #[inline]
    pub fn is_requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    /// Registers an emitter of a point, with the name `owner` in messages.
    /// [`Point::wait_all`] waits for it, there and above, until it is dropped.
    ///
    /// # Errors
    /// As for [`point`](Synchronization::point).
    pub fn emitter(&self, name: &str, owner: &str) -> Result<Emitter, PointError> {
        let mut points = self.points.lock().unwrap_or_else(PoisonError::into_inner);
        let point = points.get(name)?;
        points.emitters += 1;
        Ok(Emitter::new(point, Member::new(points.emitters, owner)))
    }

    /// Returns the names of all points, in alphabetical order.
    pub fn names(&self) -> Vec<Arc<str>> {
        let points = self.points.lock().unwrap_or_else(PoisonError::into_inner);
        points.by_name.keys().cloned().collect()
    }
}

impl Points {
    fn get(&mut self, name: &str) -> Result<Arc<Point>, PointError> {
        if let Some(point) = self.by_name.get(name) {
            return Ok(Arc::clone(point));
        }
        if !is_name(name) {
            return Err(PointError::Name { name: name.into() });
        }
        // None is left behind when there is no room for the last.
        if self.by_name.len() + DEPTH_LIMIT >= POINT_LIMIT {
            return Err(PointError::TooMany { name: name.into() });
        }
        let parent = match name.rfind('/') {
            _ if name == "/" => None,
            None | Some(0) => Some("/"),
            Some(end) => Some(&name[..end]),
        };
        let parent = parent.map(|parent| self.get(parent)).transpose()?;
        let name: Arc<str> = name.into();
        let point = Arc::new(Point::new(Arc::clone(&name), parent));
        self.by_name.insert(name, Arc::clone(&point));
        Ok(point)
    }
}

fn is_name(name: &str) -> bool {
    let is_part = |part: &str| {
        !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-.".contains(&byte))
    };
    let is_path = |path: &str| path.split('/').all(is_part) && path.split('/').count() <= DEPTH_LIMIT;
    name == "/" || name.len() <= NAME_LIMIT && name.strip_prefix('/').is_some_and(is_path)
}
