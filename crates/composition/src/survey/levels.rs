//! Order of modules in a stage: writers before readers, otherwise by name.

/// Cycle of modules that depend on each other.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct CycleFound(pub Vec<usize>);

/// Sorts `count` modules topologically into levels; `edges` are (before, after).
/// Each module comes after those that it depends on. Inside a level the given order stays.
pub(super) fn levels(count: usize, edges: &[(usize, usize)]) -> Result<Vec<Vec<usize>>, CycleFound> {
    let mut level = vec![0_usize; count];
    // In a graph without cycles no path has more than count - 1 edges, so that many passes settle it.
    for pass in 0..=count {
        let mut changed = None;
        for &(before, after) in edges {
            if level[after] <= level[before] {
                level[after] = level[before] + 1;
                changed = Some(after);
            }
        }
        match changed {
            None => break,
            Some(module) if pass == count => return Err(CycleFound(cycle(module, count, edges))),
            Some(_) => {}
        }
    }
    let mut result = vec![Vec::new(); level.iter().map(|level| level + 1).max().unwrap_or(0)];
    for (module, &level) in level.iter().enumerate() {
        result[level].push(module);
    }
    Ok(result)
}

/// Returns a cycle found backwards from `module`, in the order of the edges.
fn cycle(module: usize, count: usize, edges: &[(usize, usize)]) -> Vec<usize> {
    // Only modules in or behind a circle still rise after `count` passes, so each has a predecessor; walking back
    // `count` times ends inside a circle.
    let on_circle = |module: usize| {
        let mut reached = vec![false; count];
        let mut todo = vec![module];
        while let Some(at) = todo.pop() {
            for &(before, after) in edges {
                if before == at && !reached[after] {
                    reached[after] = true;
                    todo.push(after);
                }
            }
        }
        reached[module]
    };
    let mut at = module;
    for _ in 0..count {
        if on_circle(at) {
            break;
        }
        let Some(&(before, _)) = edges.iter().find(|(_, after)| *after == at) else { break };
        at = before;
    }
    let mut path = vec![at];
    loop {
        let last = path[path.len() - 1];
        let next = edges.iter().find(|(before, after)| {
            *before == last && (*after == at || (on_circle(*after) && !path.contains(after)))
        });
        match next {
            Some(&(_, after)) if after != at => path.push(after),
            _ => return path,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writers_come_before_readers() {
        assert_eq!(levels(3, &[(2, 0), (0, 1)]), Ok(vec![vec![2], vec![0], vec![1]]));
    }

    #[test]
    fn independent_modules_share_a_level_in_the_given_order() {
        assert_eq!(levels(3, &[]), Ok(vec![vec![0, 1, 2]]));
    }

    #[test]
    fn a_circle_is_named() {
        let Err(CycleFound(mut found)) = levels(4, &[(0, 1), (1, 2), (2, 1), (2, 3)]) else {
            panic!("1 and 2 depend on each other");
        };
        found.sort_unstable();
        assert_eq!(found, [1, 2]);
    }

    #[test]
    fn a_module_that_reads_itself_is_a_circle() {
        assert_eq!(levels(1, &[(0, 0)]), Err(CycleFound(vec![0])));
    }
}
