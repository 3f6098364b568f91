//! Subscription of a link to a property of another agent, or to a field of one.
//! The answer of the other agent decides between the two.

use slate_runtime::sharing::{
    Compression as RequestedCompression, DemandState, Pace, RemoteDemand, RemotePath, SharingHost,
};

use super::subscriptions::Subscriptions;
use crate::peers::{Status, WantedProperty};
use crate::session::{Compression, Content, Mode, Options};

/// Delay after a refusal, ns.
const RETRY_DELAY: u64 = 1_000_000_000;

pub(super) struct RemoteReading {
    path: RemotePath,
    pub demand: RemoteDemand,
    /// Path of the subscription: the whole path, or the beginning of it.
    property: String,
    is_open: bool,
    /// Presence of the property on the board since the subscription began.
    was_served: bool,
    /// Refusal of the whole path by the other agent.
    refusal: Option<String>,
    retry_at: u64,
    reported: Option<DemandState>,
    settled: bool,
}

impl RemoteReading {
    pub fn new(path: RemotePath, demand: RemoteDemand) -> Self {
        Self {
            property: path.path.clone(),
            path,
            demand,
            is_open: false,
            was_served: false,
            refusal: None,
            retry_at: 0,
            reported: None,
            settled: false,
        }
    }

    /// Returns the path of the subscription.
    pub fn property(&self) -> &str {
        &self.property
    }

    /// Returns whether no step is pending.
    pub fn is_settled(&self) -> bool {
        self.settled
    }

    /// Ends the subscription; the property leaves the board.
    pub fn end(&mut self, subscriptions: &mut Subscriptions) {
        if std::mem::take(&mut self.is_open) {
            subscriptions.end(&self.path.agent, &self.property);
        }
        self.was_served = false;
    }

    pub fn report(&mut self, host: &SharingHost, state: DemandState) {
        if self.reported.as_ref() != Some(&state) {
            self.reported = Some(state.clone());
            host.report(&self.path, state);
        }
    }

    /// Updates the status, and performs the next step.
    pub fn update_status(
        &mut self,
        subscriptions: &mut Subscriptions,
        host: &SharingHost,
        absence: Option<String>,
        now: u64,
    ) {
        self.settled = false;
        if !self.is_open {
            if now < self.retry_at {
                return;
            }
            match subscriptions.begin(&self.path.agent, self.subscription()) {
                Ok(()) => self.is_open = true,
                Err(error) => {
                    self.retry_at = now + RETRY_DELAY;
                    // Why it is not even dialed says more.
                    let reason = absence.unwrap_or_else(|| error.to_string());
                    return self.report(host, DemandState::Absent { reason });
                }
            }
        }
        let status = subscriptions.status(&self.path.agent, &self.property);
        match (absence, status) {
            (Some(reason), _) => {
                // The other agent may be another one when it is back.
                if !self.was_served && self.property != self.path.path {
                    self.restart(subscriptions, 0);
                }
                self.settled = true;
                self.report_missing(host, reason);
            }
            (None, None) => self.is_open = false,
            (None, Some(Status::Unanswered)) => {}
            (None, Some(Status::Served)) => {
                (self.was_served, self.settled, self.refusal) = (true, true, None);
                let property = self.property.clone();
                self.report(host, DemandState::Served { property });
            }
            (None, Some(Status::Waiting(reason))) => {
                self.settled = self.property == self.path.path;
                let reason = self.refusal.clone().unwrap_or(reason);
                self.report_missing(host, reason);
                if !self.settled && !self.was_served {
                    self.restart(subscriptions, now + RETRY_DELAY);
                }
            }
            (None, Some(Status::Refused(reason))) if self.was_served => {
                // It is another property now: it must not be read after its removal.
                self.was_served = false;
                self.report_missing(host, reason);
                self.restart(subscriptions, 0);
            }
            (None, Some(Status::Refused(reason))) => {
                let reason = self.refusal.get_or_insert(reason).clone();
                // The refused path may be a field; a property has at least a module and a name.
                match self.property.rsplit_once('/') {
                    Some((shorter, _)) if shorter.contains('/') => {
                        let shorter = shorter.to_owned();
                        self.end(subscriptions);
                        self.property = shorter;
                    }
                    _ => {
                        self.report_missing(host, reason);
                        self.restart(subscriptions, now + RETRY_DELAY);
                    }
                }
            }
        }
    }

    fn report_missing(&mut self, host: &SharingHost, reason: String) {
        let state = if self.was_served {
            DemandState::Silent { property: self.property.clone(), reason }
        } else {
            DemandState::Absent { reason }
        };
        self.report(host, state);
    }

    /// Restarts the subscription with the whole path, not before `retry_at`.
    fn restart(&mut self, subscriptions: &mut Subscriptions, retry_at: u64) {
        self.end(subscriptions);
        self.property.clone_from(&self.path.path);
        self.refusal = None;
        self.retry_at = retry_at;
    }

    fn subscription(&self) -> WantedProperty {
        let RemoteDemand::Values { reliable, pace, compression, every, .. } = &self.demand else {
            return WantedProperty::new(&self.property, Options::default());
        };
        let options = Options {
            mode: match *pace {
                Pace::OnChange(interval) => Mode::OnChange(interval),
                Pace::Every(period) => Mode::Periodic(period),
            },
            content: if every.is_some() { Content::All } else { Content::Newest },
            reliable: *reliable,
            compression: match *compression {
                RequestedCompression::None => Compression::None,
                RequestedCompression::Lossless => Compression::Lossless,
                RequestedCompression::Jpeg(quality) => Compression::Jpeg(quality),
            },
        };
        WantedProperty::new(&self.property, options).depth(every.unwrap_or(1))
    }
}
