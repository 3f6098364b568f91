-- What scripts see of Lua: no files, no processes, no clock, no addresses, and a fixed order of `pairs`.
local slate = ...
local native = slate.native

local raw_next, raw_pcall, raw_load, raw_tostring = next, pcall, load, tostring
local raw_format, find, gmatch = string.format, string.find, string.gmatch
local getmetatable, rawget, select, type, error = getmetatable, rawget, select, type, error
local pack, unpack, sort = table.pack, table.unpack, table.sort

-- Raises an error with the place in the script, unless something holds.
local function expect(is_fine, text, ...)
    if not is_fine then
        error((native.where() or "") .. slate.format(text, ...), 0)
    end
end
slate.expect = expect

-- What the scripts may still do in this tick, in tokens of Lua that are executed.
local left, granted = math.maxinteger, math.maxinteger

-- Without a count, the prelude works for the host.
function slate.grant(count)
    left, granted = count or math.maxinteger, count
end

local function meter(count)
    left = left - count
    if left < 0 then
        expect(false, "the script was stopped after %d operations; expected fewer in a tick (ten times as many " ..
               "while the files are loaded)", granted)
    end
end
slate.meter = meter

function slate.left() return left > 0 and left or 0 end

local ranks = {number = 1, string = 2, boolean = 3}

-- Text by which a key is ordered that is no number, text or boolean.
local function label(key)
    local name = type(key) == "table" and rawget(key, "name")
    if type(name) == "string" then
        return name
    end
    error("the order of keys that are a " .. type(key) .. " is not fixed; expected numbers, texts or booleans, " ..
          "or tables with a `name`", 0)
end

local function comes_before(one, other)
    local own, its = ranks[type(one)] or 4, ranks[type(other)] or 4
    if own ~= its then
        return own < its
    elseif own == 3 then
        return other and not one
    elseif own == 4 then
        one, other = label(one), label(other)
    end
    return one < other
end

-- Keys of a table: numbers, texts, booleans, then tables by their names.
local function ordered_keys(all)
    local keys, count, kind, is_list = {}, 0, nil, true
    for key in raw_next, all do
        count = count + 1
        keys[count] = key
        local own = ranks[type(key)] or 4
        if kind == nil then
            kind = own
        elseif kind ~= own then
            kind = 4
        end
        is_list = is_list and key == count
    end
    meter(count)
    if not is_list then
        if kind == 1 or kind == 2 then
            sort(keys)
        else
            sort(keys, comes_before)
        end
    end
    return keys
end
slate.ordered_keys = ordered_keys

local function pairs(all)
    local meta = getmetatable(all)
    if meta and meta.__pairs then
        return meta.__pairs(all)
    elseif type(all) ~= "table" then
        error("bad argument #1 to 'pairs' (table expected, got " .. type(all) .. ")", 2)
    end
    local keys, index = ordered_keys(all), 0
    return function()
        local value
        repeat
            index = index + 1
            local key = keys[index]
            if key == nil then
                return nil
            end
            value = rawget(all, key)
        until value ~= nil
        return keys[index], value
    end, all, nil
end
slate.pairs = pairs

-- The traversal that `next` is in.
local traversed, traversed_keys, position

-- A traversal does not outlive a tick: a resumed run would not have it.
function slate.forget_traversal()
    traversed, traversed_keys = nil, nil
end

local function next(all, key)
    if raw_next(all) == nil then
        return nil
    end
    if key == nil or traversed ~= all or traversed_keys[position] ~= key then
        traversed, traversed_keys, position = all, ordered_keys(all), 0
        while key ~= nil and traversed_keys[position] ~= key do
            position = position + 1
            if position > #traversed_keys then
                error("invalid key to 'next'", 2)
            end
        end
    end
    repeat
        position = position + 1
        key = traversed_keys[position]
    until key == nil or rawget(all, key) ~= nil
    if key ~= nil then
        return key, rawget(all, key)
    end
end

-- Addresses differ from run to run, so they are left out.
local function tostring(value)
    local kind = type(value)
    if kind == "table" then
        local meta = getmetatable(value)
        if meta and meta.__tostring then
            return meta.__tostring(value)
        end
        return kind
    elseif kind == "function" or kind == "thread" then
        return kind
    end
    -- The sign of what is no number differs between machines.
    return value ~= value and "nan" or raw_tostring(value)
end
slate.tostring = tostring

