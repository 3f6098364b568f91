//! Nets of linear plans.

use std::sync::Arc;

use proptest::prelude::*;
use slate_petri_net::{
    ActionProgress, CheckLimits, ConflictOrder, PetriNet, PetriNetExecutor, PetriPlan, check_net,
    generate_net, parse_linear_plan, parse_rules,
};

use crate::common::Script;

const PLAN: &str = "
    # To the printer, and back.
    goto_printer|30; say_hello
    goto_home
";

const RULES: &str = "
    *if* (and person close) *during* goto *do* say_MoveAway; restart_action
    *if* lowbattery *during* goto_printer *do* fail_plan
    *if* nobody *during* say *do* skip_action   # there is no one to hear it
    *if* lost *during* goto_home *do* restart_plan
";

fn made(plan: &str, rules: &str) -> Result<PetriNet, String> {
    let net = parse_linear_plan(plan).and_then(|plan| generate_net("made", &plan, &parse_rules(rules)?));
    net.map_err(|error| error.to_string())
}

/// Runs the plan while `play` sets what happens before each step; returns the orders and the end.
fn run(net: PetriNet, mut play: impl FnMut(usize, &mut Script)) -> (Vec<String>, ActionProgress) {
    let plan = Arc::new(PetriPlan::new(net, |_| Ok(None)).unwrap());
    let mut executor = PetriNetExecutor::new(plan, ConflictOrder::File);
    let mut host = Script::default();
    for step in 0..40 {
        play(step, &mut host);
        if executor.step(&mut host).unwrap() != ActionProgress::Running {
            break;
        }
    }
    (host.orders(), executor.progress())
}

fn succeed(host: &mut Script) {
    for action in ["goto_printer", "say_hello", "goto_home", "say_MoveAway"] {
        host.end(action, ActionProgress::Succeeded);
    }
}

#[test]
fn a_linear_plan_is_performed_in_its_order() {
    let (orders, end) = run(made(PLAN, "").unwrap(), |_, host| succeed(host));
    assert_eq!(end, ActionProgress::Succeeded);
    let started: Vec<&str> = orders.iter().filter_map(|order| order.strip_prefix("start ")).collect();
    assert_eq!(started, ["goto_printer", "say_hello", "goto_home"]);
}

#[test]
fn a_rule_interrupts_its_action_and_the_recovery_follows() {
    let (orders, end) = run(made(PLAN, RULES).unwrap(), |step, host| {
        host.set("person", step == 1);
        host.set("close", true);
        host.set("lost", false);
        if step > 1 {
            succeed(host);
        }
    });
    assert_eq!(end, ActionProgress::Succeeded);
    let expected = [
        "start goto_printer",
        "interrupt goto_printer",
        "start say_MoveAway",
        "end say_MoveAway",
        "start goto_printer",
        "end goto_printer",
    ];
    assert_eq!(orders[..6], expected);
    let (orders, end) = run(made(PLAN, RULES).unwrap(), |_, host| host.set("lowbattery", true));
    assert_eq!((end, orders.len()), (ActionProgress::Failed, 2));
}

#[test]
fn a_time_out_skips_and_a_failure_fails() {
    let (orders, _) = run(made(PLAN, "").unwrap(), |step, host| host.set("elapsed_30", step == 2));
    assert_eq!(orders, ["start goto_printer", "interrupt goto_printer", "start say_hello"]);
    let (_, end) = run(made(PLAN, "").unwrap(), |_, host| host.end("goto_printer", ActionProgress::Failed));
    assert_eq!(end, ActionProgress::Failed);
}

#[test]
fn a_wrong_plan_or_rule_is_named_with_its_line() {
    let error = |plan: &str, rules: &str| made(plan, rules).unwrap_err();
    assert!(error(" ; # nothing", "").contains("expected at least one action"));
    assert!(error("a;\nb|soon", "").starts_with("line 2: expected a timeout in seconds"));
    assert!(error("a; b c", "").starts_with("line 1: expected an action with its arguments"));
    assert!(error("a", "\n*if* x *during* a").starts_with("line 2: expected a rule such as `*if*"));
    assert!(
        error("a", "*if* x *during* a *do* stop").contains("expected one of skip_action, restart_action")
    );
    assert!(error("a", "*if* x *during* b *do* skip_action").contains("names the action `b`"));
    assert!(error("a", "*if* (x *during* a *do* skip_action").contains("expected `)`"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_made_net_is_sound_and_safe(
        plan in prop::collection::vec((0..4usize, prop::option::of(1u32..60)), 1..7),
        rules in prop::collection::vec((0..4usize, 0..4usize, prop::collection::vec(0..6usize, 0..3)), 0..6),
    ) {
        let text: Vec<String> = plan
            .iter()
            .map(|(action, timeout)| match timeout {
                Some(seconds) => format!("a{action}_1|{seconds}"),
                None => format!("a{action}_1"),
            })
            .collect();
        let recoveries = ["skip_action", "restart_action", "restart_plan", "fail_plan"];
        let rules: Vec<String> = rules
            .iter()
            .filter(|(action, ..)| plan.iter().any(|(own, _)| own == action))
            .map(|(action, recovery, between)| {
                let between: String = between.iter().map(|action| format!("a{action}_1; ")).collect();
                format!("*if* c{action} *during* a{action} *do* {between}{}", recoveries[*recovery])
            })
            .collect();
        let net = made(&text.join(";"), &rules.join("\n")).unwrap();
        let report = check_net(&net, &CheckLimits::default());
        prop_assert!(report.is_sound(), "{report:?}");
        prop_assert!(report.findings.is_empty(), "{report:?}");
        prop_assert!(report.states <= net.places().len());
    }
}
