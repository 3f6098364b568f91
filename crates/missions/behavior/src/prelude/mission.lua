-- A mission: the skill or agent of a file, or a call of skills, run tick by tick.
local slate = ...
local globals, native, expect = slate.globals, slate.native, slate.expect
local pairs, tostring, ipairs = slate.pairs, slate.tostring, ipairs

-- State machines in the order in which they were made.
local machines = {}
slate.machines = machines

function slate.add_machine(machine)
    machines[#machines + 1] = machine
end

local main, call
local mission = {name = "mission", is_entered = false, error = "", status = 2, changes = 0}

local function register_states()
    slate.register("mission", mission)
    slate.register("globals", globals)
    for _, name in ipairs(slate.environment_names) do
        slate.register("file:" .. name, slate.environments[name])
    end
    for _, machine in ipairs(machines) do
        slate.register("machine:" .. machine.name, machine)
        slate.register("vars:" .. machine.name, machine.vars)
        for _, state in ipairs(machine.order) do
            slate.register("state:" .. machine.name .. "/" .. state.name, state)
            for index, transition in ipairs(state.transitions) do
                slate.register("transition:" .. machine.name .. "/" .. state.name .. "/" .. index, transition)
            end
        end
    end
end

-- Skills of a call such as `moveto{x = 1}; say("done")`, each of which is called once in a tick.
local function callable(skill, results)
    return setmetatable({}, {
        __index = skill,
        __call = function(_, ...)
            local status = skill.execute(...)
            results[#results + 1] = {skill, status}
            return status
        end,
    })
end

local function compile_call(text)
    local results = {}
    local environment = setmetatable({}, {__index = globals})
    for _, skill in ipairs(slate.skills) do
        environment[skill.name] = callable(skill, results)
    end
    local chunk, reason = slate.load(text, "=call `" .. text .. "`", "t", environment)
    expect(chunk, "%s", reason)
    return function()
        for index in ipairs(results) do
            results[index] = nil
        end
        chunk()
        local status, skill = 1, nil
        expect(#results > 0, "the call `%s` calls no skill", text)
        for _, result in ipairs(results) do
            if result[2] == 3 then
                return 3, result[1]
            elseif result[2] ~= 1 then
                status, skill = 2, result[1]
            end
        end
        return status, skill
    end
end

-- Loads the mission's file and what it depends on.
function slate.load_mission(name, text)
    slate.is_loading = true
    if native.exists("interfaces") and name ~= "interfaces" then
        slate.run_file("interfaces", globals)
    end
    local module = slate.require(name)
    if text ~= "" then
        call = compile_call(text)
    else
        main = type(module) == "table" and slate.skill_modules[module] and module or nil
        expect(main, "the file has neither a skill nor an agent: name a call of one, such as `moveto{x = 1, y = 2}`")
        call = function() return main.execute({}), main end
    end
    slate.is_loading = false
    register_states()
    slate.keep_initial()
end

-- Runs the mission once; returns its status.
function slate.tick()
    slate.forget_traversal()
    slate.reset_predicates()
    slate.read_interfaces()
    local status, skill = call()
    mission.status = status
    if status == 3 then
        local reason = skill.fsm and skill.fsm.error or skill.error
        mission.error = skill.name .. ": " .. (type(reason) == "string" and reason ~= "" and reason or "failed")
    end
    local is_changed = not mission.is_entered
    mission.is_entered = true
    for _, machine in ipairs(machines) do
        if machine.state_changed then
            machine.state_changed, is_changed = false, true
        end
    end
    if is_changed then
        mission.changes = mission.changes + 1
    end
    return status, is_changed
end

-- Makes a machine go to a state, as by a transition; false if it does not run.
function slate.jump(number, place)
    local machine = machines[number]
    local state = machine.current
    if not state or state.name == machine.exit_state or state.name == machine.fail_state then
        return false
    end
    machine.current_recursion = 0
    machine:trans(machine.order[place])
    mission.changes = mission.changes + 1
    return true
end

-- Number of ticks and jumps that have changed a state.
function slate.changes() return mission.changes end

-- Place of the state that each machine is in, 0 for none.
function slate.current_states()
    slate.grant()
    local list = {}
    for number, machine in ipairs(machines) do
        list[number] = 0
        for place, state in ipairs(machine.order) do
            if state == machine.current then
                list[number] = place
            end
        end
    end
    return list
end

function slate.failure() return mission.error end
function slate.status() return mission.status end

-- Machines that are in a state that does not end them, such as `patrol/DRIVE, visit/GO`.
function slate.active()
    slate.grant()
    local parts = {}
    for _, machine in ipairs(machines) do
        local state = machine.current
        if state and state.name ~= machine.exit_state and state.name ~= machine.fail_state then
            parts[#parts + 1] = machine.name .. "/" .. state.name
        end
    end
    return table.concat(parts, ", ")
end

local function name_of(state) return type(state) == "table" and state.name or state end

-- Outline of all machines, for drawings and checks.
function slate.outline()
    local list = {}
    for _, machine in ipairs(machines) do
        local states = {}
        for _, state in ipairs(machine.order) do
            local transitions, skills = {}, {}
            for _, transition in ipairs(state.transitions) do
                transitions[#transitions + 1] = {
                    name_of(transition.state), tostring(transition.description or ""), transition.pre == true,
                    transition.timeout ~= nil,
                }
            end
            for _, entry in ipairs(state.skills or {}) do
                skills[#skills + 1] = entry[1].name
            end
            states[#states + 1] = {state.name, transitions, skills}
        end
        list[#list + 1] = {machine.name, machine.start, machine.exit_state or "", machine.fail_state or "", states}
    end
    return list
end

-- Names of actions, each with its owner and kind.
function slate.action_names()
    local list = {}
    for _, action in ipairs(slate.actions) do
        list[#list + 1] = {action.owner, action.name, action.kind}
    end
    return list
end
