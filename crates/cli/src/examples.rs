use std::path::Path;

use slate::blackboard::nearest_names;
use slate::module::Plugin;
use slate::runtime::configuration::{Configuration, Options};

use crate::failure::Failure;

/// An example that is linked into the command.
struct Example {
    name: &'static str,
    about: &'static str,
    configuration: &'static str,
}

const EXAMPLES: [Example; 1] =
    [Example { name: slate_exp1::NAME, about: slate_exp1::ABOUT, configuration: slate_exp1::CONFIGURATION }];

/// Names at the top of a configuration that belong to applications.
const EXTRA_TABLES: [&str; 3] = ["world", "report", "variants"];

/// What there is to run.
pub struct Application {
    /// What the run is called.
    pub name: String,
    pub configuration: Configuration,
    pub plugins: Vec<Plugin>,
}

/// The modules that are linked into the command.
fn plugins() -> Vec<Plugin> {
    let mut plugins = slate::sim::plugins();
    plugins.extend(slate_exp1::plugins());
    plugins
}

/// Finds an example by name, from any directory, or reads a configuration file.
pub fn find(name: &str, sets: Vec<String>) -> Result<Application, Failure> {
    let options = Options { sets, extra_tables: EXTRA_TABLES.map(Into::into).to_vec(), ..Options::default() };
    if let Some(example) = EXAMPLES.iter().find(|example| example.name == name) {
        let configuration =
            Configuration::from_text(&format!("{name}.toml"), example.configuration, &options)?;
        return Ok(Application { name: name.into(), configuration, plugins: plugins() });
    }
    let path = Path::new(name);
    if !path.is_file() {
        let near = nearest_names(name, EXAMPLES.iter().map(|example| example.name));
        let all = EXAMPLES.map(|example| example.name).join(", ");
        let help = match near.first() {
            Some(near) => format!("did you mean `{near}`? Examples: {all}; or name a configuration file"),
            None => format!("examples: {all}; or name a configuration file"),
        };
        return Err(Failure::Unknown { name: name.into(), help });
    }
    let configuration = Configuration::load(path, &options)?;
    let stem = path.file_stem().map_or_else(|| name.into(), |stem| stem.to_string_lossy().into_owned());
    Ok(Application { name: stem, configuration, plugins: plugins() })
}

/// Lists the examples.
pub fn list() -> Result<bool, Failure> {
    for example in &EXAMPLES {
        println!("{:10} {}", example.name, example.about);
    }
    Ok(true)
}
