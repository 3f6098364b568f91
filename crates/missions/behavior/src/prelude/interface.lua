-- Interfaces of the blackboard: values and messages that a mission's files name, and predicates about them.
local slate = ...
local globals, native, expect = slate.globals, slate.native, slate.expect
local pairs, tostring, class = slate.pairs, slate.tostring, slate.class
local type, setmetatable, rawget, rawset, getmetatable = type, setmetatable, rawget, rawset, getmetatable

local interfaces, order = {}, {}

-- Message --------------------------------------------------------------------------------------------------------

local Message = class("Message")

function Message:new(kind, ...)
    local made = {kind = kind, values = {}}
    for index = 1, select("#", ...) do
        made.values[kind.fields[index] or index] = (select(index, ...))
    end
    return setmetatable(made, Message)
end

Message.__index = function(message, key)
    local own = rawget(Message, key)
    if own ~= nil then
        return own
    end
    local set = string.match(key, "^set_(.*)$")
    if set then
        return function(_, value) message.values[set] = value end
    end
    return function() return message.values[key] end
end

-- Interface ------------------------------------------------------------------------------------------------------

local Interface = class("Interface")

-- A message that is not named has its values by their places.
local function unnamed_message(interface, key)
    local name = string.match(key, "^(.+)Message$")
    if not name then
        -- A constant that is not named is nil, as in Fawkes.
        expect(string.match(key, "^%u") or key == "action", "`%s` has no `%s`: name it among the `fields` of " ..
               "interface{...}", rawget(interface, "identifier"), key)
        return nil
    end
    local kind = {name = name, fields = {}}
    return {name = key, new = function(_, ...) return Message:new(kind, ...) end}
end

Interface.__index = function(interface, key)
    local own = rawget(Interface, key)
    if own ~= nil or type(key) ~= "string" then
        return own
    end
    return unnamed_message(interface, key)
end

local function accessor(name)
    return function(interface) return interface:value(name) end
end

-- Gives an interface a function for each of its fields.
function Interface:define_field(name, definition)
    local is_table = type(definition) == "table"
    local initial = definition
    if is_table then
        initial = definition[1]
    end
    self.values[name] = initial
    self.units[name] = is_table and definition.unit or nil
    self.sources[name] = is_table and definition.condition or nil
    if rawget(Interface, name) == nil then
        self[name] = accessor(name)
    end
    if type(initial) == "boolean" or self.sources[name] then
        self["is_" .. name] = accessor(name)
    end
    self["set_" .. name] = function(interface, value) interface.values[name] = value end
end

function Interface:define_message(name, definition)
    local kind = {name = name, fields = {}, is_stop = definition.stop == true}
    for index, field in ipairs(definition) do
        kind.fields[index] = field
    end
    if definition.action then
        kind.action = slate.Action:new(self.identifier, {
            v = name, kind = definition.action, arguments = definition.arguments or kind.fields,
            defaults = definition.defaults,
        })
    end
    self[name .. "Message"] = {
        name = name .. "Message", new = function(_, ...) return Message:new(kind, ...) end,
    }
end

