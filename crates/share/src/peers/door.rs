//! Where other agents come in.

use std::io::ErrorKind;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::handle::Common;
use crate::carrier::{CarrierError, Link};
use crate::session::{Application, Event, Sample, Session, refusal};

/// How long whoever comes in may take to greet.
const GREETING: Duration = Duration::from_secs(2);

/// How many may be about to greet.
const CROWD: usize = 32;

/// Listens at an endpoint, in a thread of its own.
pub(super) fn open_door(common: &Arc<Common>, endpoint: &str) -> Result<JoinHandle<()>, CarrierError> {
    let listener = common.carrier(endpoint)?.listen(endpoint)?;
    let system = |error| CarrierError::System { endpoint: endpoint.into(), error };
    let shared = Arc::clone(common);
    let accept = move || {
        while !shared.ended.load(Ordering::Acquire) {
            match listener.accept(Duration::from_millis(100)) {
                Ok(Some(link)) => let_in(&shared, link),
                Ok(None) => {}
                // The system has no more files, perhaps; later it may.
                Err(_) => thread::sleep(Duration::from_millis(100)),
            }
        }
    };
    thread::Builder::new().name("sharing".into()).spawn(accept).map_err(system)
}

/// Waits for the greeting in a thread of its own, so that nobody who comes later waits for it.
fn let_in(common: &Arc<Common>, link: Arc<dyn Link>) {
    if common.greeting.fetch_add(1, Ordering::AcqRel) >= CROWD {
        common.greeting.fetch_sub(1, Ordering::AcqRel);
        return;
    }
    let shared = Arc::clone(common);
    let greet = move || {
        greet(&shared, &link);
        shared.greeting.fetch_sub(1, Ordering::AcqRel);
    };
    if thread::Builder::new().name("greeting".into()).spawn(greet).is_err() {
        common.greeting.fetch_sub(1, Ordering::AcqRel);
    }
}

fn greet(common: &Arc<Common>, link: &Arc<dyn Link>) {
    let mut packet = vec![0; link.largest() + 1];
    let length = match link.receive(&mut packet, GREETING) {
        Ok(Some(length)) => length,
        Ok(None) => return link.close(),
        Err(error) => {
            // Others only went away.
            if error.kind() == ErrorKind::PermissionDenied {
                common.turned_away("", &error.to_string());
            }
            return link.close();
        }
    };
    let packet = &packet[..length];
    let refused = match Session::greeting(packet) {
        Some(identity) if identity.agent != common.identity.agent => {
            let own = &common.identity.agent;
            let denied = impostor(link.as_ref(), &identity.agent)
                .or_else(|| common.rights.of(own, &identity.agent).err());
            if let Some(reason) = denied {
                common.turned_away(&identity.agent, &reason);
                let _ = link.send(&refusal(&reason));
                return link.close();
            }
            let line = common.line_to(&identity.agent, None);
            match line.map(|line| line.adopt(common, Arc::clone(link), identity.instance, packet)) {
                Ok(Ok(())) => return,
                Ok(Err(reason)) => reason.map(|reason| refusal(&reason)),
                Err(error) => Some(refusal(&error.to_string())),
            }
        }
        _ => answer_to_stranger(common, packet),
    };
    if let Some(refused) = refused {
        // Whoever does not read it learns from the link's end that it is not wanted.
        let _ = link.send(&refused);
    }
    link.close();
}

/// Why whoever is at the other end is not that agent, if something proves that.
pub(super) fn impostor(link: &dyn Link, agent: &str) -> Option<String> {
    let name = link.authenticated().filter(|name| *name != agent)?;
    Some(format!("the certificate there is that of agent `{name}`, and not of agent `{agent}`"))
}

/// What an agent of another version, or of this one's name, is told.
fn answer_to_stranger(common: &Common, packet: &[u8]) -> Option<Vec<u8>> {
    let mut session = Session::new(common.identity.clone(), None, common.limits());
    let (now, mut answer) = (common.now(), Vec::new());
    session.receive(now, packet, &mut Nothing);
    let refused = session.refused().is_some();
    (refused && session.outgoing(now, packet.len(), &mut answer, &mut Nothing)).then_some(answer)
}

/// Serves nothing and takes nothing.
struct Nothing;

impl Application for Nothing {
    fn event(&mut self, _: Event) {}

    fn sample(&mut self, _: u32, _: &Sample, _: u64, _: &[u8]) {}

    fn has_news(&mut self, _: u32) -> bool {
        false
    }

    fn take(&mut self, _: u32, _: &mut Vec<u8>) -> Option<Sample> {
        None
    }
}
