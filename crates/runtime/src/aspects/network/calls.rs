use std::net::SocketAddr;

use slate_module::aspect::{ABSENT, Network, NetworkAddress};
use slate_module::table::{Bytes, DONE, REFUSED, Sink};

use super::super::calls::{name, say};
use super::{ModuleSocketKind, NetworkService, ReceivedBytes};

/// Returns the table of the calls of a service.
///
/// # Safety
/// The context is a [`NetworkService`], which the module's tick uses alone and which stays as long as the table.
pub(super) const unsafe fn table(context: *mut ()) -> Network {
    // SAFETY: passed on to the caller.
    unsafe { Network::new(context, udp, connect, listen, accepted, send, receive, address, close) }
}

fn shown(address: &SocketAddr) -> NetworkAddress {
    NetworkAddress::new(&address.to_string())
}

/// # Safety
/// As of the calls below.
unsafe fn open(
    context: *mut (),
    kind: ModuleSocketKind,
    address: Bytes,
    socket: *mut u64,
    sink: *const Sink,
) -> i32 {
    // SAFETY: the context is the service, which the module's tick uses alone; the rest lives during the call.
    unsafe {
        match (*context.cast::<NetworkService>()).open(kind, name(address)) {
            Ok(Some(number)) => {
                socket.write(number);
                DONE
            }
            Ok(None) => ABSENT,
            Err(reason) => {
                say(sink, &reason);
                REFUSED
            }
        }
    }
}

unsafe extern "C" fn udp(context: *mut (), address: Bytes, socket: *mut u64, sink: *const Sink) -> i32 {
    // SAFETY: passed on.
    unsafe { open(context, ModuleSocketKind::Datagrams, address, socket, sink) }
}

unsafe extern "C" fn connect(context: *mut (), address: Bytes, socket: *mut u64, sink: *const Sink) -> i32 {
    // SAFETY: passed on.
    unsafe { open(context, ModuleSocketKind::Connection, address, socket, sink) }
}

unsafe extern "C" fn listen(context: *mut (), address: Bytes, socket: *mut u64, sink: *const Sink) -> i32 {
    // SAFETY: passed on.
    unsafe { open(context, ModuleSocketKind::Listener, address, socket, sink) }
}

unsafe extern "C" fn accepted(context: *mut (), listener: u64, place: usize, socket: *mut u64) -> i32 {
    // SAFETY: as for `open`.
    unsafe {
        match (*context.cast::<NetworkService>()).accepted(listener, place) {
            Some(number) => {
                socket.write(number);
                DONE
            }
            None => ABSENT,
        }
    }
}

unsafe extern "C" fn send(context: *mut (), socket: u64, to: Bytes, data: Bytes, sink: *const Sink) -> i32 {
    // SAFETY: as for `open`.
    unsafe {
        match (*context.cast::<NetworkService>()).send(socket, name(to), data.as_slice()) {
            Ok(()) => DONE,
            Err(reason) => {
                say(sink, &reason);
                REFUSED
            }
        }
    }
}

unsafe extern "C" fn receive(
    context: *mut (),
    socket: u64,
    room: *mut u8,
    size: usize,
    length: *mut usize,
    from: *mut NetworkAddress,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `open`; the module lends that much room.
    unsafe {
        let room: &mut [u8] = if size == 0 { &mut [] } else { std::slice::from_raw_parts_mut(room, size) };
        match (*context.cast::<NetworkService>()).receive(socket, room) {
            ReceivedBytes::Bytes(count, sender) => {
                length.write(count);
                if let Some(sender) = sender {
                    from.write(shown(&sender));
                }
                DONE
            }
            ReceivedBytes::Nothing => ABSENT,
            ReceivedBytes::Refused(reason) => {
                say(sink, &reason);
                REFUSED
            }
        }
    }
}

unsafe extern "C" fn address(
    context: *mut (),
    socket: u64,
    other: bool,
    address: *mut NetworkAddress,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `open`.
    unsafe {
        match (*context.cast::<NetworkService>()).address(socket, other) {
            Ok(found) => {
                address.write(shown(&found));
                DONE
            }
            Err(reason) => {
                say(sink, &reason);
                REFUSED
            }
        }
    }
}

unsafe extern "C" fn close(context: *mut (), socket: u64) {
    // SAFETY: as for `open`.
    unsafe { (*context.cast::<NetworkService>()).close(socket) }
}
