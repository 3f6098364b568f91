-- Skills: functions with arguments and a status, most of them made of a state machine; agents above them.
local slate = ...
local globals, native, expect = slate.globals, slate.native, slate.expect
local pairs, tostring, class = slate.pairs, slate.tostring, slate.class
local type, ipairs, setmetatable, rawget, rawset = type, ipairs, setmetatable, rawget, rawset

local S_INACTIVE, S_FINAL, S_RUNNING, S_FAILED = 0, 1, 2, 3
local stati = {S_INACTIVE = S_INACTIVE, S_FINAL = S_FINAL, S_RUNNING = S_RUNNING, S_FAILED = S_FAILED}

-- Skills in the order of loading.
local skills = {}
slate.skills = skills
local skill_meta = {__call = function(skill, ...) return skill.execute(...) end}

local skillenv, agentenv = {}, {}
globals.skillenv, globals.agentenv, globals.skillstati = skillenv, agentenv, stati

function skillenv.get_skill_module(skill)
    if type(skill) == "string" then
        for _, known in ipairs(skills) do
            if known.name == skill then
                return known
            end
        end
    elseif type(skill) == "table" and type(skill.execute) == "function" then
        return skill
    end
end

function skillenv.get_skill_fsm(skill)
    local found = skillenv.get_skill_module(skill)
    return found and found.fsm
end

local function copied(original)
    return type(original) == "table" and getmetatable(original) == nil and table.deepcopy(original) or original
end

-- Skills made of machines ------------------------------------------------------------------------------------------

local function execute_machine(fsm, ...)
    local vars = fsm.vars
    if not vars.__set__ then
        local first = ...
        if type(first) == "table" then
            for key, value in pairs(first) do
                vars[key] = value
            end
        else
            for index = 1, select("#", ...) do
                vars[index] = select(index, ...)
            end
        end
        vars.__set__ = true
    end
    fsm:loop()
    local name = fsm.current.name
    if name == fsm.exit_state then
        return S_FINAL
    elseif name == fsm.fail_state or fsm.error ~= "" then
        return S_FAILED
    end
    return S_RUNNING
end

