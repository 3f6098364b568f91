//! Check of the tables that belong to this program, without an agent.

use slate_runtime::composition::CheckedComposition;

use crate::bridges::check_bridges;
use crate::console::check_console;
use crate::observation::Observation;
use crate::{RunError, dds, groot, network, ros1, ros2, scene};

/// Checks the tables of a configuration that belong to this program.
/// These are the report, the world, the console, the network and the bridges. It opens nothing.
///
/// # Errors
/// The first table with a mistake, or a property that it names and the composition lacks.
pub fn check_tables(composition: &CheckedComposition<'_>) -> Result<(), RunError> {
    let configuration = composition.configuration();
    Observation::new(configuration, composition)?;
    scene::of(configuration)?;
    check_bridges(configuration)?;
    check_console(configuration)?;
    network::check(composition, configuration)?;
    dds::check(composition, configuration)?;
    groot::check(composition, configuration)?;
    ros1::check(composition, configuration)?;
    ros2::check(composition, configuration)?;
    Ok(())
}
