-- Hybrid state machines: states, transitions with conditions and timeouts, machines inside of states.
local slate = ...
local pairs, format, tostring, pcall, load = slate.pairs, slate.format, slate.tostring, slate.pcall, slate.load
local native, checked, raw_pcall = slate.native, slate.checked, _G.pcall
local type, ipairs, setmetatable, getmetatable, error = type, ipairs, setmetatable, getmetatable, error

-- A class that has what its parent has.
local function class(name, parent)
    local made = setmetatable({}, {__index = parent})
    -- What is inherited is found at once.
    for key, value in next, parent or {} do
        made[key] = value
    end
    made.name, made.__index = name, made
    function made.is_instance(value)
        while type(value) == "table" do
            local meta = getmetatable(value)
            if meta == made or value == made then
                return true
            end
            value = meta and meta.__index
        end
        return false
    end
    slate.register("class:" .. name, made)
    return made
end
slate.class = class

local expect = slate.expect

-- State ------------------------------------------------------------------------------------------------------------

local State = class("State")

function State:new(o)
    expect(type(o) == "table" and type(o.name) == "string", "a state needs a `name`")
    expect(type(o.fsm) == "table", "state `%s` needs an `fsm`", o.name)
    o.transitions = o.transitions or {}
    o.loops, o.inits, o.dotattr = o.loops or {}, o.inits or {}, o.dotattr or {}
    return setmetatable(o, self)
end

function State:init() end
function State:loop() end
function State:exit() end
function State:prepare() end
function State:do_init(...) return self:init(...) end
function State:do_loop() return self:loop() end
function State:do_exit() self:exit() end
function State:reset() self.last_trans = nil end
function State:last_transition() return self.last_trans end
function State:clear_transitions() self.transitions = {} end

local function name_of(state)
    return type(state) == "table" and state.name or state
end