-- Makes a module that has been loaded a skill, if it has what a skill needs.
function slate.finish_module(module)
    if type(module) ~= "table" or not slate.skill_modules[module] or rawget(module, "__finished__") then
        return
    end
    local fsm = rawget(module, "fsm")
    if type(rawget(module, "execute")) ~= "function" then
        expect(type(fsm) == "table" and fsm.exit_state, "skill `%s` has neither `execute` nor an `fsm` with an exit " ..
               "state", module.name)
        rawset(module, "execute", function(...) return execute_machine(fsm, ...) end)
    end
    if type(rawget(module, "reset")) ~= "function" then
        rawset(module, "reset", function()
            if fsm then
                fsm:reset()
            end
        end)
    end
    expect(not skillenv.get_skill_module(module.name), "the skill `%s` exists already", module.name)
    rawset(module, "__finished__", true)
    if type(rawget(module, "init")) == "function" then
        module.init()
    elseif fsm then
        fsm:reset()
    end
    skills[#skills + 1] = module
    slate.register("skill:" .. module.name, module)
end
slate.skill_modules = {}

-- Returns a skill by its name: one that is loaded, or that of a file of this name.
local function skill_of(name, user)
    local known = skillenv.get_skill_module(name)
    if not known then
        expect(native.exists(name), "skill `%s` depends on the skill `%s`, which is neither loaded nor a file " ..
               "of the skill path; an action of the robot belongs to `depends_actions`", user, name)
        expect(not slate.is_loading_module(name), "the skills `%s` and `%s` depend on each other", user, name)
        slate.require(name)
        known = skillenv.get_skill_module(name)
        expect(known, "the file of `%s` has no skill of this name", name)
    end
    return known
end

function skillenv.use_skill(name)
    local module = slate.require(name)
    expect(type(module) == "table" and slate.skill_modules[module], "`%s` is not a skill: it does not call " ..
           "skillenv.skill_module", tostring(name))
    return module
end
globals.use_skill = skillenv.use_skill

local exports = {}
function skillenv.add_export(key, value) exports[key] = value end

local function export_to(module, names)
    for _, name in ipairs(names) do
        slate.inherited[module][name] = slate[name]
    end
    for key, value in pairs(exports) do
        slate.inherited[module][key] = value
    end
    for key, value in pairs(stati) do
        slate.inherited[module][key], slate.inherited[module][key:sub(3)] = value, value
    end
    slate.inherited[module].os = slate.clock
end

local COMMON = {"JumpState", "SkillJumpState", "SubFSMJumpState", "MultiSubFSMJumpState", "WaitState", "Time"}

function skillenv.module_init(module)
    export_to(module, COMMON)
    slate.inherited[module].SkillHSM = slate.SkillHSM
end

local function module_of(name)
    return type(name) == "string" and slate.require(name) or name
end

-- Gives a module what it depends on.
local function depend(module)
    local inherited = slate.inherited[module]
    expect(inherited, "a skill starts with `module(..., skillenv.module_init)`")
    for _, name in ipairs(module.depends_skills or {}) do
        inherited[name] = skill_of(name, module.name)
    end
    for _, definition in ipairs(module.depends_actions or {}) do
        local action = slate.Action:new(module.name, definition)
        inherited[definition.v] = action
        rawset(slate.own_actions, module, slate.own_actions[module] or {})
        slate.own_actions[module][definition.v] = action
    end
    for _, definition in ipairs(module.depends_interfaces or {}) do
        inherited[definition.v] = slate.interface_of(definition, module.name)
    end
    local meta = getmetatable(module)
    meta.__call, meta.__tostring = skill_meta.__call, function(own) return own.name end
end
slate.own_actions = {}

function skillenv.skill_module(name)
    local module = module_of(name)
    expect(type(module.name) == "string", "a skill needs a `name`")
    expect(type(module.documentation) == "string", "skill `%s` needs a `documentation`", module.name)
    depend(module)
    slate.skill_modules[module] = true
    rawset(module, "__SKILLMODULE__", true)
end

function agentenv.module_init(module)
    export_to(module, COMMON)
    slate.inherited[module].AgentHSM = slate.AgentHSM
    slate.inherited[module].SkillJumpState = slate.AgentSkillExecJumpState
    slate.inherited[module].AgentSkillExecJumpState = slate.AgentSkillExecJumpState
end

function agentenv.agent_module(name)
    skillenv.skill_module(name)
end

-- Actions of the robot ---------------------------------------------------------------------------------------------

local Action = class("Action")
slate.Action = Action
slate.actions = {}

-- An action of `kind`; `arguments` has the names of its numbers in their order, `defaults` some of their values.
function Action:new(owner, definition)
    expect(type(definition) == "table" and type(definition.v) == "string", "an action of `%s` needs a `v`, the " ..
           "name of its variable", owner)
    local made = {
        name = definition.v, owner = owner, kind = definition.kind or definition.v, index = #slate.actions,
        arguments = definition.arguments or {}, defaults = definition.defaults or {}, is_active = false, error = "",
    }
    expect(type(made.kind) == "string" and type(made.arguments) == "table" and type(made.defaults) == "table",
           "action `%s` of `%s`: expected a text as `kind`, and tables as `arguments` and `defaults`", made.name, owner)
    made.execute = function(...) return made:run(...) end
    made.reset = function() made:stop() end
    slate.actions[#slate.actions + 1] = made
    setmetatable(made, Action)
    slate.register("action:" .. owner .. "/" .. made.name, made)
    return made
end

Action.__call = function(action, ...) return action.execute(...) end

-- Numbers of a start, in the order of the action, or nothing and what is wrong.
function Action:numbers(given)
    local numbers, missing = {}, nil
    for index, name in ipairs(self.arguments) do
        local value = given[name]
        if value == nil then
            value = given[index]
        end
        if value == nil then
            value = self.defaults[name]
        end
        if value == nil then
            missing = missing or name
        elseif missing then
            return nil, "the argument `" .. missing .. "` is missing"
        elseif type(value) ~= "number" then
            return nil, "expected a number as `" .. name .. "`, found " .. tostring(value)
        else
            numbers[index] = value
        end
    end
    return numbers
end

function Action:start(given)
    local numbers, reason = self:numbers(given)
    if numbers then
        reason = native.start(self.index, numbers)
    end
    if reason then
        self.error = "action `" .. self.kind .. "`: " .. reason
        native.log("error", self.error)
        return false
    end
    self.is_active, self.error = true, ""
    return true
end

-- Starts the action with the first call, and asks how far it is with the others.
function Action:run(...)
    if not self.is_active then
        local first = ...
        if not self:start(type(first) == "table" and first or {...}) then
            return S_FAILED
        end
        return S_RUNNING
    end
    local progress = native.progress(self.index)
    if progress == "failed" then
        self.error = "action `" .. self.kind .. "` failed"
        return S_FAILED
    end
    return progress == "succeeded" and S_FINAL or S_RUNNING
end

function Action:stop()
    if self.is_active then
        self.is_active = false
        native.stop(self.index)
    end
end

-- States that run skills -------------------------------------------------------------------------------------------

local SkillJumpState = class("SkillJumpState", slate.JumpState)

local function entry_of(definition, state)
    local entry = {}
    for key, value in pairs(type(definition) == "table" and not definition.execute and definition or {definition}) do
        entry[key] = value
    end
    local skill = entry[1]
    if type(skill) == "string" then
        local environment = slate.environment_of()
        local own = slate.own_actions[environment]
        skill = own and own[skill] or skillenv.get_skill_module(skill)
    end
    expect(skill, "state `%s` runs the skill `%s`, which is unknown: is it in `depends_skills`?", state,
           tostring(entry[1]))
    expect(type(skill) == "table" and type(skill.name) == "string", "state `%s`: expected a skill, found a %s", state,
           type(skill))
    entry[1], entry.status = skill, S_RUNNING
    return entry
end

function SkillJumpState:new(o)
    local made = slate.JumpState.new(self, o)
    local entries = {}
    for index, definition in ipairs(o.skills or {}) do
        entries[index] = entry_of(definition, o.name)
        slate.register("entry:" .. o.fsm.name .. "/" .. o.name .. "/" .. index, entries[index])
    end
    made.skills, made.skill_status, made.args = entries, S_RUNNING, {}
    made:check_definition()
    made:set_transition_labels()
    if o.final_to and o.final_to == o.fail_to then
        made.final_transition = made:add_new_transition(o.final_to, made.jumpcond_skill_done,
               made.skill_names .. " done")
    else
        if o.final_to then
            made.final_transition =
                made:add_new_transition(o.final_to, made.jumpcond_skill_final, made.skill_names .. " succeeded")
        end
        if o.fail_to then
            made.failure_transition =
                made:add_new_transition(o.fail_to, made.jumpcond_skill_failed, made.skill_names .. " failed")
        end
    end
    return made
end

function SkillJumpState:check_definition()
    expect(#self.skills > 0, "state `%s` needs `skills`", self.name)
    expect(self.final_to, "state `%s` needs a `final_to`", self.name)
    self.fail_to = self.fail_to or "FAILED"
end

function SkillJumpState:set_transition_labels()
    local names = {}
    for index, entry in ipairs(self.skills) do
        names[index] = entry[1].name
    end
    self.skill_names = #names > 0 and table.concat(names, ", ") or "no skill"
end

function SkillJumpState:jumpcond_skill_final() return self.skill_status == S_FINAL end
function SkillJumpState:jumpcond_skill_failed() return self.skill_status == S_FAILED end
function SkillJumpState:jumpcond_skill_done()
    return self.skill_status == S_FINAL or self.skill_status == S_FAILED
end

function SkillJumpState:skill_reset()
    for _, entry in ipairs(self.skills) do
        entry.args, entry.__args, entry.status = nil, nil, S_RUNNING
        entry[1].reset()
    end
end

-- Arguments that the definition of the state gives to a skill.
function SkillJumpState:default_arguments(entry, arguments)
    local is_any = false
    for key, value in pairs(entry) do
        if key ~= 1 and key ~= "status" and key ~= "args" and key ~= "__args" then
            is_any = true
            if type(key) == "number" and type(value) == "table" then
                self:positional_arguments(value, arguments)
            else
                arguments[key] = copied(value)
            end
        end
    end
    return is_any
end

function SkillJumpState:positional_arguments(given, arguments)
    for key, value in pairs(given) do
        arguments[key] = copied(value)
    end
end

function SkillJumpState:set_arguments()
    for _, entry in ipairs(self.skills) do
        local arguments = {}
        local is_any = self:default_arguments(entry, arguments)
        local own = self.args[entry[1]] or self.args[entry[1].name] or entry.args
        if type(own) == "table" then
            is_any = true
            for key, value in pairs(own) do
                arguments[key] = value
            end
        end
        if not is_any then
            for key, value in pairs(self.fsm.vars) do
                arguments[key] = key ~= "__set__" and value or nil
            end
        end
        entry.__args = arguments
    end
end

function SkillJumpState:do_init(...)
    local state, one, two, three = self:try_transitions(true)
    if state then
        return state, one, two, three
    end
    self:skill_reset()
    self.skill_status, self.skill_error, self.args = S_RUNNING, nil, {}
    for _, entry in ipairs(self.skills) do
        self.args[entry[1].name] = {}
    end
    self:init(...)
    self:set_arguments()
    self:run_inits()
    return self:try_transitions()
end

local function error_of(skill)
    return skill.fsm and skill.fsm.error or skill.error
end

function SkillJumpState:do_loop()
    self:loop()
    if self.skill_status == S_RUNNING then
        local all_final = true
        for _, entry in ipairs(self.skills) do
            if entry.status == S_RUNNING then
                entry.status = entry[1](entry.__args)
                if entry.status == S_FAILED then
                    local reason = error_of(entry[1])
                    self.skill_status, self.skill_error, all_final = S_FAILED, reason ~= "" and reason or nil, false
                    break
                end
                all_final = all_final and entry.status == S_FINAL
            end
        end
        if all_final then
            self.skill_status = S_FINAL
        end
    end
    self:run_loops()
    return self:try_transitions()
end

function SkillJumpState:do_exit()
    self:exit()
    for _, entry in ipairs(self.skills) do
        entry.__args, entry.status = nil, S_RUNNING
        entry[1].reset()
    end
end

function SkillJumpState:reset()
    slate.JumpState.reset(self)
    self:skill_reset()
    self.skill_status, self.skill_error = S_INACTIVE, nil
end

-- A state of an agent: it may name no state that follows, and a positional table has names of variables.
local AgentSkillExecJumpState = class("AgentSkillExecJumpState", SkillJumpState)

function AgentSkillExecJumpState:check_definition() end

function AgentSkillExecJumpState:positional_arguments(given, arguments)
    for key, variable in pairs(given) do
        arguments[key] = self.fsm.vars[variable]
    end
end

-- Machines of skills -----------------------------------------------------------------------------------------------

local SkillHSM = class("SkillHSM", slate.HSM)

function SkillHSM:new(o)
    local made = slate.HSM.new(self, o)
    if not o.no_default_states then
        made.exit_state, made.fail_state = "FINAL", "FAILED"
        made:define_states {
            export_to = o.export_to or slate.environment_of(),
            {"FINAL", slate.JumpState}, {"FAILED", slate.JumpState},
        }
    end
    return made
end

local AgentHSM = class("AgentHSM", SkillHSM)

for _, made in ipairs {SkillJumpState, AgentSkillExecJumpState, SkillHSM, AgentHSM} do
    slate[made.name], globals[made.name] = made, made
end
