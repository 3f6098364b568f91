-- Functions that skill files expect: printing, mathematics, texts, tables, time.
local slate = ...
local globals, native = slate.globals, slate.native
local format, tostring, pairs, type = slate.format, slate.tostring, slate.pairs, type

local function printer(level)
    return function(text, ...)
        native.log(level, format(tostring(text), ...))
    end
end

local prints = {
    print_debug = printer("debug"),
    print_info = printer("info"),
    print_warn = printer("warn"),
    print_error = printer("error"),
    printf = printer("info"),
}
function prints.print(...)
    local parts = table.pack(...)
    for index = 1, parts.n do
        parts[index] = tostring(parts[index])
    end
    native.log("info", table.concat(parts, ", "))
end
slate.prints = prints
for name, body in pairs(prints) do
    globals[name] = body
end

globals.logger = {}
for _, level in ipairs {"debug", "info", "warn", "error"} do
    globals.logger["log_" .. level] = function(_, text)
        native.log(level, tostring(text))
    end
end

local tau = 2 * math.pi
math.nan = native.nan
function math.isnan(value) return value ~= value end
function math.round(value)
    return value < 0 and math.ceil(value - 0.5) or math.floor(value + 0.5)
end
function math.sign(value)
    return value == 0 and 0 or (value > 0 and 1 or -1)
end
function math.vec_length(x, y) return math.sqrt(x * x + y * y) end
function math.cart2polar2d(x, y) return math.atan(y, x), math.vec_length(x, y) end
function math.polar2cart2d(phi, distance) return distance * math.cos(phi), distance * math.sin(phi) end
function math.normalize_mirror_rad(angle)
    if angle >= -math.pi and angle <= math.pi then
        return angle
    end
    return angle - tau * math.round(angle / tau)
end
function math.normalize_rad(angle)
    if angle >= 0 and angle < tau then
        return angle
    end
    return angle - tau * math.floor(angle / tau)
end
function math.deg2rad(angle) return angle * math.pi / 180 end
function math.rad2deg(angle) return angle * 180 / math.pi end
function math.angle_distance(one, other)
    return math.abs(math.normalize_mirror_rad(one - other))
end

function string.join(separator, parts)
    local texts = {}
    for index, part in ipairs(parts) do
        texts[index] = tostring(part)
    end
    return table.concat(texts, separator)
end
function string.split(text, separator)
    local parts, from = {}, 1
    if separator == "" then
        return {text}
    end
    while true do
        local first, last = string.find(text, separator, from, true)
        parts[#parts + 1] = string.sub(text, from, (first or 0) - 1)
        if not first then
            return parts
        end
        from = last + 1
    end
end

function table.deepcopy(original, with_metatable)
    local copy = {}
    for key, value in pairs(original) do
        copy[key] = type(value) == "table" and table.deepcopy(value, with_metatable) or value
    end
    return with_metatable and setmetatable(copy, getmetatable(original)) or copy
end

-- Names of Lua 5.1 that 5.4 has dropped.
math.atan2 = math.atan
math.mod = math.fmod
function table.getn(list) return #list end
table.maxn = table.getn
function table.foreach(all, body)
    for key, value in pairs(all) do
        body(key, value)
    end
end

-- A point in time, nanoseconds since the start of the agent's clock.
local Time = {name = "Time"}
Time.__index = Time
slate.Time = Time
function Time:new(seconds, microseconds)
    local nanoseconds = native.now()
    if seconds then
        nanoseconds = math.floor(seconds * 1e9) + math.floor((microseconds or 0) * 1e3)
    end
    return setmetatable({nanoseconds = nanoseconds}, Time)
end
function Time:stamp()
    self.nanoseconds = native.now()
    return self
end
function Time:in_sec() return self.nanoseconds / 1e9 end
function Time:in_msec() return self.nanoseconds // 1000000 end
function Time:in_usec() return self.nanoseconds // 1000 end
function Time:get_sec() return self.nanoseconds // 1000000000 end
function Time:get_msec() return self.nanoseconds // 1000000 end
function Time:get_usec() return self.nanoseconds % 1000000000 // 1000 end
function Time.__sub(one, other) return (one.nanoseconds - other.nanoseconds) / 1e9 end
function Time.__eq(one, other) return one.nanoseconds == other.nanoseconds end
function Time.__lt(one, other) return one.nanoseconds < other.nanoseconds end
function Time.__le(one, other) return one.nanoseconds <= other.nanoseconds end

local fawkes = {Time = Time, logprint = prints}
globals.fawkes = fawkes
globals.Time = Time

-- The clock of the agent under the names of Lua's library.
slate.clock = {
    time = function() return native.now() // 1000000000 end,
    difftime = function(later, earlier) return later - earlier end,
}

-- A condition of the robot: true, false, or nil while nobody has told it.
globals.conditions = setmetatable({}, {
    __index = function(_, name) return native.condition(tostring(name)) end,
    __newindex = function() error("conditions are set by the robot", 2) end,
    __metatable = false,
})
