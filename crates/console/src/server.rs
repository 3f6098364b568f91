//! Thread of the console, which listens, admits connections and answers.

mod listen;
mod respond;
mod secure;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use slate_module::Level;
use slate_runtime::{Agent, printable};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;

use slate_control::{
    ConnectionEnd, ConnectionSlot, Connections, ControlSurface, DescriptorReserve, Dispatcher, Document,
    LEASE_CHECK_PERIOD, Page, TRACE_END_TIMEOUT, TimedStream,
};

use crate::guard::Guard;
use crate::pages::Pages;
use crate::reserve::{RESERVE_TIMEOUT, accept_with};
use crate::settings::Settings;
use crate::token::{TokenFile, Tokens};
use secure::Tls;

/// Timeout for the arrival of a request.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);

/// Maximum size of a request's head, bytes.
/// hyper also reads bodies in pieces of this size.
const MAX_HEAD_SIZE: usize = 16 << 10;

/// Maximum number of headers in a request.
const MAX_HEADERS: usize = 64;

/// Maximum number of concurrent requests; a stop needs none of these permits.
const MAX_SLOW_REQUESTS: usize = 12;

/// Number of threads for slow work, some of which are kept for stops.
const MAX_THREADS: usize = MAX_SLOW_REQUESTS + 4;

/// Reason why an agent's console can't start.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum StartError {
    /// Failure to listen at the address.
    #[error("the console can't listen at {address}: {reason}")]
    #[diagnostic(help("name another `console.port`, or 0 for any that is free"))]
    Listen {
        /// Address.
        address: SocketAddr,
        /// Reason.
        reason: String,
    },
    /// Invalid file with a token, a certificate or a key.
    #[error("the console can't use {}: {reason}", printable(path))]
    #[diagnostic(help("see `tokens`, `certificate` and `key` in [console]"))]
    File {
        /// File.
        path: std::path::PathBuf,
        /// Reason.
        reason: String,
    },
    /// Others would reach it, and nothing protects it.
    #[error("others reach {address}, and the console has no TLS or no tokens")]
    #[diagnostic(help("give `certificate`, `key` and `tokens`, or listen on this machine alone"))]
    Exposed {
        /// Address.
        address: SocketAddr,
    },
    /// System error: no secrets, no thread, or no place for the secrets.
    #[error("the console can't begin: {0}")]
    System(#[from] std::io::Error),
}

/// Console of an agent over HTTP, as long as this value lives.
pub struct Console {
    addresses: Vec<SocketAddr>,
    link: String,
    file: TokenFile,
    connections: Arc<Connections>,
    end: Arc<Notify>,
    thread: Option<JoinHandle<()>>,
}

impl std::fmt::Debug for Console {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Console").field("addresses", &self.addresses).finish_non_exhaustive()
    }
}

/// State shared by all connections.
pub(crate) struct ConsoleHost {
    pub dispatcher: Arc<Dispatcher>,
    pub guard: Guard,
    pages: Pages,
    connections: Arc<Connections>,
}

impl Console {
    /// Begins to listen, on a thread of its own.
    ///
    /// # Errors
    /// When it can't listen there, a file is wrong, or others could reach it unprotected.
    pub fn start(agent: &Agent, settings: &Settings, documents: Vec<Document>) -> Result<Self, StartError> {
        let surface = ControlSurface::new(agent)?;
        surface.add_documents(documents);
        Self::start_on(Arc::new(surface), settings, Vec::new())
    }

