-- R2 visits three places and goes back. When something comes near, it stops for two seconds, once for each meeting.
module(..., skillenv.module_init)

name = "patrol"
fsm = SkillHSM:new{name = name, start = "LOCALIZE"}
depends_skills = {"visit"}

documentation = [==[Visits places, one after the other.

patrol{}
]==]

skillenv.skill_module(_M)

local PLACES = {{x = 1.4, y = 1.4}, {x = -1.4, y = 1.4}, {x = -1.4, y = -1.4}, {x = 0, y = 0}}

fsm:define_states{
    export_to = _M,
    closure = {places = PLACES},
    {"LOCALIZE", JumpState},
    {"VISIT", SkillJumpState, skills = {{visit}}, final_to = "NEXT", fail_to = "FAILED"},
    {"NEXT", JumpState},
}

fsm:add_transitions{
    {"LOCALIZE", "VISIT", cond = "conditions.localized"},
    {"NEXT", "FINAL", cond = "vars.place > #places", desc = "all places were visited"},
    {"NEXT", "VISIT", cond = true},
}

function LOCALIZE:init() self.fsm.vars.place = 1 end

function VISIT:init() self.args["visit"] = PLACES[self.fsm.vars.place] end

function NEXT:init() self.fsm.vars.place = self.fsm.vars.place + 1 end
