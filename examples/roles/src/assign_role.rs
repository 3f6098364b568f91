//! Role of a robot by its knowledge of its plans and its team.

use serde::{Deserialize, Serialize};
use slate_plugin::mapek::{FactTable, Newest, Role, StrategyReport, WorldModel};
use slate_plugin::prelude::*;

use crate::team_knowledge::RoleClaim;

/// Role of the robot that attacks; a team has one at most.
pub const ATTACKER: &str = "attacker";
/// Role of the other robots.
pub const DEFENDER: &str = "defender";

/// Knowledge of this robot and of another one, and what follows from it.
#[ports]
pub struct ObservedTeam {
    /// Outcomes of this robot's plans, from its Knowledge.
    report: Input<StrategyReport>,
    /// Claims of others, from this robot's Knowledge.
    #[stale(after = "3s")]
    claims: Input<FactTable<RoleClaim>>,
    /// Role, for Knowledge.
    role: Output<Role>,
    /// Claim, for Knowledge.
    claim: Output<RoleClaim>,
}

/// Parameters of [`AssignRole`].
#[params]
pub struct AssignRoleParams {
    #[param(
        default = "r2",
        doc = "name of this robot; of two that claim the same the first by name has precedence"
    )]
    robot: Text<28>,
    #[param(default = false, doc = "begin as the attacker")]
    attacks: Bool,
}

/// Claims of the team, and this robot's role.
#[derive(Default, Serialize, Deserialize)]
pub struct RoleState {
    team: WorldModel<String, RoleClaim>,
    claim: Option<(bool, bool)>,
    since: u64,
    /// Successes of plans of this role when it was taken.
    before: u64,
}

/// Assigns the role of attacker.
/// An attacker that has succeeded gives the role up, and a defender that is in its place takes it.
///
/// A robot takes the role only when no other one claims it. Claims arrive a cycle late, so two may take it at once; then the first by
/// name keeps it, and the other one gives it up in the next cycle. A robot that is silent for three seconds has no claims.
pub struct AssignRole;

impl Analyze for AssignRole {
    const NAME: &'static str = "assign_role";
    const DOC: &'static str = "Decides the robot's role by the knowledge of the team.";
    type Observed = ObservedTeam;
    type Params = AssignRoleParams;
    type State = RoleState;
    type Value = Role;

    fn process(
        state: &mut RoleState,
        observed: &ObservedTeam,
        params: &AssignRoleParams,
        now: &Tick,
    ) -> Option<Role> {
        if let Some(claims) = observed.claims.updated() {
            state.team.replace(claims);
        }
        let Some((attacks, _)) = state.claim else {
            return state.take(params.attacks.get(), 0, observed, now);
        };
        let succeeded = |attacks| observed.report.get().map_or(0, |report| successes(report, attacks));
        let done = succeeded(attacks) > state.before;
        let own = params.robot.as_str();
        let others = || {
            let heard = observed.claims.fresh().is_some();
            let claims = state.team.view::<Newest>().filter(move |_| heard);
            claims
                .filter_map(|(robot, fact)| Some((robot.as_str(), fact?.value?)))
                .filter(|(robot, _)| *robot != own)
        };
        let attack = match attacks {
            true => !done && !others().any(|(robot, claim)| claim.attacks > 0 && robot < own),
            false => {
                done && !others().any(|(robot, claim)| claim.attacks > 0 || claim.ready > 0 && robot < own)
            }
        };
        if attack != attacks {
            return state.take(attack, succeeded(attack), observed, now);
        }
        state.state(attacks, !attacks && done, observed);
        None
    }
}

impl RoleState {
    /// Takes a role with the number of successes until now.
    fn take(&mut self, attacks: bool, before: u64, observed: &ObservedTeam, now: &Tick) -> Option<Role> {
        (self.since, self.before) = (now.now(), before);
        self.state(attacks, false, observed);
        let role = Role { name: Text::new(name(attacks)) };
        observed.role.set(role);
        Some(role)
    }

    /// States a claim that has changed.
    fn state(&mut self, attacks: bool, ready: bool, observed: &ObservedTeam) {
        if self.claim.replace((attacks, ready)) != Some((attacks, ready)) {
            observed.claim.set(RoleClaim { since: self.since, attacks: attacks.into(), ready: ready.into() });
        }
    }
}

fn name(attacks: bool) -> &'static str {
    if attacks { ATTACKER } else { DEFENDER }
}

/// Successes of the plans of a role.
fn successes(report: &StrategyReport, attacks: bool) -> u64 {
    let of_role = report.records.iter().filter(|record| record.role.as_str() == name(attacks));
    of_role.map(|record| record.succeeded).sum()
}
