use slate_blackboard::interface::{Descriptor, Text};

use super::blackboard::{ABSENT, call_with_sink};
use super::{Effect, HostedService, Service, call_table, service};
use crate::Refusal;
use crate::table::{Bytes, DONE, Sink};

call_table! {
    /// Sockets that the host owns and closes with the module. No call waits.
    ///
    /// A socket is named by its address, as with the blackboard's paths: it is opened at its first use, and stays open.
    /// So a module keeps nothing of it in its state. Addresses are texts such as `192.168.0.7:9000` or `[::1]:9000`;
    /// only [`connect`](Network::connect) takes a name in place of the number.
    ///
    /// Data of a tick is sent at the end of the tick, unless it fails. Received data is that of the present moment of
    /// the wall clock, also in lockstep: a run that receives data can be repeated only if that was recorded, so write
    /// it to an output.
    ///
    /// ```
    /// use slate_module::aspect::{Aspect, Network};
    /// use slate_module::prelude::*;
    ///
    /// #[ports]
    /// pub struct Io {
    ///     network: Aspect<Network>,
    /// }
    ///
    /// #[params]
    /// pub struct Params {
    ///     #[param(default = "0.0.0.0:9000", doc = "where it listens")]
    ///     address: Text<64>,
    /// }
    ///
    /// /// Sends every datagram back.
    /// pub struct Echo;
    ///
    /// impl Echo {
    ///     fn serve(io: &Io, params: &Params) -> Result<(), Refusal> {
    ///         let socket = io.network.udp(params.address.as_str())?;
    ///         let mut buffer = [0; 1500];
    ///         while let Some((length, from)) = socket.receive(&mut buffer)? {
    ///             socket.send(from.as_str(), &buffer[..length])?;
    ///         }
    ///         Ok(())
    ///     }
    /// }
    ///
    /// #[module(stage = SensorAcquire)]
    /// impl Module for Echo {
    ///     type Io = Io;
    ///     type Params = Params;
    ///     type State = ();
    ///
    ///     fn tick(_: &mut (), io: &Io, params: &Params, now: &Tick) -> Outcome {
    ///         if let Err(reason) = Echo::serve(io, params) {
    ///             now.warn(format_args!("{reason}"));
    ///             return Outcome::Degraded;
    ///         }
    ///         Outcome::Ok
    ///     }
    /// }
    /// # fn main() {}
    /// ```
    pub struct Network {
        /// Opens a UDP socket at that address.
        fn udp(Bytes, *mut u64, *const Sink) -> i32;
        /// Connects to that address; [`ABSENT`] while it is not connected.
        fn connect(Bytes, *mut u64, *const Sink) -> i32;
        /// Opens a listener at that address.
        fn listen(Bytes, *mut u64, *const Sink) -> i32;
        /// Returns a listener's connection by index; [`ABSENT`] behind the last one.
        fn accepted(u64, usize, *mut u64) -> i32;
        /// Sends bytes to an address, which is left out for a connection.
        fn send(u64, Bytes, Bytes, *const Sink) -> i32;
        /// Receives data into a buffer, with its length; [`ABSENT`] if none has come.
        /// For a datagram, also the sender's address.
        fn receive(u64, *mut u8, usize, *mut usize, *mut NetworkAddress, *const Sink) -> i32;
        /// Returns the own address of a socket, or the peer's.
        fn address(u64, bool, *mut NetworkAddress, *const Sink) -> i32;
        /// Closes a socket, after the pending data was sent.
        fn close(u64);
    }
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Network {
    const DESCRIPTOR: &'static Descriptor =
        &service::<Self>("network 1", "Sends and receives over UDP and TCP; no call waits.");
}

impl HostedService for Network {
    const EFFECT: Effect = Effect::Communicates;
}

/// Network address: host number and port, such as `192.168.0.7:9000`.
pub type NetworkAddress = Text<64>;

/// Maximum number of bytes of a connection that wait to be sent.
pub const SEND_LIMIT: usize = 256 * 1024;
/// Maximum number of sockets that a module may have at a time.
pub const SOCKET_LIMIT: usize = 64;

impl Network {
    /// Returns the UDP socket at an address of this machine, such as `0.0.0.0:9000`.
    /// Port 0 means any that is free. It may send to the broadcast address, `255.255.255.255`.
    ///
    /// # Errors
    /// When it is not an address, it is taken, or the module has too many sockets.
    pub fn udp(&self, address: &str) -> Result<Datagrams<'_>, Refusal> {
        Ok(Datagrams { network: self, socket: self.open(self.udp, address)?.unwrap_or_default() })
    }

    /// Returns the connection to an address, such as `base.local:7000`.
    /// `None` while it is not made. That may take seconds and happens beside the ticks; after it failed, or the
    /// connection ended, a call one second later tries again.
    ///
    /// # Errors
    /// Why it could not be made, until it is tried again.
    pub fn connect(&self, address: &str) -> Result<Option<Connection<'_>>, Refusal> {
        let socket = self.open(self.connect, address)?;
        Ok(socket.map(|socket| Connection { network: self, socket }))
    }

    /// Returns the listener at an address of this machine, for connections by others.
    ///
    /// # Errors
    /// As for [`udp`](Network::udp).
    pub fn listen(&self, address: &str) -> Result<Listener<'_>, Refusal> {
        Ok(Listener { network: self, socket: self.open(self.listen, address)?.unwrap_or_default() })
    }

    fn open(
        &self,
        open: unsafe extern "C" fn(*mut (), Bytes, *mut u64, *const Sink) -> i32,
        address: &str,
    ) -> Result<Option<u64>, Refusal> {
        let mut socket = 0;
        // SAFETY: everything lives during the call.
        let (code, reason) =
            call_with_sink(|sink| unsafe { open(self.context, Bytes::of(address), &raw mut socket, sink) });
        match code {
            DONE => Ok(Some(socket)),
            ABSENT => Ok(None),
            _ => Err(Refusal(reason)),
        }
    }

    fn send(&self, socket: u64, to: &str, data: &[u8]) -> Result<(), Refusal> {
        let data = Bytes { data: data.as_ptr(), length: data.len() };
        // SAFETY: everything lives during the call.
        let (code, reason) =
            call_with_sink(|sink| unsafe { (self.send)(self.context, socket, Bytes::of(to), data, sink) });
        if code == DONE { Ok(()) } else { Err(Refusal(reason)) }
    }

    fn receive(&self, socket: u64, buffer: &mut [u8]) -> Result<Option<(usize, NetworkAddress)>, Refusal> {
        let (mut length, mut from) = (0, NetworkAddress::default());
        let (start, size) = (buffer.as_mut_ptr(), buffer.len());
        // SAFETY: everything lives during the call.
        let (code, reason) = call_with_sink(|sink| unsafe {
            (self.receive)(self.context, socket, start, size, &raw mut length, &raw mut from, sink)
        });
        match code {
            DONE => Ok(Some((length, from))),
            ABSENT => Ok(None),
            _ => Err(Refusal(reason)),
        }
    }

    fn address(&self, socket: u64, other: bool) -> Result<NetworkAddress, Refusal> {
        let mut address = NetworkAddress::default();
        // SAFETY: everything lives during the call.
        let (code, reason) = call_with_sink(|sink| unsafe {
            (self.address)(self.context, socket, other, &raw mut address, sink)
        });
        if code == DONE { Ok(address) } else { Err(Refusal(reason)) }
    }

    fn close(&self, socket: u64) {
        // SAFETY: the host knows its sockets by number.
        unsafe { (self.close)(self.context, socket) }
    }
}

