//! Nets that are read, generated and written.

use std::path::Path;

use slate_petri_net::{
    NetError, PetriNet, generate_net, parse_linear_plan, parse_rules, read_pnml, write_pnml,
};

use super::{MissionVerb, check, svg, tree, tree_svg};
use crate::failure::Failure;
use crate::graph::write;
use crate::output;

/// Runs the command; returns the exit code.
pub fn mission(verb: &MissionVerb) -> Result<u8, Failure> {
    match verb {
        MissionVerb::Check { file, action, json, .. } if is_tree(file) => tree::check(file, action, *json),
        MissionVerb::Check { file, action, states, json } => check::check(file, action, *states, *json),
        MissionVerb::Show { file, out } => {
            let drawing =
                if is_tree(file) { tree_svg::draw(&tree::read(file)?) } else { svg::draw(&read_pnml(file)?) };
            put(&drawing, out.as_deref())?;
            Ok(0)
        }
        MissionVerb::Generate { file, rules, out } => {
            put(&write_pnml(&generate(file, rules.as_deref())?), out.as_deref())?;
            Ok(0)
        }
    }
}

/// Whether a file is a behaviour tree, by its name.
fn is_tree(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xml"))
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