function State:get_transitions(state)
    local found = {}
    for _, transition in ipairs(self.transitions) do
        if not state or name_of(transition.state) == name_of(state) then
            found[#found + 1] = transition
        end
    end
    return found
end

function State:get_transition(state)
    local found = State.get_transitions(self, state)
    expect(#found < 2, "state `%s` has several transitions to `%s`", self.name, tostring(name_of(state)))
    return found[1]
end

-- JumpState --------------------------------------------------------------------------------------------------------

local JumpState = class("JumpState", State)
JumpState.comment = ""

-- What a condition that is a text sees.
local function condition_environment(state)
    local environment = {
        string = string, math = math, table = table, next = slate.globals.next, pairs = pairs, ipairs = ipairs,
        type = type, tostring = tostring, rawequal = rawequal, os = slate.clock, conditions = slate.globals.conditions,
        state = state, self = state, fsm = state.fsm, vars = state.fsm.vars,
    }
    for name, value in pairs(state.closure or {}) do
        environment[name] = value
    end
    return environment
end

local function always() return true end

function JumpState:create_transition(state, jumpcond, description, message)
    expect(state and (type(state) == "string" or state.name), "state `%s`: a transition leads to no state", self.name)
    local kind = type(jumpcond)
    if kind == "string" then
        description = description or jumpcond
        self.condition_environment = self.condition_environment or condition_environment(self)
        local compiled, reason = load("return " .. jumpcond, "=condition `" .. jumpcond .. "`", "t",
                                      self.condition_environment)
        expect(compiled, "state `%s`: %s", self.name, tostring(reason))
        jumpcond = compiled
    elseif jumpcond == true then
        description = description or "always"
        jumpcond = always
    else
        expect(kind == "function", "state `%s`: expected a function, a text or true as condition of the " ..
               "transition to " ..
               "`%s`, found %s", self.name, tostring(name_of(state)), kind == "boolean" and "false" or kind)
    end
    return {state = state, jumpcond = jumpcond, description = description, error = message}
end

function JumpState:add_new_transition(state, jumpcond, description, message)
    local transition = self:create_transition(state, jumpcond, description, message)
    transition.post = true
    self.transitions[#self.transitions + 1] = transition
    return transition
end

function JumpState:add_new_precondition(state, jumpcond, description, message)
    local transition = self:create_transition(state, jumpcond, description, message)
    transition.pre = true
    self.transitions[#self.transitions + 1] = transition
    return transition
end
JumpState.add_precond_trans = JumpState.add_new_precondition

local function add_once(state, transition)
    for _, own in ipairs(state.transitions) do
        if own == transition then
            return transition
        end
    end
    state.transitions[#state.transitions + 1] = transition
    return transition
end

function JumpState:add_precondition(transition)
    transition.pre = true
    return add_once(self, transition)
end

-- Adds a made transition, or with a condition a new one as older skill files do.
function JumpState:add_transition(transition, jumpcond, ...)
    if jumpcond ~= nil then
        return self:add_new_transition(transition, jumpcond, ...)
    end
    transition.post = true
    return add_once(self, transition)
end

-- Finds states that were named before they existed.
function JumpState:prepare()
    for _, transition in ipairs(self.transitions) do
        if type(transition.state) == "string" then
            local state = self.fsm.states[transition.state]
            expect(state, "`%s`: state `%s` leads to `%s`, which does not exist", self.fsm.name, self.name,
                   transition.state)
            transition.state = state
        end
    end
end

-- Returns the state that follows and what its condition adds, or nothing.
function JumpState:try_transitions(is_entry)
    local transitions = self.transitions
    for index = 1, #transitions do
        local transition = transitions[index]
        if is_entry and transition.pre or not is_entry and transition.post then
            local fires, one, two, three = transition.jumpcond(self)
            if fires then
                local fsm, message = self.fsm, transition.error
                if message then
                    fsm.error = fsm.error == "" and message or fsm.error .. ", " .. message
                end
                self.last_trans = transition
                return transition.state, one, two, three
            end
        end
    end
end

function JumpState:run_inits()
    for _, init in ipairs(self.inits) do
        init(self)
    end
end

function JumpState:run_loops()
    local loops = self.loops
    for index = 1, #loops do
        loops[index](self)
    end
end

function JumpState:do_init(...)
    local state, one, two, three = self:try_transitions(true)
    if state then
        return state, one, two, three
    end
    self:init(...)
    self:run_inits()
    return self:try_transitions()
end

function JumpState:do_loop()
    self:loop()
    if self.loops[1] then
        self:run_loops()
    end
    return self:try_transitions()
end

JumpState.jumpcond_true = always

function JumpState:jumpcond_nowriter()
    for _, interface in ipairs(self.nowriter_interfaces or {}) do
        if not interface:has_writer() then
            return true
        end
    end
    return false
end

function JumpState:init_timeout() self.timeout_start = native.now() end

function JumpState:set_timeout(seconds, to, message, description)
    expect(type(seconds) == "number", "state `%s`: expected a timeout in seconds, found %s", self.name, type(seconds))
    local duration = math.floor(seconds * 1e9)
    self.timeout_time = seconds
    for index = #self.inits, 1, -1 do
        if self.inits[index] == self.init_timeout then
            table.remove(self.inits, index)
        end
    end
    table.insert(self.inits, self.init_timeout)
    local text = format("timeout %g s%s", seconds, description and " (" .. tostring(description) .. ")" or "")
    local transition = self:add_new_transition(to, function(state)
        return native.now() - state.timeout_start >= duration
    end, text, message)
    transition.dotattr, transition.timeout = {style = "dashed"}, seconds
    return transition
end

-- WaitState: stays for `time_sec`, or for the time that the transition to it adds.
local WaitState = class("WaitState", JumpState)

function WaitState:new(o)
    local made = JumpState.new(self, o)
    expect(o.next_state, "state `%s` needs a `next_state`", o.name)
    made:add_new_transition(o.next_state, function(state)
        local seconds = state.time_sec or state.fsm.vars.time_sec or 0
        return native.now() - state.timeout_start >= math.floor(seconds * 1e9)
    end, "time is over")
    made.inits = {made.init_timeout}
    return made
end

function WaitState:do_init(seconds)
    if type(seconds) == "number" then
        self.time_sec = seconds
    end
    return JumpState.do_init(self)
end

-- FSM --------------------------------------------------------------------------------------------------------------

local FSM = class("FSM")
FSM.debug, FSM.recursion_limit = false, 10

function FSM:new(o)
    expect(type(o) == "table" and type(o.name) == "string", "a state machine needs a `name`")
    expect(type(o.start) == "string", "state machine `%s` needs a `start` state", o.name)
    o.states, o.order, o.vars, o.persistent_vars = {}, {}, {}, {}
    o.error, o.current_recursion, o.state_changed, o.prepared = "", 0, false, false
    setmetatable(o, self)
    slate.add_machine(o)
    return o
end

function FSM:keep(state)
    expect(not self.states[state.name], "`%s`: the state `%s` exists already", self.name, state.name)
    self.states[state.name] = state
    self.order[#self.order + 1] = state
    return state
end

function FSM:new_state(name, vars, export_to)
    local o = {}
    for key, value in pairs(vars or {}) do
        o[key] = value
    end
    o.name, o.fsm = name, self
    local state = self:keep(State:new(o))
    if export_to then
        export_to[name] = state
    end
    return state
end

function FSM:clear_states()
    self.states, self.order, self.state_changed = {}, {}, true
end

function FSM:set_debug(is_on) self.debug = is_on end
function FSM:mark_changed() self.state_changed = true end
function FSM:set_changed(is_changed) self.state_changed = is_changed ~= false end
function FSM:changed()
    local is_changed = self.state_changed
    self.state_changed = false
    return is_changed
end
function FSM:reset_trace() end

function FSM:set_error(text)
    self.error = text
    if text and text ~= "" then
        native.log("warn", format("%s: %s", self.name, text))
    end
end

local function calls_init(state, ...) return state:do_init(...) end
local function calls_exit(state) state:do_exit() end

-- Goes to the state that stands for failures, or raises the error where the machine has none.
function FSM:fail(text)
    self:set_error(text)
    local state = self.states[self.fail_state]
    expect(state, "%s: %s", self.name, text)
    return self:trans(state)
end

-- Follows what a state has returned, or its error.
function FSM:follow(phase, is_fine, state, ...)
    if is_fine then
        if state then
            return self:trans(state, ...)
        end
    elseif self.current.name == self.fail_state then
        self:set_error(format("state `%s` failed in its %s: %s", self.current.name, phase, tostring(state)))
    else
        return self:fail(format("state `%s` failed in its %s: %s", self.current.name, phase, tostring(state)))
    end
end

-- Loops the current state, and makes the transitions that follow.
function FSM:loop()
    self.current_recursion = 0
    if not self.current then
        self.current = self.states[self.start]
        expect(self.current, "`%s`: the start state `%s` does not exist", self.name, self.start)
        self.state_changed = true
        self:follow("init", pcall(calls_init, self.current))
    end
    local current = self.current
    if current.name ~= self.fail_state then
        local is_fine, state, one, two, three = raw_pcall(current.do_loop, current)
        if state or not is_fine then
            self:follow("loop", checked(is_fine, state, one, two, three))
        end
    end
    if self.current.name == self.fail_state and self.error == "" then
        local transition = self.previous and self.previous:last_transition()
        self.error = transition and transition.description or "failed"
        if self.previous and self.previous.skill_error then
            self.error = self.error .. ": " .. self.previous.skill_error
        end
    end
end

-- Makes a transition, and those that follow from it at once.
function FSM:trans(state, ...)
    self.current_recursion = self.current_recursion + 1
    if self.current_recursion >= self.recursion_limit then
        expect(false, "`%s`: %d transitions follow each other at once, up to `%s` to `%s`; expected fewer", self.name,
               self.recursion_limit, self.current.name, state.name)
    end
    self.state_changed = true
    if self.debug then
        native.log("debug", format("%s: %s to %s", self.name, self.current.name, state.name))
    end
    local is_fine, reason = pcall(calls_exit, self.current)
    if not is_fine then
        self:set_error(format("state `%s` failed in its exit: %s", self.current.name, tostring(reason)))
    end
    self.previous, self.current = self.current, state
    return self:follow("init", pcall(calls_init, state, ...))
end

-- Leaves the current state of a machine that does not go on.
function FSM:interrupt()
    local state = self.current
    if state and state.name ~= self.exit_state and state.name ~= self.fail_state then
        state:do_exit()
        self.current = nil
    end
end

function FSM:reset()
    if self.current then
        self.current:do_exit()
    end
    for _, state in ipairs(self.order) do
        state:reset()
    end
    -- Conditions that are texts have this table.
    for key in next, self.vars do
        self.vars[key] = nil
    end
    if not self.prepared then
        self.prepared = true
        for _, state in ipairs(self.order) do
            state:prepare()
        end
    end
    self.current, self.previous, self.error, self.state_changed = nil, nil, "", true
end

-- HSM --------------------------------------------------------------------------------------------------------------

local HSM = class("HSM", FSM)

function HSM:new(o)
    local made = FSM.new(self, o)
    made.default_transitions = {}
    return made
end

function HSM:new_state() error("a hybrid state machine has jump states: use define_states", 2) end

function HSM:add_state(state)
    self:keep(state)
    self:apply_deftrans(state)
    return state
end

function HSM:define_states(definitions)
    local export_to = definitions.export_to
    if export_to then
        for _, state in ipairs(self.order) do
            export_to[state.name] = state
        end
    end
    for _, definition in ipairs(definitions) do
        local o, kind = {}, JumpState
        if type(definition) == "table" then
            for key, value in pairs(definition) do
                if key ~= 1 and key ~= 2 then
                    o[key] = value
                end
            end
            o.name, kind = definition[1], definition[2]
        else
            o.name = definition
        end
        expect(type(o.name) == "string", "`%s`: a state has no name", self.name)
        expect(type(kind) == "table" and kind.new, "`%s`: the class of state `%s` is unknown", self.name, o.name)
        o.fsm, o.closure = self, definitions.closure
        local state = self:add_state(kind:new(o))
        if export_to then
            export_to[o.name] = state
        end
    end
end

function HSM:new_jump_state(name, transitions, vars, export_to)
    local o = {}
    for key, value in pairs(vars or {}) do
        o[key] = value
    end
    o.name, o.fsm, o.transitions = name, self, transitions
    local state = self:add_state(JumpState:new(o))
    -- Older skill files expect it among their variables.
    export_to = export_to or slate.environment_of(self)
    if export_to then
        export_to[name] = state
    end
    return state
end

local function decorated(transition, definition)
    transition.dotattr = definition.dotattr
    transition.hide = definition.hide
    return transition
end

function HSM:add_transitions(definitions)
    for _, definition in ipairs(definitions) do
        if definition[2] then
            self:add_definition(definition)
        else
            local to = self:existing(definition[1], "a default transition leads to")
            expect(definition.cond, "`%s`: the default transition to `%s` needs a `cond`", self.name, to.name)
            self:add_default_transition(to.name, definition.cond, definition.desc)
        end
    end
end

function HSM:existing(name, role)
    local state = self.states[name_of(name)]
    expect(state, "`%s`: %s `%s`, which does not exist", self.name, role, tostring(name_of(name)))
    return state
end

function HSM:add_definition(definition)
    local from = self:existing(definition[1], "a transition starts at")
    local to = self:existing(definition[2], format("state `%s` leads to", from.name))
    local condition, precondition = definition[3] or definition.cond, definition.precond
    local timeout = definition.timeout
    if definition.cond_and_precond then
        expect(not (condition or precondition), "`%s`: `cond_and_precond` excludes `cond` and `precond`", self.name)
        condition, precondition = definition.cond_and_precond, definition.cond_and_precond
    end
    expect(condition or precondition or timeout, "`%s`: the transition from `%s` to `%s` needs a `cond`, a " ..
           "`precond` or a `timeout`", self.name, from.name, to.name)
    if type(timeout) == "table" then
        local target = self:existing(timeout.to or timeout[2] or to.name, format("a timeout of `%s` leads to",
               from.name))
        from:set_timeout(timeout.time or timeout[1], target, timeout.error, definition.desc)
    elseif timeout then
        from:set_timeout(timeout, to, nil, definition.desc)
    end
    if condition then
        decorated(from:add_new_transition(to, condition, definition.desc, definition.error), definition)
    end
    if precondition then
        decorated(from:add_new_precondition(to, precondition, definition.desc, definition.error), definition)
    end
end

function HSM:add_default_transition(state, jumpcond, description)
    table.insert(self.default_transitions, {state = state, jumpcond = jumpcond, description = description})
    for _, own in ipairs(self.order) do
        self:apply_deftrans(own)
    end
end

function HSM:apply_deftrans(state)
    if state.name == self.exit_state or state.name == self.fail_state then
        return
    end
    for index, default in ipairs(self.default_transitions) do
        local has_it = name_of(default.state) == state.name
        for _, transition in ipairs(state.transitions) do
            has_it = has_it or transition.deftransindex == index
        end
        if not has_it then
            local made = state:add_new_transition(default.state, default.jumpcond, default.description)
            made.deftransindex = index
        end
    end
end

-- States with machines inside --------------------------------------------------------------------------------------

local SubFSMJumpState = class("SubFSMJumpState", JumpState)

function SubFSMJumpState:new(o)
    local made = JumpState.new(self, o)
    expect(type(o.subfsm) == "table", "state `%s` needs a `subfsm`", o.name)
    if o.subfsm.exit_state and o.exit_to then
        made.final_transition = made:add_new_transition(o.exit_to, made.jumpcond_fsm_done, "FSM succeeded")
    end
    if o.subfsm.fail_state and o.fail_to then
        made.failure_transition = made:add_new_transition(o.fail_to, made.jumpcond_fsm_failed, "FSM failed")
    end
    return made
end

local function is_in(machine, name) return machine.current ~= nil and machine.current.name == name end

function SubFSMJumpState:jumpcond_fsm_done() return is_in(self.subfsm, self.subfsm.exit_state) end
function SubFSMJumpState:jumpcond_fsm_failed() return is_in(self.subfsm, self.subfsm.fail_state) end

-- The machine inside has not run, so only preconditions are tried.
function SubFSMJumpState:do_init(...)
    local state, one, two, three = self:try_transitions(true)
    if state then
        return state, one, two, three
    end
    self.subfsm:reset()
    self:init(...)
    self:run_inits()
    for key, value in pairs(self.fsm.vars) do
        self.subfsm.vars[key] = value
    end
end

function SubFSMJumpState:do_loop()
    self:loop()
    self.subfsm:loop()
    self:run_loops()
    if self.subfsm:changed() then
        self.fsm:mark_changed()
    end
    return self:try_transitions()
end

function SubFSMJumpState:do_exit()
    self:exit()
    self.subfsm:interrupt()
    if self.subfsm.error ~= "" and is_in(self.subfsm, self.subfsm.fail_state) then
        self.skill_error = self.subfsm.error
    end
end

function SubFSMJumpState:reset()
    JumpState.reset(self)
    self.skill_error = nil
    self.subfsm:reset()
end

local MultiSubFSMJumpState = class("MultiSubFSMJumpState", JumpState)

function MultiSubFSMJumpState:new(o)
    local made = JumpState.new(self, o)
    expect(type(o.subfsms) == "table" and #o.subfsms > 0, "state `%s` needs `subfsms`", o.name)
    for _, machine in ipairs(o.subfsms) do
        expect(machine.exit_state and machine.fail_state, "machine `%s` in state `%s` needs an `exit_state` and a " ..
               "`fail_state`", machine.name, o.name)
    end
    if o.exit_to then
        made.final_transition = made:add_new_transition(o.exit_to, made.final, "FSMs succeeded")
    end
    if o.fail_to then
        made.failure_transition = made:add_new_transition(o.fail_to, made.failed, "FSM failed")
    end
    return made
end

function MultiSubFSMJumpState:final()
    for _, machine in ipairs(self.subfsms) do
        if not is_in(machine, machine.exit_state) then
            return false
        end
    end
    return true
end

function MultiSubFSMJumpState:failed()
    for _, machine in ipairs(self.subfsms) do
        if is_in(machine, machine.fail_state) then
            return true
        end
    end
    return false
end

function MultiSubFSMJumpState:do_init(...)
    local state, one, two, three = self:try_transitions(true)
    if state then
        return state, one, two, three
    end
    for _, machine in ipairs(self.subfsms) do
        machine:reset()
    end
    self:init(...)
    self:run_inits()
    for _, machine in ipairs(self.subfsms) do
        for key, value in pairs(self.fsm.vars[machine.name] or {}) do
            machine.vars[key] = value
        end
    end
end

function MultiSubFSMJumpState:do_loop()
    self:loop()
    for _, machine in ipairs(self.subfsms) do
        machine:loop()
        if machine:changed() then
            self.fsm:mark_changed()
        end
    end
    self:run_loops()
    return self:try_transitions()
end

function MultiSubFSMJumpState:do_exit()
    self:exit()
    local reasons = {}
    for _, machine in ipairs(self.subfsms) do
        machine:interrupt()
        if machine.error ~= "" then
            reasons[#reasons + 1] = machine.name .. ": " .. machine.error
        end
    end
    self.skill_error = #reasons > 0 and table.concat(reasons, ", ") or nil
end

function MultiSubFSMJumpState:reset()
    JumpState.reset(self)
    self.skill_error = nil
    for _, machine in ipairs(self.subfsms) do
        machine:reset()
    end
end

for _, made in ipairs {State, JumpState, WaitState, FSM, HSM, SubFSMJumpState, MultiSubFSMJumpState} do
    slate[made.name], slate.globals[made.name] = made, made
end
