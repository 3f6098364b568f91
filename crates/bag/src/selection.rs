use std::io::{Read, Seek};
use std::path::Path;

use slate_blackboard::{Pattern, nearest_names};

use super::{Error, Message, Reader};

/// Topic, with its pattern, if it is one.
type TopicFilter = (String, Option<Pattern>);

/// Selection of the messages of a file.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    topics: Vec<TopicFilter>,
    /// Exceptions from the topics.
    exclude: Vec<TopicFilter>,
    /// Start, nanoseconds after the first message.
    pub from: Option<u64>,
    /// End, nanoseconds after the first message, inclusive.
    pub to: Option<u64>,
}

impl Selection {
    /// Selects the topics that match one of these patterns; all without patterns.
    /// Patterns are such as `/r2/*` or `/**/timing`, or just a topic.
    pub fn new(topics: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { topics: topic_filters(topics), ..Self::default() }
    }

    /// Excludes these topics, or those that match such patterns.
    #[must_use]
    pub fn without(self, topics: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { exclude: topic_filters(topics), ..self }
    }

    /// Returns true if all messages of every file are selected.
    pub fn is_all(&self) -> bool {
        self.topics.is_empty() && self.exclude.is_empty() && !self.is_span()
    }

    /// Returns true if messages before or after some time are left out.
    pub fn is_span(&self) -> bool {
        self.from.is_some() || self.to.is_some()
    }

    /// Returns true if the topic is selected.
    pub fn has(&self, topic: &str) -> bool {
        let is_among =
            |topics: &[TopicFilter]| topics.iter().any(|topic_filters| matches(topic_filters, topic));
        (self.topics.is_empty() || is_among(&self.topics)) && !is_among(&self.exclude)
    }

    /// Returns true if a log time is selected.
    /// `start` is the time of the file's first message.
    pub fn has_time(&self, time: u64, start: u64) -> bool {
        let time = time.saturating_sub(start);
        self.from.is_none_or(|from| time >= from) && self.to.is_none_or(|to| time <= to)
    }

    /// Calls `visit` for each message that belongs to it, until that returns false.
    ///
    /// # Errors
    /// When the file is damaged, a topic is not in it, or `visit` fails.
    pub fn visit<R: Read + Seek>(
        &self,
        reader: &mut Reader<R>,
        mut visit: impl FnMut(&Message) -> Result<bool, Error>,
    ) -> Result<(), Error> {
        let is_known_before = !reader.outline().summary.definitions.channels.is_empty();
        if is_known_before {
            let channels = reader.outline().summary.definitions.channels.values();
            self.check(reader.path(), channels.map(|channel| channel.topic.as_str()))?;
        }
        let mut start = reader.start();
        while let Some(message) = reader.next_message()? {
            let start = *start.get_or_insert(message.log_time);
            let matches = self.has(&message.channel.topic) && self.has_time(message.log_time, start);
            if matches && !visit(&message)? {
                return Ok(());
            }
        }
        if !is_known_before {
            self.check(reader.path(), reader.channels().map(|channel| channel.topic.as_str()))?;
        }
        Ok(())
    }

    /// Checks that all selected topics exist.
    pub fn check<'a>(&self, path: &Path, topics: impl Iterator<Item = &'a str>) -> Result<(), Error> {
        let topics: Vec<_> = topics.collect();
        for topic_filters in self.topics.iter().chain(&self.exclude) {
            if !topics.iter().any(|topic| matches(topic_filters, topic)) {
                let near = nearest_names(&topic_filters.0, topics.iter().copied());
                let mend = match near.is_empty() {
                    true => format!("`slate bag info` lists its {} topics", topics.len()),
                    false => format!("did you mean `{}`?", near.join("` or `")),
                };
                let what = format!("it has no topic `{}`; {mend}", topic_filters.0);
                return Err(Error::Unfit { path: path.into(), what });
            }
        }
        Ok(())
    }
}

fn topic_filters(topics: impl IntoIterator<Item = impl Into<String>>) -> Vec<TopicFilter> {
    let topics = topics.into_iter().map(Into::into);
    topics.map(|topic: String| (topic.clone(), Pattern::parse(&topic).ok())).collect()
}

fn matches((name, pattern): &TopicFilter, topic: &str) -> bool {
    let path = topic.strip_prefix('/').unwrap_or(topic);
    name == topic || pattern.as_ref().is_some_and(|pattern| pattern.matches(path))
}
