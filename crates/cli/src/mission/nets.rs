//! Nets that are read, generated and written.

use std::path::Path;

use slate_petri_net::{
    NetError, PetriNet, generate_net, parse_linear_plan, parse_rules, read_pnml, write_pnml,
};

#[cfg(feature = "lua")]
use super::skills::{check as check_skills, draw as draw_skills};
use super::{MissionVerb, check, golog, svg, tree, tree_svg};
use crate::failure::Failure;
use crate::graph::write;
use crate::output;

/// Runs the command; returns the exit code.
pub fn mission(verb: &MissionVerb) -> Result<u8, Failure> {
    match verb {
        MissionVerb::Check { file, action, json, .. } if is_skill(file) => check_skills(file, action, *json),
        MissionVerb::Show { file, out } if is_skill(file) => {
            put(&draw_skills(file)?, out.as_deref())?;
            Ok(0)
        }
        MissionVerb::Check { file, action, json, .. } if golog::is_theory(file) => {
            golog::check(file, action, *json)
        }
        MissionVerb::Check { file, action, json, .. } if is_tree(file) => tree::check(file, action, *json),
        MissionVerb::Check { file, action, states, json } => check::check(file, action, *states, *json),
        MissionVerb::Show { file, out } => {
            let drawing = if golog::is_theory(file) {
                golog::draw(file)?
            } else if is_tree(file) {
                let tree = tree::read(file)?;
                tree_svg::draw(tree.name(), &tree_svg::rows(&tree))
            } else {
                svg::draw(&read_pnml(file)?)
            };
            put(&drawing, out.as_deref())?;
            Ok(0)
        }
        MissionVerb::Generate { file, rules, out } => {
            put(&write_pnml(&generate(file, rules.as_deref())?), out.as_deref())?;
            Ok(0)
        }
    }
}

/// Returns whether a file has skills, by its name.
fn is_skill(file: &Path) -> bool {
    file.extension().is_some_and(|end| end == "lua")
}

#[cfg(not(feature = "lua"))]
fn check_skills(_: &Path, _: &[String], _: bool) -> Result<u8, Failure> {
    Err(Failure::NotBuilt { what: "what checks skills in Lua".into(), feature: "lua" })
}

#[cfg(not(feature = "lua"))]
fn draw_skills(_: &Path) -> Result<String, Failure> {
    Err(Failure::NotBuilt { what: "what draws skills in Lua".into(), feature: "lua" })
}

/// Returns whether a file is a behavior tree, by its content.
/// An unreadable file is not a tree; reading it as a net then reports the reason.
fn is_tree(file: &Path) -> bool {
    std::fs::read_to_string(file).is_ok_and(|text| is_tree_text(&text))
}

/// Returns whether the first element is that of a behavior tree.
fn is_tree_text(text: &str) -> bool {
    let starts = text.match_indices('<').map(|(start, _)| &text[start + 1..]);
    let first = starts.into_iter().find(|rest| rest.starts_with(|c: char| c.is_alphabetic()));
    first.is_some_and(|rest| rest.split(|c: char| !c.is_alphanumeric()).next() == Some("root"))
}

/// Generates the net of a linear plan.
fn generate(plan: &Path, rules: Option<&Path>) -> Result<PetriNet, Failure> {
    let read = |path: &Path| {
        std::fs::read_to_string(path).map_err(|source| Failure::File { path: path.into(), source })
    };
    let of_file = |path: &Path, error: NetError| Failure::Net(error.of_file(path));
    let steps = parse_linear_plan(&read(plan)?).map_err(|error| of_file(plan, error))?;
    let rules = match rules {
        Some(path) => parse_rules(&read(path)?).map_err(|error| of_file(path, error))?,
        None => Vec::new(),
    };
    let name = plan.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    Ok(generate_net(name.split('.').next().unwrap_or(name), &steps, &rules)?)
}

/// Writes a file, or prints it.
fn put(text: &str, out: Option<&Path>) -> Result<(), Failure> {
    match out {
        Some(path) => write(path, text).map_err(|source| Failure::File { path: path.into(), source }),
        None => {
            output::line(text.trim_end());
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::is_tree_text;

    #[test]
    fn the_first_element_tells_a_tree_from_a_net() {
        assert!(is_tree_text("<?xml version=\"1.0\"?>\n<!-- a plan -->\n<root BTCPP_format=\"4\">"));
        assert!(!is_tree_text("<?xml version=\"1.0\"?><pnml><net/></pnml>"));
        assert!(!is_tree_text("<rooted/>"));
        assert!(!is_tree_text("goto_1_2|30; look"));
    }
}
