//! Which operations stand in a graph already, and where.

use std::hash::BuildHasher;

use rustc_hash::FxBuildHasher;

use super::operation::{Node, Operation};

/// No number.
const FREE: Node = Node::MAX;
/// Places of the smallest table.
const LEAST: usize = 1024;

/// Places of operations by what they are: a table of numbers alone, a tenth of what a map from operations would take, with the next
/// free place for what collides (Knuth 1998, "The Art of Computer Programming" 3, section 6.4, algorithm L).
#[derive(Clone, Debug, Default)]
pub(super) struct Known {
    /// A power of two, at most half of them taken.
    slots: Vec<Node>,
}

impl Known {
    /// Place of a known `operation` among `all`, or that of the next one, which the caller appends.
    pub fn place(&mut self, operation: &Operation, all: &[Operation]) -> Node {
        if 2 * all.len() >= self.slots.len() {
            self.grow(all);
        }
        let slot = self.slot(operation, |node| all[node as usize] == *operation);
        if self.slots[slot] == FREE {
            self.slots[slot] = all.len() as Node;
        }
        self.slots[slot]
    }

    /// First slot among known operations that is free or holds the number looked for.
    fn slot(&self, operation: &Operation, found: impl Fn(Node) -> bool) -> usize {
        let mask = self.slots.len() - 1;
        let mut slot = FxBuildHasher.hash_one(operation) as usize & mask;
        while self.slots[slot] != FREE && !found(self.slots[slot]) {
            slot = (slot + 1) & mask;
        }
        slot
    }

    fn grow(&mut self, all: &[Operation]) {
        self.slots = vec![FREE; (4 * all.len()).next_power_of_two().max(LEAST)];
        for (node, operation) in (0..).zip(all) {
            let slot = self.slot(operation, |_| false);
            self.slots[slot] = node;
        }
    }
}
