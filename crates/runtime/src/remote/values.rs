//! What tools ask of values that come: the new ones, how often they come, and another one in their place.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use slate_blackboard::{Access, BoardError, Property, Watching, interface};

use super::desk::{Desk, Done, refusal, result};
use super::properties::{KNOWN, reading};
use super::protocol::{Measured, News, Reading, Refusal, Spread, Watched};
use slate_configuration::{Message, Mistake};

/// The longest that a call may look for values: less than tools wait for an answer.
pub const LONGEST: Duration = Duration::from_secs(50);

/// How often it is looked for new values; nobody who writes is asked to tell, so nobody waits for a tool.
const LOOK: Duration = Duration::from_millis(1);

/// How often while it is measured: each value that is missed is one interval less that is known.
const MEASURE: Duration = Duration::from_micros(250);

/// How often another agent is asked.
const ELSEWHERE: Duration = Duration::from_millis(100);

/// What is watched.
enum Target<'u> {
    Here { property: Arc<Property>, path: String, _watching: Watching },
    Elsewhere { agent: &'u str, path: &'u str },
}

impl Desk {
    fn watched<'u>(&self, url: &'u str) -> Result<Target<'u>, Refusal> {
        if let Some((agent, path)) = self.elsewhere(url) {
            return Ok(Target::Elsewhere { agent, path });
        }
        let path = self.value_path(url)?;
        let (property, field) = self.composer.board().find(&path).map_err(unknown)?;
        if !field.is_empty() {
            let wrong = |error| unknown(BoardError::Access { url: format!("/{}", property.path()), error });
            interface::find(property.descriptor(), &field).map_err(wrong)?;
        }
        Ok(Target::Here { _watching: property.watch(), property, path })
    }

    /// The values that are newer than what the tool has seen, waiting for the first of them.
    #[allow(clippy::disallowed_methods, reason = "a tool waits on the wall clock")]
    pub(super) fn watch(&self, of: &[Watched], within: Duration) -> Done {
        let targets = of.iter().map(|one| self.watched(&one.url)).collect::<Result<Vec<_>, _>>()?;
        let until = Instant::now() + within.min(LONGEST);
        let mut asked: Option<Instant> = None;
        loop {
            let ask_others = asked.is_none_or(|asked| asked.elapsed() >= ELSEWHERE);
            if ask_others {
                asked = Some(Instant::now());
            }
            let mut news = Vec::new();
            for (index, (target, Watched { after, .. })) in targets.iter().zip(of).enumerate() {
                let readings = match target {
                    Target::Here { property, path, .. } => self.newer(property, path, *after)?,
                    Target::Elsewhere { agent, path } if ask_others => {
                        let read = self.remote_read(agent, path)?;
                        let read: Option<Reading> = serde_json::from_value(read).unwrap_or_default();
                        read.into_iter().filter(|read| Some(read.sequence) != *after).collect()
                    }
                    Target::Elsewhere { .. } => Vec::new(),
                };
                let Some(first) = readings.first() else { continue };
                let missed = after.map_or(0, |after| first.sequence.saturating_sub(after + 1));
                news.push(News { of: index, missed, readings });
            }
            if !news.is_empty() || Instant::now() >= until {
                return result(news);
            }
            sleep(LOOK);
        }
    }

    /// Those of a property here; without a number the newest alone.
    fn newer(&self, property: &Property, path: &str, after: Option<u64>) -> Result<Vec<Reading>, Refusal> {
        let channel = property.channel();
        let published = channel.map_or(0, |channel| channel.published());
        if published == 0 || Some(published) == after {
            return Ok(Vec::new());
        }
        let board = self.composer.board();
        // Of one that goes on from a snapshot the count may be a smaller one than before.
        let after = after.filter(|after| *after < published);
        if let Some(after) = after.filter(|_| channel.is_some_and(|channel| channel.depth() > 1)) {
            let kept = board.history(path).map_err(unknown)?.into_iter();
            return Ok(kept.filter(|(_, stamp)| stamp.sequence > after).map(reading).collect());
        }
        Ok(board.read(path).map_err(unknown)?.map(reading).into_iter().collect())
    }

    /// How often values come, for a while.
    #[allow(clippy::disallowed_methods, reason = "a tool waits on the wall clock")]
    pub(super) fn measure(&self, urls: &[String], time: Duration) -> Done {
        let mut watched = Vec::new();
        for url in urls {
            match self.watched(url)? {
                Target::Here { property, _watching, .. } => {
                    watched.push((url, Series::new(property), _watching));
                }
                Target::Elsewhere { agent, .. } => {
                    return Err(refusal(
                        Mistake::OtherAgent.of(format!(
                            "{url} is of another agent, and values are measured where they are written"
                        )),
                        &format!("ask that agent itself: slate stat {url} --agent {agent}"),
                    ));
                }
            }
        }
        let lost = self.lost();
        let until = Instant::now() + time.min(LONGEST);
        while Instant::now() < until {
            watched.iter_mut().for_each(|(_, series, _)| series.look());
            sleep(MEASURE);
        }
        let (now, lost_since) = (self.composer.now(), self.lost());
        let measured = watched.into_iter().map(|(url, series, _)| {
            let of = |lost: &BTreeMap<String, u64>| lost.get(series.property.path()).copied().unwrap_or(0);
            let lost = of(&lost_since).saturating_sub(of(&lost));
            series.measured(url.clone(), now, lost)
        });
        result(measured.collect::<Vec<_>>())
    }

    /// What readers of queues have lost until now, by the path of what they read.
    fn lost(&self) -> BTreeMap<String, u64> {
        let mut lost = BTreeMap::new();
        for link in self.composer.links() {
            let (Some((_, count)), Ok((property, _))) =
                (link.queue, self.composer.board().find(link.from.trim_start_matches('/')))
            else {
                continue;
            };
            *lost.entry(property.path().to_owned()).or_default() += count;
        }
        lost
    }

    /// Sets a parameter, an input without a link, or whether a module is on: a setting of the configuration, so that it is
    /// checked, recorded, and can be taken back and saved.
    pub(super) fn set_property(&self, url: &str, value: &serde_json::Value) -> Done {
        if let Some((agent, _)) = self.elsewhere(url) {
            let message =
                Mistake::OtherAgent.of(format!("{url} is of another agent, and only that one changes it"));
            return Err(refusal(message, &format!("ask that agent itself: slate set {url} --agent {agent}")));
        }
        let path = self.path_of(url)?;
        let path = path.trim_matches('/');
        let board = self.composer.board();
        let is_at = |whole: &str| {
            path.strip_prefix(whole).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        if let Some((to, from)) = board.aliases().into_iter().find(|(to, _)| is_at(to)) {
            let message =
                Mistake::Linked.of(format!("`{to}` is linked, from /{}", from.trim_start_matches('/')));
            return Err(refusal(message, &format!("take the link away first: slate unlink {to}")));
        }
        let (property, _) = board.find(path).map_err(unknown)?;
        let modules = self.composer.modules().into_iter().map(|module| module.name);
        let owns = |name: &String| path.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('/'));
        let Some(module) = modules.filter(owns).max_by_key(|name| name.len()) else {
            let message =
                Mistake::OneWriter.of(format!("/{} is the host's own, which writes it", property.path()));
            return Err(refusal(message, "settings of the host are changed by `slate config set`"));
        };
        let rest = &path[module.len() + 1..];
        match property.access() {
            Access::Setting if self.is_queue(property.path()) => {
                let message =
                    format!("/{} is a queue, which takes the values of its link alone", property.path());
                let help = format!("link it: slate link {} PROPERTY", property.path());
                return Err(refusal(Mistake::OneWriter.of(message), &help));
            }
            Access::Setting => {}
            Access::Output => {
                let message = Mistake::OneWriter.of(format!(
                    "/{} is written by module `{module}`, and a property has one writer",
                    property.path()
                ));
                return Err(refusal(
                    message,
                    &format!(
                        "set what the module works with: `slate list '/{module}/*'` shows its inputs and params; or \
                         link its readers to another property: slate link"
                    ),
                ));
            }
            Access::Messages => {
                let message = Mistake::Messages
                    .of(format!("/{} takes messages of modules that are linked to it", property.path()));
                return Err(refusal(
                    message,
                    "send one: slate send; or link the output of a module to it: slate link",
                ));
            }
        }
        let names: Vec<&str> = rest.split('/').collect();
        let setting = match names[..] {
            ["enabled"] | ["enabled", "value"] => match value {
                serde_json::Value::Bool(on) => return self.enable(&module, *on),
                _ => {
                    return Err(refusal(
                        Mistake::Value.of(format!("`{value}` is no truth value")),
                        "a module is on with `true` and off with `false`",
                    ));
                }
            },
            ["params", ..] => ["modules", &module].into_iter().chain(names).collect::<Vec<_>>(),
            _ => ["modules", &module, "inputs"].into_iter().chain(names).collect(),
        };
        let keys: Vec<_> =
            setting.iter().map(|name| toml_edit::Key::new(*name).display_repr().into_owned()).collect();
        let value = toml(value).ok_or_else(|| refusal("nothing can't be set", "give a value"))?;
        self.set(&[(keys.join("."), value)], false)
    }
}

