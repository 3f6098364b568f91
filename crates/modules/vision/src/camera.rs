//! Cameras of a vision master.
//! A capture takes no lock: cameras are only added, and each has a pool of readers.

use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use slate_interfaces::Image;
use slate_module::Interface;
use slate_module::blackboard::Channel;
use slate_module::blackboard::channel::{Budget, Latest, Loan};

use crate::handover::Handover;
use crate::source::ImageSource;

/// Maximum number of cameras of a master.
pub(crate) const CAMERAS: usize = 16;
/// Maximum number of pictures of a camera in use.
const SEATS: usize = 16;

/// Cameras of a master.
#[derive(Debug, Default)]
pub(crate) struct Cameras {
    first: OnceLock<Box<Node>>,
}

#[derive(Debug)]
struct Node {
    camera: Arc<Camera>,
    next: OnceLock<Box<Node>>,
}

/// Requested camera.
#[derive(Debug)]
pub(crate) struct Camera {
    text: String,
    pub source: ImageSource,
    /// Channel, once the size of the pictures is known.
    channel: OnceLock<Arc<Channel>>,
    seats: [Seat; SEATS],
    /// Handover from its thread, if any.
    pub handover: Handover,
    failing: AtomicBool,
    problem: Mutex<String>,
}

/// Reader for one user at a time.
#[derive(Debug, Default)]
pub(crate) struct Seat {
    taken: AtomicBool,
    reader: UnsafeCell<Option<Latest>>,
}

// SAFETY: only the holder of the seat uses the reader.
unsafe impl Sync for Seat {}

impl Cameras {
    /// Returns all cameras, in the order of request.
    pub fn iter(&self) -> impl Iterator<Item = &Arc<Camera>> {
        let first = self.first.get();
        std::iter::successors(first, |node| node.next.get()).map(|node| &node.camera)
    }

    /// Returns the camera of a text; adds it if it is new.
    pub fn camera(&self, text: &str) -> Result<&Camera, String> {
        let mut place = &self.first;
        for _ in 0..CAMERAS {
            let node = match place.get() {
                Some(node) => node,
                None => {
                    let source = text.parse().map_err(|error: crate::SourceError| error.to_string())?;
                    // Another thread may have been faster, with this or another camera.
                    place.get_or_init(|| Box::new(Node::new(text, source)))
                }
            };
            if node.camera.text == text {
                return Ok(&node.camera);
            }
            place = &node.next;
        }
        Err(format!("no room for the camera `{text}`: there are {CAMERAS}, which is the limit"))
    }

    /// Returns the newest picture of a camera, and the reader to return afterwards.
    pub fn capture(&self, text: &str) -> Result<Option<(&Seat, Loan<'_>)>, String> {
        let camera = self.camera(text)?;
        if camera.failing.load(Ordering::Acquire) {
            return Err(camera.problem.lock().unwrap_or_else(PoisonError::into_inner).clone());
        }
        let Some(channel) = camera.channel.get() else { return Ok(None) };
        let seat = camera.seats.iter().find(|seat| !seat.taken.swap(true, Ordering::AcqRel));
        let seat = seat
            .ok_or_else(|| format!("{SEATS} pictures of the camera `{text}` are held, which is the limit"))?;
        // SAFETY: the seat was just taken.
        let reader = unsafe { &mut *seat.reader.get() };
        let reader = match reader {
            Some(reader) => reader,
            None => match channel.latest() {
                Ok(new) => reader.insert(new),
                Err(error) => {
                    seat.leave();
                    return Err(format!("the camera `{text}`: {error}"));
                }
            },
        };
        reader.refresh();
        let loan = reader.value();
        if loan.is_none() {
            seat.leave();
        }
        Ok(loan.map(|loan| (seat, loan)))
    }
}

impl Seat {
    /// Returns a reader to the pool.
    pub fn leave(&self) {
        self.taken.store(false, Ordering::Release);
    }
}

impl Node {
    fn new(text: &str, source: ImageSource) -> Self {
        let camera = Camera {
            text: text.into(),
            source,
            channel: OnceLock::new(),
            seats: Default::default(),
            handover: Handover::default(),
            failing: AtomicBool::new(false),
            problem: Mutex::default(),
        };
        Self { camera: Arc::new(camera), next: OnceLock::new() }
    }
}

impl Camera {
    /// Returns the text of the request.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the channel for pictures of a size, bytes; the first size counts.
    pub fn channel(&self, bytes: usize) -> &Arc<Channel> {
        self.channel.get_or_init(|| {
            let budget = Budget { latest: SEATS as u16, queues: 0, window: 0 };
            Channel::new(Image::DESCRIPTOR.shape(bytes), 1, budget)
        })
    }

