//! Layered layout of a graph (Sugiyama): columns from left to right along the data flow.
//!
//! Own code: `rust-sugiyama` returns positions of nodes alone, and an edge that passes a column needs a place there, too.

use super::{Edge, Graph};

/// Between columns, and between the rows of one.
const COLUMN: f64 = 96.0;
const ROW: f64 = 18.0;

/// A line that only passes a column.
const PASSING: f64 = 6.0;

/// Where a node stands, its upper left corner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    pub x: f64,
    pub y: f64,
    pub column: usize,
}

/// Where all stand.
#[derive(Debug, Default)]
pub struct Layout {
    pub places: Vec<Place>,
    /// Points that each edge passes between its ends; none of an edge that goes back.
    pub ways: Vec<Vec<(f64, f64)>>,
    /// Whether an edge goes back to a column further left.
    pub back: Vec<bool>,
    pub width: f64,
    pub height: f64,
}

/// A node, or a place where an edge passes a column.
struct Slot {
    /// The node; or the edge that passes.
    node: Option<usize>,
    height: f64,
    column: usize,
    y: f64,
    /// Slots in the columns beside it.
    left: Vec<usize>,
    right: Vec<usize>,
}

/// Places nodes of these widths and heights.
pub fn place(graph: &Graph, sizes: &[(f64, f64)]) -> Layout {
    let order = order(graph);
    let is_back = |edge: &Edge| order[edge.from] >= order[edge.to];
    let back: Vec<bool> = graph.edges.iter().map(is_back).collect();
    let columns = columns(graph, &order, &back);
    let count = columns.iter().max().map_or(0, |last| last + 1);
    let mut slots: Vec<Slot> = Vec::new();
    for (node, (_, height)) in sizes.iter().enumerate() {
        let column = columns[node];
        slots.push(Slot {
            node: Some(node),
            height: *height,
            column,
            y: 0.0,
            left: Vec::new(),
            right: Vec::new(),
        });
    }
    let mut passes: Vec<Vec<usize>> = vec![Vec::new(); graph.edges.len()];
    // Edges of one node to one other pass together.
    let mut bundles = std::collections::BTreeMap::new();
    for (index, edge) in graph.edges.iter().enumerate().filter(|(index, _)| !back[*index]) {
        if let Some(first) = bundles.get(&(edge.from, edge.to)) {
            let first: &usize = first;
            passes[index] = passes[*first].clone();
            continue;
        }
        bundles.insert((edge.from, edge.to), index);
        let mut before = edge.from;
        for column in columns[edge.from] + 1..columns[edge.to] {
            let slot =
                Slot { node: None, height: PASSING, column, y: 0.0, left: vec![before], right: Vec::new() };
            slots.push(slot);
            let own = slots.len() - 1;
            slots[before].right.push(own);
            passes[index].push(own);
            before = own;
        }
        slots[before].right.push(edge.to);
        slots[edge.to].left.push(before);
    }
    let mut rows: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut by_order: Vec<usize> = (0..slots.len()).collect();
    by_order.sort_by_key(|slot| slots[*slot].node.map_or((1, *slot), |node| (0, order[node])));
    for slot in by_order {
        rows[slots[slot].column].push(slot);
    }
    untangle(&mut slots, &mut rows);
    settle(&mut slots, &rows);
    finish(graph, sizes, &slots, &rows, passes, back)
}

/// An order of the nodes in which few edges go back: what nothing flows into comes first (Eades, Lin and Smyth).
fn order(graph: &Graph) -> Vec<usize> {
    let count = graph.nodes.len();
    let mut left: Vec<bool> = vec![true; count];
    let (mut first, mut last) = (Vec::new(), Vec::new());
    let degrees = |left: &[bool], node: usize| {
        let lives = |edge: &&Edge| left[edge.from] && left[edge.to] && edge.from != edge.to;
        let of = graph.edges.iter().filter(lives);
        let (into, out): (Vec<_>, Vec<_>) =
            of.filter(|edge| edge.from == node || edge.to == node).partition(|edge| edge.to == node);
        (into.len(), out.len())
    };
    while left.iter().any(|left| *left) {
        let nodes: Vec<usize> = (0..count).filter(|node| left[*node]).collect();
        let degree: Vec<_> = nodes.iter().map(|node| (*node, degrees(&left, *node))).collect();
        if let Some((node, _)) = degree.iter().find(|(_, (_, out))| *out == 0) {
            last.push(*node);
            left[*node] = false;
        } else if let Some((node, _)) = degree.iter().find(|(_, (into, _))| *into == 0) {
            first.push(*node);
            left[*node] = false;
        } else if let Some((node, _)) = degree
            .iter()
            .max_by_key(|(node, (into, out))| (*out as i64 - *into as i64, std::cmp::Reverse(*node)))
        {
            first.push(*node);
            left[*node] = false;
        }
    }
    let mut order = vec![0; count];
    for (place, node) in first.into_iter().chain(last.into_iter().rev()).enumerate() {
        order[node] = place;
    }
    order
}

