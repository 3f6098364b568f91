-- The robot as the prelude sees it: one function of the host, and the time of the tick.
local slate = ...
local native = slate.native
local dispatch, now = nil, 0

local PROGRESS = {[0] = "running", "succeeded", "failed", "preempted"}

function native.now() return now end
function native.log(level, text) dispatch(1, level, text) end
function native.condition(name) return dispatch(2, name) end
function native.start(index, numbers) return dispatch(3, index, numbers) end
function native.progress(index) return PROGRESS[dispatch(4, index)] end
function native.stop(index) dispatch(5, index) end

-- Random numbers are the host's, under the name and with the arguments of Lua's.
function math.random(low, high)
    local bits = dispatch(6)
    if not low then
        return (bits >> 11) * 2.0 ^ -53
    elseif not high then
        low, high = 1, low
    end
    local count = math.tointeger(high) - math.tointeger(low) + 1
    slate.expect(count > 0, "bad argument to 'random' (interval is empty)")
    return math.tointeger(low) + (bits >> 1) % count
end

-- Calls a function with a host, at a time, and lets scripts do so much.
function slate.enter(body, host, time, count, ...)
    dispatch, now = host, time
    slate.grant(count)
    return body(...)
end
