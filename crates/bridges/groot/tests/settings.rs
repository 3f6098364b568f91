//! The table `[groot]`.

use slate_groot::{GrootBridge, GrootSettings, check_trees};

use crate::agent::{database, loaded, settings};

#[test]
fn a_table_that_is_wrong_is_refused_with_its_place() {
    for (line, words) in [
        ("port = 70000", "a port is a number from 0 to 65535"),
        ("prot = 1667", "prot"),
        ("address = \"everywhere\"", "`address` takes an address"),
        ("address = \"0.0.0.0\"", "monitors need no token"),
        ("trusted = 1", "`trusted` takes true or false"),
        ("port = 1667\nports = { planner = 1667 }", "exclude each other"),
        ("ports = { planner = 1667, other = 1667 }", "two Plans have the port 1667"),
        ("ports = {}", "`ports` is a table of Plans"),
    ] {
        let database = database(&format!("[groot]\n{line}"));
        let report = GrootSettings::of(&database.current()).unwrap_err().to_string();
        assert!(report.contains(words) && report.contains("test.toml:"), "{line}: {report}");
    }
    let open = database("[groot]\naddress = \"0.0.0.0\"\ntrusted = true");
    assert!(settings(&open.current()).address.is_unspecified());
    assert!(GrootSettings::of(&database("").current()).unwrap().is_none());
}

#[test]
fn missing_tree_is_reported_before_run() {
    let planner = "[modules.planner]\nkind = \"shown\"";
    let two = format!("{planner}\n[modules.other]\nkind = \"shown\"");
    for (modules, table, words) in [
        ("", "port = 0", "no Plan of this agent follows a behavior tree"),
        (&two[..], "port = 0", "2 Plans follow behavior trees, and each needs a port: other, planner"),
        (&two, "port = 0", "ports = { \"other\" = 1667, \"planner\" = 1669 }"),
        (
            planner,
            "ports = { plan = 0 }",
            "`plan` is no Plan that follows a behavior tree; available: planner",
        ),
    ] {
        let database = database(&format!("{modules}\n[groot]\n{table}"));
        let configuration = database.current();
        let error = check_trees(&loaded(&database).composer(), &settings(&configuration)).unwrap_err();
        let report = error.report(&configuration).to_string();
        assert!(report.contains(words) && report.contains("test.toml:"), "{report}");
    }
}

#[test]
fn a_port_that_is_taken_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let database = database(&format!("[modules.planner]\nkind = \"shown\"\n[groot]\nport = {port}"));
    let error = GrootBridge::open(&loaded(&database).composer(), &settings(&database.current())).unwrap_err();
    assert!(error.to_string().contains(&format!("Groot can't be served at 127.0.0.1:{port}")), "{error}");
}
