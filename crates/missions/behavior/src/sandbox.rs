//! Lua without the world: limits, functions of the host, and the prelude.

use mlua::{Function, Lua, LuaOptions, MultiValue, StdLib, Table, Value};

use crate::files::SkillFiles;
use crate::meter::metered;
use crate::pattern::{LuaPatternError, PatternCapture, PatternMatch, PatternMatcher};

/// Files of the prelude, in their order.
const PRELUDE: [(&str, &str); 12] = [
    ("=host", include_str!("prelude/host.lua")),
    ("=sandbox", include_str!("prelude/sandbox.lua")),
    ("=pattern", include_str!("prelude/pattern.lua")),
    ("=library", include_str!("prelude/library.lua")),
    ("=state", include_str!("prelude/state.lua")),
    ("=jump_state", include_str!("prelude/jump_state.lua")),
    ("=machine", include_str!("prelude/machine.lua")),
    ("=nested", include_str!("prelude/nested.lua")),
    ("=modules", include_str!("prelude/modules.lua")),
    ("=skill", include_str!("prelude/skill.lua")),
    ("=interface", include_str!("prelude/interface.lua")),
    ("=mission", include_str!("prelude/mission.lua")),
];

/// Limits of what scripts use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BehaviorLimits {
    /// Tokens of Lua that are executed in a tick; loading has ten times as many.
    pub operations: u32,
    /// Memory of all scripts, bytes.
    pub memory: usize,
}

impl Default for BehaviorLimits {
    fn default() -> Self {
        Self { operations: 1_000_000, memory: 64 << 20 }
    }
}

/// Sandbox: Lua with the prelude, and the limits of a tick.
#[derive(Debug)]
pub struct Sandbox {
    lua: Lua,
    slate: Table,
}

impl Sandbox {
    /// Returns a sandbox with the prelude; scripts may read the files.
    pub fn new(files: &SkillFiles, limits: BehaviorLimits) -> mlua::Result<Self> {
        let libraries = StdLib::MATH | StdLib::STRING | StdLib::TABLE | StdLib::UTF8;
        let lua = Lua::new_with(libraries, LuaOptions::default())?;
        lua.set_memory_limit(limits.memory)?;
        let slate = lua.create_table()?;
        slate.set("native", native(&lua, files)?)?;
        for (name, text) in PRELUDE {
            lua.load(text).set_name(name).call::<()>(&slate)?;
        }
        Ok(Self { lua, slate })
    }

    pub fn lua(&self) -> &Lua {
        &self.lua
    }

    /// Returns a function of the prelude.
    pub fn function(&self, name: &str) -> mlua::Result<Function> {
        self.slate.get(name)
    }
}

/// Returns the file and line of the innermost script that runs.
/// For example `patrol.lua:12: `.
fn place(lua: &Lua) -> Option<String> {
    let at = |level| {
        lua.inspect_stack(level, |debug| {
            let source = debug.source().source.map(|source| source.into_owned());
            (source.unwrap_or_default(), debug.current_line())
        })
    };
    (0..).map_while(at).find_map(|(source, line)| {
        let file = source.strip_prefix('@')?;
        Some(format!("{file}:{}: ", line?))
    })
}

/// Returns the host functions of the prelude.
fn native(lua: &Lua, files: &SkillFiles) -> mlua::Result<Table> {
    let native = lua.create_table()?;
    let metered = |_: &Lua, text: mlua::LuaString| match text.to_str().map(|text| metered(&text)) {
        Ok(Ok(text)) => Ok((Some(text), None)),
        Ok(Err(reason)) => Ok((None, Some(reason))),
        Err(_) => Ok((None, Some("expected UTF-8".to_string()))),
    };
    native.set("metered", lua.create_function(metered)?)?;
    native.set("where", lua.create_function(|lua, ()| Ok(place(lua)))?)?;
    let own = files.clone();
    let read = move |_: &Lua, name: String| match own.read(&name) {
        Ok((text, short)) => Ok((Some(text), short)),
        Err(reason) => Ok((None, reason)),
    };
    native.set("read", lua.create_function(read)?)?;
    let own = files.clone();
    native.set("exists", lua.create_function(move |_, name: String| Ok(own.exists(&name)))?)?;
    native.set("math", mathematics(lua)?)?;
    native.set("nan", f64::NAN)?;
    native.set("match", lua.create_function(find_pattern)?)?;
    Ok(native)
}

/// Subject, pattern, where to start, where not to end, and the most steps.
type PatternCall = (mlua::LuaString, mlua::LuaString, usize, Option<usize>, u64);

/// Finds a pattern; returns the number of steps, the bounds and the captures.
/// Or an error in the pattern.
fn find_pattern(
    lua: &Lua,
    (subject, pattern, from, not_end, limit): PatternCall,
) -> mlua::Result<MultiValue> {
    let (subject, pattern) = (subject.as_bytes(), pattern.as_bytes());
    let mut matcher = PatternMatcher::new(&subject, &pattern, limit);
    let found = matcher.find(from.saturating_sub(1), not_end);
    let mut values = vec![Value::Integer(matcher.steps.min(i64::MAX as u64).cast_signed())];
    let text = |start, end| Ok::<Value, mlua::Error>(Value::String(lua.create_string(&subject[start..end])?));
    // Places count from 1.
    let place = |at: usize| Value::Integer(i64::try_from(at + 1).unwrap_or(i64::MAX));
    match found {
        Ok(Some(PatternMatch { bounds: (start, end), captures })) => {
            values.extend([place(start), Value::Integer(i64::try_from(end).unwrap_or(i64::MAX))]);
            if captures.is_empty() {
                values.push(text(start, end)?);
            }
            for capture in captures {
                values.push(match capture {
                    PatternCapture::Part(start, end) => text(start, end)?,
                    PatternCapture::Position(at) | PatternCapture::Open(at) => place(at),
                });
            }
        }
        // The steps say so.
        Ok(None) | Err(LuaPatternError::Limit) => {}
        Err(LuaPatternError::Malformed(reason)) => values.push(Value::String(lua.create_string(reason)?)),
    }
    Ok(values.into_iter().collect())
}

/// Function of real numbers.
type RealFunction = fn(f64) -> f64;

/// Functions of `math` whose results are the same on every machine.
fn mathematics(lua: &Lua) -> mlua::Result<Table> {
    let math = lua.create_table()?;
    let functions: [(&str, RealFunction); 10] = [
        ("sin", libm::sin),
        ("cos", libm::cos),
        ("tan", libm::tan),
        ("asin", libm::asin),
        ("acos", libm::acos),
        ("exp", libm::exp),
        ("sinh", libm::sinh),
        ("cosh", libm::cosh),
        ("tanh", libm::tanh),
        ("log10", libm::log10),
    ];
    for (name, body) in functions {
        math.set(name, lua.create_function(move |_, x: f64| Ok(body(x)))?)?;
    }
    let atan = |_: &Lua, (y, x): (f64, Option<f64>)| Ok(libm::atan2(y, x.unwrap_or(1.0)));
    math.set("atan", lua.create_function(atan)?)?;
    let log = |_: &Lua, (x, base): (f64, Option<f64>)| {
        Ok(match base {
            None => libm::log(x),
            Some(2.0) => libm::log2(x),
            Some(10.0) => libm::log10(x),
            Some(base) => libm::log(x) / libm::log(base),
        })
    };
    math.set("log", lua.create_function(log)?)?;
    math.set("pow", lua.create_function(|_, (x, y): (f64, f64)| Ok(libm::pow(x, y)))?)?;
    Ok(math)
}
