//! Where other agents come in.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::handle::Common;
use super::line::locked;
use crate::carrier::{CarrierError, Link};
use crate::session::{Application, Event, Sample, Session, refusal};

/// How long whoever comes in may take to greet.
const GREETING: Duration = Duration::from_secs(2);

/// How many may be about to greet, and how many of them of one machine: those who say nothing keep no others out.
const CROWD: usize = 32;
const OF_ONE: usize = 8;

/// Those who are about to greet, by where they are from.
#[derive(Debug, Default)]
pub(super) struct Crowd(Mutex<BTreeMap<Option<String>, usize>>);

impl Crowd {
    fn enter(&self, from: &Option<String>) -> bool {
        let mut inside = locked(&self.0);
        let of_it = inside.get(from).copied().unwrap_or_default();
        let enters = inside.values().sum::<usize>() < CROWD && (from.is_none() || of_it < OF_ONE);
        if enters {
            inside.insert(from.clone(), of_it + 1);
        }
        enters
    }

    fn leave(&self, from: &Option<String>) {
        let mut inside = locked(&self.0);
        if let Some(of_it) = inside.get_mut(from) {
            *of_it -= 1;
            if *of_it == 0 {
                inside.remove(from);
            }
        }
    }
}

/// Listens at an endpoint, in a thread of its own.
pub(super) fn open_door(common: &Arc<Common>, endpoint: &str) -> Result<JoinHandle<()>, CarrierError> {
    let listener = common.carrier(endpoint)?.listen(endpoint)?;
    let system = |error| CarrierError::System { endpoint: endpoint.into(), error };
    let shared = Arc::clone(common);
    let at: Arc<str> = endpoint.into();
    let accept = move || {
        while !shared.ended.load(Ordering::Acquire) {
            match listener.accept(Duration::from_millis(100)) {
                Ok(Some(link)) => let_in(&shared, &at, link),
                Ok(None) => {}
                // The system has no more files, perhaps; later it may.
                Err(_) => thread::sleep(Duration::from_millis(100)),
            }
        }
    };
    thread::Builder::new().name("sharing".into()).spawn(accept).map_err(system)
}

/// Waits for the greeting in a thread of its own, so that nobody who comes later waits for it.
fn let_in(common: &Arc<Common>, at: &Arc<str>, link: Arc<dyn Link>) {
    let from = link.origin();
    if !common.greeting.enter(&from) {
        return;
    }
    let (shared, at, comes_from) = (Arc::clone(common), Arc::clone(at), from.clone());
    let greet = move || {
        greet(&shared, &at, &link);
        shared.greeting.leave(&comes_from);
    };
    if thread::Builder::new().name("greeting".into()).spawn(greet).is_err() {
        common.greeting.leave(&from);
    }
}

fn greet(common: &Arc<Common>, at: &str, link: &Arc<dyn Link>) {
    let mut packet = vec![0; link.largest() + 1];
    let refuse = |reason: &str| {
        let from = link.origin().unwrap_or_else(|| "somebody".into());
        common.turned_away("", &format!("{from} at {at}"), reason);
        link.close();
    };
    let length = match link.receive(&mut packet, GREETING) {
        Ok(Some(length)) => length,
        Ok(None) => return refuse(&format!("no greeting within {} s", GREETING.as_secs())),
        Err(error) if error.kind() == ErrorKind::PermissionDenied => return refuse(&error.to_string()),
        // It went away again.
        Err(_) => return link.close(),
    };
    let packet = &packet[..length];
    let refused = match Session::greeting(packet) {
        Some(identity) if identity.agent != common.identity.agent => {
            let own = &common.identity.agent;
            let denied = impostor(link.as_ref(), &identity.agent)
                .or_else(|| common.rights.of(own, &identity.agent).err());
            if let Some(reason) = denied {
                let agent = &identity.agent;
                common.turned_away(agent, &format!("agent `{agent}`"), &reason);
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
