-- States of machines: phases, transitions with conditions and timeouts.
local slate = ...
local pairs, format, tostring, load = slate.pairs, slate.format, slate.tostring, slate.load
local native = slate.native
local type, ipairs, setmetatable, getmetatable = type, ipairs, setmetatable, getmetatable

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
slate.name_of = name_of

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

for _, made in ipairs {State, JumpState, WaitState} do
    slate[made.name], slate.globals[made.name] = made, made
end
