//! Order of nodes and edges in columns and lanes.

use slate_module::math::{max, min};
use slate_sorted::{SortedMap, SortedSet};

use super::columns::columns;
use super::model::{GraphEdge, ModuleGraph};

/// Height of an edge that passes a column, and the space around it.
const PASS_HEIGHT: f64 = 4.0;
const PASS_GAP: f64 = 10.0;

/// Number of sweeps that order the columns and that move nodes to their neighbors.
const ORDER_SWEEPS: usize = 12;
const MOVE_SWEEPS: usize = 8;

/// Around the drawing, and above the nodes of a group for its name.
pub(super) const MARGIN: f64 = 16.0;
pub(super) const TITLE_HEIGHT: f64 = 20.0;

/// Distance of edges that run back below a group.
pub(super) const TRACK_SPACING: f64 = 9.0;

/// Node, or the place where an edge passes a column.
pub(super) struct Slot {
    pub column: usize,
    pub height: f64,
    pub is_pass: bool,
    pub y: f64,
    /// Linked slots in other columns.
    pub near: Vec<usize>,
}

impl Slot {
    pub fn middle(&self) -> f64 {
        self.y + self.height / 2.0
    }

    pub fn gap(&self, nodes: f64) -> f64 {
        if self.is_pass { PASS_GAP } else { nodes }
    }
}

/// Slots of a group of nodes, by their columns.
#[derive(Default)]
pub(super) struct Lane {
    pub name: String,
    pub columns: Vec<Vec<usize>>,
    /// Destinations of edges that run back below the lane.
    pub tracks: Vec<usize>,
    pub top: f64,
    pub height: f64,
}

impl Lane {
    pub fn add(&mut self, column: usize, slot: usize) {
        if self.columns.len() <= column {
            self.columns.resize_with(column + 1, Vec::new);
        }
        self.columns[column].push(slot);
    }

    /// Returns the height of its columns with a gap between nodes.
    pub fn needed_height(&self, slots: &[Slot], gap: f64) -> f64 {
        let height = |slot: &usize| slots[*slot].height + slots[*slot].gap(gap);
        let heights = self.columns.iter().map(|column| column.iter().map(height).sum::<f64>());
        heights.fold(0.0, max)
    }

    pub fn tracks_height(&self) -> f64 {
        if self.tracks.is_empty() { 0.0 } else { (self.tracks.len() + 1) as f64 * TRACK_SPACING }
    }

    pub fn title_height(&self) -> f64 {
        if self.name.is_empty() { 0.0 } else { TITLE_HEIGHT }
    }

    /// Returns the space below it.
    pub fn margin(&self) -> f64 {
        if self.name.is_empty() { 0.0 } else { MARGIN }
    }
}

/// Layout that is being made.
pub(super) struct Layering<'a> {
    pub graph: &'a ModuleGraph,
    pub sizes: &'a [(f64, f64)],
    pub columns: Vec<usize>,
    /// Nodes, then the passes.
    pub slots: Vec<Slot>,
    pub lanes: Vec<Lane>,
    /// Lane of each node.
    pub lane_of: Vec<usize>,
    /// Passes of each edge.
    pub passes: Vec<Vec<usize>>,
}

impl<'a> Layering<'a> {
    pub fn new(graph: &'a ModuleGraph, sizes: &'a [(f64, f64)]) -> Self {
        let columns = columns(graph);
        let groups: SortedSet<&str> = (0..graph.nodes.len()).map(|node| graph.group(node)).collect();
        let groups: Vec<&str> = groups.into_iter().collect();
        let lane = |name: &&str| Lane { name: (*name).to_owned(), ..Lane::default() };
        let mut lanes: Vec<Lane> = groups.iter().map(lane).collect();
        let mut lane_of = Vec::new();
        let mut slots = Vec::new();
        for (node, (_, height)) in sizes.iter().enumerate().take(graph.nodes.len()) {
            let own = groups.iter().position(|group| *group == graph.group(node)).unwrap_or(0);
            lanes[own].add(columns[node], node);
            lane_of.push(own);
            let column = columns[node];
            slots.push(Slot { column, height: *height, is_pass: false, y: 0.0, near: Vec::new() });
        }
        Self { graph, sizes, columns, slots, lanes, lane_of, passes: Vec::new() }
    }

    pub fn is_back(&self, edge: &GraphEdge) -> bool {
        self.columns[edge.from] >= self.columns[edge.to]
    }

    /// Returns the lane that an edge runs in.
    pub fn lane(&self, edge: &GraphEdge) -> usize {
        let is_in_group = !self.graph.group(edge.to).is_empty();
        self.lane_of[if is_in_group { edge.to } else { edge.from }]
    }

    /// Returns whether an edge leaves the lane of its source at once.
    pub fn is_across(&self, edge: &GraphEdge) -> bool {
        self.lane_of[edge.from] != self.lane(edge)
    }

