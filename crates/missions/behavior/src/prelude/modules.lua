-- Files of scripts: `require` within the skill path, and `module` as Lua 5.1 has it.
local slate = ...
local globals, native, expect, pairs = slate.globals, slate.native, slate.expect, slate.pairs
local type, setmetatable, rawset, rawget = type, setmetatable, rawset, rawget

-- What `require` has returned for each name, and the names that are being loaded.
local loaded, loading = {}, {}
-- Environment of each file, by its name and in the order of loading.
slate.environments, slate.environment_names = {}, {}
-- Environments that are being filled, the innermost last.
local stack = {}

function slate.provide(name, module) loaded[name] = module end

-- Makes a module reachable as `a.b.c`, unless something else has the name.
local function publish(name, module)
    local at = globals
    for part, is_last in string.gmatch(name, "([^.]+)(%.?)") do
        local known = rawget(at, part)
        if is_last == "" then
            if known == nil then
                rawset(at, part, module)
            end
        elseif known == nil then
            known = {}
            rawset(at, part, known)
        elseif type(known) ~= "table" then
            return
        end
        at = known
    end
end

-- An environment whose variables are a module's, and which sees those of all.
local function environment_of_file(name)
    local inherited = setmetatable({}, {__index = globals})
    local environment = setmetatable({}, {__index = inherited})
    slate.inherited[environment] = inherited
    rawset(environment, "module", function(own, ...)
        rawset(environment, "module", nil)
        environment._NAME, environment._M = own, environment
        environment._PACKAGE = string.match(own, "^(.*%.)") or ""
        loaded[own] = environment
        publish(own, environment)
        for index = 1, select("#", ...) do
            local option = select(index, ...)
            expect(type(option) == "function", "module `%s`: expected functions as options", own)
            option(environment)
        end
    end)
    slate.environments[name] = environment
    table.insert(slate.environment_names, name)
    return environment
end
slate.inherited = {}

-- The machine's file, while it is being loaded.
function slate.environment_of() return stack[#stack] end

-- Runs a file in an environment of its own, or in that of all.
function slate.run_file(name, environment)
    local text, place = native.read(name)
    expect(text, "%s", place)
    local chunk, reason = slate.load(text, "@" .. place, "t", environment or environment_of_file(name))
    if not chunk then
        error(reason, 0)
    end
    environment = environment or slate.environments[name]
    table.insert(stack, environment)
    loading[name] = true
    local result = chunk(name)
    loading[name] = nil
    table.remove(stack)
    return result, environment
end

function slate.is_loading_module(name) return loading[name] end

function slate.require(name)
    expect(type(name) == "string", "expected the name of a module, found a %s", type(name))
    if loaded[name] ~= nil then
        return loaded[name]
    end
    expect(not loading[name], "module `%s` requires itself", name)
    expect(slate.is_loading, "module `%s` is required while the mission runs; require it at the start of the " ..
           "file", name)
    local result, environment = slate.run_file(name)
    if result ~= nil then
        loaded[name] = result
    elseif loaded[name] == nil then
        loaded[name] = rawget(environment, "_M") or true
    end
    slate.finish_module(loaded[name])
    return loaded[name]
end
globals.require = slate.require
globals.package = {seeall = function() end}
globals.module = function() slate.expect(false, "`module` belongs to the start of a file, once") end
