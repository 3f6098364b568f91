//! Routes.

use slate_sorted::SortedMap;

use crate::graph::NavigationGraph;

/// Route through a graph.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphRoute {
    /// Names of the nodes, from start to goal.
    pub nodes: Vec<String>,
    /// Length with the distance to the first node, m.
    pub length: f64,
}

impl NavigationGraph {
    /// Returns the shortest route between two nodes.
    /// `None` if no route exists, or a node is unknown.
    pub fn route(&self, from: &str, to: &str) -> Option<GraphRoute> {
        self.route_from(|node| (node == from).then_some(0.0), to)
    }

    /// Returns the shortest route to a node from a position outside the graph.
    /// The position is, for instance, the robot's. `entry` returns the path length to each node, m, for instance on a
    /// grid; `None` for a node out of reach.
    ///
    /// Dijkstra, 1959. Of routes of the same length it is always the same one.
    pub fn route_from(&self, entry: impl Fn(&str) -> Option<f64>, to: &str) -> Option<GraphRoute> {
        // By name: length so far, and the node before.
        let mut open: SortedMap<&str, (f64, Option<&str>)> = SortedMap::new();
        let mut done: SortedMap<&str, (f64, Option<&str>)> = SortedMap::new();
        for name in self.nodes.keys() {
            if let Some(length) = entry(name).filter(|length| length.is_finite() && *length >= 0.0) {
                open.insert(name, (length, None));
            }
        }
        while let Some((name, (length, before))) =
            open.iter().min_by(|(_, (a, _)), (_, (b, _))| a.total_cmp(b)).map(|(name, found)| (*name, *found))
        {
            open.remove(name);
            done.insert(name, (length, before));
            if name == to {
                return Some(self.trace(&done, name, length));
            }
            for next in self.successors(name).filter(|next| !done.contains_key(next)) {
                let through = length + self.length(name, next);
                if open.get(next).is_none_or(|(known, _)| through < *known) {
                    open.insert(next, (through, Some(name)));
                }
            }
        }
        None
    }

    fn successors<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a str> {
        self.connections.iter().filter_map(move |connection| {
            if connection.from == name {
                Some(connection.to.as_str())
            } else {
                (connection.to == name && !connection.is_directed).then_some(connection.from.as_str())
            }
        })
    }

    fn trace(&self, done: &SortedMap<&str, (f64, Option<&str>)>, goal: &str, length: f64) -> GraphRoute {
        let mut nodes = vec![goal.to_owned()];
        let mut here = goal;
        while let Some((_, Some(before))) = done.get(here) {
            nodes.push((*before).to_owned());
            here = before;
        }
        nodes.reverse();
        GraphRoute { nodes, length }
    }
}
