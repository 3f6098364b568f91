//! Contents of a plugin library.

use std::path::Path;

use slate::runtime::plugin::{self, InterfaceOutline};

use crate::failure::Failure;
use crate::output;

pub fn info(file: &Path, json: bool) -> Result<(), Failure> {
    let outline = plugin::outline(file, Vec::new)?;
    if json {
        output::document("slate.plugin.info/1", &outline);
        return Ok(());
    }
    output::line(format_args!("{} {}", outline.name, outline.version));
    let panic = if outline.panic.is_empty() { "none" } else { &outline.panic };
    let needs = if outline.depends.is_empty() { "nothing".into() } else { outline.depends.join(", ") };
    output::line(format_args!("plugin interface {}, panic {panic}, needs {needs}", outline.abi));
    for module in &outline.modules {
        output::line("");
        output::line(format_args!("{} ({})", module.name, module.stage));
        module.doc.lines().for_each(|line| output::line(format_args!("  {}", line.trim())));
        let row = |direction: &str, name: &str, carries: &InterfaceOutline| {
            let schema = if carries.schema.is_empty() { "schema unknown" } else { &carries.schema };
            [format!("  {}", direction.to_lowercase()), name.into(), carries.interface.clone(), schema.into()]
        };
        let ports = module.ports.iter().map(|port| row(&port.direction, &port.name, &port.carries));
        let params = module.params.iter().map(|params| row("params", "", params));
        output::columns(ports.chain(params));
    }
    Ok(())
}
