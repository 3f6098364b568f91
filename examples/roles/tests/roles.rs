//! Two robots exchange their roles, and never both attack for longer than the exchange takes.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::blackboard::interface::Value;
use slate::runtime::configuration::{self, Configuration};
use slate::runtime::{Agent, Options, Rate};

fn agent(sets: &[&str]) -> Agent {
    let options = configuration::Options {
        sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        extra_tables: ["world", "report"].map(Into::into).to_vec(),
        ..configuration::Options::default()
    };
    let configuration = Configuration::from_text("roles.toml", slate_roles::CONFIGURATION, &options).unwrap();
    let plugins = [slate::sim::plugin(), slate_wheeled::plugin(), slate_roles::plugin()];
    let options = Options { rate: Rate::Max, armed: true, ..Options::default() };
    Agent::load(&configuration, &plugins, options).unwrap()
}

fn text(agent: &Agent, path: &str) -> String {
    let value = agent.board().read(path).unwrap().map(|(value, _)| value);
    value.as_ref().and_then(Value::as_str).unwrap_or_default().to_owned()
}

/// Which robots attack, R2 and R3, by the role of their StrategyModel.
fn attackers(agent: &Agent) -> [bool; 2] {
    ["r2", "r3"].map(|robot| text(agent, &format!("{robot}/knowledge/report/role")) == "attacker")
}

/// Roles in a run.
#[derive(Default)]
struct Roles {
    /// Robots that took the role of the attacker, in order: 0 for R2, 1 for R3.
    taken: Vec<usize>,
    /// Robots that were the only attacker, in order.
    alone: Vec<usize>,
    /// Most cycles in which both were attackers, without a break.
    most_both: usize,
}

fn run(agent: &mut Agent, cycles: usize) -> Roles {
    let (mut roles, mut both, mut before) = (Roles::default(), 0, [false; 2]);
    for _ in 0..cycles {
        agent.step();
        let now = attackers(agent);
        roles.taken.extend((0..2).filter(|robot| now[*robot] && !before[*robot]));
        if let [true, false] | [false, true] = now {
            let attacker = usize::from(now[1]);
            if roles.alone.last() != Some(&attacker) {
                roles.alone.push(attacker);
            }
        }
        both = if now == [true; 2] { both + 1 } else { 0 };
        roles.most_both = roles.most_both.max(both);
        before = now;
    }
    roles
}

/// Claims arrive a cycle late, and a role that is given up is known in the next one.
const EXCHANGE: usize = 3;

#[test]
fn roles_are_exchanged_and_one_attacks_at_a_time() {
    let mut agent = agent(&[]);
    let Roles { alone, most_both, .. } = run(&mut agent, 6000);
    assert!(alone.len() >= 6, "{alone:?}");
    assert!(most_both <= EXCHANGE, "{most_both}");
    assert_eq!(text(&agent, "referee/verdict/state"), "SUCCEEDED", "R2 attacked, defended, attacked");
}

#[test]
fn two_attackers_agree_on_one() {
    let both = ["r2", "r3"].map(|robot| format!("robots.{robot}.modules.assign_role.params.attacks=true"));
    let mut agent = agent(&[&both[0], &both[1]]);
    let Roles { taken, most_both, .. } = run(&mut agent, 20);
    assert_eq!(taken, [0, 1], "both begin as attackers");
    assert!((1..=EXCHANGE).contains(&most_both), "{most_both}");
    assert_eq!(attackers(&agent), [true, false], "the first by name keeps the role");
}

#[test]
fn a_robot_that_is_silent_keeps_no_role_from_others() {
    let mut agent = agent(&["robots.r2.modules.assign_role.params.attacks=true"]);
    run(&mut agent, 50);
    assert_eq!(attackers(&agent), [true, false]);
    for module in ["knowledge", "assign_role", "planner"] {
        agent.board().write(&format!("r2/{module}/enabled/value"), &Value::Bool(false), 0).unwrap();
    }
    let Roles { taken, .. } = run(&mut agent, 1500);
    assert!(taken.contains(&1), "R2 is an attacker that states nothing any more: {taken:?}");
}

#[test]
fn a_run_depends_on_its_seed_alone() {
    let digest = || {
        let mut agent = agent(&["world.profile=real"]);
        run(&mut agent, 500);
        agent.digest().unwrap()
    };
    assert_eq!(digest(), digest());
}
