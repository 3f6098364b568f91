//! Priority queue whose elements are moved and removed.

/// No place in the heap.
const NONE: u32 = u32::MAX;

/// Binary heap of cells by a key of two parts, the least first.
/// Among equal keys the cell of lower index comes first.
#[derive(Clone, Debug, Default)]
pub(crate) struct IndexedHeap {
    heap: Vec<(HeapKey, u32)>,
    /// Position of each cell in the heap.
    places: Vec<u32>,
}

/// Compared part by part; never NaN.
pub(crate) type HeapKey = (f64, f64);

impl IndexedHeap {
    /// Empties the heap, for that many cells.
    pub fn clear(&mut self, cells: usize) {
        self.heap.clear();
        self.places.clear();
        self.places.resize(cells, NONE);
    }

    pub fn first(&self) -> Option<(HeapKey, u32)> {
        self.heap.first().copied()
    }

    /// Inserts a cell, or gives it another key.
    pub fn set(&mut self, cell: u32, key: HeapKey) {
        match self.places[cell as usize] {
            NONE => {
                self.heap.push((key, cell));
                self.up(self.heap.len() - 1);
            }
            place => {
                let place = place as usize;
                let is_less = less((key, cell), self.heap[place]);
                self.heap[place].0 = key;
                if is_less { self.up(place) } else { self.down(place) }
            }
        }
    }

    /// Removes a cell, if it is in it.
    pub fn remove(&mut self, cell: u32) {
        let place = std::mem::replace(&mut self.places[cell as usize], NONE);
        if place == NONE {
            return;
        }
        let place = place as usize;
        self.heap.swap_remove(place);
        if place < self.heap.len() {
            self.up(place);
            self.down(self.places[self.heap[place].1 as usize] as usize);
        }
    }

    fn up(&mut self, mut place: usize) {
        let moved = self.heap[place];
        while place > 0 {
            let parent = (place - 1) / 2;
            if !less(moved, self.heap[parent]) {
                break;
            }
            self.put(place, self.heap[parent]);
            place = parent;
        }
        self.put(place, moved);
    }

    fn down(&mut self, mut place: usize) {
        let moved = self.heap[place];
        loop {
            let mut child = 2 * place + 1;
            if child >= self.heap.len() {
                break;
            }
            if child + 1 < self.heap.len() && less(self.heap[child + 1], self.heap[child]) {
                child += 1;
            }
            if !less(self.heap[child], moved) {
                break;
            }
            self.put(place, self.heap[child]);
            place = child;
        }
        self.put(place, moved);
    }

    fn put(&mut self, place: usize, element: (HeapKey, u32)) {
        self.heap[place] = element;
        self.places[element.1 as usize] = place as u32;
    }
}

fn less(a: (HeapKey, u32), b: (HeapKey, u32)) -> bool {
    let ((a_first, a_second), a_cell) = a;
    let ((b_first, b_second), b_cell) = b;
    a_first < b_first
        || (a_first == b_first && (a_second < b_second || (a_second == b_second && a_cell < b_cell)))
}
