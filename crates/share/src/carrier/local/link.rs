use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use rustix::event::PollFlags;
use rustix::io::Errno;
use rustix::net::sockopt::{Timeout, set_socket_timeout};
use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, ReturnFlags, SendAncillaryBuffer,
    SendAncillaryMessage, SendFlags, Shutdown,
};
use slate_blackboard::channel::LentBytes;

use super::memory::{Region, Regions};
use super::wait_ready;
use crate::carrier::{Link, SharedMemory};

/// Largest packet, bytes; a few of them fit into a socket's buffer.
const MAX_PACKET_SIZE: usize = 48 << 10;

/// First byte of a packet that transfers memory, unlike packets of a session.
/// The memory is for this end to fill.
const MEMORY_MARKER: u8 = b'M';

/// Link between two processes, or two agents in one.
#[derive(Debug)]
pub(super) struct LocalLink {
    socket: OwnedFd,
    /// Current receive timeout of the socket.
    timeout: Mutex<Duration>,
    /// Regions that this end fills, and regions that the other end fills.
    own: Mutex<Regions>,
    others: Mutex<Regions>,
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn closed() -> io::Error {
    io::Error::new(io::ErrorKind::ConnectionAborted, "the link was closed")
}

impl LocalLink {
    pub fn new(socket: OwnedFd) -> rustix::io::Result<Self> {
        // Packets are sent without waiting in any case, and are waited for.
        rustix::io::ioctl_fionbio(&socket, false)?;
        Ok(Self {
            socket,
            timeout: Mutex::new(Duration::ZERO),
            own: Mutex::new(Regions::default()),
            others: Mutex::new(Regions::default()),
        })
    }

    /// Transfers memory to the other end; false if the packet can't be sent now.
    fn send_file(&self, class: u8, file: BorrowedFd<'_>) -> bool {
        let files = [file];
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut control = SendAncillaryBuffer::new(&mut space);
        control.push(SendAncillaryMessage::ScmRights(&files));
        let flags = SendFlags::DONTWAIT | SendFlags::NOSIGNAL;
        rustix::net::sendmsg(&self.socket, &[IoSlice::new(&[MEMORY_MARKER, class])], &mut control, flags)
            .is_ok()
    }

    fn set_timeout(&self, limit: Duration) -> io::Result<()> {
        let mut timeout = lock(&self.timeout);
        if *timeout != limit {
            // None at all would mean to wait for ever.
            let at_least = limit.max(Duration::from_micros(1));
            set_socket_timeout(&self.socket, Timeout::Recv, Some(at_least))?;
            *timeout = limit;
        }
        Ok(())
    }
}

impl Link for LocalLink {
    fn send(&self, packet: &[u8]) -> io::Result<bool> {
        match rustix::net::send(&self.socket, packet, SendFlags::DONTWAIT | SendFlags::NOSIGNAL) {
            Ok(_) => Ok(true),
            Err(Errno::AGAIN | Errno::NOBUFS | Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    fn wait_for_room(&self, limit: Duration) -> io::Result<()> {
        wait_ready(&self.socket, PollFlags::OUT, limit).map(drop)
    }

    fn receive(&self, packet: &mut [u8], limit: Duration) -> io::Result<Option<usize>> {
        self.set_timeout(limit)?;
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut control = RecvAncillaryBuffer::new(&mut space);
        let received = rustix::net::recvmsg(
            &self.socket,
            &mut [IoSliceMut::new(packet)],
            &mut control,
            RecvFlags::CMSG_CLOEXEC,
        );
        let received = match received {
            Ok(received) => received,
            Err(Errno::AGAIN | Errno::INTR) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        if received.bytes == 0 {
            return Err(closed());
        }
        // Packets of no session do not count, so that an agent that sends nothing else blocks no other.
        if received.flags.contains(ReturnFlags::TRUNC) {
            // No agent sends such a packet.
            return Ok(None);
        }
        if packet[0] != MEMORY_MARKER {
            return Ok(Some(received.bytes));
        }
        let files = control.drain().filter_map(|message| match message {
            RecvAncillaryMessage::ScmRights(files) => Some(files),
            _ => None,
        });
        if let (Some(file), 2) = (files.flatten().next(), received.bytes)
            && let Some(region) = Region::map_received(packet[1], file)
        {
            lock(&self.others).add(region);
        }
        Ok(None)
    }

    fn largest(&self) -> usize {
        MAX_PACKET_SIZE
    }

    fn close(&self) {
        // It may be closed already.
        let _ = rustix::net::shutdown(&self.socket, Shutdown::Both);
    }

    fn memory(&self) -> Option<&dyn SharedMemory> {
        Some(self)
    }
}

impl SharedMemory for LocalLink {
    fn place(&self, bytes: &[u8], reference: &mut Vec<u8>) -> bool {
        let mut own = lock(&self.own);
        own.place(bytes, reference, |class, file| self.send_file(class, file))
    }

    fn read(&self, reference: &[u8], length: usize, take: &mut dyn FnMut(&[u8])) -> bool {
        lock(&self.others).read(reference, length, take)
    }

    fn lend(&self, reference: &[u8], length: usize) -> Option<Box<dyn LentBytes>> {
        lock(&self.others).lend(reference, length)
    }
}
