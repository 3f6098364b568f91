use std::ops::Deref;
use std::sync::Arc;

use slate_interfaces::Image;
use slate_module::aspect::{ABSENT, Service, answered, service};
use slate_module::blackboard::interface::Descriptor;
use slate_module::table::{Bytes, DONE, REFUSED, Sink};
use slate_module::{Interface, Refusal, Stamp};

use crate::camera::{Cameras, Seat};

/// The newest pictures of cameras, without copying them and without waiting for anybody.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Vision {
    context: *const Cameras,
    capture: unsafe extern "C" fn(*const Cameras, Bytes, *mut Captured, *const Sink) -> i32,
    release: unsafe extern "C" fn(*const ()),
}

/// A picture as the service lends it.
#[repr(C)]
#[derive(Debug)]
struct Captured {
    data: *const u8,
    items: usize,
    stamp: Stamp,
    /// Given back when the picture is no longer used.
    hold: *const (),
}

// SAFETY: plain C data; the cameras may be used from any thread.
unsafe impl Service for Vision {
    const DESCRIPTOR: &'static Descriptor = &service("vision 1", "The newest pictures of cameras.");
}

impl Vision {
    /// The service over those cameras, which its owner keeps.
    pub(crate) fn new(cameras: &Arc<Cameras>) -> Self {
        Self { context: Arc::as_ptr(cameras), capture, release }
    }

    /// The newest picture of a camera, named as [`Source`](crate::Source) says. The first call opens it, so the first
    /// picture comes with a later tick. Whether a picture is new shows in its [stamp](Picture::stamp), how large it is
    /// in the [`Image`] that it is.
    ///
    /// # Errors
    /// When the text names no camera, the camera gives no pictures now, or too many are open or held.
    pub fn capture(&self, camera: &str) -> Result<Option<Picture<'_>>, Refusal> {
        let mut captured =
            Captured { data: std::ptr::null(), items: 0, stamp: Stamp::default(), hold: std::ptr::null() };
        // SAFETY: everything lives during the call, and the cameras as long as the service.
        let (code, reason) = answered(|sink| unsafe {
            (self.capture)(self.context, Bytes::of(camera), &raw mut captured, sink)
        });
        match code {
            DONE => Ok(Some(Picture { captured, vision: self })),
            ABSENT => Ok(None),
            _ => Err(Refusal(reason)),
        }
    }
}

/// A picture, the same as long as it is held; a tick can hold it no longer than itself.
#[derive(Debug)]
pub struct Picture<'a> {
    captured: Captured,
    vision: &'a Vision,
}

impl Picture<'_> {
    /// When it was taken, the agent's time in nanoseconds, and which picture of the camera it is.
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
