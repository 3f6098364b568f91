//! Events of robots in order: changes noticed, plans, actions.

use slate_sorted::SortedMap;

use super::table::{Table, seconds};
use crate::Route;
use slate_bag::Value;
use slate_ros_messages as ros;

/// Maximum number of rows; a recording of days could fill the memory.
const MAX_ROWS: usize = 100_000;

/// Decisions, and their reasons.
#[derive(Debug, Default)]
pub(super) struct Decisions {
    rows: Vec<Decision>,
    /// Rows that repeated events are added to, by robot, and by event.
    open: SortedMap<String, SortedMap<(&'static str, String), usize>>,
    left_out: u64,
}

#[derive(Debug)]
struct Decision {
    from: u64,
    until: u64,
    times: u64,
    robot: String,
    what: &'static str,
    detail: String,
    /// Distance to the nearest object at that time, meters.
    clearance: Option<f64>,
}

/// The last status of an Execute.
#[derive(Clone, Debug, Default)]
pub(super) struct Status {
    pub route: Option<Route>,
    pub running: String,
    ticket: f64,
    reflexes: f64,
    ended: f64,
    refused: f64,
    route_switches: f64,
    is_known: bool,
    wants_plan: bool,
}

impl Status {
    /// Returns true if the Execute has published a status.
    pub fn is_known(&self) -> bool {
        self.is_known
    }

    /// Reflexes, and changes of the route.
    pub fn counts(&self) -> [f64; 2] {
        [self.reflexes, self.route_switches]
    }
}

impl Decisions {
    /// Adds an event that happened `times` times; `time` in nanoseconds.
    pub fn add(
        &mut self,
        time: u64,
        robot: &str,
        what: &'static str,
        detail: String,
        times: u64,
        clearance: Option<f64>,
    ) {
        let open = self.open.entry(robot.to_owned()).or_default();
        let key = (what, detail);
        if let Some(row) = open.get(&key).and_then(|row| self.rows.get_mut(*row)) {
            row.until = time;
            row.times += times;
            return;
        }
        if self.rows.len() >= MAX_ROWS {
            self.left_out += times;
            return;
        }
        open.insert(key.clone(), self.rows.len());
        let (robot, detail) = (robot.to_owned(), key.1);
        self.rows.push(Decision { from: time, until: time, times, robot, what, detail, clearance });
    }

    /// Adds an event that happened once, in a row of its own.
    pub fn row(&mut self, time: u64, robot: &str, what: &'static str, detail: String) {
        self.cut(robot);
        self.add(time, robot, what, detail, 1, None);
    }

    /// Sorts the events by the time of their beginning.
    pub fn sort(&mut self) {
        self.open.clear();
        self.rows.sort_by_key(|row| row.from);
    }

    /// Begins a new row for the next event.
    fn cut(&mut self, robot: &str) {
        self.open.remove(robot);
    }

    /// Notes the changes of an Execute's status since the previous one.
    pub fn status(
        &mut self,
        time: u64,
        robot: &str,
        value: &Value,
        names: &Names,
        last: &mut Status,
        clearance: Option<f64>,
    ) {
        let number = |name: &str| value.number(name).unwrap_or_default();
        let text = |name: &str| value.text(name).unwrap_or_default();
        let more = |now: f64, before: f64| if now > before { (now - before) as u64 } else { 0 };
        let mut now = Status {
            route: names.route(number("route")),
            running: text("running"),
            ticket: number("ticket"),
            reflexes: number("reflexes"),
            refused: number("refused"),
            route_switches: number("route_switches"),
            wants_plan: number("replan") != 0.0,
            ended: last.ended,
            is_known: true,
        };
        if now.route != last.route || now.running != last.running || !last.is_known {
            self.cut(robot);
        }
        let mut add_event =
            |what, detail: String, times| self.add(time, robot, what, detail, times, clearance);
        let reflexes = more(now.reflexes, last.reflexes);
        if reflexes > 0 {
            add_event("reflex", now.running.clone(), reflexes);
        }
        for i in 0..8 {
            let field = |name: &str| format!("ended/{i}/{name}");
            let Some(count) = value.number(&field("number")).filter(|count| *count > last.ended) else {
                continue;
            };
            // The latest stand last.
            now.ended = count;
            let ending = names.ending(value.number(&field("ending")).unwrap_or_default());
            add_event(
                "action ended",
                format!("{}: {ending}", value.text(&field("kind")).unwrap_or_default()),
                1,
            );
        }
        let refused = more(now.refused, last.refused);
        if refused > 0 {
            add_event("refused", "a message to Execute".into(), refused);
        }
        let planned = more(now.ticket, last.ticket);
        if planned > 0 {
            add_event("plan", "Execute took what the Plan sent".into(), planned);
        }
        if now.route != last.route && last.is_known {
            let name = |route: Option<Route>| route.map_or("idle", Route::name);
            add_event("route", format!("{} to {}", name(last.route), name(now.route)), 1);
        }
        if now.running != last.running && !now.running.is_empty() {
            add_event("action began", text("tree"), 1);
        }
        if now.wants_plan && !last.wants_plan {
            add_event("plan", "a new one is wanted".into(), 1);
        }
        *last = now;
    }

