//! Connections: how many there are, and when one is let go.

use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Result};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::sync::Notify;
use tokio::time::{Instant, Sleep};

/// How many connections there may be; for one more, the one that has been idle for the longest goes.
const MOST: usize = 64;

/// How many of them may be WebSockets.
pub(crate) const MOST_SOCKETS: usize = 24;

/// How long somebody may read nothing of what waits for him. It is dropped then, with what waits.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

/// The connections that there are.
#[derive(Default)]
pub(crate) struct Guests {
    present: Mutex<(u64, BTreeMap<u64, Guest>)>,
}

struct Guest {
    /// Counts what all of them did, at what this one did last.
    last: u64,
    /// Requests that are being answered.
    busy: usize,
    is_socket: bool,
    /// Whether it is the page in a browser.
    is_page: bool,
    leave: Arc<Notify>,
}

/// A connection that is counted as long as this lives.
pub(crate) struct Place {
    guests: Arc<Guests>,
    number: u64,
    /// Notified when it is to go.
    pub leave: Arc<Notify>,
}

impl Guests {
    fn present(&self) -> MutexGuard<'_, (u64, BTreeMap<u64, Guest>)> {
        self.present.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets the one go that has been idle for the longest, so that its descriptor is free; false when all are at work.
    pub fn let_oldest_go(&self) -> bool {
        let mut present = self.present();
        let oldest = oldest_idle(&present.1).and_then(|number| present.1.remove(&number));
        oldest.inspect(|guest| guest.leave.notify_one()).is_some()
    }

    /// Counts one more; nothing when all places are taken by who is at work.
    pub fn admit(self: &Arc<Self>) -> Option<Place> {
        let mut present = self.present();
        if present.1.len() >= MOST {
            let oldest = oldest_idle(&present.1)?;
            if let Some(guest) = present.1.remove(&oldest) {
                guest.leave.notify_one();
            }
        }
        present.0 += 1;
        let number = present.0;
        let leave = Arc::new(Notify::new());
        let guest =
            Guest { last: number, busy: 0, is_socket: false, is_page: false, leave: Arc::clone(&leave) };
        present.1.insert(number, guest);
        Some(Place { guests: Arc::clone(self), number, leave })
    }
}

impl Guests {
    /// How many pages browsers show.
    pub fn pages(&self) -> usize {
        self.present().1.values().filter(|guest| guest.is_page).count()
    }
}

fn oldest_idle(present: &BTreeMap<u64, Guest>) -> Option<u64> {
    let idle = present.iter().filter(|(_, guest)| guest.busy == 0 && !guest.is_socket);
    idle.min_by_key(|(_, guest)| guest.last).map(|(number, _)| *number)
}

impl Place {
    /// Counts as busy until what is returned is dropped.
    pub fn work(self: &Arc<Self>) -> Work {
        let mut present = self.guests.present();
        present.0 += 1;
        let now = present.0;
        if let Some(guest) = present.1.get_mut(&self.number) {
            (guest.last, guest.busy) = (now, guest.busy + 1);
        }
        Work(Arc::clone(self))
    }

    /// Counts as a WebSocket from now on, perhaps that of a browser's page; false when there are too many.
    pub fn becomes_socket(&self, is_page: bool) -> bool {
        let mut present = self.guests.present();
        let sockets = present.1.values().filter(|guest| guest.is_socket).count();
        match present.1.get_mut(&self.number) {
            Some(guest) if sockets < MOST_SOCKETS => {
                (guest.is_socket, guest.is_page) = (true, is_page);
                true
            }
            _ => false,
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.guests.present().1.remove(&self.number);
    }
}

/// A request that is being answered.
pub(crate) struct Work(Arc<Place>);

impl Drop for Work {
    fn drop(&mut self) {
        if let Some(guest) = self.0.guests.present().1.get_mut(&self.0.number) {
            guest.busy -= 1;
        }
    }
}

/// A stream that ends with an error when the other side reads nothing for too long.
pub(crate) struct Patient<S> {
    stream: S,
    waits: Option<Pin<Box<Sleep>>>,
}

impl<S> Patient<S> {
    pub fn new(stream: S) -> Self {
        Self { stream, waits: None }
    }

    fn judge<T>(&mut self, task: &mut Context<'_>, done: Poll<Result<T>>) -> Poll<Result<T>> {
        if done.is_ready() {
            self.waits = None;
            return done;
        }
        let waits =
            self.waits.get_or_insert_with(|| Box::pin(tokio::time::sleep_until(Instant::now() + PATIENCE)));
        ready!(waits.as_mut().poll(task));
        Poll::Ready(Err(Error::new(ErrorKind::TimedOut, "the other side reads nothing")))
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Patient<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        task: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<Result<()>> {
        Pin::new(&mut self.stream).poll_read(task, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Patient<S> {
    fn poll_write(mut self: Pin<&mut Self>, task: &mut Context<'_>, bytes: &[u8]) -> Poll<Result<usize>> {
        let done = Pin::new(&mut self.stream).poll_write(task, bytes);
        self.judge(task, done)
    }

    fn poll_flush(mut self: Pin<&mut Self>, task: &mut Context<'_>) -> Poll<Result<()>> {
        let done = Pin::new(&mut self.stream).poll_flush(task);
        // A flush that has nothing to do says nothing of who reads.
        if done.is_ready() { done } else { self.judge(task, done) }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, task: &mut Context<'_>) -> Poll<Result<()>> {
        let done = Pin::new(&mut self.stream).poll_shutdown(task);
        self.judge(task, done)
    }
}
