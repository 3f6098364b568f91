//! Plans whose actions are plans.

use std::sync::Arc;

use slate_petri_net::{
    ActionProgress, ConflictOrder, ForceError, PetriNet, PetriNetExecutor, PetriPlan, PlanTransition,
    write_pnml,
};

use crate::common::{Script, net};

fn outer(action: &str) -> PetriNet {
    let label = |event: &str| format!("{action}.{event}");
    net(
        "outer",
        &[("start", 1), (&label("exec"), 0), ("wait", 0), ("goal", 0)],
        &[
            (&label("start"), &[0], &[1]),
            (&label("interrupt [person]"), &[1], &[2]),
            (&label("resume [not person]"), &[2], &[1]),
            (&label("end"), &[1], &[3]),
        ],
    )
}

fn inner() -> PetriNet {
    net(
        "inspect_1",
        &[("start", 1), ("goto.exec", 0), ("look.exec", 0), ("goal", 0)],
        &[("goto.start", &[0], &[1]), ("goto.end look.start", &[1], &[2]), ("look.end", &[2], &[3])],
    )
}

fn plan() -> Arc<PetriPlan> {
    let plan = PetriPlan::new(outer("inspect_1"), |name| Ok((name == "inspect_1").then(inner)));
    Arc::new(plan.unwrap())
}

#[test]
fn a_sub_plan_is_an_action_of_the_plan_above() {
    let plan = plan();
    assert!(plan.is_sub_plan("inspect_1"));
    let actions: Vec<_> = plan.actions().iter().map(|action| (action.path(), action.text())).collect();
    assert_eq!(actions, [("outer/inspect_1", "goto"), ("outer/inspect_1", "look")]);
    let (mut executor, mut host) = (PetriNetExecutor::new(plan, ConflictOrder::File), Script::default());
    host.set("person", false);
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), [""; 0]);
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["start goto"]);
    host.end("goto", ActionProgress::Succeeded);
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["end goto", "start look"]);
    host.end("look", ActionProgress::Succeeded);
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
    assert_eq!(host.orders(), ["end look"]);
}

#[test]
fn an_interrupted_sub_plan_continues_where_it_was() {
    let (mut executor, mut host) = (PetriNetExecutor::new(plan(), ConflictOrder::File), Script::default());
    host.set("person", false);
    executor.step(&mut host).unwrap();
    executor.step(&mut host).unwrap();
    host.end("goto", ActionProgress::Succeeded);
    executor.step(&mut host).unwrap();
    host.orders();
    host.set("person", true);
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["interrupt look"]);
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), [""; 0]);
    host.set("person", false);
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["resume look"]);
    assert_eq!(executor.marking(1), [0, 0, 1, 0]);
}

#[test]
fn sub_plans_are_read_from_the_folder_of_the_plan() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("sub-plans");
    std::fs::create_dir_all(&folder).unwrap();
    let write = |net: &PetriNet| {
        let file = folder.join(format!("{}.pnml", net.name()));
        std::fs::write(&file, write_pnml(net)).unwrap();
        file
    };
    let file = write(&outer("inspect_1"));
    write(&inner());
    assert_eq!(PetriPlan::read(&file).unwrap().nets().len(), 2);
    std::fs::write(folder.join("inspect_1.pnml"), "<pnml>").unwrap();
    let error = PetriPlan::read(&file).unwrap_err().to_string();
    assert!(error.contains("inspect_1.pnml:1: expected XML"), "{error}");
}

#[test]
fn a_plan_inside_itself_is_refused_with_the_path() {
    let again = |_: &str| Ok(Some(outer("loop")));
    let error = PetriPlan::new(outer("loop"), again).unwrap_err().to_string();
    assert!(error.contains("a plan can't be a part of itself: `outer/loop/loop` leads back"), "{error}");
    let error = PetriPlan::new(outer("outer"), |_| Ok(None)).unwrap_err().to_string();
    assert!(error.contains("`outer/outer` leads back to `outer`"), "{error}");
}

#[test]
fn too_many_sub_plans_are_refused() {
    let twice = |level: usize| {
        let (one, other) = (format!("l{}_1.exec", level + 1), format!("l{}_2.exec", level + 1));
        net(&format!("l{level}"), &[(&one, 1), (&other, 1)], &[])
    };
    let plan = PetriPlan::new(twice(0), |name| Ok(Some(twice(name[1..name.len() - 2].parse().unwrap()))));
    assert!(plan.unwrap_err().to_string().contains("at most"));
}

#[test]
fn forced_transition_of_a_sub_plan_ends_what_it_leads_to() {
    let (mut executor, mut host) = (PetriNetExecutor::new(plan(), ConflictOrder::File), Script::default());
    let at = |instance, transition| PlanTransition { instance, transition };
    // The sub-plan does not run yet, and the way has no token.
    assert_eq!(executor.force(at(1, 0), &mut host), Err(ForceError::Inactive("outer/inspect_1".into())));
    let lacking = ForceError::Tokens { place: "inspect_1.exec".into(), tokens: 0, needed: 1 };
    assert_eq!(executor.force(at(0, 3), &mut host), Err(lacking));
    executor.step(&mut host).unwrap();
    executor.step(&mut host).unwrap();
    assert_eq!(host.orders(), ["start goto"]);
    executor.force(at(1, 1), &mut host).unwrap();
    assert_eq!(host.orders(), ["end goto", "start look"]);
    executor.force(at(1, 2), &mut host).unwrap();
    assert_eq!((host.orders(), executor.is_running(1)), (vec!["end look".to_owned()], false));
    assert_eq!(executor.step(&mut host), Ok(ActionProgress::Succeeded));
    assert_eq!(executor.force(at(0, 0), &mut host), Err(ForceError::Ended));
    // What runs in a sub-plan is ended with the plan.
    let mut executor = PetriNetExecutor::new(plan(), ConflictOrder::File);
    executor.step(&mut host).unwrap();
    executor.step(&mut host).unwrap();
    host.orders();
    executor.force(at(0, 3), &mut host).unwrap();
    assert_eq!(
        (host.orders(), executor.progress()),
        (vec!["end goto".to_owned()], ActionProgress::Succeeded)
    );
}
