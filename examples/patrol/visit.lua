-- Goes to a place, and lets others pass.
module(..., skillenv.module_init)

name = "visit"
fsm = SkillHSM:new{name = name, start = "GO"}
depends_actions = {
    {
        v = "go_to",
        kind = "GoToOrigin",
        arguments = {"x", "y", "velocity", "tolerance"},
        defaults = {velocity = 0.4, tolerance = 0.1},
    },
}

documentation = [==[Goes to a place, and stops for two seconds when something is near.

visit{x = X, y = Y}   in the odometry frame, m
]==]

skillenv.skill_module(_M)

fsm:define_states{
    export_to = _M,
    {"GO", SkillJumpState, skills = {{go_to}}, final_to = "FINAL", fail_to = "FAILED"},
    {"LET_PASS", JumpState},
}

fsm:add_transitions{
    {"GO", "LET_PASS", cond = "conditions.obstacle and not vars.met", desc = "something is near"},
    {"LET_PASS", "GO", timeout = 2},
}

function GO:init() self.args.go_to = {x = self.fsm.vars.x, y = self.fsm.vars.y} end

function GO:loop()
    if not conditions.obstacle then
        self.fsm.vars.met = false
    end
end

function LET_PASS:init() self.fsm.vars.met = true end
