use std::io::{Read, Seek};
use std::path::Path;

use slate_blackboard::{Pattern, nearest_names};

use super::{Error, Message, Reader};

/// A topic, with the pattern that it is, if it is one.
type Meant = (String, Option<Pattern>);

/// A part of the messages of a file.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    topics: Vec<Meant>,
    /// Those of them that do not belong to it.
    exclude: Vec<Meant>,
    /// Nanoseconds from the first message on, at which it begins.
    pub from: Option<u64>,
    /// Nanoseconds from the first message on, at which it ends; what is recorded then still belongs to it.
    pub to: Option<u64>,
}

impl Selection {
    /// The topics that are one of these, or fit patterns such as `/r2/*` or `/**/timing`; all if there are none.
    pub fn new(topics: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { topics: meant(topics), ..Self::default() }
    }

    /// The same without these topics, or those that fit such patterns.
    #[must_use]
    pub fn without(self, topics: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { exclude: meant(topics), ..self }
    }

    /// Whether all messages of every file belong to it.
    pub(crate) fn is_all(&self) -> bool {
        self.topics.is_empty() && self.exclude.is_empty() && !self.is_span()
    }

    /// Whether it leaves out what is before or after some time.
    pub(crate) fn is_span(&self) -> bool {
        self.from.is_some() || self.to.is_some()
    }

    /// Whether the topic belongs to it.
    pub fn has(&self, topic: &str) -> bool {
        let is_among = |topics: &[Meant]| topics.iter().any(|meant| is_meant(meant, topic));
        (self.topics.is_empty() || is_among(&self.topics)) && !is_among(&self.exclude)
    }

    /// Whether a log time belongs to it, of a file whose first message has that other one.
    pub(crate) fn has_time(&self, time: u64, start: u64) -> bool {
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
            let is_meant = self.has(&message.channel.topic) && self.has_time(message.log_time, start);
            if is_meant && !visit(&message)? {
                return Ok(());
            }
        }
        if !is_known_before {
            self.check(reader.path(), reader.channels().map(|channel| channel.topic.as_str()))?;
        }
        Ok(())
    }

    /// All that is asked for is there.
    pub(crate) fn check<'a>(&self, path: &Path, topics: impl Iterator<Item = &'a str>) -> Result<(), Error> {
        let topics: Vec<_> = topics.collect();
        for meant in self.topics.iter().chain(&self.exclude) {
            if !topics.iter().any(|topic| is_meant(meant, topic)) {
                let near = nearest_names(&meant.0, topics.iter().copied());
                let mend = match near.is_empty() {
                    true => format!("`slate bag info` lists its {} topics", topics.len()),
                    false => format!("did you mean `{}`?", near.join("` or `")),
                };
                let what = format!("it has no topic `{}`; {mend}", meant.0);
                return Err(Error::Unfit { path: path.into(), what });
            }
        }
        Ok(())
    }
}

fn meant(topics: impl IntoIterator<Item = impl Into<String>>) -> Vec<Meant> {
    let topics = topics.into_iter().map(Into::into);
    topics.map(|topic: String| (topic.clone(), Pattern::parse(&topic).ok())).collect()
}

fn is_meant((name, pattern): &Meant, topic: &str) -> bool {
    let path = topic.strip_prefix('/').unwrap_or(topic);
    name == topic || pattern.as_ref().is_some_and(|pattern| pattern.matches(path))
}