    /// Starts on a control surface that may be served elsewhere too.
    /// As [`start`](Console::start), with more files that a browser gets without a token, beside the console's page.
    ///
    /// # Errors
    /// As [`start`](Console::start).
    pub fn start_on(
        surface: Arc<ControlSurface>,
        settings: &Settings,
        pages: Vec<Page>,
    ) -> Result<Self, StartError> {
        let tokens = match settings.tokens.is_empty() {
            true => Tokens::generate()?,
            false => {
                Tokens::read(&settings.tokens).map_err(|(path, reason)| StartError::File { path, reason })?
            }
        };
        let tls = settings
            .certificate
            .as_ref()
            .map(|(certificate, key)| Tls::load(certificate, key))
            .transpose()?;
        let listeners = listen::listen(settings)?;
        let addresses: Vec<_> =
            listeners.iter().map(|listener| listener.local_addr()).collect::<Result<_, _>>()?;
        let exposed = addresses.iter().find(|address| !address.ip().is_loopback());
        if let Some(address) = exposed.filter(|_| tls.is_none() || settings.tokens.is_empty()) {
            // Also for settings made in code.
            return Err(StartError::Exposed { address: *address });
        }
        let scheme = if tls.is_some() { "https" } else { "http" };
        // Programs of this machine know the certificate, whatever it names, and not each name leads here.
        let local_host = listen::hosts(&addresses, &settings.names).into_iter().next().unwrap_or_default();
        let names: Vec<_> = settings.names.iter().cloned().chain(tls.iter().flat_map(Tls::names)).collect();
        let hosts = listen::hosts(&addresses, &names);
        let display_host = match &tls {
            None => local_host.clone(),
            Some(tls) => listen::display_host(&addresses, &hosts, |host| tls.holds(host)).unwrap_or_else(|| {
                let message = format!(
                    "the console's certificate holds no name by which this agent is called; browsers will refuse {local_host}. \
                     Let `console.names` have one that it holds, or make one that holds these"
                );
                surface.log(Level::Warn, &message);
                local_host.clone()
            }),
        };
        let port = addresses.first().map_or(0, SocketAddr::port);
        let certificate = settings.certificate.as_ref().map(|(certificate, _)| certificate.as_path());
        let [local_host, display_host] = [local_host, display_host].map(|host| format!("{scheme}://{host}"));
        let file = tokens.write(surface.name(), port, [&local_host, &display_host], certificate)?;
        let link = format!("{display_host}/#token={}", tokens.highest());
        surface.allow_operators(settings.operable.clone());
        let host = Arc::new(ConsoleHost {
            dispatcher: Arc::new(Dispatcher::new(surface, MAX_SLOW_REQUESTS, true)),
            guard: Guard::new(tokens, scheme, hosts, settings.origins.clone()),
            pages: Pages::new(pages, settings.assets.clone()),
            connections: Arc::default(),
        });
        let (connections, end) = (Arc::clone(&host.connections), Arc::new(Notify::new()));
        let ended = Arc::clone(&end);
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .thread_name("console work")
            .max_blocking_threads(MAX_THREADS)
            // A thread that exists needs none to be made.
            .thread_keep_alive(Duration::from_secs(u64::from(u32::MAX)))
            .build()?;
        let thread = std::thread::Builder::new().name("console".into()).spawn(move || {
            // Its threads get that from it. Where it can't be had, nothing is worse than without.
            let _ = rustix::process::nice(10);
            runtime.block_on(async {
                tokio::task::spawn_blocking(|| {});
                serve(listeners, tls, host, &ended).await;
            });
            // Requests that still run do not delay the end.
            runtime.shutdown_background();
        })?;
        Ok(Self { addresses, link, file, connections, end, thread: Some(thread) })
    }

    /// Returns the addresses on which it listens.
    pub fn addresses(&self) -> &[SocketAddr] {
        &self.addresses
    }

    /// Returns the URL for a browser: the address with the secret behind `#`.
    /// The secret is that of the highest role; browsers keep the part behind `#` to themselves.
    pub fn link(&self) -> &str {
        &self.link
    }

    /// Returns the number of browsers that show the page.
    pub fn browsers(&self) -> usize {
        self.connections.pages()
    }

