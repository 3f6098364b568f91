-- Functions of texts with patterns, whose matches take from the budget of the tick.
local slate = ...
local native, meter, tostring = slate.native, slate.meter, slate.tostring
local plain_find, sub, pack = string.find, string.sub, table.pack
local type, error, select = type, error, select

-- Another build of Lua has no such matcher.
if not native.match then
    return
end

-- Bounds and captures of the first match, or nothing.
local function match(text, pattern, from, not_end)
    local function counted(steps, first, ...)
        meter(steps)
        if type(first) == "string" then
            error(first, 0)
        end
        return first, ...
    end
    return counted(native.match(text, pattern, from, not_end, slate.left()))
end

local function start_of(text, from)
    from = from or 1
    if from < 0 then
        from = #text + from + 1
    end
    return from < 1 and 1 or from
end

local function checked_text(value, name)
    if type(value) == "number" then
        return tostring(value)
    elseif type(value) ~= "string" then
        error("bad argument #1 to '" .. name .. "' (string expected, got " .. type(value) .. ")", 3)
    end
    return value
end

local function found(first, last, is_plain, ...)
    if first then
        if is_plain then
            return first, last
        end
        return first, last, ...
    end
end

-- Without captures the matcher returns the whole match in their place, which `find` leaves out.
function string.find(text, pattern, from, is_plain)
    text, pattern = checked_text(text, "find"), checked_text(pattern, "find")
    from = start_of(text, from)
    if from > #text + 1 then
        return nil
    elseif is_plain or not plain_find(pattern, "[%^%$%*%+%?%.%(%[%%%-]") then
        meter(#text >> 4)
        return plain_find(text, pattern, from, true)
    end
    local has_captures = plain_find(pattern, "(", 1, true)
    local function bounds(first, last, ...)
        return found(first, last, not has_captures, ...)
    end
    return bounds(match(text, pattern, from))
end

local function captures(first, _, ...)
    if first then
        return ...
    end
    return nil
end

function string.match(text, pattern, from)
    text, pattern = checked_text(text, "match"), checked_text(pattern, "match")
    from = start_of(text, from)
    if from > #text + 1 then
        return nil
    end
    return captures(match(text, pattern, from))
end

function string.gmatch(text, pattern, from)
    text, pattern = checked_text(text, "gmatch"), checked_text(pattern, "gmatch")
    from = start_of(text, from)
    -- An anchor is none here.
    if sub(pattern, 1, 1) == "^" then
        pattern = "%" .. pattern
    end
    local last_end
    local function next_match(first, last, ...)
        if not first then
            from = #text + 2
            return nil
        end
        from, last_end = last + 1, last
        return ...
    end
    return function()
        if from > #text + 1 then
            return nil
        end
        return next_match(match(text, pattern, from, last_end))
    end
end

local function replaced(replacement, whole, ...)
    local kind, value = type(replacement), nil
    if kind == "function" then
        value = replacement(...)
    elseif kind == "table" then
        value = replacement[(...)]
    else
        local own = pack(...)
        local pieces, at = {}, 1
        while true do
            local percent = plain_find(replacement, "%", at, true)
            pieces[#pieces + 1] = sub(replacement, at, (percent or 0) - 1)
            if not percent then
                break
            end
            local digit = sub(replacement, percent + 1, percent + 1)
            local index = math.tointeger(digit)
            if digit == "%" then
                pieces[#pieces + 1] = "%"
            elseif not index then
                error("invalid use of '%' in replacement string", 0)
            elseif index > own.n then
                error("invalid capture index %" .. index, 0)
            else
                pieces[#pieces + 1] = index == 0 and whole or tostring(own[index])
            end
            at = percent + 2
        end
        return table.concat(pieces)
    end
    if not value then
        return whole
    elseif type(value) ~= "string" and type(value) ~= "number" then
        error("invalid replacement value (a " .. type(value) .. ")", 0)
    end
    return tostring(value)
end

function string.gsub(text, pattern, replacement, most)
    text, pattern = checked_text(text, "gsub"), checked_text(pattern, "gsub")
    local kind = type(replacement)
    if kind ~= "string" and kind ~= "number" and kind ~= "table" and kind ~= "function" then
        error("bad argument #3 to 'gsub' (string/function/table expected, got " .. kind .. ")", 2)
    end
    replacement = kind == "number" and tostring(replacement) or replacement
    local pieces, from, count, last_end = {}, 1, 0, nil
    local is_anchored = sub(pattern, 1, 1) == "^"
    local function taken(first, last, ...)
        if not first then
            return false
        end
        pieces[#pieces + 1] = sub(text, from, first - 1)
        pieces[#pieces + 1] = replaced(replacement, sub(text, first, last), ...)
        count, from, last_end = count + 1, last + 1, last
        return true
    end
    while (not most or count < most) and from <= #text + 1 do
        if not taken(match(text, pattern, from, last_end)) or is_anchored then
            break
        end
    end
    pieces[#pieces + 1] = sub(text, from)
    return table.concat(pieces), count
end
