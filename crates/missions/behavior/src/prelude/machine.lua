-- Hybrid state machines: they loop their current state and follow its transitions.
local slate = ...
local expect, class, name_of = slate.expect, slate.class, slate.name_of
local pairs, format, tostring, pcall = slate.pairs, slate.format, slate.tostring, slate.pcall
local native, checked, raw_pcall = slate.native, slate.checked, _G.pcall
local State, JumpState = slate.State, slate.JumpState
local type, ipairs, error = type, ipairs, error

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

for _, made in ipairs {FSM, HSM} do
    slate[made.name], slate.globals[made.name] = made, made
end