    /// Returns the file with the address and the secrets of all roles.
    /// Only its owner can read it.
    pub fn token_file(&self) -> &Path {
        self.file.path()
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        self.connections.end_traces(TRACE_END_TIMEOUT);
        self.end.notify_one();
        if let Some(thread) = self.thread.take() {
            // It has nothing that panics.
            let _ = thread.join();
        }
    }
}

async fn serve(
    listeners: Vec<std::net::TcpListener>,
    tls: Option<Tls>,
    host: Arc<ConsoleHost>,
    ended: &Notify,
) {
    for listener in listeners {
        match TcpListener::from_std(listener) {
            Ok(listener) => drop(tokio::spawn(receive(listener, tls.clone(), Arc::clone(&host)))),
            Err(error) => {
                host.dispatcher.surface().log(Level::Error, &format!("the console does not listen: {error}"))
            }
        }
    }
    let ends_leases = async {
        loop {
            tokio::time::sleep(LEASE_CHECK_PERIOD).await;
            host.dispatcher.surface().end_old_leases();
        }
    };
    let (ended, ends_leases) = (std::pin::pin!(ended.notified()), std::pin::pin!(ends_leases));
    futures_util::future::select(ended, ends_leases).await;
}

async fn receive(listener: TcpListener, tls: Option<Tls>, host: Arc<ConsoleHost>) {
    let mut reserve = DescriptorReserve::take();
    loop {
        if let Ok((stream, from)) = listener.accept().await {
            reserve.refill();
            let slot = Arc::new(host.connections.admit());
            tokio::spawn(serve_connection(stream, from, (tls.clone(), Arc::clone(&host)), slot));
        } else if host.connections.close_idle() {
            // No descriptor is left, for example, and that of the one that has been idle for the longest is free in a moment.
            tokio::time::sleep(Duration::from_millis(5)).await;
        } else if let Some((stream, from)) = accept_with(&mut reserve, &listener).await {
            let slot = Arc::new(host.connections.admit());
            let connection = serve_connection(stream, from, (tls.clone(), Arc::clone(&host)), slot);
            // The next one needs the reserve, too.
            let _ = tokio::time::timeout(RESERVE_TIMEOUT, connection).await;
            reserve.refill();
        } else {
            // It may be otherwise in a while.
            reserve.refill();
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }
}

/// Serves a connection until it ends or has to leave.
async fn serve_connection(
    stream: TcpStream,
    from: SocketAddr,
    (tls, host): (Option<Tls>, Arc<ConsoleHost>),
    slot: Arc<ConnectionSlot>,
) {
    // Small answers are not held back.
    let _ = stream.set_nodelay(true);
    let leave = Arc::clone(&slot.close_notice);
    let closing = ConnectionEnd::new(host.dispatcher.surface(), &slot);
    let greeted = async move {
        match tls {
            None => serve_http(stream, from, host, slot).await,
            Some(tls) => {
                if let Ok(Some(stream)) = tokio::time::timeout(REQUEST_TIMEOUT, tls.accept(stream)).await {
                    serve_http(stream, from, host, slot).await;
                }
            }
        }
    };
    let (greeted, left) = (std::pin::pin!(greeted), std::pin::pin!(leave.notified()));
    futures_util::future::select(greeted, left).await;
    drop(closing);
}

async fn serve_http<S>(stream: S, from: SocketAddr, host: Arc<ConsoleHost>, slot: Arc<ConnectionSlot>)
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let only_stops = slot.only_stops;
    let service = service_fn(move |request| {
        let (host, slot) = (Arc::clone(&host), Arc::clone(&slot));
        async move { Ok::<_, std::convert::Infallible>(respond::respond(&host, &slot, from, request).await) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(if only_stops { RESERVE_TIMEOUT } else { REQUEST_TIMEOUT })
        .keep_alive(!only_stops)
        .max_buf_size(MAX_HEAD_SIZE)
        .max_headers(MAX_HEADERS)
        .serve_connection(TokioIo::new(TimedStream::new(stream)), service)
        .with_upgrades();
    // The client may have disconnected.
    let _ = connection.await;
}
