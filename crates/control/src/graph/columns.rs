//! Columns of a graph's nodes.

use slate_sorted::SortedSet;

use super::model::ModuleGraph;

/// Returns the column of each node.
/// It is right of all that flows into the node, except along an edge that closes a loop.
///
/// Depth-first search from the nodes that read least and are read most finds the edges that close loops.
pub(super) fn columns(graph: &ModuleGraph) -> Vec<usize> {
    let count = graph.nodes.len();
    let mut next: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut read = vec![0_usize; count];
    for (from, to) in graph.forward_pairs() {
        next[from].push(to);
        read[to] += 1;
    }
    let mut order: Vec<usize> = (0..count).collect();
    let surplus = |node: usize| read[node] as i64 - next[node].len() as i64;
    order.sort_by(|one, other| {
        let names = || graph.nodes[*one].name.cmp(&graph.nodes[*other].name);
        surplus(*one).cmp(&surplus(*other)).then_with(names)
    });
    let (mut is_open, mut is_seen) = (vec![false; count], vec![false; count]);
    let mut loops = SortedSet::new();
    let mut done = Vec::new();
    for start in order {
        if is_seen[start] {
            continue;
        }
        (is_open[start], is_seen[start]) = (true, true);
        let mut path = vec![(start, 0)];
        while let Some((node, at)) = path.last_mut() {
            let Some(other) = next[*node].get(*at).copied() else {
                is_open[*node] = false;
                done.push(*node);
                path.pop();
                continue;
            };
            *at += 1;
            if is_open[other] {
                loops.insert((*node, other));
            } else if !is_seen[other] {
                (is_open[other], is_seen[other]) = (true, true);
                path.push((other, 0));
            }
        }
    }
    let mut columns = vec![0; count];
    for node in done.into_iter().rev() {
        for other in next[node].iter().filter(|other| !loops.contains(&(node, **other))) {
            columns[*other] = columns[*other].max(columns[node] + 1);
        }
    }
    columns
}