    /// Adds the passes of all edges. Edges of one source pass together.
    pub fn add_edges(&mut self) {
        let graph = self.graph;
        let mut known = SortedMap::new();
        for edge in &graph.edges {
            let mut own = Vec::new();
            if self.is_back(edge) {
                let tracks = &mut self.lanes[self.lane_of[edge.to]].tracks;
                if !tracks.contains(&edge.to) {
                    tracks.push(edge.to);
                }
            } else {
                let lane = self.lane(edge);
                let mut before = edge.from;
                for column in self.columns[edge.from] + 1..self.columns[edge.to] {
                    let pass = *known.entry((edge.from, lane, column)).or_insert_with(|| {
                        let slot =
                            Slot { column, height: PASS_HEIGHT, is_pass: true, y: 0.0, near: Vec::new() };
                        self.slots.push(slot);
                        self.lanes[lane].add(column, self.slots.len() - 1);
                        self.slots.len() - 1
                    });
                    self.join(before, pass);
                    own.push(pass);
                    before = pass;
                }
                self.join(before, edge.to);
            }
            self.passes.push(own);
        }
    }

    pub fn join(&mut self, one: usize, other: usize) {
        if !self.slots[one].near.contains(&other) {
            self.slots[one].near.push(other);
            self.slots[other].near.push(one);
        }
    }

    /// Orders each column by the barycenters of its neighbors to reduce crossings.
    /// It takes the left and the right neighbors in turn.
    pub fn order(&mut self) {
        let mut rank = vec![0.0; self.slots.len()];
        let number = |rank: &mut [f64], lane: usize, column: &[usize]| {
            for (row, slot) in column.iter().enumerate() {
                rank[*slot] = lane as f64 + (row as f64 + 0.5) / column.len() as f64;
            }
        };
        for (lane, Lane { columns, .. }) in self.lanes.iter().enumerate() {
            columns.iter().for_each(|column| number(&mut rank, lane, column));
        }
        let count = self.lanes.iter().map(|lane| lane.columns.len()).max().unwrap_or(0);
        for sweep in 0..ORDER_SWEEPS {
            for step in 0..count {
                let is_rightward = sweep % 2 == 0;
                let at = if is_rightward { step } else { count - 1 - step };
                for (lane, Lane { columns, .. }) in self.lanes.iter_mut().enumerate() {
                    let Some(column) = columns.get_mut(at) else { continue };
                    let barycenter = |slot: usize| {
                        let is_beside = |other: &&usize| match is_rightward {
                            true => self.slots[**other].column < at,
                            false => self.slots[**other].column > at,
                        };
                        let near = self.slots[slot].near.iter().filter(is_beside);
                        let ranks: Vec<f64> = near.map(|other| rank[*other]).collect();
                        mean(&ranks).unwrap_or(rank[slot])
                    };
                    let mut keyed: Vec<(f64, usize)> =
                        column.iter().map(|slot| (barycenter(*slot), *slot)).collect();
                    keyed.sort_by(|one, other| one.0.total_cmp(&other.0));
                    *column = keyed.into_iter().map(|(_, slot)| slot).collect();
                    number(&mut rank, lane, column);
                }
            }
        }
    }

    /// Moves slots up and down toward their neighbors, keeping the columns' order.
    pub fn settle(&mut self, gap: f64) {
        for Lane { columns, top, height, .. } in &self.lanes {
            for column in columns {
                let total: f64 =
                    column.iter().map(|slot| self.slots[*slot].height + self.slots[*slot].gap(gap)).sum();
                let mut y = top + (height - total) / 2.0;
                for slot in column {
                    let slot = &mut self.slots[*slot];
                    slot.y = y + slot.gap(gap) / 2.0;
                    y += slot.height + slot.gap(gap);
                }
            }
        }
        for _ in 0..MOVE_SWEEPS {
            for Lane { columns, top, height, .. } in &self.lanes {
                for column in columns.iter().filter(|column| !column.is_empty()) {
                    let placed = self.spread(column, gap, (*top, top + height));
                    column.iter().zip(placed).for_each(|(slot, y)| self.slots[*slot].y = y);
                }
            }
        }
    }

    /// Returns the y of each slot of a column, near the mean of its neighbors.
    /// As near as the order and two borders permit: halfway between the placement that gives way downward first and the
    /// one that gives way upward first.
    pub fn spread(&self, column: &[usize], gap: f64, (top, bottom): (f64, f64)) -> Vec<f64> {
        let slot = |row: usize| &self.slots[column[row]];
        let count = column.len();
        let wanted: Vec<f64> = (0..count)
            .map(|row| {
                let middles: Vec<f64> =
                    slot(row).near.iter().map(|other| self.slots[*other].middle()).collect();
                mean(&middles).unwrap_or(slot(row).middle()) - slot(row).height / 2.0
            })
            .collect();
        let apart = |row: usize| (slot(row).gap(gap) + slot(row + 1).gap(gap)) / 2.0;
        let first = top + slot(0).gap(gap) / 2.0;
        let last = bottom - slot(count - 1).gap(gap) / 2.0;
        let downward = |ys: &mut Vec<f64>| {
            for row in 0..count {
                let least =
                    if row == 0 { first } else { ys[row - 1] + slot(row - 1).height + apart(row - 1) };
                ys[row] = max(ys[row], least);
            }
        };
        let upward = |ys: &mut Vec<f64>| {
            for row in (0..count).rev() {
                let end = if row == count - 1 { last } else { ys[row + 1] - apart(row) };
                ys[row] = min(ys[row], end - slot(row).height);
            }
        };
        let (mut low, mut high) = (wanted.clone(), wanted);
        downward(&mut low);
        upward(&mut low);
        upward(&mut high);
        downward(&mut high);
        low.into_iter().zip(high).map(|(low, high)| (low + high) / 2.0).collect()
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
