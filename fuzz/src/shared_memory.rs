//! Other end of a local link that hands over any file as memory.
//! It says where values lie, and writes to them while they are read.

use std::io::IoSlice;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::{Mutex, OnceLock};
use std::time::Duration;

use crate::input::Input;
use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, ftruncate, memfd_create};
use rustix::net::{
    AddressFamily, SendAncillaryBuffer, SendAncillaryMessage, SendFlags, SocketAddrUnix, SocketType,
};
use slate_share::carrier::local::Local;
use slate_share::carrier::{Carrier, Link, Listener};

/// Part of a script that hands over memory.
/// Its class, its length if it is a wrong one, its seals, and its content at the beginning.
pub const MEMORY: u8 = 0;
/// A packet.
pub const PACKET: u8 = 1;
/// A reference, which is read.
pub const READ: u8 = 2;
/// The memory is changed, or cut off.
pub const CHANGE: u8 = 3;

const KINDS: u8 = 4;

/// Bytes before the slots, and how many slots there are.
const HEAD: u64 = 4096;
const SLOTS: u64 = 8;

type Listening = (String, Mutex<Box<dyn Listener>>);

fn listener() -> &'static Listening {
    static LISTENER: OnceLock<Listening> = OnceLock::new();
    LISTENER.get_or_init(|| {
        let folder = crate::folder();
        let path = folder.join("link.share").display().to_string();
        let listener = Local.listen(&format!("local:{path}")).expect("nobody else listens there");
        (path, Mutex::new(listener))
    })
}

/// Plays a script.
pub fn run(script: &[u8]) {
    let mut script = Input(script);
    let (path, listener) = listener();
    let hostile =
        rustix::net::socket(AddressFamily::UNIX, SocketType::SEQPACKET, None).expect("there are sockets");
    let address = SocketAddrUnix::new(path.as_str()).expect("it is short");
    rustix::net::connect(&hostile, &address).expect("it listens");
    let accepted = listener.lock().expect("nobody panics").accept(Duration::from_secs(1));
    let link = accepted.expect("it listens").expect("one has connected");
    let mut files = Vec::new();
    while !script.is_empty() {
        match script.byte() % KINDS {
            MEMORY => {
                files.extend(hand_over(&hostile, &mut script));
                receive(link.as_ref());
            }
            PACKET => {
                let flags = SendFlags::DONTWAIT | SendFlags::NOSIGNAL;
                let _ = rustix::net::send(&hostile, script.counted(), flags);
                receive(link.as_ref());
            }
            READ => read(link.as_ref(), &files, &mut script),
            _ => {
                if let Some(file) = files.last() {
                    change(file, &mut script);
                }
            }
        }
    }
    link.close();
}

/// Receives all that was sent.
fn receive(link: &dyn Link) {
    let mut packet = vec![0; link.largest() + 1];
    if let Ok(Some(length)) = link.receive(&mut packet, Duration::from_micros(1)) {
        assert!(length <= packet.len(), "more than there is room for");
    }
}

fn hand_over(hostile: &OwnedFd, script: &mut Input<'_>) -> Option<OwnedFd> {
    let (class, how, seals) = (script.byte(), script.byte(), script.byte());
    let file = memfd_create("hostile", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING).ok()?;
    let right = HEAD + SLOTS * (1_u64 << (class % 32));
    let length = if how % 4 == 0 { u64::from(script.word()) } else { right };
    ftruncate(&file, length).ok()?;
    let _ = rustix::io::pwrite(&file, script.counted(), 0);
    // The right one, with others now and then.
    let seals = SealFlags::from_bits_truncate(u32::from(seals)) | SealFlags::SHRINK;
    let seals = if how & 4 == 4 { seals - SealFlags::SHRINK } else { seals };
    let _ = fcntl_add_seals(&file, seals);
    let files = [file.as_fd(), file.as_fd()];
    let files = &files[..1 + usize::from(how & 8 == 8)];
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(2))];
    let mut control = SendAncillaryBuffer::new(&mut space);
    control.push(SendAncillaryMessage::ScmRights(files));
    let flags = SendFlags::DONTWAIT | SendFlags::NOSIGNAL;
    let _ = rustix::net::sendmsg(hostile, &[IoSlice::new(b"M"), IoSlice::new(&[class])], &mut control, flags);
    Some(file)
}

fn change(file: &OwnedFd, script: &mut Input<'_>) {
    let length = script.word().into();
    match script.byte() % 3 {
        0 => drop(ftruncate(file, length)),
        1 => {
            let flags = rustix::fs::FallocateFlags::PUNCH_HOLE | rustix::fs::FallocateFlags::KEEP_SIZE;
            let _ = rustix::fs::fallocate(file, flags, 0, length.max(1));
        }
        _ => drop(rustix::io::pwrite(file, script.counted(), length % (1 << 16))),
    }
}

/// Reads what a reference means, while the memory is written to.
fn read(link: &dyn Link, files: &[OwnedFd], script: &mut Input<'_>) {
    let (length, races) = (script.word() as usize, script.byte() % 8 == 1);
    let reference = script.counted();
    let memory = link.memory().expect("a local link has memory");
    let mut sum = 0_u64;
    let mut take = |bytes: &[u8]| {
        assert_eq!(bytes.len(), length);
        // As much as a session takes.
        sum = bytes.iter().take(64 << 10).map(|byte| u64::from(*byte)).sum();
    };
    match files.last().filter(|_| races) {
        None => drop(memory.read(reference, length, &mut take)),
        Some(file) => std::thread::scope(|scope| {
            scope.spawn(|| {
                for place in 0..64 {
                    let _ = rustix::io::pwrite(file, &[place as u8; 512], place * 64);
                }
            });
            let _ = memory.read(reference, length, &mut take);
        }),
    }
    std::hint::black_box(sum);
}