local function format(text, ...)
    local values = pack(...)
    local index = 0
    for conversion in gmatch(text, "%%[-+ #0-9.]*(.)") do
        if conversion ~= "%" then
            index = index + 1
        end
        if conversion == "p" then
            error("invalid conversion '%p' to 'format': addresses differ from run to run", 2)
        elseif conversion == "s" then
            values[index] = index <= values.n and tostring(values[index]) or nil
        elseif values[index] ~= values[index] then
            values[index] = native.nan
        end
    end
    return raw_format(text, unpack(values, 1, values.n))
end
slate.format = format
string.format, string.dump = format, nil
getmetatable("").__metatable = false

-- A script that has reached a limit can't go on by catching the error.
local function checked(is_fine, ...)
    if not is_fine and (left < 0 or (...) == "not enough memory") then
        error((...), 0)
    end
    return is_fine, ...
end

slate.checked = checked

local function pcall(body, ...)
    return checked(raw_pcall(body, ...))
end
slate.pcall = pcall

local function handled(handler, is_fine, ...)
    if is_fine then
        return true, ...
    end
    return false, handler(...)
end

local function xpcall(body, handler, ...)
    return handled(handler, pcall(body, ...))
end

local globals = {}
slate.globals = globals

local function load(chunk, name, mode, environment)
    if type(chunk) ~= "string" then
        return nil, "expected a text of Lua to load"
    end
    environment = environment == nil and globals or environment
    -- What is wrong with it is said about the text as it is.
    local script, reason = raw_load(chunk, name or "=text", "t", environment)
    if script then
        local text
        text, reason = native.metered(chunk)
        script = text and raw_load(text, name or "=text", "t", environment)(meter)
    end
    return script, reason
end
slate.load = load

local function set_metatable(value, meta)
    if meta and (rawget(meta, "__gc") ~= nil or rawget(meta, "__mode") ~= nil) then
        error("a metatable with `__gc` or `__mode` is refused: when garbage is collected is not fixed", 2)
    end
    return setmetatable(value, meta)
end

-- Functions of C are not interrupted, so their loops are bounded before they begin.
local LONGEST = 10000000
local function bounded(name)
    local body = table[name]
    table[name] = function(list, ...)
        if type(list) == "table" then
            if #list > LONGEST then
                error("the table is too long for table." .. name, 2)
            end
            meter(#list >> 4)
        end
        for index = 1, select("#", ...) do
            local bound = select(index, ...)
            if name ~= "insert" and type(bound) == "number" and (bound > LONGEST or bound < -LONGEST) then
                error("bounds of table." .. name .. " are at most " .. LONGEST, 2)
            end
        end
        return body(list, ...)
    end
end
for _, name in ipairs {"concat", "insert", "move", "remove", "unpack"} do
    bounded(name)
end

local function is_less(one, other) return one < other end

local function merge(from, to, first, middle, last, comes_first)
    local left, right = first, middle + 1
    for index = first, last do
        if right > last or left <= middle and not comes_first(from[right], from[left]) then
            to[index], left = from[left], left + 1
        else
            to[index], right = from[right], right + 1
        end
    end
end

-- Sorts by merging, and keeps the order of equal elements: that of Lua's own sort depends on the clock.
function table.sort(list, comes_first)
    comes_first = comes_first or is_less
    local count = #list
    local from, to, width = {}, {}, 1
    meter(8 * count)
    for index = 1, count do
        from[index] = list[index]
    end
    while width < count do
        for first = 1, count, 2 * width do
            local middle, last = math.min(first + width - 1, count), math.min(first + 2 * width - 1, count)
            merge(from, to, first, middle, last, comes_first)
        end
        from, to, width = to, from, 2 * width
    end
    for index = 1, count do
        list[index] = from[index]
    end
end

for name, body in raw_next, native.math do
    math[name] = body
end
math.randomseed = function() end

for _, name in ipairs {
    "assert", "error", "getmetatable", "ipairs", "rawequal", "rawget", "rawlen", "rawset", "select", "tonumber",
    "type", "_VERSION", "math", "string", "table", "utf8"
} do
    globals[name] = _G[name]
end
globals._G = globals
globals.pairs, globals.next, globals.tostring = pairs, next, tostring
globals.pcall, globals.xpcall = pcall, xpcall
globals.load, globals.loadstring, globals.setmetatable = load, load, set_metatable
globals.unpack = table.unpack
globals.debug = {traceback = function(message) return message end}