    /// Sets the reason of a failure; returns whether it is new.
    pub fn fail(&self, problem: &mut String) {
        std::mem::swap(&mut *self.problem.lock().unwrap_or_else(PoisonError::into_inner), problem);
        self.failing.store(true, Ordering::Release);
    }

    /// Clears the failure.
    pub fn work(&self) {
        self.failing.store(false, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

    use slate_module::blackboard::channel::Writer;

    use super::*;

    const TEXT: &str = "pattern:16x16@30";

    fn write(writer: &mut Writer, value: u8) {
        let mut bytes = vec![value; Image::DESCRIPTOR.shape(256).bytes(256)];
        bytes[..4].copy_from_slice(&u32::from(value).to_le_bytes());
        writer.write(&bytes, 256, value.into()).unwrap();
    }

    #[test]
    fn a_picture_stays_as_it_is_while_it_is_held() {
        let cameras = Cameras::default();
        assert!(cameras.capture(TEXT).unwrap().is_none());
        let camera = cameras.iter().next().unwrap();
        let mut writer = camera.channel(256).writer().unwrap();
        assert!(cameras.capture(TEXT).unwrap().is_none());
        write(&mut writer, 1);
        let (seat, loan) = cameras.capture(TEXT).unwrap().unwrap();
        (2..100).for_each(|value| write(&mut writer, value));
        assert_eq!((loan.stamp().time, loan.bytes()[20]), (1, 1));
        seat.leave();
        let (seat, loan) = cameras.capture(TEXT).unwrap().unwrap();
        assert_eq!(loan.stamp().time, 99);
        seat.leave();
    }

    #[test]
    fn as_many_pictures_can_be_held_as_there_are_seats() {
        let cameras = Cameras::default();
        assert!(cameras.capture(TEXT).unwrap().is_none());
        let mut writer = cameras.iter().next().unwrap().channel(256).writer().unwrap();
        write(&mut writer, 1);
        let held: Vec<_> = (0..SEATS).map(|_| cameras.capture(TEXT).unwrap().unwrap()).collect();
        let reason = cameras.capture(TEXT).map(|_| ()).unwrap_err();
        assert!(reason.contains("16 pictures of the camera"), "{reason}");
        held.iter().for_each(|(seat, _)| seat.leave());
        assert!(cameras.capture(TEXT).unwrap().is_some());
    }

    #[test]
    fn invalid_and_surplus_cameras_are_refused() {
        let cameras = Cameras::default();
        let refused = |text: &str| cameras.capture(text).map(|_| ()).unwrap_err();
        assert!(refused("webcam").contains("`webcam` names no camera"));
        assert_eq!(cameras.iter().count(), 0);
        for number in 1..=CAMERAS {
            assert!(cameras.capture(&format!("pattern:{number}x1")).unwrap().is_none());
            assert!(cameras.capture(&format!("pattern:{number}x1")).unwrap().is_none());
        }
        assert!(refused("pattern:1x99").contains("there are 16, which is the limit"));
        assert_eq!(cameras.iter().count(), CAMERAS);
        let camera = cameras.iter().next().unwrap();
        camera.fail(&mut "unplugged".into());
        assert_eq!(refused("pattern:1x1"), "unplugged");
        camera.work();
        assert!(cameras.capture("pattern:1x1").unwrap().is_none());
    }

    #[test]
    fn many_threads_see_whole_pictures_in_order() {
        let cameras = Cameras::default();
        std::thread::scope(|scope| {
            let view = || {
                let mut last = 0;
                while last < 250 {
                    let Some((seat, loan)) = cameras.capture(TEXT).unwrap() else { continue };
                    let (time, bytes) = (loan.stamp().time, loan.bytes());
                    assert!(time >= last && bytes[4..].iter().all(|byte| u64::from(*byte) == time));
                    last = time;
                    seat.leave();
                }
            };
            (0..4).for_each(|_| drop(scope.spawn(view)));
            let camera = loop {
                match cameras.iter().next() {
                    Some(camera) => break camera,
                    None => std::thread::yield_now(),
                }
            };
            let mut writer = camera.channel(256).writer().unwrap();
            (1..=250).for_each(|value| {
                write(&mut writer, value);
                std::thread::yield_now();
            });
        });
        assert_eq!(cameras.iter().count(), 1);
    }
}
