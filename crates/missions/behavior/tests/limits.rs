//! Scripts that run away.

use slate_behavior::{BehaviorEngine, BehaviorLimits, SkillFiles};

use crate::common::{Robot, engine, files, machine};

const LIMITS: BehaviorLimits = BehaviorLimits { operations: 100_000, memory: 8 << 20 };

fn first_error(rest: &str) -> String {
    let mut engine = BehaviorEngine::load(&files(&machine(rest)), "", LIMITS).unwrap();
    let mut robot = Robot::default();
    let error = engine.tick(0, &mut robot).unwrap_err();
    assert_eq!(engine.tick(1, &mut robot).unwrap_err(), error, "the mission can't go on");
    error.to_string()
}

#[test]
fn an_endless_loop_is_stopped_and_named() {
    let states = "fsm:define_states{export_to = _M, {'A', JumpState}}\nfsm:add_transitions{{'A', 'FINAL', cond = true}}\n";
    let bodies = [
        "while true do end",
        "while true do pcall(function() while true do end end) end",
        "xpcall(function() while true do end end, function() while true do end end)",
        "for _ in pairs(setmetatable({}, {__pairs = function() return function() return 1 end end})) do end",
        "table.sort({3, 1, 2}, function() while true do end end)",
        "local function f() return 1 + f() end f()",
        "local t = setmetatable({}, {__index = function(t, k) return t[k + 1] end}) while true do pcall(function() return t[1] end) end",
    ];
    for body in bodies {
        let error = first_error(&format!("{states}function A:init() {body} end"));
        assert!(
            error.starts_with("it.lua:9: the script was stopped after 100000 operations"),
            "{body}: {error}"
        );
    }
}

#[test]
fn an_endless_loop_in_a_file_is_refused() {
    let error = BehaviorEngine::load(&files("while true do end"), "", LIMITS).unwrap_err().to_string();
    assert!(error.starts_with("it.lua:1: the script was stopped after 1000000 operations"), "{error}");
}

#[test]
fn a_gigabyte_of_tables_is_refused() {
    let states = "fsm:define_states{export_to = _M, {'A', JumpState}}\nfsm:add_transitions{{'A', 'FINAL', cond = true}}\n";
    for body in [
        "all = {} for i = 1, 1e9 do all[i] = {{}, {}} end",
        "x = ('x'):rep(1e9)",
        "s = 'x' while true do s = s .. s end",
    ] {
        let text = machine(&format!("{states}function A:init() {body} end"));
        let limits = BehaviorLimits { operations: 100_000_000, ..LIMITS };
        let mut engine = BehaviorEngine::load(&files(&text), "", limits).unwrap();
        let error = engine.tick(0, &mut Robot::default()).unwrap_err().to_string();
        assert_eq!(
            error, "the scripts use more than 8388608 bytes of memory in it/A; expected less",
            "{body}"
        );
        let error = BehaviorEngine::load(&files(body), "", limits).unwrap_err().to_string();
        assert_eq!(error, "the files use more than 8388608 bytes of memory; expected less", "{body}");
    }
}

#[test]
fn functions_of_c_are_bounded() {
    let body = "print((pcall(table.move, {}, 1, 1e15, 2)))
        print((pcall(table.insert, setmetatable({}, {__len = function() return 1e15 end}), 1, 1)))
        print((pcall(table.concat, {}, '', 1, 1e15)))";
    let text =
        crate::common::skill(&format!("function execute() {body} return S_FINAL end function reset() end"));
    let mut robot = Robot::default();
    engine(&text).tick(0, &mut robot).unwrap();
    assert_eq!(robot.events, ["false"; 3]);
}

#[test]
fn a_large_file_is_refused() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("behavior-large");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("large.lua");
    std::fs::write(&file, " ".repeat((1 << 20) + 1)).unwrap();
    let files = SkillFiles::open(&file).unwrap();
    let error = BehaviorEngine::load(&files, "", LIMITS).unwrap_err().to_string();
    assert!(error.contains("the file is larger than 1048576 bytes"), "{error}");
}

#[test]
fn scripts_that_are_metered_do_what_they_did() {
    let body = "local seen = {}
        for index = 1, 3 do if index == 2 then goto continue end seen[#seen + 1] = index ::continue:: end
        repeat local last = #seen seen[last + 1] = 'r' until last == 3
        while (function() return #seen < 6 end)() do (print or error)('while') seen[#seen + 1] = [[end until]] end
        local f = function(...) return select('#', ...), ... end -- end
        --[==[ function until ]] ]==]
        do local s = 'it\\'s \"end\"' print(s, #s) end
        print(f(nil, 2), (function() return 1 end)(), \"while do\")
        for key, value in (function() return next, {a = 1} end)() do print(key, value) end
        print(table.concat(seen, ' '), load('return function() return 0x7end end'))
        print((load('local function f(n) if n == 0 then return 0 end return f(n - 1) end return f(9)'))())";
    let text =
        crate::common::skill(&format!("function execute() {body} return S_FINAL end function reset() end"));
    let mut robot = Robot::default();
    engine(&text).tick(0, &mut robot).unwrap();
    let expected = [
        "while",
        "while",
        "it's \"end\", 10",
        "2, 1, while do",
        "a, 1",
        "1 3 r r end until end until, nil, text:1: malformed number near '0x7en'",
        "0",
    ];
    assert_eq!(robot.events, expected);
}

#[test]
fn a_pattern_that_takes_too_long_is_stopped() {
    let states = "fsm:define_states{export_to = _M, {'A', JumpState}}\n";
    let bodies =
        ["local s = ('a'):rep(5000) s:find('.-.-.-.-b')", "pcall(string.gsub, ('a'):rep(100000), '.-b', '')"];
    for body in bodies {
        let error = first_error(&format!("{states}function A:init() {body} end"));
        assert!(
            error.starts_with("it.lua:8: the script was stopped after 100000 operations"),
            "{body}: {error}"
        );
    }
}