fn unknown(error: BoardError) -> Refusal {
    refusal(Message::from(&error), KNOWN)
}

/// A value as `--set` takes it.
fn toml(value: &serde_json::Value) -> Option<String> {
    let value: toml_edit::Value = match value {
        serde_json::Value::Null => return None,
        serde_json::Value::Array(items) => {
            let items = items.iter().map(toml).collect::<Option<Vec<_>>>()?;
            return Some(format!("[{}]", items.join(", ")));
        }
        serde_json::Value::Object(fields) => {
            let field = |(name, value): (&String, &serde_json::Value)| {
                Some(format!("{} = {}", toml_edit::Key::new(name.as_str()).display_repr(), toml(value)?))
            };
            let fields = fields.iter().map(field).collect::<Option<Vec<_>>>()?;
            return Some(format!("{{ {} }}", fields.join(", ")));
        }
        serde_json::Value::Bool(on) => (*on).into(),
        serde_json::Value::Number(number) => match number.as_i64() {
            Some(number) => number.into(),
            None => number.as_f64()?.into(),
        },
        serde_json::Value::String(text) => text.as_str().into(),
    };
    Some(value.to_string())
}

/// The values of a property, one after the other.
struct Series {
    property: Arc<Property>,
    first: Option<(u64, u64)>,
    /// Sequence and time of the last one that was seen.
    last: Option<(u64, u64)>,
    /// From a value to the next, where both were seen.
    intervals: Vec<u64>,
    seen: u64,
    bytes: u64,
}

