//! Statements of the robots that follow one plan.

use serde::{Deserialize, Serialize};
use slate_petri_net::{
    JointNet, PetriNet, PlanTransition, RobotNet, RobotStatement, SynchronizationEntry, Synchronizer,
    SynchronizerState,
};
use slate_plugin::interfaces::FactHead;
use slate_plugin::mapek::FactTable;
use slate_plugin::prelude::*;

/// Period in which an unchanged statement is rewritten, ns.
/// The host drops the outputs of a failed step.
const AGAIN: u64 = 1_000_000_000;

/// Identifier of a transition that robots share.
type TransitionId = Text<28>;

/// Maximum number of transitions that a robot shares with others.
const MOST_SHARED: usize = 48;

/// Statement of a robot about a transition that it shares with others.
#[interface]
#[derive(PartialEq)]
pub struct TransitionStatement {
    /// Identifier in the file; with `>` behind it for tokens that are sent.
    pub id: TransitionId,
    /// Run of the deciding robot that the numbers are of.
    pub life: u64,
    /// Open or promised attempt; 0 for none.
    pub open: u64,
    /// Newest attempt in which it fired, or number of firings whose tokens it has sent.
    pub done: u64,
    /// True if the robot could fire it now.
    pub is_ready: Bool,
}

/// Statement of a robot about its part of a plan.
#[interface]
#[derive(PartialEq)]
pub struct MissionStatement {
    /// Number of the run of its plan.
    pub life: u64,
    /// Changes as long as the robot runs.
    pub beat: u64,
    /// Transitions that it shares with others.
    pub transitions: Sequence<TransitionStatement, 48>,
    /// True if its part has reached its goal or failed.
    pub has_ended: Bool,
}

/// Part of a robot in a plan of several.
#[derive(Clone, Debug)]
pub struct TeamPart {
    robot: String,
    /// Synchronizations of the part.
    pub synchronizer: Synchronizer,
    /// Newest written statement, its time and count.
    written: Option<MissionStatement>,
    time: u64,
    count: u64,
}

/// State of a [`TeamPart`].
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedTeamPart {
    synchronizer: SynchronizerState,
    time: u64,
    count: u64,
}

/// Returns a robot's net of a plan.
/// It is the plan itself if that is for one robot.
///
/// # Errors
/// If the plan does not name the robot, or names robots and `None` is given.
pub fn part_of(net: PetriNet, robot: &str) -> Result<(PetriNet, Option<RobotNet>), String> {
    let joint = JointNet::new(&net).map_err(|error| error.to_string())?;
    let Some(joint) = joint else {
        return match robot {
            "" => Ok((net, None)),
            _ => Err(format!("the plan names no robot: expected labels such as `goto_6_2@{robot}.exec`")),
        };
    };
    let part = joint.robot(robot).ok_or_else(|| {
        let robots = joint.robots().join("`, `");
        format!("the plan is for the robots `{robots}`: expected one of them as `robot`, found `{robot}`")
    })?;
    Ok((part.net.clone(), Some(part)))
}

impl TeamPart {
    /// Begins or resumes a robot's part at a time, ns.
    ///
    /// # Errors
    /// If it shares too many transitions, or a state does not fit into it.
    pub fn new(net: &RobotNet, robot: &str, now: u64, saved: &SavedTeamPart) -> Result<Self, String> {
        let mut synchronizer = Synchronizer::new(net, robot, now);
        let ids: Vec<&str> = synchronizer.entries().map(|(id, _)| id).collect();
        if ids.len() > MOST_SHARED {
            let found = ids.len();
            return Err(format!(
                "expected at most {MOST_SHARED} transitions that robots share, found {found}"
            ));
        }
        if let Some(id) = ids.iter().find(|id| TransitionId::new(id).as_str() != **id) {
            return Err(format!("expected a shorter identifier of the shared transition `{id}`"));
        }
        synchronizer.restore(&saved.synchronizer)?;
        let mut part =
            Self { robot: robot.into(), synchronizer, written: None, time: saved.time, count: saved.count };
        // The statement written before the snapshot is the same.
        part.written = (saved.count > 0).then(|| part.statement());
        Ok(part)
    }

    /// Returns true if a transition concerns this robot alone.
    /// No promise to others may be open for it.
    pub fn may_force(&self, transition: PlanTransition) -> bool {
        !self.synchronizer.is_bound()
            && (transition.instance > 0 || !self.synchronizer.shares(transition.transition))
    }

    /// Returns the state.
    pub fn save(&self) -> SavedTeamPart {
        SavedTeamPart { synchronizer: self.synchronizer.state(), time: self.time, count: self.count }
    }

    /// Begins a run: reads the others' statements, and decides.
    ///
    /// # Errors
    /// If robots do not agree about a synchronization.
    pub fn begin(
        &mut self,
        partners: Option<&FactTable<MissionStatement>>,
        timeout: f64,
        now: &Tick,
    ) -> Result<(), String> {
        // The cast clamps numbers out of range.
        self.synchronizer.begin(now.now(), (timeout * 1e9) as u64);
        let facts = partners.into_iter().flat_map(|table| table.iter());
        for fact in facts.filter(|fact| !fact.head.retracted.get() && fact.head.key.as_str() != self.robot) {
            let MissionStatement { life, beat, has_ended, transitions } = &fact.value;
            let statement = RobotStatement { life: *life, beat: *beat, has_ended: has_ended.get() };
            let entries = transitions.iter().map(|own| {
                let (is_ready, life, open, done) = (own.is_ready.get(), own.life, own.open, own.done);
                (own.id.as_str(), SynchronizationEntry { is_ready, life, open, done })
            });
            self.synchronizer.receive(fact.head.key.as_str(), statement, entries);
        }
        self.synchronizer.report_presence(|robot, is_absent, has_ended| match (is_absent, has_ended) {
            (true, true) => now.info(format_args!("`{robot}` has ended its part of the plan")),
            (true, false) => now.warn(format_args!("`{robot}` is absent: not heard for {timeout} s")),
            (false, _) => now.info(format_args!("`{robot}` is back")),
        });
        self.synchronizer.decide().map_err(|error| error.to_string())
    }

    fn statement(&self) -> MissionStatement {
        let RobotStatement { life, beat, has_ended } = self.synchronizer.statement();
        let mut all = [TransitionStatement::default(); MOST_SHARED];
        let mut count = 0;
        for ((id, entry), place) in self.synchronizer.entries().zip(&mut all) {
            let SynchronizationEntry { is_ready, life, open, done } = entry;
            *place = TransitionStatement {
                id: TransitionId::new(id),
                life,
                open,
                done,
                is_ready: is_ready.into(),
            };
            count += 1;
        }
        MissionStatement {
            life,
            beat,
            transitions: Sequence::new(&all[..count]),
            has_ended: has_ended.into(),
        }
    }

    /// Writes the statement of this robot, if it has changed or is old.
    pub fn write(&mut self, claims: &Output<FactTable<MissionStatement>>, now: u64) {
        let statement = self.statement();
        if self.written.as_ref() == Some(&statement) && now.abs_diff(self.time) < AGAIN {
            return;
        }
        let count = self.count + 1;
        let is_written = claims.write(1, |table| {
            let head = FactHead {
                sequence: now,
                time: now,
                order: now,
                heard: now,
                certainty: 1.0,
                key: Text::new(&self.robot),
                ..FactHead::default()
            };
            table.facts[0].head = head;
            table.facts[0].value = statement;
            table.head.revision = count;
        });
        if is_written {
            (self.written, self.time, self.count) = (Some(statement), now, count);
        }
    }
}