-- Names an interface: its type and id, its fields, constants and messages.
function globals.interface(definition)
    expect(type(definition) == "table" and type(definition.type) == "string" and type(definition.id) == "string",
           "an interface needs a `type` and an `id`")
    local identifier = definition.type .. "::" .. definition.id
    expect(not interfaces[identifier], "the interface `%s` is named twice", identifier)
    local made = setmetatable({
        name = identifier, identifier = identifier, values = {}, units = {}, sources = {}, newest = 0,
        has_a_writer = definition.writer ~= false,
    }, Interface)
    for name, field in pairs {msgid = 0, final = true, error_code = 0} do
        made:define_field(name, field)
    end
    for name, field in pairs(definition.fields or {}) do
        made:define_field(name, field)
    end
    for name, value in pairs(definition.constants or {}) do
        made[name] = value
    end
    for name, message in pairs(definition.messages or {}) do
        made:define_message(name, message)
    end
    interfaces[identifier] = made
    order[#order + 1] = made
    slate.register("interface:" .. identifier, made)
    slate.register("values:" .. identifier, made.values)
end

function Interface:value(name)
    local source = self.sources[name]
    if source then
        return native.condition(source) == true
    end
    return self.values[name]
end

function Interface:has_writer() return self.has_a_writer end
function Interface:is_valid() return true end
function Interface:read() end
function Interface:write() end
function Interface:changed() return true end
function Interface:id() return string.match(self.identifier, "::(.*)$") end
function Interface:type() return string.match(self.identifier, "^(.-)::") end
function Interface:uid() return self.identifier end
function Interface:unit(name) return self.units[name] end

-- Takes a message; returns its number. One that is an action starts it, and stops the one before.
function Interface:msgq_enqueue(message)
    expect(type(message) == "table" and getmetatable(message) == Message, "expected a message of `%s`", self.identifier)
    self.newest = self.newest + 1
    local action = message.kind.action
    if action or message.kind.is_stop then
        if self.action then
            self.action:stop()
            rawset(self, "action", nil)
        end
        self.values.msgid, self.values.final, self.values.error_code = self.newest, not action, 0
    end
    if action then
        if action:start(message.values) then
            self.action = action
        else
            self.values.final, self.values.error_code = true, 1
        end
    elseif not message.kind.is_stop then
        native.log("info", self.identifier .. " received " .. message.kind.name)
        self.values.msgid = self.newest
    end
    return self.newest
end
Interface.msgq_enqueue_copy = Interface.msgq_enqueue

-- Asks how far the actions of messages are, before the skills read it.
function slate.read_interfaces()
    for _, interface in ipairs(order) do
        local action = interface.action
        local progress = action and native.progress(action.index)
        if progress == "succeeded" or progress == "failed" then
            interface.values.final, interface.values.error_code = true, progress == "failed" and 1 or 0
            action.is_active, interface.action = false, nil
        end
    end
end

-- Returns an interface that a file depends on.
function slate.interface_of(definition, user)
    expect(type(definition) == "table" and definition.v and definition.type and definition.id,
           "an interface of `%s` needs `v`, `type` and `id`", user)
    local identifier = definition.type .. "::" .. definition.id
    expect(interfaces[identifier], "`%s` needs the interface `%s`: name it with interface{type = \"%s\", id = " ..
           "\"%s\"} " ..
           "in interfaces.lua beside the mission", user, identifier, definition.type, definition.id)
    return interfaces[identifier]
end

-- Configuration --------------------------------------------------------------------------------------------------

local configuration = {}
function globals.configuration(values)
    for path, value in pairs(values) do
        configuration[path] = value
    end
end
globals.config = {exists = function(_, path) return configuration[path] ~= nil end}
for _, kind in ipairs {"string", "float", "int", "uint", "bool"} do
    globals.config["get_" .. kind] = function(_, path)
        expect(configuration[path] ~= nil, "the configuration has no `%s`: give it with configuration{[\"%s\"] " ..
               "= ...} in interfaces.lua", tostring(path), tostring(path))
        return configuration[path]
    end
end

-- Transforms -----------------------------------------------------------------------------------------------------

local transformation
-- Sets the function that brings a pose {x, y, ori} from one frame into another.
function globals.transformation(body) transformation = body end
local function transform(pose, from, to)
    if from == to then
        return pose
    end
    expect(transformation, "no transform from `%s` to `%s`: give one with transformation(function(pose, from, " ..
           "to) ... end) in interfaces.lua", tostring(from), tostring(to))
    return transformation(pose, from, to)
end
local tfutils = {transform = transform, transform6D = transform}

-- Places ---------------------------------------------------------------------------------------------------------

local places = {}
local Place = class("Place")
local NavGraph = class("NavGraph")

function Place:is_valid() return self.is_known end
function Place:x() return self.properties.x end
function Place:y() return self.properties.y end
function Place:has_property(key) return self.properties[key] ~= nil end
function Place:property(key) return tostring(self.properties[key]) end
function Place:property_as_float(key) return tonumber(self.properties[key]) end
Place.property_as_int, Place.property_as_bool = Place.property_as_float, function(self, key)
    return self.properties[key] == true
end

function NavGraph:node(name)
    return setmetatable({name = name, is_known = places[name] ~= nil, properties = places[name] or {}}, Place)
end

-- Names places in the map, each with `x` and `y`, m, and what else is known about it.
function globals.places(definitions)
    for name, properties in pairs(definitions) do
        places[name] = properties
    end
    globals.navgraph = setmetatable({name = "navgraph"}, NavGraph)
    slate.register("navgraph", globals.navgraph)
end

-- Predicates -----------------------------------------------------------------------------------------------------

local libraries = {}
local predlib = {name = "predlib"}

-- Makes the functions of a module predicates: fields whose values hold for a tick.
function predlib.module_init(module)
    local inherited = slate.inherited[module]
    local predicates, values = {}, {}
    rawset(module, "predparams", {})
    rawset(module, "setup", function(parameters)
        for key, value in pairs(parameters) do
            module.predparams[key] = value
        end
    end)
    local meta = getmetatable(module)
    meta.__newindex = function(_, key, value)
        if type(value) == "function" then
            expect(not predicates[key], "the predicate `%s` is defined twice", key)
            predicates[key] = value
            return
        end
        rawset(module, key, value)
        if key == "depends_interfaces" then
            for _, definition in ipairs(value) do
                inherited[definition.v] = slate.interface_of(definition, module._NAME)
            end
        end
    end
    meta.__index = function(_, key)
        local predicate = predicates[key]
        if not predicate then
            return inherited[key]
        end
        if values[key] == nil then
            local value, is_kept = predicate()
            if is_kept == false then
                return value
            end
            values[key] = value
        end
        return values[key]
    end
    libraries[#libraries + 1] = {predicates = predicates, values = values}
    libraries[module] = predicates
end

function predlib.get_predfunc(module, name) return libraries[module] and libraries[module][name] end
function predlib.setup() end

function predlib.reset()
    for _, library in ipairs(libraries) do
        for key in next, library.values do
            library.values[key] = nil
        end
    end
end
slate.reset_predicates = predlib.reset

-- Modules of Fawkes that skill files require ------------------------------------------------------------------------

local function nothing() end
local modinit = {
    name = "modinit", module_init = nothing, register_all = nothing, register_global_funcs = nothing,
}
local fawkes = globals.fawkes
fawkes.modinit, fawkes.predlib, fawkes.tfutils = modinit, predlib, tfutils
fawkes.fsm = {
    FSM = slate.FSM, State = slate.State, JumpState = slate.JumpState,
    jumpstate = {JumpState = slate.JumpState},
    subfsmjumpstate = {SubFSMJumpState = slate.SubFSMJumpState},
    multi_subfsm_jumpstate = {MultiSubFSMJumpState = slate.MultiSubFSMJumpState},
    skill_jumpstate = {SkillJumpState = slate.SkillJumpState},
}
fawkes.hsm = {HSM = slate.HSM}
globals.skiller = {
    skillenv = globals.skillenv, skillstati = globals.skillstati, skillhsm = {SkillHSM = slate.SkillHSM},
    subskill_jumpstate = {SubSkillJumpState = slate.SkillJumpState},
}
globals.luaagent = {
    agentenv = globals.agentenv, agenthsm = {AgentHSM = slate.AgentHSM},
    jumpstates = {AgentSkillExecJumpState = slate.AgentSkillExecJumpState},
}
for _, name in ipairs {"depinit", "mathext", "stringext", "tableext", "envext"} do
    fawkes[name] = {name = name}
end
local function provide_all(prefix, modules)
    for name, module in pairs(modules) do
        if type(name) == "string" and type(module) == "table" then
            slate.provide(prefix .. "." .. name, module)
            if prefix == "fawkes" and name == "fsm" then
                provide_all("fawkes.fsm", module)
            end
        end
    end
end
provide_all("fawkes", fawkes)
provide_all("skiller", globals.skiller)
provide_all("luaagent", globals.luaagent)
