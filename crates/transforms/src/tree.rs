use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use nalgebra::Isometry3;
use slate_interfaces::{FrameName, Transform};

use crate::history::{Gap, History};
use crate::interpolation::normalized;
use crate::{SetError, TransformError, isometry};

/// Maximum length of a frame's name, bytes: that of the interface [`Transform`].
const NAME_LIMIT: usize = 64;

/// Tolerance of a quaternion's length; within it is normalized.
const NORM_TOLERANCE: f64 = 1e-3;

/// Limits of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Maximum number of frames.
    pub frames: usize,
    /// Length of the history of a moving frame; 64 bytes per transform.
    pub history: usize,
    /// Tolerance of a lookup beyond the known times, nanoseconds.
    /// Within it the nearest transform counts, without extrapolation.
    pub tolerance: u64,
}

impl Default for Limits {
    /// Returns the default limits: 256 frames, 10 s at 100 Hz, no tolerance.
    fn default() -> Self {
        Self { frames: 256, history: 1000, tolerance: 0 }
    }
}

/// Effect of a transform on the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// New frame.
    New,
    /// New transform in the same parent.
    Same,
    /// New parent, or change between fixed and moving.
    /// Children follow, the history is cleared.
    Changed,
}

/// Frame with its parent; see [`FrameTree::edges`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge<'a> {
    /// Parent frame.
    pub parent: &'a str,
    /// Child frame.
    pub child: &'a str,
    /// Oldest and newest time, nanoseconds; `None` for a fixed frame.
    pub times: Option<(u64, u64)>,
}

/// Tree of frames with a history of transforms.
///
/// The first transform of a frame allocates its history; later ones and lookups do not allocate.
#[derive(Clone, Debug, Default)]
pub struct FrameTree {
    limits: Limits,
    /// Frames in the order of their first use.
    frames: Vec<FrameNode>,
    names: BTreeMap<Arc<str>, usize>,
}

#[derive(Clone, Debug)]
struct FrameNode {
    name: Arc<str>,
    /// Parent, and transforms to it.
    place: Option<(usize, Motion)>,
}

#[derive(Clone, Debug)]
enum Motion {
    Fixed(Isometry3<f64>),
    Moving(History),
}

impl FrameTree {
    /// Returns a tree with limits.
    pub fn new(limits: Limits) -> Self {
        Self { limits, ..Self::default() }
    }

    /// Sets the transform from `child` to `parent` at a time, nanoseconds.
    ///
    /// Times may be in any order; the later call wins at equal times. A new parent, or a frame that was fixed, clears the history.
    ///
    /// # Errors
    /// If a name or the transform is invalid, the tree is full, the frames form a cycle, or the time is older than the history, or than the
    /// newest with another parent. The tree is unchanged.
    pub fn set(
        &mut self,
        parent: &str,
        child: &str,
        time: u64,
        transform: Isometry3<f64>,
    ) -> Result<Placement, SetError> {
        let transform = checked(parent, child, transform)?;
        let (parent_index, child_index) = self.check(parent, child, Some(time))?;
        if let (Some(parent_index), Some(child_index)) = (parent_index, child_index)
            && let Some((known, Motion::Moving(history))) = &mut self.frames[child_index].place
            && *known == parent_index
        {
            if history.add(time, transform) {
                return Ok(Placement::Same);
            }
            return Err(too_late(parent, child, time, history.oldest()));
        }
        let history = History::new(self.limits.history, time, transform);
        Ok(self.place(parent, child, Motion::Moving(history)))
    }

    /// Sets a static transform, as of a sensor's mount.
    ///
    /// # Errors
    /// As for [`set`](FrameTree::set), but it can't be too late.
    pub fn set_fixed(
        &mut self,
        parent: &str,
        child: &str,
        transform: Isometry3<f64>,
    ) -> Result<Placement, SetError> {
        let transform = checked(parent, child, transform)?;
        self.check(parent, child, None)?;
        Ok(self.place(parent, child, Motion::Fixed(transform)))
    }

    /// Sets the transform of a property.
    ///
    /// # Errors
    /// As for [`set`](FrameTree::set).
    pub fn apply(&mut self, transform: &Transform) -> Result<Placement, SetError> {
        let (parent, child) = (transform.parent.as_str(), transform.child.as_str());
        if transform.fixed.get() {
            self.set_fixed(parent, child, isometry(transform))
        } else {
            self.set(parent, child, transform.time, isometry(transform))
        }
    }

    /// Removes a frame from its parent, with its children.
    /// Returns false without a parent. Its name stays known.
    pub fn detach(&mut self, child: &str) -> bool {
        let index = self.names.get(child).copied();
        index.is_some_and(|index| self.frames[index].place.take().is_some())
    }

