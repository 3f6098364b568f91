//! Parts of Lua that scripts have.

use crate::common::{Robot, engine, printed, refusal, skill};

#[test]
fn scripts_have_no_files_processes_or_clock() {
    let names = "io os dofile loadfile collectgarbage coroutine debug.getinfo debug.setupvalue string.dump \
        package.loadlib package.loaded";
    for name in names.split_whitespace() {
        assert_eq!(printed(&format!("print(pcall(load('return {name}')))")), ["true, nil"], "{name}");
    }
    assert_eq!(
        printed("print(os.execute, os.getenv, os.exit, os.remove, os.clock)"),
        ["nil, nil, nil, nil, nil"]
    );
    assert_eq!(printed("print(os.time(), fawkes.Time:new():in_msec())"), ["0, 0"]);
}

#[test]
fn bytecode_is_refused() {
    assert_eq!(printed("print(load('\\27Lua'))"), ["nil, attempt to load a binary chunk (mode is 't')"]);
}

#[test]
fn require_stays_in_the_skill_path() {
    for name in ["../secret", "..secret", "/etc/passwd", "skills/../x", ""] {
        let error = refusal(&format!("require '{name}'"));
        assert!(error.contains("is not a file of the skill path"), "{error}");
    }
    assert!(printed("print(pcall(require, 'other'))")[0].contains("is required while the mission runs"));
}

#[test]
fn pairs_and_next_have_a_fixed_order() {
    let body = "local all = {delta = 1, alpha = 2, [10] = 3, [2] = 4, [true] = 5, [1.5] = 6}
        local seen = {}
        for key in pairs(all) do seen[#seen + 1] = tostring(key) end
        print(table.concat(seen, ' '))
        seen = {}
        for key in next, all do seen[#seen + 1] = tostring(key) end
        print(table.concat(seen, ' '))
        for key in pairs(all) do all[key] = nil end
        print(next(all), next({b = 1}))
        local named = {[{name = 'z'}] = 1, [{name = 'a'}] = 2}
        for key in pairs(named) do print(key.name) end
        print((pcall(pairs, {[{}] = 1, [{}] = 2})))";
    let order = "1.5 2 10 alpha delta true";
    assert_eq!(printed(body), [order, order, "nil, b, 1", "a", "z", "false"]);
}

#[test]
fn texts_of_tables_have_no_address() {
    let body = "print({}, print, ('%s|%5s|%d'):format({}, 'x', 3)) print(pcall(string.format, '%p', {}))
        print(tostring(0/0), ('%.1f'):format(0/0))";
    let said = printed(body);
    assert_eq!(said[0], "table, function, table|    x|3");
    assert!(said[1].starts_with("false, "), "{said:?}");
    assert_eq!(said[2], "nan, nan");
}

#[test]
fn random_numbers_are_the_hosts() {
    let body =
        "math.randomseed(1) for _ = 1, 3 do print(math.random(6), math.random(-1, 1), math.random() < 1) end";
    assert_eq!(printed(body), printed(body));
    assert_eq!(printed(body)[0].split(", ").count(), 3);
    assert_eq!(printed("print(pcall(math.random, 2, 1))")[0].split(", ").next(), Some("false"));
}

#[test]
fn sorting_keeps_the_order_of_equal_elements() {
    let body = "local all = {}
        for index = 1, 500 do all[index] = {key = index % 3, index = index} end
        table.sort(all, function(one, other) return one.key < other.key end)
        for index = 2, 500 do
            local one, other = all[index - 1], all[index]
            if one.key == other.key and one.index > other.index then print('swapped') end
        end
        local plain = {3, 1, 2.5, 1}
        table.sort(plain)
        print(table.concat(plain, ' '))";
    assert_eq!(printed(body), ["1 1 2.5 3"]);
}

#[test]
fn garbage_collection_can_not_be_observed() {
    assert_eq!(printed("print((pcall(setmetatable, {}, {__gc = print})))"), ["false"]);
    assert_eq!(printed("print((pcall(setmetatable, {}, {__mode = 'k'})))"), ["false"]);
    assert_eq!(printed("print(getmetatable(''))"), ["false"], "texts have no metatable to change");
}

#[test]
fn mathematics_are_those_of_the_project() {
    let body = "print(math.sin(1) == 0.8414709848078965, math.atan2(1, -1), math.round(-2.5), math.sign(-3))
        print(math.normalize_mirror_rad(4), math.angle_distance(3, -3), math.isnan(math.nan))
        print(string.join('-', string.split('a b c', ' ')), table.deepcopy({{1}})[1][1], #math.pi .. '')";
    let text = skill(&format!(
        "function execute() {} return S_FINAL end function reset() end",
        body.replace(", #math.pi .. ''", "")
    ));
    let mut robot = Robot::default();
    engine(&text).tick(0, &mut robot).unwrap();
    let expected = ["true, 2.3561944901923, -3, -1", "-2.2831853071796, 0.28318530717959, true", "a-b-c, 1"];
    assert_eq!(robot.events, expected);
}

#[test]
fn patterns_are_those_of_lua() {
    let body = r#"print(('key = value'):match('^(%w+)%s*=%s*(%w+)$'))
        print(('hello world'):find('o w'), ('hello'):find('l+'), ('hello'):find('(l)(l)'), ('a.b'):find('.', 1, true))
        print(('THE (quick) fox'):find('%((%a+)%)'), ('x'):find('', 10), (''):find(''), ('abc'):find('b', -2))
        print(('f(a(b)c)d'):match('%b()'), ('THE (quick) fox'):gsub('%f[%a]%a+', '<%0>'))
        print(('hello world'):gsub('o', {o = '0'}), ('abc'):gsub('%w', '%0%0', 2), ('abc'):gsub('', '-'))
        print(('hello'):gsub('(l)(.)', '%2%1'), ('x y'):gsub('%a', function(a) if a == 'x' then return 1 end end))
        local all = {} for key, value in ('a=1, b=2'):gmatch('(%w)=(%w)') do all[#all + 1] = key .. value end
        for place in ('ab'):gmatch('()') do all[#all + 1] = place end
        print(table.concat(all, ' '), ('[[x]]'):match('%[%[(.-)%]%]'), ('"q"'):match('(["\'])q%1'), ('a-b'):match('[a%-]+'))
        print(('  trim '):match('^%s*(.-)%s*$') .. '|', ('2024-01'):match('(%d+)-(%d+)'), ('x'):match('y?x'), ('a]'):match('[]]'))
        print(pcall(string.find, 'a', '[a'), pcall(string.match, 'a', '(a'), pcall(string.gsub, 'a', 'a', '%2'))"#;
    let expected = [
        "key, value",
        "5, 3, 3, 2, 2",
        "5, nil, 1, 2, 2",
        "(a(b)c), <THE> (<quick>) <fox>, 3",
        "hell0 w0rld, aabbc, -a-b-c-, 4",
        "hello, 1 y, 2",
        "a1 b2 1 2 3, x, \", a-",
        "trim|, 2024, x, ]",
        "false, false, false, invalid capture index %2",
    ];
    assert_eq!(printed(body), expected);
}
