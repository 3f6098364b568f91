//! Open list of a search.

/// No cell, or no bucket.
const NONE: u32 = u32::MAX;
/// Priorities in one bucket differ by less than this, cells.
const WIDTH: f64 = 0.25;

/// Bucket queue of cells by priority.
/// Buckets are lists through the cells themselves (Dial, 1969, *Shortest-path forest with topological ordering*): each
/// operation takes constant time, and a cell is in it once.
///
/// Priorities in the queue may span [`BucketQueue::clear`]'s `span`, as those of a search with a consistent heuristic
/// do, which span one step. In a bucket, the cell that came last is the first.
#[derive(Clone, Debug, Default)]
pub(crate) struct BucketQueue {
    /// First cell of each bucket; they are used in a circle.
    first: Vec<u32>,
    /// Bucket of the search, counted from priority 0.
    current: u64,
    len: usize,
    links: Vec<BucketLink>,
}

#[derive(Clone, Copy, Debug)]
struct BucketLink {
    next: u32,
    previous: u32,
    bucket: u32,
}

impl BucketQueue {
    /// Empties the queue, for `cells` cells.
    /// Priorities begin at `lowest` and span at most `span`.
    pub fn clear(&mut self, cells: usize, lowest: f64, span: f64) {
        while self.pop().is_some() {}
        // One more for the bucket of the lowest one, and one for rounding.
        let buckets = ((span / WIDTH) as usize + 3).next_power_of_two();
        if self.first.len() < buckets {
            self.first.clear();
            self.first.resize(buckets, NONE);
        }
        self.links.resize(cells, BucketLink { next: NONE, previous: NONE, bucket: NONE });
        self.current = (lowest / WIDTH) as u64;
        self.len = 0;
    }

    /// Inserts a cell, or changes its priority.
    /// A priority below the current bucket's counts as in it.
    #[inline(always)]
    pub fn insert(&mut self, cell: u32, priority: f64) {
        let number = u64::max((priority / WIDTH) as u64, self.current);
        let bucket = (number & (self.first.len() as u64 - 1)) as u32;
        let link = self.links[cell as usize];
        if link.bucket == bucket {
            return;
        }
        if link.bucket != NONE {
            self.unlink(link);
        }
        let next = std::mem::replace(&mut self.first[bucket as usize], cell);
        if next != NONE {
            self.links[next as usize].previous = cell;
        }
        self.links[cell as usize] = BucketLink { next, previous: NONE, bucket };
        self.len += 1;
    }

    /// Removes and returns a cell of the lowest bucket.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<u32> {
        if self.len == 0 {
            return None;
        }
        let mask = self.first.len() as u64 - 1;
        while self.first[(self.current & mask) as usize] == NONE {
            self.current += 1;
        }
        let cell = self.first[(self.current & mask) as usize];
        let link = std::mem::replace(
            &mut self.links[cell as usize],
            BucketLink { next: NONE, previous: NONE, bucket: NONE },
        );
        self.unlink(link);
        Some(cell)
    }

    fn unlink(&mut self, link: BucketLink) {
        match link.previous {
            NONE => self.first[link.bucket as usize] = link.next,
            previous => self.links[previous as usize].next = link.next,
        }
        if link.next != NONE {
            self.links[link.next as usize].previous = link.previous;
        }
        self.len -= 1;
    }

    /// Returns true if no queued cell has a lower priority.
    #[inline(always)]
    pub fn is_past(&self, priority: f64) -> bool {
        (self.current as f64) * WIDTH >= priority
    }
}