    /// Removes all frames, as on a restart of a simulation.
    pub fn clear(&mut self) {
        self.frames.clear();
        self.names.clear();
    }

    /// Returns the transform from `source` to `target` at a time, nanoseconds.
    ///
    /// Interpolates translation linearly and rotation spherically (slerp). Does not allocate.
    ///
    /// # Errors
    /// If a frame is unknown, they are in different trees, or an edge between them has no transform at this time.
    pub fn lookup(&self, target: &str, source: &str, time: u64) -> Result<Isometry3<f64>, TransformError> {
        let (target, source) = (self.find(target)?, self.find(source)?);
        let top = self.common(target, source)?;
        let (target, source) = (self.climb(target, top, time)?, self.climb(source, top, time)?);
        Ok(normalized(&(target.inverse() * source)))
    }

    /// Returns the newest common time of `source` and `target`, nanoseconds.
    /// `None` if all edges are fixed.
    ///
    /// A lookup may still fail if the histories of two edges do not overlap.
    ///
    /// # Errors
    /// If a frame is unknown, or they are in different trees.
    pub fn latest_common_time(&self, target: &str, source: &str) -> Result<Option<u64>, TransformError> {
        let (target, source) = (self.find(target)?, self.find(source)?);
        let top = self.common(target, source)?;
        let ways = self.way(target, top).chain(self.way(source, top));
        Ok(ways.filter_map(|(_, _, motion)| motion.times()).map(|(_, newest)| newest).min())
    }

    /// Returns the transform from `source` to `target` at their newest common time.
    ///
    /// # Errors
    /// As for [`lookup`](FrameTree::lookup).
    pub fn lookup_latest(&self, target: &str, source: &str) -> Result<Isometry3<f64>, TransformError> {
        let time = self.latest_common_time(target, source)?;
        self.lookup(target, source, time.unwrap_or(0))
    }

    /// Returns the names of all frames, in alphabetical order.
    pub fn frames(&self) -> impl Iterator<Item = &str> {
        self.names.keys().map(|name| &**name)
    }

