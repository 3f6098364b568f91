//! Insertion of connections.

use crate::error::GraphError;
use crate::graph::{NavigationEdge, NavigationGraph, NavigationNode, distance};

/// Treatment of a new connection that crosses an existing one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Crossing {
    /// Refusal of the connection, `no-intersection`.
    #[default]
    Refuse,
    /// Added unchanged, `allow-intersection`: the robot does not turn there.
    Allow,
    /// Both are split by a node at the crossing, `split-intersection`.
    Split,
}

impl NavigationGraph {
    /// Adds a connection.
    ///
    /// # Errors
    /// A node of it does not exist or is unconnected, both are the same, the connection exists, or it crosses another one
    /// and may not.
    pub fn connect(&mut self, connection: NavigationEdge, crossing: Crossing) -> Result<(), GraphError> {
        self.check(&connection)?;
        if crossing == Crossing::Allow {
            self.connections.push(connection);
            return Ok(());
        }
        let crossed = self.crossed(&connection);
        match (crossing, crossed.first()) {
            (Crossing::Refuse, Some((other, _))) => Err(GraphError(format!(
                "connection `{}` to `{}` crosses that of `{}` to `{}`: expected !allow-intersection or \
                 !split-intersection before it, or a node at the crossing",
                connection.from, connection.to, self.connections[*other].from, self.connections[*other].to
            ))),
            _ => {
                // All of it, or nothing.
                let mut changed = self.clone();
                changed.split(connection, crossed)?;
                *self = changed;
                Ok(())
            }
        }
    }

    fn check(&self, connection: &NavigationEdge) -> Result<(), GraphError> {
        let NavigationEdge { from, to, .. } = connection;
        for name in [from, to] {
            match self.node(name) {
                None => return Err(GraphError(format!("connection `{from}` to `{to}`: no node `{name}`"))),
                Some(node) if node.is_unconnected => {
                    let reason = format!("connection `{from}` to `{to}`: node `{name}` is unconnected");
                    return Err(GraphError(reason));
                }
                Some(_) => {}
            }
        }
        if from == to {
            return Err(GraphError(format!("connection of `{from}` with itself")));
        }
        let is_same = |other: &&NavigationEdge| {
            (&other.from, &other.to) == (from, to)
                || (&other.from, &other.to) == (to, from) && !(other.is_directed && connection.is_directed)
        };
        match self.connections.iter().find(is_same) {
            Some(_) => Err(GraphError(format!("connection `{from}` to `{to}` exists twice"))),
            None => Ok(()),
        }
    }

    /// Connections that one crosses, with its fraction there, in the order along it.
    fn crossed(&self, connection: &NavigationEdge) -> Vec<(usize, f64)> {
        let line = [self.position(&connection.from), self.position(&connection.to)];
        let is_apart = |other: &NavigationEdge| {
            ![&other.from, &other.to].iter().any(|end| [&connection.from, &connection.to].contains(end))
        };
        let others = self.connections.iter().enumerate().filter(|(_, other)| is_apart(other));
        let mut crossed: Vec<(usize, f64)> = others
            .filter_map(|(at, other)| {
                let other = [self.position(&other.from), self.position(&other.to)];
                Some((at, crossing_fraction(line, other)?))
            })
            .collect();
        crossed.sort_by(|a, b| a.1.total_cmp(&b.1));
        crossed
    }

    fn split(&mut self, connection: NavigationEdge, crossed: Vec<(usize, f64)>) -> Result<(), GraphError> {
        let (start, end) = (self.position(&connection.from), self.position(&connection.to));
        let mut from = connection.from.clone();
        for (at, fraction) in crossed {
            let other = self.connections[at].clone();
            let position = [0, 1].map(|axis| start[axis] + fraction * (end[axis] - start[axis]));
            let name = format!("{}-{}_{}-{}", connection.from, connection.to, other.from, other.to);
            self.add_node(NavigationNode { name: name.clone(), position, ..NavigationNode::default() })?;
            self.connections[at].to.clone_from(&name);
            self.connections.push(NavigationEdge { from: name.clone(), ..other });
            self.connections.push(NavigationEdge {
                from,
                to: name.clone(),
                is_directed: connection.is_directed,
            });
            from = name;
        }
        self.connections.push(NavigationEdge { from, ..connection });
        Ok(())
    }