/// The column of each node: right of all that flows into it, and as near to what it flows into as that lets it.
fn columns(graph: &Graph, order: &[usize], back: &[bool]) -> Vec<usize> {
    let mut nodes: Vec<usize> = (0..order.len()).collect();
    nodes.sort_by_key(|node| order[*node]);
    let forward = || graph.edges.iter().zip(back).filter(|(_, back)| !**back).map(|(edge, _)| edge);
    let mut columns = vec![0_usize; order.len()];
    for node in &nodes {
        let before = forward().filter(|edge| edge.to == *node).map(|edge| columns[edge.from] + 1);
        columns[*node] = before.max().unwrap_or(0);
    }
    for node in nodes.iter().rev() {
        let has_source = forward().any(|edge| edge.to == *node);
        let next = forward().filter(|edge| edge.from == *node).map(|edge| columns[edge.to]).min();
        if let Some(next) = next.filter(|_| !has_source) {
            columns[*node] = next.saturating_sub(1);
        }
    }
    columns
}

/// Orders the rows of each column so that fewer lines cross: each by the middle of what it is linked to beside it.
fn untangle(slots: &mut [Slot], rows: &mut [Vec<usize>]) {
    let number = |slots: &mut [Slot], rows: &[Vec<usize>]| {
        for row in rows {
            row.iter().enumerate().for_each(|(place, slot)| slots[*slot].y = place as f64);
        }
    };
    number(slots, rows);
    for sweep in 0..24 {
        let from_left = sweep % 2 == 0;
        let count = rows.len();
        for step in 0..count {
            let column = if from_left { step } else { count - 1 - step };
            let middle = |slot: usize| {
                let beside = if from_left { &slots[slot].left } else { &slots[slot].right };
                let places: Vec<f64> = beside.iter().map(|other| slots[*other].y).collect();
                match places.len() {
                    0 => slots[slot].y,
                    count => places.iter().sum::<f64>() / count as f64,
                }
            };
            let mut keyed: Vec<(f64, usize)> =
                rows[column].iter().map(|slot| (middle(*slot), *slot)).collect();
            keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
            rows[column] = keyed.into_iter().map(|(_, slot)| slot).collect();
            let placed = rows[column].clone();
            placed.iter().enumerate().for_each(|(place, slot)| slots[*slot].y = place as f64);
        }
    }
}

/// Moves all up and down to what they are linked to, as far as the rows of a column let them.
fn settle(slots: &mut [Slot], rows: &[Vec<usize>]) {
    for row in rows {
        let mut y = 0.0;
        for slot in row {
            slots[*slot].y = y;
            y += slots[*slot].height + ROW;
        }
    }
    for _ in 0..32 {
        for row in rows {
            let wanted: Vec<f64> = row
                .iter()
                .map(|slot| {
                    let own = &slots[*slot];
                    let beside = own.left.iter().chain(&own.right);
                    let middles: Vec<f64> =
                        beside.map(|other| slots[*other].y + slots[*other].height / 2.0).collect();
                    match middles.len() {
                        0 => own.y,
                        count => middles.iter().sum::<f64>() / count as f64 - own.height / 2.0,
                    }
                })
                .collect();
            spread(slots, row, &wanted);
        }
    }
    let top = slots.iter().map(|slot| slot.y).fold(f64::INFINITY, |a, b| if b < a { b } else { a });
    slots.iter_mut().for_each(|slot| slot.y -= top);
}

