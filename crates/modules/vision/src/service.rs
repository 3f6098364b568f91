use std::ops::Deref;
use std::sync::Arc;

use slate_interfaces::Image;
use slate_module::aspect::{ABSENT, Service, call_with_sink, service};
use slate_module::blackboard::interface::Descriptor;
use slate_module::table::{Bytes, DONE, REFUSED, Sink};
use slate_module::{Interface, Refusal, Stamp};

use crate::camera::{Cameras, Seat};

/// Service of cameras' newest pictures, without copies and without locks.
#[repr(C)]
#[derive(Debug)]
pub struct Vision {
    context: *const Cameras,
    capture: unsafe extern "C" fn(*const Cameras, Bytes, *mut Captured, *const Sink) -> i32,
    release: unsafe extern "C" fn(*const ()),
}

/// Lent picture.
#[repr(C)]
#[derive(Debug)]
struct Captured {
    data: *const u8,
    items: usize,
    stamp: Stamp,
    /// Reader to return afterwards.
    hold: *const (),
}

// SAFETY: plain C data; the cameras may be used from any thread.
unsafe impl Service for Vision {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("vision 1", "The newest pictures of cameras.");
}

impl Vision {
    /// Returns the service of cameras.
    ///
    /// # Safety
    /// The owner that is provided with it keeps the cameras.
    pub(crate) unsafe fn new(cameras: &Arc<Cameras>) -> Self {
        Self { context: Arc::as_ptr(cameras), capture, release }
    }

    /// Returns the newest picture of a camera.
    /// `camera` is the text of a [`Source`](crate::ImageSource).
    ///
    /// The first call opens the camera; its first picture comes with a later tick. The [stamp](Picture::stamp) has time and number.
    ///
    /// # Errors
    /// If the text is invalid, the camera has failed, or too many are open or in use.
    pub fn capture(&self, camera: &str) -> Result<Option<Picture<'_>>, Refusal> {
        let mut captured =
            Captured { data: std::ptr::null(), items: 0, stamp: Stamp::default(), hold: std::ptr::null() };
        // SAFETY: everything lives during the call, and the cameras as long as the service.
        let (code, reason) = call_with_sink(|sink| unsafe {
            (self.capture)(self.context, Bytes::of(camera), &raw mut captured, sink)
        });
        match code {
            DONE => Ok(Some(Picture { captured, vision: self })),
            ABSENT => Ok(None),
            _ => Err(Refusal(reason)),
        }
    }
}

/// Picture, constant while it is held; at most for a tick.
#[derive(Debug)]
pub struct Picture<'a> {
    captured: Captured,
    vision: &'a Vision,
}

impl Picture<'_> {
    /// Returns capture time and number of the picture.
    /// The time is the agent's, nanoseconds.
    pub fn stamp(&self) -> Stamp {
        self.captured.stamp
    }
}

impl Deref for Picture<'_> {
    type Target = Image;

    fn deref(&self) -> &Image {
        // SAFETY: the service lends an image until it is given back.
        unsafe { Image::from_raw(self.captured.data, self.captured.items) }
    }
}

impl Drop for Picture<'_> {
    fn drop(&mut self) {
        // SAFETY: it was held by this service, and is given back once.
        unsafe { (self.vision.release)(self.captured.hold) }
    }
}

unsafe extern "C" fn capture(
    cameras: *const Cameras,
    camera: Bytes,
    captured: *mut Captured,
    sink: *const Sink,
) -> i32 {
    // SAFETY: the owner of the service keeps the cameras; all else lives during the call.
    unsafe {
        let text = std::str::from_utf8(camera.as_slice()).unwrap_or("\u{fffd}");
        match (*cameras).capture(text) {
            Ok(Some((seat, loan))) => {
                captured.write(Captured {
                    data: loan.as_ptr(),
                    items: loan.items(),
                    stamp: loan.stamp(),
                    hold: std::ptr::from_ref(seat).cast(),
                });
                DONE
            }
            Ok(None) => ABSENT,
            Err(reason) => {
                (*sink).take(reason.as_bytes());
                REFUSED
            }
        }
    }
}

unsafe extern "C" fn release(seat: *const ()) {
    // SAFETY: `capture` gave it, the cameras are there as long as the service, and it is given back once.
    unsafe { (*seat.cast::<Seat>()).leave() }
}
