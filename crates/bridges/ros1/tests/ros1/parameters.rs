//! Parameters of modules on the master, with `rosparam`.

use slate_blackboard::interface::Value;

use crate::ros1::agent::{Running, eventually};
use crate::ros1::peer::Master;

fn text(master: &Master, access: &str) -> String {
    format!(
        "[modules.lamp]\n[modules.\"hall/lamp2\"]\nkind = \"lamp\"\n[ros1]\nmaster = \"{}\"\nparameters = \"{access}\"\n",
        master.address()
    )
}

fn get(master: &Master, name: &str) -> String {
    master.try_tool("rosparam", &["get", name]).unwrap_or_default().trim().to_owned()
}

#[test]
fn rosparam_lists_reads_and_sets_parameters_of_modules() {
    let mut master = Master::start();
    let agent = Running::of(&text(&master, "set"));
    eventually("parameters", || get(&master, "/r2_d2/lamp/brightness") == "0.5");
    let all = master.tool("rosparam", &["list", "/r2_d2"]);
    let all: Vec<_> = all.lines().collect();
    let names = [
        "/r2_d2/hall/lamp2/brightness",
        "/r2_d2/hall/lamp2/locked",
        "/r2_d2/lamp/brightness",
        "/r2_d2/lamp/locked",
    ];
    assert_eq!(all, names);
    master.tool("rosparam", &["set", "/r2_d2/lamp/brightness", "0.25"]);
    eventually("the parameter", || agent.number("lamp/params/brightness") == 0.25);
    master.tool("rosparam", &["set", "/r2_d2/hall/lamp2/brightness", "1"]);
    eventually("a whole number", || agent.number("hall/lamp2/params/brightness") == 1.0);
    master.tool("rosparam", &["set", "/r2_d2/lamp/locked", "true"]);
    eventually("a truth value", || agent.value("lamp/params/locked") == Some(Value::Bool(true)));
    // The checks are those of tools; what is refused is put back.
    master.tool("rosparam", &["set", "/r2_d2/lamp/brightness", "7.0"]);
    eventually("the refusal", || agent.logged("/r2_d2/lamp/brightness can't be set: ") == 1);
    eventually("the old value", || get(&master, "/r2_d2/lamp/brightness") == "0.25");
    master.tool("rosparam", &["delete", "/r2_d2/lamp/brightness"]);
    eventually("the value again", || get(&master, "/r2_d2/lamp/brightness") == "0.25");
    // Values set here reach the master.
    agent.set("lamp/params", "brightness", Value::Float(0.75));
    eventually("the new value", || get(&master, "/r2_d2/lamp/brightness") == "0.75");
    // A master that begins anew learns them again.
    master.kill();
    master.revive();
    eventually("the value on a new master", || get(&master, "/r2_d2/lamp/brightness") == "0.75");
    // With the agent they go.
    drop(agent);
    assert_eq!(master.try_tool("rosparam", &["get", "/r2_d2/lamp/brightness"]), None);
}

#[test]
fn rosparam_sets_only_where_the_file_says_so() {
    let master = Master::start();
    let agent = Running::of(&text(&master, "read"));
    eventually("parameters", || get(&master, "/r2_d2/lamp/brightness") == "0.5");
    master.tool("rosparam", &["set", "/r2_d2/lamp/brightness", "0.25"]);
    eventually("the refusal", || agent.logged("parameters = \"set\" in [ros1]") == 1);
    eventually("the old value", || get(&master, "/r2_d2/lamp/brightness") == "0.5");
    assert_eq!(agent.number("lamp/params/brightness"), 0.5);
}
