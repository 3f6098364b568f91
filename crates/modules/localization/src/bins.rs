//! Bins of poses.

use std::f64::consts::PI;

use slate_interfaces::Pose2;

/// Size of a bin, m and rad, as in Nav2.
const POSITION: f64 = 0.5;
const HEADINGS: i64 = 36;
/// Bins from here on are one.
const FARTHEST: i64 = 1 << 40;
/// No bin.
const NONE: u32 = u32::MAX;

/// Bins of poses with their weights, in the order of their first pose.
/// An open-addressing table finds them, as a tick must not allocate.
#[derive(Clone, Debug, Default)]
pub(crate) struct PoseBins {
    bins: Vec<PoseBin>,
    table: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct PoseBin {
    key: [i64; 3],
    weight: f64,
    cluster: u32,
}

impl PoseBins {
    /// Empties them, for that many poses.
    pub fn clear(&mut self, most: usize) {
        self.bins.clear();
        self.bins.reserve(most);
        self.table.clear();
        self.table.resize((2 * most).next_power_of_two(), NONE);
    }

    /// Adds a pose.
    pub fn add(&mut self, pose: &Pose2, weight: f64) {
        let key = key(pose);
        let slot = self.slot(key);
        match self.table[slot] {
            NONE => {
                self.table[slot] = self.bins.len() as u32;
                self.bins.push(PoseBin { key, weight, cluster: NONE });
            }
            bin => self.bins[bin as usize].weight += weight,
        }
    }

    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Returns the table slot of a bin, or the free slot for it.
    fn slot(&self, key: [i64; 3]) -> usize {
        let mixed = key.into_iter().fold(0_u64, |hash, part| {
            (hash ^ part as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
        });
        let mask = self.table.len() - 1;
        let mut slot = mixed as usize & mask;
        while self.table[slot] != NONE && self.bins[self.table[slot] as usize].key != key {
            slot = (slot + 1) & mask;
        }
        slot
    }

    /// Clusters adjacent bins, and returns the cluster of the largest weight.
    /// `stack` is a buffer.
    pub fn heaviest_cluster(&mut self, stack: &mut Vec<u32>) -> Option<u32> {
        let mut best: Option<(u32, f64)> = None;
        for first in 0..self.bins.len() {
            if self.bins[first].cluster != NONE {
                continue;
            }
            let cluster = first as u32;
            let mut weight = 0.0;
            self.bins[first].cluster = cluster;
            stack.push(cluster);
            while let Some(bin) = stack.pop() {
                weight += self.bins[bin as usize].weight;
                self.push_neighbors(bin, cluster, stack);
            }
            if best.is_none_or(|(_, most)| weight > most) {
                best = Some((cluster, weight));
            }
        }
        best.map(|(cluster, _)| cluster)
    }

    fn push_neighbors(&mut self, bin: u32, cluster: u32, stack: &mut Vec<u32>) {
        let [column, row, heading] = self.bins[bin as usize].key;
        for (right, up, turn) in (0..27).map(|k| (k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1)) {
            let key = [column + right, row + up, (heading + turn).rem_euclid(HEADINGS)];
            let other = self.table[self.slot(key)];
            if other != NONE && self.bins[other as usize].cluster == NONE {
                self.bins[other as usize].cluster = cluster;
                stack.push(other);
            }
        }
    }

    /// Returns the cluster of a pose that was added.
    pub fn cluster(&self, pose: &Pose2) -> Option<u32> {
        let bin = self.table[self.slot(key(pose))];
        self.bins.get(bin as usize).map(|bin| bin.cluster)
    }
}

fn key(pose: &Pose2) -> [i64; 3] {
    let heading = ((pose.theta + PI) / (2.0 * PI) * HEADINGS as f64).floor() as i64;
    // Neighbors of the farthest one are numbers, too.
    let part = |length: f64| ((length / POSITION).floor() as i64).clamp(-FARTHEST, FARTHEST);
    [part(pose.x), part(pose.y), heading.rem_euclid(HEADINGS)]
}
