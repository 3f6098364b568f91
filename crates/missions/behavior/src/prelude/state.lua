-- State of a mission as plain data: what has changed in known objects since they were loaded.
local slate = ...
local expect, pairs, tostring = slate.expect, slate.pairs, slate.tostring
local type, next, rawget, rawset, getmetatable, setmetatable = type, next, rawget, rawset, getmetatable, setmetatable

-- Objects by name, in the order in which they were made.
local objects, names, order = {}, {}, {}
-- What each object had after loading.
local initial = {}

-- Gives an object the name by which a state refers to it; a second one of that name gets a number.
function slate.register(name, object)
    if names[object] then
        return
    end
    local number, unique = 1, name
    while objects[unique] do
        number = number + 1
        unique = name .. "#" .. number
    end
    objects[unique], names[object] = object, unique
    order[#order + 1] = unique
end

-- A copy of a table of plain data, or nothing where it has functions.
local function plain_copy(value, depth)
    if names[value] or getmetatable(value) ~= nil or depth > 32 then
        return nil
    end
    local copy = {}
    for key, own in next, value do
        local kind = type(own)
        if kind == "table" and not names[own] then
            own = plain_copy(own, depth + 1)
        end
        if own == nil or kind == "function" or kind == "userdata" then
            return nil
        end
        copy[key] = own
    end
    return copy
end

local function is_same(one, other)
    if one == other or one ~= one and other ~= other then
        return math.type(one) == math.type(other)
    elseif type(one) ~= "table" or type(other) ~= "table" or names[one] or getmetatable(one) then
        return false
    end
    for key, value in next, one do
        if not is_same(value, other[key]) then
            return false
        end
    end
    for key in next, other do
        if one[key] == nil then
            return false
        end
    end
    return true
end

-- Keeps what all objects have now.
function slate.keep_initial()
    for _, name in ipairs(order) do
        local fields = {}
        for key, value in next, objects[name] do
            local copy = type(value) == "table" and not names[value] and plain_copy(value, 0) or nil
            fields[key] = {value = value, copy = copy}
        end
        initial[name] = fields
    end
end

local function place_of(place, key)
    return place .. "." .. (type(key) == "table" and (names[key] or "table") or tostring(key))
end

local function encoded(value, seen, place)
    local kind = type(value)
    if kind == "table" then
        if names[value] then
            return {"reference", names[value]}
        elseif seen[value] then
            return {"same", seen[value]}
        end
        seen.count = seen.count + 1
        seen[value] = seen.count
        local meta = getmetatable(value)
        expect(meta == nil or names[meta], "%s has a metatable that is no class of the engine, so it can't be " ..
               "saved; keep plain data there", place)
        local text = {"table", seen.count, meta and names[meta] or ""}
        for _, key in ipairs(slate.ordered_keys(value)) do
            text[#text + 1] = encoded(key, seen, place)
            text[#text + 1] = encoded(rawget(value, key), seen, place_of(place, key))
        end
        return text
    end
    expect(kind ~= "function" and kind ~= "userdata", "%s is a %s, which can't be saved; keep plain data there", place,
           kind)
    return value
end

-- Variables of files may be functions that the file makes anew.
local function is_file(name) return name:match("^file:") ~= nil or name == "globals" end

local function changed_fields(name, seen, list)
    local object, before = objects[name], initial[name] or {}
    for _, key in ipairs(slate.ordered_keys(object)) do
        local value = rawget(object, key)
        local own = before[key]
        local is_changed = not own or not is_same(value, own.copy or own.value)
        if is_changed and not (is_file(name) and type(value) == "function") then
            list[#list + 1] = {name, encoded(key, seen, name), encoded(value, seen, place_of(name, key))}
        end
    end
    for key in pairs(before) do
        if rawget(object, key) == nil then
            list[#list + 1] = {name, encoded(key, seen, name)}
        end
    end
end

function slate.save()
    slate.grant()
    local list, seen = {}, {count = 0}
    for _, name in ipairs(order) do
        changed_fields(name, seen, list)
    end
    return list
end

local function decoded(value, seen, target)
    if type(value) ~= "table" then
        return value
    end
    local kind, what = value[1], value[2]
    if kind == "reference" then
        return objects[what]
    elseif kind == "same" then
        return seen[what]
    end
    local made = target or {}
    seen[what] = made
    for key in next, made do
        made[key] = nil
    end
    for index = 4, #value, 2 do
        local key = decoded(value[index], seen)
        if key ~= nil then
            made[key] = decoded(value[index + 1], seen)
        end
    end
    return value[3] ~= "" and setmetatable(made, objects[value[3]]) or made
end

-- The states that a saved state is in must exist: a run can't go on elsewhere.
local function check_states(list)
    for _, change in ipairs(list) do
        local name, key, value = change[1], change[2], change[3]
        if key == "current" and type(value) == "table" then
            expect(objects[name], "the state machine `%s` runs and does not exist any more", name)
            expect(objects[value[2]], "`%s` is where the mission is, and does not exist any more", value[2])
        end
    end
end

-- Applies a saved state to objects that were loaded and have not run.
function slate.restore(list)
    slate.grant()
    check_states(list)
    local seen = {}
    for _, change in ipairs(list) do
        local name, value = change[1], change[3]
        local object, key = objects[name], decoded(change[2], seen)
        if object and key ~= nil then
            local own = initial[name] and initial[name][key]
            local target = own and own.copy and type(value) == "table" and value[1] == "table" and own.value or nil
            rawset(object, key, decoded(value, seen, target))
        elseif type(value) == "table" then
            -- Others may refer to a table in it.
            decoded(value, seen)
        end
    end
end
