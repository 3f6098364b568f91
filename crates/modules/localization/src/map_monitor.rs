//! Monitor of a map, which hands it on without a copy.

use slate_interfaces::OccupancyGrid;
use slate_mapek::prelude::*;
use slate_module::prelude::*;

/// Ports of [`MapMonitor`].
#[ports]
pub struct MapSensors {
    /// Map, which the Analyzes read where the Sensor has written it.
    percept: HandedOn<OccupancyGrid>,
}

/// Hands on the map of a [`MapServer`](crate::MapServer).
pub struct MapMonitor;

impl Monitor for MapMonitor {
    const NAME: &'static str = "map_monitor";
    const DOC: &'static str = "Forwards the map of a map_server.";
    type Sensors = MapSensors;
    type Params = ();
    type State = ();
    type Value = InPlace<OccupancyGrid>;

    fn interpret(_: &mut (), sensors: &MapSensors, _: &(), _: &Tick) -> Option<InPlace<OccupancyGrid>> {
        Some(sensors.percept.as_it_is())
    }
}
