//! Location of a flat path in a document.

use toml_edit::{Item, TableLike};

use super::super::scope::{SECTIONS, flat_name, in_agent, in_scope};
use super::super::value::Value;

/// Returns the keys of a flat path in a part, and the robot of their scope.
pub(super) fn locate(part: &Item, path: &[String]) -> (Vec<String>, String) {
    let as_it_is = (path.to_vec(), String::new());
    let Some(root) = part.as_table_like() else { return as_it_is };
    let [section, name, rest @ ..] = path else { return as_it_is };
    if !SECTIONS.contains(&section.as_str()) {
        return as_it_is;
    }
    let place = |scope: &str, key: &str| {
        let mut keys = section_of(scope, section);
        keys.push(key.into());
        keys.extend_from_slice(rest);
        let depth = match (section.as_str(), rest) {
            ("links", [_, ..]) => Some(1),
            ("actuators", [list, _, ..]) if list == "commands" => Some(2),
            _ => None,
        };
        if let Some(at) = depth.map(|depth| section_of(scope, section).len() + depth) {
            keys[at] = written(root, &keys[..=at], scope);
        }
        (keys, scope.to_owned())
    };
    let robots = root.get("robots").and_then(Item::as_table_like);
    let robots: Vec<&str> =
        robots.into_iter().flat_map(|robots| robots.iter()).map(|(name, _)| name).collect();
    for scope in [""].iter().chain(&robots) {
        let mut section_keys = section_of(scope, section).into_iter();
        let first = section_keys.next().and_then(|key| root.get(&key));
        let found = section_keys.try_fold(first, |item, key| Some(item?.as_table_like()?.get(&key)));
        let Some(table) = found.flatten().and_then(Item::as_table_like) else { continue };
        if let Some((key, _)) = table.iter().find(|(key, _)| flat_name(section, key, scope) == *name) {
            return place(scope, key);
        }
    }
    match name.split_once('/') {
        // A link's name must have a module before the port even then.
        Some((robot, own)) if robots.contains(&robot) && (section != "links" || own.contains('/')) => {
            place(robot, own)
        }
        _ => as_it_is,
    }
}

fn section_of(scope: &str, section: &str) -> Vec<String> {
    let keys = if scope.is_empty() { vec![section] } else { vec!["robots", scope, section] };
    keys.into_iter().map(String::from).collect()
}

/// Returns the item at a path of keys.
pub(super) fn item_at<'a>(part: &'a mut Item, keys: &[String]) -> Option<&'a mut Item> {
    keys.iter().try_fold(part, |item, key| item.as_table_like_mut()?.get_mut(key))
}

/// Returns a sender as written in the scope of a robot.
pub(super) fn short(sender: &str, scope: &str) -> String {
    let path = ["links", ""].map(String::from);
    match in_scope(&path, &Value::Text(sender.into()), scope) {
        Value::Text(short) => short,
        _ => sender.into(),
    }
}

/// Returns true if a text in the scope of a robot means that sender.
pub(super) fn is_it(text: &str, sender: &str, scope: &str) -> bool {
    text == sender || in_agent(scope)(text).is_some_and(|whole| whole == sender)
}

/// Returns the key of the last name in the table of its list.
/// It is the written one, or else the short one.
fn written(root: &dyn TableLike, keys: &[String], scope: &str) -> String {
    let Some((sender, [first, list @ ..])) = keys.split_last() else { return String::new() };
    if !sender.contains('/') {
        return sender.clone();
    }
    let item =
        list.iter().try_fold(root.get(first), |item, key| Some(item?.as_table_like()?.get(key))).flatten();
    let table = item.and_then(Item::as_table_like);
    let own = table.and_then(|table| table.iter().map(|(key, _)| key).find(|key| is_it(key, sender, scope)));
    own.map_or_else(|| short(sender, scope), str::to_owned)
}
