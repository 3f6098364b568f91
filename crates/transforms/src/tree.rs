use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use nalgebra::Isometry3;
use slate_interfaces::{FrameName, Transform};

use crate::history::{Gap, History};
use crate::interpolation::normalized;
use crate::{SetError, TransformError, isometry};

/// How many bytes a frame's name may have: as many as the interface [`Transform`] carries.
const NAME_LIMIT: usize = 64;

/// By how much the length of a quaternion may differ from 1; what is within is made exact.
const NORM_TOLERANCE: f64 = 1e-3;

/// What a tree keeps and forgives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// How many frames there may be.
    pub frames: usize,
    /// How many transforms are kept of each frame that moves; 64 bytes each.
    pub history: usize,
    /// How far beyond the known times a lookup may be, nanoseconds; the nearest transform holds there. There is no
    /// extrapolation.
    pub tolerance: u64,
}

impl Default for Limits {
    /// 256 frames, 10 s at 100 Hz, no tolerance.
    fn default() -> Self {
        Self { frames: 256, history: 1000, tolerance: 0 }
    }
}

/// What a frame's new place has meant for the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// The frame had no parent.
    New,
    /// Another place in the same parent.
    Same,
    /// The frame has a new parent, or has begun or ceased to move. All below it came along; its earlier places are
    /// forgotten.
    Changed,
}

/// A frame in its parent, as [`FrameTree::edges`] shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge<'a> {
    /// The frame that the place is told in.
    pub parent: &'a str,
    /// The frame.
    pub child: &'a str,
    /// The oldest and the newest time known, nanoseconds; none for a fixed one.
    pub times: Option<(u64, u64)>,
}

/// Frames, each with at most one parent, and where they were in it.
///
/// Setting a frame for the first time allocates its history; afterwards neither setting nor looking up allocates.
#[derive(Clone, Debug, Default)]
pub struct FrameTree {
    limits: Limits,
    /// In the order in which they were first named.
    frames: Vec<Frame>,
    names: BTreeMap<Arc<str>, usize>,
}

#[derive(Clone, Debug)]
struct Frame {
    name: Arc<str>,
    /// The parent, and where the frame is in it.
    place: Option<(usize, Motion)>,
}

#[derive(Clone, Debug)]
enum Motion {
    Fixed(Isometry3<f64>),
    Moving(History),
}

impl FrameTree {
    /// A tree with limits of its own.
    pub fn new(limits: Limits) -> Self {
        Self { limits, ..Self::default() }
    }

    /// Says where `child` was in `parent` at a time in nanoseconds: what takes coordinates in `child` to coordinates
    /// in `parent`. Times may come in any order; of two with the same time the later holds.
    ///
    /// With another parent than before, or for a frame that was fixed, the frame's earlier places are forgotten.
    ///
    /// # Errors
    /// When a name or the transform is invalid, the tree is full, the frames would form a cycle, or the time is older
    /// than what is kept, or with another parent older than the newest. The tree stays as it is.
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

    /// Says where `child` is in `parent` at any time, past ones too: a sensor that is screwed on.
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

    /// Sets what a property says.
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

    /// Takes a frame out of its parent, with all below it; false when it is in none. Its name stays known.
    pub fn detach(&mut self, child: &str) -> bool {
        let index = self.names.get(child).copied();
        index.is_some_and(|index| self.frames[index].place.take().is_some())
    }

    /// Forgets all frames, as when a simulation begins anew and its time with it.
    pub fn clear(&mut self) {
        self.frames.clear();
        self.names.clear();
    }

    /// Where `source` was in `target` at a time in nanoseconds: what takes coordinates in `source` to coordinates in
    /// `target`. Between two known times the translation goes straight and the rotation evenly. Allocates nothing.
    ///
    /// # Errors
    /// When a frame is not known, they are in different trees, or an edge on the way between them is not known at that
    /// time.
    pub fn lookup(&self, target: &str, source: &str, time: u64) -> Result<Isometry3<f64>, TransformError> {
        let (target, source) = (self.find(target)?, self.find(source)?);
        let top = self.common(target, source)?;
        let (target, source) = (self.climb(target, top, time)?, self.climb(source, top, time)?);
        Ok(normalized(&(target.inverse() * source)))
    }

    /// The newest time at which `source` is known in `target`, nanoseconds; none when nothing between them moves, so
    /// that any time will do. That may still fail in a lookup, when an edge has ended before another began.
    ///
    /// # Errors
    /// When a frame is not known, or they are in different trees.
    pub fn latest_common_time(&self, target: &str, source: &str) -> Result<Option<u64>, TransformError> {
        let (target, source) = (self.find(target)?, self.find(source)?);
        let top = self.common(target, source)?;
        let ways = self.way(target, top).chain(self.way(source, top));
        Ok(ways.filter_map(|(_, _, motion)| motion.times()).map(|(_, newest)| newest).min())
    }

    /// Where `source` was in `target` at the newest time at which all between them is known.
    ///
    /// # Errors
    /// As for [`lookup`](FrameTree::lookup).
    pub fn lookup_latest(&self, target: &str, source: &str) -> Result<Isometry3<f64>, TransformError> {
        let time = self.latest_common_time(target, source)?;
        self.lookup(target, source, time.unwrap_or(0))
    }

    /// The names of all frames, in alphabetical order.
    pub fn frames(&self) -> impl Iterator<Item = &str> {
        self.names.keys().map(|name| &**name)
    }

    /// All frames that have a parent, in the order in which they were first named.
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

    /// The edges from a frame up to one of its ancestors, itself, or past all to the root.
    fn way(&self, frame: usize, top: usize) -> impl Iterator<Item = (usize, usize, &Motion)> {
        let mut child = frame;
        std::iter::from_fn(move || {
            let (parent, motion) = self.frames[child].place.as_ref().filter(|_| child != top)?;
            let edge = (*parent, child, motion);
            child = *parent;
            Some(edge)
        })
    }

    /// The frame that the tree of a frame grows from, and how many edges are between them.
    fn root(&self, frame: usize) -> (usize, usize) {
        // No frame has a number that high, so the way ends at the root.
        self.way(frame, usize::MAX).fold((frame, 0), |(_, depth), (parent, _, _)| (parent, depth + 1))
    }

    /// The lowest frame that both are in.
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

    /// Where a frame was in one of its ancestors.
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

    /// Whether the one may be the parent of the other; says which of them are known. Changes nothing.
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

    /// Puts the child into the parent, making either if need be.
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
        self.frames.push(Frame { name, place: None });
        self.frames.len() - 1
    }

    fn write(&self, f: &mut fmt::Formatter<'_>, frame: usize, depth: usize) -> fmt::Result {
        writeln!(f, "{:width$}{}", "", self.frames[frame].name, width = 2 * depth)?;
        let is_child = |index: &usize| self.frames[*index].place.as_ref().is_some_and(|(p, _)| *p == frame);
        self.names.values().copied().filter(is_child).try_for_each(|child| self.write(f, child, depth + 1))
    }
}

/// The frames, each below its parent and indented.
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
