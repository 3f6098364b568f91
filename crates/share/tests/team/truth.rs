use slate_share::knowledge::{Replica, Version};
use slate_sorted::SortedMap;

/// Keys are single bytes below this.
pub const KEYS: u64 = 24;

/// What was stated (a value) or retracted about a key, as far as the simulation saw it.
type Word = Option<u64>;

/// A statement: its number, its key, and what was said.
type Said = (u64, u8, Word);

/// All that the robots of a team ever said, kept beside the replicas and without their code.
#[derive(Default)]
pub struct Truth {
    /// Of each life, its statements in order.
    lives: SortedMap<(u32, u64), Vec<Said>>,
    /// Of each robot, its last words since its present start.
    runs: SortedMap<u32, SortedMap<u8, Word>>,
    /// The newest statement of each robot that was noted.
    noted: SortedMap<u32, Version>,
    /// What tells the lives of a robot's present start from others.
    starts: SortedMap<u32, u32>,
}

impl Truth {
    /// The robot starts with that random number, and remembers nothing but what it has saved.
    pub fn start(&mut self, robot: u32, random: u32) {
        self.runs.insert(robot, SortedMap::new());
        self.noted.remove(&robot);
        self.starts.insert(robot, random);
    }

    /// The robot said that.
    pub fn note(&mut self, replica: &Replica, key: u8, word: Word) {
        let robot = replica.robot();
        self.runs.entry(robot).or_default().insert(key, word);
        let Some(newest) = self.newest(replica) else { return };
        let next = self.noted.get(&robot).map(|noted| Version { sequence: noted.sequence + 1, ..*noted });
        if next == Some(newest) {
            self.noted.insert(robot, newest);
            self.lives.entry((robot, newest.epoch)).or_default().push((newest.sequence, key, word));
        } else {
            self.catch_up(replica);
        }
    }

    /// Notes what a robot states anew by itself: what it shows of its present life then, and what it has retracted in
    /// this run.
    pub fn catch_up(&mut self, replica: &Replica) {
        let robot = replica.robot();
        let Some(newest) = self.newest(replica).filter(|newest| self.noted.get(&robot) != Some(newest))
        else {
            return;
        };
        let before = self.noted.insert(robot, newest).filter(|noted| noted.epoch == newest.epoch);
        let log = self.lives.entry((robot, newest.epoch)).or_default();
        let since = before.map_or(0, |before| before.sequence);
        let run = self.runs.entry(robot).or_default();
        for key in 0..KEYS {
            let key = key as u8;
            let own = replica.facts(std::slice::from_ref(&key)).find(|fact| fact.origin == robot);
            match own {
                Some(fact) if fact.version.epoch == newest.epoch && fact.version.sequence > since => {
                    log.push((fact.version.sequence, key, Some(value(fact.statement.value))));
                }
                None if run.get(&key) == Some(&None) => log.push((newest.sequence, key, None)),
                _ => {}
            }
        }
        // Statements of one go are seen together, so a retraction may be noted as later than it is.
        log.sort_by_key(|(sequence, ..)| *sequence);
    }

    /// The newest statement of the robot's present start.
    fn newest(&self, replica: &Replica) -> Option<Version> {
        let robot = replica.robot();
        let (_, newest) = replica.versions().find(|(origin, _)| *origin == robot)?;
        (self.starts.get(&robot) == Some(&(newest.epoch as u32))).then_some(newest)
    }

    /// What a replica with those versions must show, by key and origin: what was stated up to them, a later life over
    /// an earlier one.
    pub fn expected(&self, replica: &Replica) -> SortedMap<(u8, u32), (Version, u64)> {
        let mut expected = SortedMap::new();
        let mut versions: Vec<(u32, Version)> = replica.versions().collect();
        versions.sort();
        for (origin, version) in versions {
            let log = self.lives.get(&(origin, version.epoch)).map_or(&[][..], |log| log);
            for (sequence, key, word) in log.iter().take_while(|said| said.0 <= version.sequence) {
                let said = Version { epoch: version.epoch, sequence: *sequence };
                match word {
                    Some(value) => expected.insert((*key, origin), (said, *value)),
                    None => expected.remove(&(*key, origin)),
                };
            }
        }
        expected
    }

    /// What each robot said last since its start, about the keys of which it said anything.
    pub fn last_words(&self) -> impl Iterator<Item = (u32, u8, Word)> {
        self.runs.iter().flat_map(|(robot, run)| run.iter().map(move |(key, word)| (*robot, *key, *word)))
    }
}

/// What a replica shows.
pub fn shown(replica: &Replica) -> SortedMap<(u8, u32), (Version, u64)> {
    let mut shown = SortedMap::new();
    for key in replica.keys() {
        for fact in replica.facts(key) {
            shown.insert((key[0], fact.origin), (fact.version, value(fact.statement.value)));
        }
    }
    shown
}

fn value(bytes: &[u8]) -> u64 {
    bytes.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes))
}