/// UDP socket for datagrams.
#[derive(Clone, Copy, Debug)]
pub struct Datagrams<'a> {
    network: &'a Network,
    socket: u64,
}

impl Datagrams<'_> {
    /// Sends a datagram at the end of this tick.
    /// `to` is an address such as `192.168.0.7:9000`.  It may get lost, as datagrams do: also here, when the system has
    /// no room for it.
    ///
    /// # Errors
    /// When it is not an address, the datagram is too long (65507 bytes), or too much waits for the end of this tick
    /// ([`SEND_LIMIT`]).
    pub fn send(&self, to: &str, data: &[u8]) -> Result<(), Refusal> {
        self.network.send(self.socket, to, data)
    }

    /// Returns the next datagram's length and sender; a longer one is truncated.
    ///
    /// # Errors
    /// The system's error, such as a datagram to an address without a listener.
    pub fn receive(&self, buffer: &mut [u8]) -> Result<Option<(usize, NetworkAddress)>, Refusal> {
        self.network.receive(self.socket, buffer)
    }

    /// Returns the own address, with the port that was free.
    ///
    /// # Errors
    /// When it was closed.
    pub fn address(&self) -> Result<NetworkAddress, Refusal> {
        self.network.address(self.socket, false)
    }

    /// Closes the socket at the end of this tick.
    pub fn close(self) {
        self.network.close(self.socket);
    }
}

/// TCP connection.
#[derive(Clone, Copy, Debug)]
pub struct Connection<'a> {
    network: &'a Network,
    socket: u64,
}

impl Connection<'_> {
    /// Sends all of these bytes, or none.
    /// They go out from the end of this tick on, as fast as the other end takes them, and only in this module's ticks.
    ///
    /// # Errors
    /// When too much waits ([`SEND_LIMIT`]), or the connection has ended.
    pub fn send(&self, data: &[u8]) -> Result<(), Refusal> {
        self.network.send(self.socket, "", data)
    }

    /// Receives bytes into a buffer; returns their number, 0 if none have come.
    ///
    /// # Errors
    /// When the connection has ended, and all that came before was received.
    pub fn receive(&self, buffer: &mut [u8]) -> Result<usize, Refusal> {
        Ok(self.network.receive(self.socket, buffer)?.map_or(0, |(length, _)| length))
    }

    /// Returns the peer's address.
    ///
    /// # Errors
    /// When it was closed.
    pub fn address(&self) -> Result<NetworkAddress, Refusal> {
        self.network.address(self.socket, true)
    }

    /// Closes the connection at the end of this tick.
    pub fn close(self) {
        self.network.close(self.socket);
    }
}

/// TCP listener.
#[derive(Clone, Copy, Debug)]
pub struct Listener<'a> {
    network: &'a Network,
    socket: u64,
}

impl<'a> Listener<'a> {
    /// Returns the accepted connections, oldest first.
    /// One that has ended is among them until a call has reported that.
    pub fn connections(&self) -> impl Iterator<Item = Connection<'a>> + use<'a> {
        let (network, listener) = (self.network, self.socket);
        (0..).map_while(move |place| {
            let mut socket = 0;
            // SAFETY: everything lives during the call.
            let code = unsafe { (network.accepted)(network.context, listener, place, &raw mut socket) };
            (code == DONE).then_some(Connection { network, socket })
        })
    }

    /// Returns the own address, with the port that was free.
    ///
    /// # Errors
    /// When it was closed.
    pub fn address(&self) -> Result<NetworkAddress, Refusal> {
        self.network.address(self.socket, false)
    }

    /// Closes the listener and its connections at the end of this tick.
    pub fn close(self) {
        self.network.close(self.socket);
    }
}
