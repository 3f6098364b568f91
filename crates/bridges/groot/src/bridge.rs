//! Ports at which monitors see the trees of an agent.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use slate_runtime::{Composer, PropertyIndex};
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::Runtime;
use tokio::sync::Semaphore;
use tokio::time::sleep;

use crate::error::GrootError;
use crate::plan::{ShownPlan, shown_plans};
use crate::request::answer;
use crate::settings::{GrootSettings, ServedTrees};
use crate::wire::MonitorConnection;

/// Connections that a port has at a time.
const MOST_CONNECTIONS: usize = 16;

/// Time that the end of the bridge waits for pending answers.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(1);

/// Server of an agent's behavior trees for monitors, as long as this value lives.
/// All of it runs in a thread of its own.
#[derive(Debug)]
pub struct GrootBridge {
    addresses: Vec<(String, SocketAddr)>,
    /// Runtime of the network; `None` once it has ended.
    network: Option<Runtime>,
}

impl GrootBridge {
    /// Opens the ports of settings, and answers monitors from now on.
    ///
    /// # Errors
    /// No tree is where the settings have one, or a port is taken.
    pub fn open(composer: &Composer, settings: &GrootSettings) -> Result<Self, GrootError> {
        let network = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
        let mut addresses = Vec::new();
        for (path, port) in served(composer, settings)? {
            let address = SocketAddr::new(settings.address, port);
            let refused = |reason| GrootError::Port { address: address.to_string(), reason };
            let listener = network.block_on(TcpListener::bind(address)).map_err(refused)?;
            addresses.push((path.clone(), listener.local_addr().map_err(refused)?));
            network.spawn(accept(listener, Arc::new(ShownPlan::new(composer, &path))));
        }
        Ok(Self { addresses, network: Some(network) })
    }

    /// Returns the path of each Plan and the address where its tree is shown.
    pub fn addresses(&self) -> &[(String, SocketAddr)] {
        &self.addresses
    }
}

impl Drop for GrootBridge {
    fn drop(&mut self) {
        if let Some(network) = self.network.take() {
            network.shutdown_timeout(SHUTDOWN_TIMEOUT);
        }
    }
}

/// Checks that each Plan of the settings follows a tree.
/// It opens nothing.
///
/// # Errors
/// The first one that does not.
pub fn check_trees(index: &impl PropertyIndex, settings: &GrootSettings) -> Result<(), GrootError> {
    served(index, settings).map(|_| ())
}

fn served(index: &impl PropertyIndex, settings: &GrootSettings) -> Result<Vec<(String, u16)>, GrootError> {
    let known = shown_plans(index);
    match (&settings.trees, &known[..]) {
        (ServedTrees::Only(port), [plan]) => Ok(vec![(plan.clone(), *port)]),
        (ServedTrees::Only(_), []) => Err(GrootError::NoTree),
        (ServedTrees::Only(_), _) => Err(GrootError::SeveralTrees(known)),
        (ServedTrees::Each(plans), _) => {
            if let Some((plan, _, place)) = plans.iter().find(|(plan, ..)| !known.contains(plan)) {
                return Err(GrootError::UnknownPlan { plan: plan.clone(), known, place: *place });
            }
            Ok(plans.iter().map(|(plan, port, _)| (plan.clone(), *port)).collect())
        }
    }
}

/// Serves all connections of a port.
async fn accept(listener: TcpListener, plan: Arc<ShownPlan>) {
    let places = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            // No file descriptor is left.
            sleep(Duration::from_millis(100)).await;
            continue;
        };
        // One too many is closed at once, and tries again.
        if let Ok(place) = Arc::clone(&places).try_acquire_owned() {
            let plan = Arc::clone(&plan);
            tokio::spawn(async move {
                // Clients come and go.
                let _ = serve(stream, &plan).await;
                drop(place);
            });
        }
    }
}

/// Answers the requests of a client, until it ends or breaks the protocol.
async fn serve(stream: TcpStream, plan: &ShownPlan) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let mut connection = MonitorConnection::open(stream).await?;
    loop {
        let request = connection.receive().await?;
        let frames = answer(plan, &request.body).await;
        connection.answer(&request, &frames).await?;
    }
}
