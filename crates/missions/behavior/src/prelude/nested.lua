-- States with machines inside of them.
local slate = ...
local expect, class, pairs = slate.expect, slate.class, slate.pairs
local JumpState = slate.JumpState
local type, ipairs = type, ipairs

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

for _, made in ipairs {SubFSMJumpState, MultiSubFSMJumpState} do
    slate[made.name], slate.globals[made.name] = made, made
end