    /// Iterates over frames with a parent, in the order of their first use.
    pub fn edges(&self) -> impl Iterator<Item = Edge<'_>> {
        self.frames.iter().filter_map(|frame| {
            let (parent, motion) = frame.place.as_ref()?;
            let parent = &self.frames[*parent].name;
            Some(Edge { parent, child: &frame.name, times: motion.times() })
        })
    }

    fn find(&self, frame: &str) -> Result<usize, TransformError> {
        let unknown = || TransformError::UnknownFrame { frame: FrameName::new(frame) };
        self.names.get(frame).copied().ok_or_else(unknown)
    }

    /// Iterates over the edges from a frame to an ancestor or the root.
    fn way(&self, frame: usize, top: usize) -> impl Iterator<Item = (usize, usize, &Motion)> {
        let mut child = frame;
        std::iter::from_fn(move || {
            let (parent, motion) = self.frames[child].place.as_ref().filter(|_| child != top)?;
            let edge = (*parent, child, motion);
            child = *parent;
            Some(edge)
        })
    }

    /// Returns the root of a frame's tree, and the depth.
    fn root(&self, frame: usize) -> (usize, usize) {
        // No frame has a number that high, so the way ends at the root.
        self.way(frame, usize::MAX).fold((frame, 0), |(_, depth), (parent, _, _)| (parent, depth + 1))
    }

    /// Returns the lowest common ancestor.
    fn common(&self, target: usize, source: usize) -> Result<usize, TransformError> {
        let ((target_root, target_depth), (source_root, source_depth)) =
            (self.root(target), self.root(source));
        if target_root != source_root {
            let name = |index: usize| Arc::clone(&self.frames[index].name);
            return Err(TransformError::NotConnected {
                target: name(target),
                source_frame: name(source),
                target_root: name(target_root),
                source_root: name(source_root),
            });
        }
        let up = |frame: usize, steps: usize| {
            self.way(frame, usize::MAX).take(steps).fold(frame, |_, (parent, _, _)| parent)
        };
        let mut target = up(target, target_depth.saturating_sub(source_depth));
        let mut source = up(source, source_depth.saturating_sub(target_depth));
        while target != source {
            (target, source) = (up(target, 1), up(source, 1));
        }
        Ok(target)
    }

    /// Returns the transform from a frame to an ancestor.
    fn climb(&self, frame: usize, top: usize, time: u64) -> Result<Isometry3<f64>, TransformError> {
        self.way(frame, top).try_fold(Isometry3::identity(), |below, (parent, child, motion)| {
            let place = match motion {
                Motion::Fixed(place) => Ok(*place),
                Motion::Moving(history) => history.at(time, self.limits.tolerance),
            };
            let (parent, child) = (&self.frames[parent].name, &self.frames[child].name);
            place.map(|place| place * below).map_err(|gap| match gap {
                Gap::Before(oldest) => {
                    TransformError::TooOld { parent: parent.clone(), child: child.clone(), time, oldest }
                }
                Gap::After(newest) => {
                    TransformError::TooNew { parent: parent.clone(), child: child.clone(), time, newest }
                }
            })
        })
    }

    /// Checks whether one frame may be the parent of the other; returns the known ones.
    fn check(
        &self,
        parent: &str,
        child: &str,
        time: Option<u64>,
    ) -> Result<(Option<usize>, Option<usize>), SetError> {
        for name in [parent, child] {
            if name.is_empty() || name.len() > NAME_LIMIT || name.contains('/') {
                return Err(SetError::Name { name: name.into(), limit: NAME_LIMIT });
            }
        }
        if parent == child {
            return Err(SetError::OwnParent { frame: child.into() });
        }
        let known = (self.names.get(parent).copied(), self.names.get(child).copied());
        let mut room = self.limits.frames.saturating_sub(self.frames.len());
        for (name, known) in [(parent, known.0), (child, known.1)] {
            if known.is_none() {
                let full = || SetError::TooManyFrames { frame: name.into(), limit: self.limits.frames };
                room = room.checked_sub(1).ok_or_else(full)?;
            }
        }
        let (Some(parent_index), Some(child_index)) = known else { return Ok(known) };
        if self.way(parent_index, usize::MAX).any(|(above, _, _)| above == child_index) {
            return Err(SetError::Cycle { parent: parent.into(), child: child.into() });
        }
        // A straggler of the former parent must not undo the change.
        if let (Some(time), Some((old, Motion::Moving(history)))) = (time, &self.frames[child_index].place)
            && *old != parent_index
            && time < history.newest()
        {
            return Err(too_late(parent, child, time, history.newest()));
        }
        Ok(known)
    }

    /// Adds the child to the parent; creates frames as needed.
    fn place(&mut self, parent: &str, child: &str, motion: Motion) -> Placement {
        let (parent, child) = (self.index(parent), self.index(child));
        let old = self.frames[child].place.replace((parent, motion));
        match (&old, &self.frames[child].place) {
            (None, _) => Placement::New,
            (Some((old, Motion::Fixed(_))), Some((_, Motion::Fixed(_)))) if *old == parent => Placement::Same,
            _ => Placement::Changed,
        }
    }

    fn index(&mut self, frame: &str) -> usize {
        if let Some(index) = self.names.get(frame) {
            return *index;
        }
        let name: Arc<str> = frame.into();
        self.names.insert(Arc::clone(&name), self.frames.len());
        self.frames.push(FrameNode { name, place: None });
        self.frames.len() - 1
    }

    fn write(&self, f: &mut fmt::Formatter<'_>, frame: usize, depth: usize) -> fmt::Result {
        writeln!(f, "{:width$}{}", "", self.frames[frame].name, width = 2 * depth)?;
        let is_child = |index: &usize| self.frames[*index].place.as_ref().is_some_and(|(p, _)| *p == frame);
        self.names.values().copied().filter(is_child).try_for_each(|child| self.write(f, child, depth + 1))
    }
}

/// Writes the frames as an indented tree.
impl fmt::Display for FrameTree {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_root = |index: &usize| self.frames[*index].place.is_none();
        self.names.values().copied().filter(is_root).try_for_each(|root| self.write(f, root, 0))
    }
}

impl Motion {
    fn times(&self) -> Option<(u64, u64)> {
        match self {
            Self::Fixed(_) => None,
            Self::Moving(history) => Some((history.oldest(), history.newest())),
        }
    }
}

fn checked(parent: &str, child: &str, transform: Isometry3<f64>) -> Result<Isometry3<f64>, SetError> {
    let norm = transform.rotation.as_vector().norm();
    let is_finite = transform.translation.vector.iter().all(|number| number.is_finite());
    // Not a number is in no range.
    if is_finite && (1.0 - NORM_TOLERANCE..=1.0 + NORM_TOLERANCE).contains(&norm) {
        return Ok(normalized(&transform));
    }
    Err(SetError::NoTransform { parent: parent.into(), child: child.into(), norm: norm.to_string() })
}

fn too_late(parent: &str, child: &str, time: u64, known: u64) -> SetError {
    SetError::TooLate { parent: parent.into(), child: child.into(), time, known }
}
