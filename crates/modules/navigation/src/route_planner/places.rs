//! Named places.

use std::path::Path;

use slate_navigation_graph::{NavigationGraph, read_graph};
use slate_plugin::interfaces::Point2;
use slate_plugin::prelude::*;

use super::grid::RouteGrid;
use crate::frames::distance;

/// Navigation graph of a file.
/// It is read when the agent starts and when its name changes.
#[derive(Default)]
pub struct KnownPlaces {
    read: Option<(String, Option<NavigationGraph>)>,
}

/// Place.
#[derive(Clone, Copy, Debug)]
pub struct NamedPlace {
    /// Position in the map frame, m.
    pub position: Point2,
    /// Heading, from the property `orientation`, rad.
    pub heading: Option<f64>,
}

impl KnownPlaces {
    /// Reads the graph, unless that is done.
    pub fn read(&mut self, file: &str, now: &Tick) {
        if self.read.as_ref().is_some_and(|(known, _)| known == file) {
            return;
        }
        let graph = if file.is_empty() { Ok(None) } else { read_graph(Path::new(file)).map(Some) };
        let graph = graph.unwrap_or_else(|error| {
            now.error(format_args!("{error}; name another `graph_filename`"));
            None
        });
        self.read = Some((file.into(), graph));
    }

    fn graph(&self) -> Option<&NavigationGraph> {
        self.read.as_ref()?.1.as_ref()
    }

    /// Returns a place by its name.
    pub fn find(&self, name: &str) -> Option<NamedPlace> {
        let graph = self.graph()?;
        let [x, y] = graph.node(name)?.position;
        let heading = graph.property(name, "orientation").and_then(|text| text.parse::<f64>().ok());
        Some(NamedPlace { position: Point2 { x, y }, heading: heading.filter(|heading| heading.is_finite()) })
    }

    /// Names of the places that can be driven to.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let nodes = self.graph().into_iter().flat_map(NavigationGraph::nodes);
        nodes.filter(|node| !node.is_unconnected).map(|node| node.name.as_str())
    }

    /// Computes the shortest route to a place, as points.
    /// The first one is a node in view of the robot, the last one the place. Without a route, the place is the only
    /// point.
    pub fn route(&self, from: Point2, name: &str, grid: &RouteGrid, route: &mut Vec<Point2>) {
        route.clear();
        let Some(graph) = self.graph() else { return };
        let point =
            |name: &str| graph.node(name).map(|node| Point2 { x: node.position[0], y: node.position[1] });
        let visible = |name: &str| {
            let to = point(name)?;
            grid.is_line_free(from, to).then(|| distance(from, to))
        };
        let nearest = graph.nearest_node([from.x, from.y]).map(|node| node.name.as_str());
        let found = graph.route_from(visible, name).or_else(|| {
            let entry = |node: &str| {
                (Some(node) == nearest).then(|| point(node).map_or(0.0, |to| distance(from, to)))
            };
            graph.route_from(entry, name)
        });
        match found {
            Some(found) => route.extend(found.nodes.iter().filter_map(|name| point(name))),
            None => route.extend(point(name)),
        }
    }
}
