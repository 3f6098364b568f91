//! Recovery of lost samples for reliable inputs.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use slate_blackboard::wake::Wake;
use zenoh::query::{ConsolidationMode, Reply, ReplyKeyExpr};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use crate::order::{QUERY_PERIOD, SampleOrder, SampleSource};
use crate::shared::locked;

/// Timeout for an origin's answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

/// Infix of the key of a publisher's cache of its last samples.
/// It is between the key of a publisher of `zenoh-ext` and its session and number.
const CACHE_KEY: &str = "/@adv/pub/";

/// Ordered delivery of a key's samples, with recovery of lost ones.
/// It queries their publishers, whose caches hold the last ones.
///
/// `zenoh-ext` has a subscriber for that, which queries once: after a link was cut, its query often arrives before
/// the other end knows the link, and is lost.
pub struct SampleRecovery {
    key: String,
    order: Mutex<SampleOrder<Sample>>,
    now: Box<dyn Fn() -> u64 + Send + Sync>,
    /// Receiver of the samples in their order.
    /// Returns whether the network's thread must handle one.
    deliver: Box<dyn Fn(&Sample) -> bool + Send + Sync>,
    /// Wakes that thread.
    wake: Arc<Wake>,
}

/// Pending query.
struct SampleQuery {
    recovery: Arc<SampleRecovery>,
    source: SampleSource,
    is_answered: AtomicBool,
}

impl SampleRecovery {
    pub fn new(
        key: String,
        is_of_agent: bool,
        now: impl Fn() -> u64 + Send + Sync + 'static,
        deliver: impl Fn(&Sample) -> bool + Send + Sync + 'static,
        wake: &Arc<Wake>,
    ) -> Self {
        let order = Mutex::new(SampleOrder::new(is_of_agent));
        Self { key, order, now: Box::new(now), deliver: Box::new(deliver), wake: Arc::clone(wake) }
    }

    /// Changes the order, and forwards the samples that are next then.
    fn change(&self, change: impl FnOnce(&mut SampleOrder<Sample>, u64, &mut dyn FnMut(Sample))) {
        // The lock keeps the order of the calls.
        let mut order = locked(&self.order);
        let mut needs_thread = false;
        change(&mut order, (self.now)(), &mut |sample| needs_thread |= (self.deliver)(&sample));
        if needs_thread || order.has_missing() {
            self.wake.notify(1);
        }
    }

    /// Returns the keys at which publishers announce the number of their last sample.
    pub fn cache_key(&self) -> String {
        format!("{}{CACHE_KEY}**", self.key)
    }

    /// Takes a sample.
    pub fn take(&self, sample: Sample) {
        let Some(info) = sample.source_info() else {
            // Its publisher has no cache.
            return self.change(|_, _, deliver| deliver(sample));
        };
        let source = (info.source_id().zid().to_string(), info.source_id().eid());
        let (number, bytes) = (info.source_sn(), sample.payload().len());
        self.change(|order, now, deliver| order.take((&source, number), (bytes, sample), now, deliver));
    }

    /// Takes the number of a publisher's last sample.
    pub fn announce(&self, heartbeat: &Sample) {
        let source = heartbeat.key_expr().as_str().strip_prefix(&self.key).and_then(|rest| {
            let (session, rest) = rest.strip_prefix(CACHE_KEY)?.split_once('/')?;
            Some((session.to_owned(), rest.split('/').next()?.parse().ok()?))
        });
        let number = zenoh_ext::z_deserialize::<u32>(heartbeat.payload()).ok();
        if let Some((source, number)) = source.zip(number) {
            self.change(|order, now, deliver| order.announce(&source, number, now, deliver));
        }
    }

    /// Requests missing samples; returns the time to the next call, ns.
    pub fn query_missing(self: &Arc<Self>, session: &Session) -> Option<u64> {
        let due = locked(&self.order).due((self.now)());
        for (source, first) in due {
            let (zid, eid) = &source;
            let selector = format!("{}{CACHE_KEY}{zid}/{eid}/**?_sn={first}..", self.key);
            let query =
                SampleQuery { recovery: Arc::clone(self), source, is_answered: AtomicBool::new(false) };
            let take = move |reply: Reply| {
                if let Ok(sample) = reply.into_result() {
                    query.is_answered.store(true, Ordering::Release);
                    query.recovery.take(sample);
                }
            };
            // A query that fails ends unanswered.
            let _ = session
                .get(selector)
                .consolidation(ConsolidationMode::None)
                .accept_replies(ReplyKeyExpr::Any)
                .timeout(ANSWER_TIMEOUT)
                .callback(take)
                .wait();
        }
        locked(&self.order).has_missing().then_some(QUERY_PERIOD)
    }
}

impl Drop for SampleQuery {
    fn drop(&mut self) {
        let is_answered = self.is_answered.load(Ordering::Acquire);
        self.recovery.change(|order, now, deliver| order.end_query(&self.source, is_answered, now, deliver));
    }
}
