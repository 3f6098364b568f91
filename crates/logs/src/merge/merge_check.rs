//! Several files as one.

use std::collections::VecDeque;
use std::path::Path;

use slate_sorted::{SortedMap, SortedSet};

use slate_bag::Error;

/// One of the files of which [`merge`](crate::merge()) makes one.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// The file.
    pub file: &'a Path,
    /// Prefix of its topics, such as `first` or `team/r1`; none if empty.
    pub prefix: &'a str,
}

/// Returns a topic under a prefix.
pub(super) fn prefixed_topic(prefix: &str, topic: &str) -> String {
    match prefix.trim_matches('/') {
        "" => topic.into(),
        prefix => format!("/{prefix}/{}", topic.trim_start_matches('/')),
    }
}

/// Check whether several files can be merged into one.
/// Messages that several recordings of one run share are written once; messages of different runs must not mix, because
/// they could not be distinguished afterwards.
pub(crate) struct MergeCheck {
    /// By file, the first file of the same run.
    groups: Vec<usize>,
    /// By topic, the time span of each group's messages.
    spans: SortedMap<String, SortedMap<usize, (u64, u64)>>,
    /// The messages copied last, by digest: for each copy, the files that have it.
    seen: SortedMap<u128, VecDeque<SortedSet<usize>>>,
    order: VecDeque<u128>,
}

/// Number of remembered messages.
/// Recordings of one run have the same order, except for values of several threads.
const MAX_REMEMBERED_MESSAGES: usize = 1 << 14;

impl MergeCheck {
    /// Creates the check for files of these runs.
    /// A file that names no run is of a run of its own.
    pub fn new(runs: &[Option<String>]) -> Self {
        let first = |(index, run): (usize, &Option<String>)| {
            let is_same = |other: &Option<String>| run.is_some() && other == run;
            runs.iter().position(is_same).unwrap_or(index)
        };
        Self {
            groups: runs.iter().enumerate().map(first).collect(),
            spans: SortedMap::new(),
            seen: SortedMap::new(),
            order: VecDeque::new(),
        }
    }

    /// Notes a message of a file; false if another file of the run had it already.
    pub fn is_new(&mut self, file: usize, topic: &str, time: u64, digest: impl FnOnce() -> u128) -> bool {
        let group = self.groups[file];
        if self.groups.iter().filter(|other| **other == group).count() > 1 {
            let digest = digest();
            let copies = self.seen.entry(digest).or_default();
            if let Some(files) = copies.iter_mut().find(|files| !files.contains(&file)) {
                files.insert(file);
                return false;
            }
            copies.push_back([file].into());
            self.order.push_back(digest);
            self.forget();
        }
        if !self.spans.contains_key(topic) {
            self.spans.insert(topic.into(), SortedMap::new());
        }
        if let Some(spans) = self.spans.get_mut(topic) {
            let span = spans.entry(group).or_insert((time, time));
            *span = (span.0.min(time), span.1.max(time));
        }
        true
    }

    fn forget(&mut self) {
        if self.order.len() > MAX_REMEMBERED_MESSAGES
            && let Some(oldest) = self.order.pop_front()
            && let Some(copies) = self.seen.get_mut(&oldest)
        {
            copies.pop_front();
            if copies.is_empty() {
                self.seen.remove(&oldest);
            }
        }
    }

    /// Refuses messages of different runs in one topic.
    pub fn check(&self, out: &Path) -> Result<(), Error> {
        let is_mixed = |spans: &SortedMap<usize, (u64, u64)>| {
            let mut spans: Vec<_> = spans.values().collect();
            spans.sort_unstable();
            spans.windows(2).any(|pair| pair[1].0 <= pair[0].1)
        };
        let mixed: Vec<_> =
            self.spans.iter().filter(|(_, spans)| is_mixed(spans)).map(|(topic, _)| topic.as_str()).collect();
        if mixed.is_empty() {
            return Ok(());
        }
        let named = mixed
            .iter()
            .take(MAX_NAMED_TOPICS)
            .map(|topic| format!("`{topic}`"))
            .collect::<Vec<_>>()
            .join(", ");
        let more = match mixed.len().saturating_sub(MAX_NAMED_TOPICS) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let what = format!(
            "messages of different runs would stand among each other in {named}{more}; give each file a name that its topics stand \
             under, such as `--prefix first --prefix second`, or mix them with `--interleave`"
        );
        Err(Error::Unfit { path: out.into(), what })
    }
}

/// Maximum number of named topics.
const MAX_NAMED_TOPICS: usize = 5;