/// Gives slots the places that they want, apart from each other: those that would overlap move as a block to their middle.
fn spread(slots: &mut [Slot], row: &[usize], wanted: &[f64]) {
    // Each block: its first slot, how many, where it begins, and the sum of what they want of that.
    let mut blocks: Vec<(usize, usize, f64, f64)> = Vec::new();
    for (index, want) in wanted.iter().enumerate() {
        blocks.push((index, 1, *want, *want));
        while let [.., (first, count, begin, sum), (_, next, beside, other)] = &blocks[..] {
            let length: f64 = row[*first..first + count].iter().map(|slot| slots[*slot].height + ROW).sum();
            if begin + length <= *beside {
                break;
            }
            let (first, all) = (*first, count + next);
            let sum = sum + other - *next as f64 * length;
            blocks.truncate(blocks.len() - 2);
            blocks.push((first, all, sum / all as f64, sum));
        }
    }
    for (first, count, begin, _) in blocks {
        let mut y = begin;
        for slot in &row[first..first + count] {
            slots[*slot].y = y;
            y += slots[*slot].height + ROW;
        }
    }
}

fn finish(
    graph: &Graph,
    sizes: &[(f64, f64)],
    slots: &[Slot],
    rows: &[Vec<usize>],
    passes: Vec<Vec<usize>>,
    back: Vec<bool>,
) -> Layout {
    let mut lefts = Vec::new();
    let mut x = 0.0;
    for row in rows {
        lefts.push(x);
        let widths = row.iter().filter_map(|slot| Some(sizes[slots[*slot].node?].0));
        x += widths.fold(0.0, |a, b| if b > a { b } else { a }) + COLUMN;
    }
    let widths: Vec<f64> =
        lefts.iter().zip(lefts.iter().skip(1).chain([&x])).map(|(a, b)| b - a - COLUMN).collect();
    // Where there is no node there is no column, and no gap behind one.
    let width = if rows.is_empty() { 0.0 } else { x - COLUMN };
    let mut layout = Layout { width, back, ..Layout::default() };
    // The nodes come before what passes.
    for Slot { column, y, .. } in slots.iter().take(graph.nodes.len()) {
        let (column, y) = (*column, *y);
        layout.places.push(Place { x: lefts[column], y, column });
    }
    for way in passes {
        let points = way.iter().flat_map(|slot| {
            let (column, y) = (slots[*slot].column, slots[*slot].y + PASSING / 2.0);
            [(lefts[column], y), (lefts[column] + widths[column], y)]
        });
        layout.ways.push(points.collect());
    }
    let bottoms = slots.iter().map(|slot| slot.y + slot.height);
    layout.height = bottoms.fold(0.0, |a, b| if b > a { b } else { a });
    layout
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Flow, Kind, Node};
    use super::*;

    fn graph(count: usize, edges: &[(usize, usize)]) -> Graph {
        let node = |index| Node { name: format!("m{index}"), kind: Kind::Module, note: String::new() };
        let edge = |(from, to): &(usize, usize)| Edge {
            from: from % count,
            to: to % count,
            output: "o".into(),
            input: "i".into(),
            flow: Flow::Values,
            inferred: false,
        };
        Graph {
            title: "test".into(),
            nodes: (0..count).map(node).collect(),
            edges: edges.iter().map(edge).collect(),
        }
    }

    #[test]
    fn a_chain_goes_from_left_to_right_in_a_line() {
        let layout = place(&graph(3, &[(0, 1), (1, 2)]), &[(50.0, 20.0); 3]);
        let places = &layout.places;
        assert!(places[0].x < places[1].x && places[1].x < places[2].x, "{places:?}");
        assert!(places.iter().all(|place| place.y == places[0].y), "{places:?}");
        assert_eq!(layout.back, [false, false]);
    }

    #[test]
    fn of_a_circle_one_edge_goes_back() {
        let layout = place(&graph(3, &[(0, 1), (1, 2), (2, 0)]), &[(50.0, 20.0); 3]);
        assert_eq!(layout.back.iter().filter(|back| **back).count(), 1);
    }

    proptest! {
        #[test]
        fn no_two_nodes_overlap_and_all_edges_but_those_back_go_right(
            count in 1usize..14,
            edges in prop::collection::vec((0usize..14, 0usize..14), 0..40),
        ) {
            let graph = graph(count, &edges);
            let layout = place(&graph, &vec![(60.0, 30.0); count]);
            for (index, one) in layout.places.iter().enumerate() {
                prop_assert!(one.x >= 0.0 && one.y >= -1e-6 && one.y + 30.0 <= layout.height + 1e-6);
                for other in &layout.places[index + 1..] {
                    prop_assert!(one.column != other.column || (one.y - other.y).abs() >= 30.0 + ROW - 1e-6);
                }
            }
            for (edge, back) in graph.edges.iter().zip(&layout.back) {
                let (from, to) = (layout.places[edge.from], layout.places[edge.to]);
                prop_assert!(*back || from.column < to.column);
            }
        }
    }
}