    /// Connects a node to the nearest other connectable one, `closest-node`.
    /// That is one which is connected or may be.
    ///
    /// # Errors
    /// The node does not exist, or no other one does.
    pub fn connect_to_nearest_node(&mut self, name: &str) -> Result<(), GraphError> {
        let missing = |what: &str| GraphError(format!("node `{name}`: {what} to connect it with"));
        let own = self.node(name).ok_or_else(|| missing("no node"))?.position;
        let others = self.nodes.values().filter(|node| node.name != name && !node.is_unconnected);
        let nearest = others.min_by(|a, b| distance(a.position, own).total_cmp(&distance(b.position, own)));
        let to = nearest.ok_or_else(|| missing("no other node"))?.name.clone();
        let is_between = |edge: &NavigationEdge| {
            (edge.from == name && edge.to == to) || (edge.from == to && edge.to == name)
        };
        if self.connections.iter().any(is_between) {
            return Ok(());
        }
        self.connect(NavigationEdge { from: name.to_owned(), to, is_directed: false }, Crossing::Allow)
    }

    /// Connects a node to the nearest connection, by a node there, `closest-edge`.
    ///
    /// # Errors
    /// The node does not exist, or no connection has a point beside it between its ends.
    pub fn connect_to_nearest_connection(&mut self, name: &str) -> Result<(), GraphError> {
        let missing = |what: &str| GraphError(format!("node `{name}`: {what} to connect it with"));
        let own = self.node(name).ok_or_else(|| missing("no node"))?.position;
        let beside = self.connections.iter().enumerate().filter_map(|(at, connection)| {
            let foot = foot(own, [self.position(&connection.from), self.position(&connection.to)])?;
            Some((at, foot))
        });
        let nearest = beside.min_by(|a, b| distance(a.1, own).total_cmp(&distance(b.1, own)));
        let (at, position) = nearest.ok_or_else(|| missing("no connection beside it"))?;
        let other = self.connections[at].clone();
        let middle = format!("{name}_{}-{}", other.from, other.to);
        self.add_node(NavigationNode { name: middle.clone(), position, ..NavigationNode::default() })?;
        self.connections[at].to.clone_from(&middle);
        self.connections.push(NavigationEdge { from: middle.clone(), ..other });
        self.connections.push(NavigationEdge { from: name.to_owned(), to: middle, is_directed: false });
        Ok(())
    }
}

/// Returns the fraction of a line at which it crosses another one.
/// `None` unless both cross inside.
fn crossing_fraction([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> Option<f64> {
    let along = |from: [f64; 2], to: [f64; 2]| [to[0] - from[0], to[1] - from[1]];
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let (own, other, between) = (along(a, b), along(c, d), along(a, c));
    let determinant = cross(own, other);
    let (at, there) = (cross(between, other) / determinant, cross(between, own) / determinant);
    // False for parallel lines, whose fractions are not numbers or infinite.
    ((0.0..=1.0).contains(&at) && (0.0..=1.0).contains(&there)).then_some(at)
}

/// Returns the foot of a perpendicular, if it is inside of the line.
/// It is the point of the line nearest to the given point.
fn foot(point: [f64; 2], [a, b]: [[f64; 2]; 2]) -> Option<[f64; 2]> {
    let along = [b[0] - a[0], b[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let fraction = ((point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1]) / square;
    (0.0 < fraction && fraction < 1.0).then(|| [a[0] + fraction * along[0], a[1] + fraction * along[1]])
}