impl Series {
    fn new(property: Arc<Property>) -> Self {
        Self { property, first: None, last: None, intervals: Vec::new(), seen: 0, bytes: 0 }
    }

    fn look(&mut self) {
        let published = self.property.channel().map_or(0, |channel| channel.published());
        if published == 0 || self.last.is_some_and(|(sequence, _)| sequence == published) {
            return;
        }
        // One for which there is no handle left is seen the next time.
        let Ok(Some((bytes, _, stamp))) = self.property.newest() else { return };
        match self.last {
            Some((sequence, time)) if stamp.sequence > sequence => {
                if stamp.sequence == sequence + 1 {
                    self.intervals.push(stamp.time.saturating_sub(time));
                }
            }
            Some((sequence, _)) if stamp.sequence == sequence => return,
            // The first, or the agent goes on from a snapshot.
            _ => self.first = Some((stamp.sequence, stamp.time)),
        }
        self.last = Some((stamp.sequence, stamp.time));
        self.seen += 1;
        self.bytes += bytes.len() as u64;
    }

    fn measured(mut self, url: String, now: u64, lost: u64) -> Measured {
        let (first, last) = (self.first.unwrap_or_default(), self.last.unwrap_or_default());
        let count = last.0.saturating_sub(first.0);
        let time = last.1.saturating_sub(first.1);
        let rate = (count > 0 && time > 0).then(|| count as f64 * 1e9 / time as f64);
        let size = (self.seen > 0).then(|| self.bytes as f64 / self.seen as f64);
        self.intervals.sort_unstable();
        Measured {
            url,
            interface: self.property.descriptor().name.into(),
            count,
            rate,
            interval: spread(&self.intervals),
            unseen: (count + u64::from(self.first.is_some())).saturating_sub(self.seen),
            size,
            bandwidth: rate.zip(size).map(|(rate, size)| rate * size),
            age: self.last.map(|(_, time)| now.saturating_sub(time)),
            readers: self.property.readers(),
            has_writer: self.property.has_writer(),
            lost,
        }
    }
}

/// How sorted durations are spread.
fn spread(sorted: &[u64]) -> Option<Spread> {
    let (min, max) = (*sorted.first()?, *sorted.last()?);
    let count = sorted.len();
    let mean = sorted.iter().map(|one| *one as f64).sum::<f64>() / count as f64;
    let squares = sorted.iter().map(|one| (*one as f64 - mean) * (*one as f64 - mean)).sum::<f64>();
    let part = |hundredths: usize| sorted[(count * hundredths).div_ceil(100).saturating_sub(1)];
    let deviation = (squares / count as f64).sqrt();
    Some(Spread { min, mean, deviation, p50: part(50), p95: part(95), p99: part(99), max })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_of_json_is_one_of_toml_with_keys_in_quotes_where_they_need_them() {
        let value = serde_json::json!({"x": 1, "two words": [1.5, "a\"b", true]});
        assert_eq!(toml(&value).as_deref(), Some(r#"{ "two words" = [1.5, 'a"b', true], x = 1 }"#));
        assert_eq!(toml(&serde_json::Value::Null), None);
    }

    #[test]
    fn the_spread_of_durations_has_the_greatest_of_each_part() {
        let sorted: Vec<u64> = (1..=100).collect();
        let spread = spread(&sorted).unwrap();
        assert_eq!((spread.min, spread.p50, spread.p95, spread.p99, spread.max), (1, 50, 95, 99, 100));
        assert!((spread.mean - 50.5).abs() < 1e-9 && (spread.deviation - 28.866).abs() < 1e-3);
    }
}