    pub fn table(&self) -> Table {
        let columns = ["#from/s", "#until/s", "#times", "robot", "what", "of what", "#clearance then/m"];
        let mut table = Table::new("decisions", &columns);
        for row in &self.rows {
            table.row([
                seconds(row.from),
                seconds(row.until),
                row.times.to_string(),
                row.robot.clone(),
                row.what.into(),
                row.detail.clone(),
                row.clearance.map(|meters| format!("{meters:.3}")).unwrap_or_default(),
            ]);
        }
        table
    }

    /// Returns the number of events that are not in the table.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }
}

/// Names of the numbers of a status, from its own definition.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    routes: SortedMap<i64, String>,
    endings: SortedMap<i64, String>,
}

impl Names {
    pub fn of(definition: &str) -> Self {
        Self { routes: constants(definition, "ROUTE_"), endings: constants(definition, "ENDING_") }
    }

    fn route(&self, number: f64) -> Option<Route> {
        match self.routes.get(&(number as i64)).map(String::as_str) {
            Some("deliberative") => Some(Route::Deliberative),
            Some("reactive") => Some(Route::Reactive),
            _ => None,
        }
    }

    fn ending(&self, number: f64) -> String {
        self.endings.get(&(number as i64)).cloned().unwrap_or_else(|| format!("ending {number}"))
    }
}

/// Formats a value in words: texts, booleans, and numbers that have names.
/// Measured numbers differ each time and are left out.
pub(super) fn format_value(value: &Value, definition: &str) -> String {
    let Value::Message(ros::Value::Map(map)) = value else { return String::new() };
    let words = map.iter().filter_map(|(name, value)| {
        let text = match value {
            ros::Value::Bool(is) => is.to_string(),
            ros::Value::Text(text) if !text.is_empty() => text.to_string(),
            whole => {
                let names = constants(definition, &format!("{}_", name.to_uppercase()));
                names.get(&i64::try_from(whole.as_integer()?).ok()?)?.clone()
            }
        };
        Some(format!("{name} {text}"))
    });
    words.collect::<Vec<_>>().join(", ")
}

/// Returns the units of a definition's own fields, by name.
/// The unit is in brackets at the end of the comment before a field.
pub(super) fn units(definition: &str) -> SortedMap<String, String> {
    let mut units = SortedMap::new();
    let mut unit = None;
    for line in definition.lines().take_while(|line| !line.starts_with("===")) {
        match line.strip_prefix('#') {
            Some(comment) => {
                let inside = comment.trim().strip_suffix(']').and_then(|rest| rest.rsplit_once('['));
                unit = inside.map(|(_, unit)| unit.to_owned());
            }
            None => {
                let name = line.split_whitespace().nth(1).map(str::to_owned);
                units.extend(name.zip(unit.take()));
            }
        }
    }
    units
}

/// Returns the constants of a definition with a prefix, by number, in lower case.
pub(super) fn constants(definition: &str, start: &str) -> SortedMap<i64, String> {
    let line = |line: &str| {
        let (_, constant) = line.split('#').next()?.trim().split_once(' ')?;
        let (name, number) = constant.split_once('=')?;
        let name = name.trim().strip_prefix(start)?;
        Some((number.trim().parse().ok()?, name.to_lowercase().replace('_', " ")))
    };
    definition.lines().filter_map(line).collect()
}
