//! Which nodes share a front, and which fronts feed which.

/// What is to be ordered into fronts: the nodes of a part of the graph that is closed towards the root.
pub(super) struct Part<'a> {
    /// Elimination order of the part's nodes, by local index.
    pub order: &'a [u32],
    /// Adjacency of the local nodes: those of node v are `targets[offsets[v]..offsets[v + 1]]`.
    pub offsets: &'a [u32],
    pub targets: &'a [u32],
    /// Subtrees that stay: the local indices of each one's separator.
    pub orphans: &'a [Vec<u32>],
}

/// A front before its numbers are known. Local indices throughout.
#[derive(Debug, Default)]
pub(super) struct SymbolicFront {
    /// Nodes eliminated here, in elimination order.
    pub frontal: Vec<u32>,
    /// Nodes eliminated later that these are joined to, in elimination order.
    pub separator: Vec<u32>,
    /// Fronts of this analysis below this one, by their place in the result.
    pub children: Vec<u32>,
    /// Orphans below this one.
    pub orphans: Vec<u32>,
}

/// A front may take a child in while zeros fill no more than this share of its blocks,
/// by the number of nodes it then eliminates. Measured on surveys: small fronts cost more
/// to visit than to compute, large ones the other way round.
const ZEROS_ALLOWED: [(usize, f64); 3] = [(2, 0.6), (6, 0.3), (usize::MAX, 0.06)];

const NONE: u32 = u32::MAX;

/// Fronts, children before parents. Cost: proportional to the blocks of the factor.
pub(super) fn analyse(part: &Part) -> Vec<SymbolicFront> {
    let structure = structure(part);
    let mut fronts: Vec<SymbolicFront> = Vec::with_capacity(part.order.len());
    let mut zeros: Vec<usize> = Vec::with_capacity(part.order.len());
    let mut absorbed: Vec<bool> = Vec::with_capacity(part.order.len());
    for (place, node) in structure.columns.into_iter().enumerate() {
        let mut front = SymbolicFront {
            frontal: vec![part.order[place]],
            separator: node.later,
            children: Vec::new(),
            orphans: node.orphans,
        };
        let mut zeros_here = 0;
        // The widest child first: it fills least.
        let mut children = node.children;
        children.sort_by_key(|&child| (usize::MAX - fronts[child as usize].separator.len(), child));
        for child in children {
            let below = &fronts[child as usize];
            let merged = below.frontal.len() + front.frontal.len();
            let blocks = |frontal: usize, separator: usize| frontal * (frontal + 1) / 2 + frontal * separator;
            let blocks_merged = blocks(merged, front.separator.len());
            let added = blocks_merged
                - blocks(below.frontal.len(), below.separator.len())
                - blocks(front.frontal.len(), front.separator.len());
            let zeros_merged = zeros_here + zeros[child as usize] + added;
            let allowed = ZEROS_ALLOWED
                .iter()
                .find(|(nodes, _)| merged <= *nodes)
                .expect("the last row allows any number")
                .1;
            if zeros_merged as f64 <= allowed * blocks_merged as f64 {
                let below = std::mem::take(&mut fronts[child as usize]);
                absorbed[child as usize] = true;
                zeros_here = zeros_merged;
                let own = std::mem::replace(&mut front.frontal, below.frontal);
                front.frontal.extend(own);
                front.children.extend(below.children);
                front.orphans.extend(below.orphans);
            } else {
                front.children.push(child);
            }
        }
        fronts.push(front);
        zeros.push(zeros_here);
        absorbed.push(false);
    }
    compact(fronts, &absorbed, &structure.place)
}

/// Drops the absorbed fronts and orders every list.
fn compact(fronts: Vec<SymbolicFront>, absorbed: &[bool], place: &[u32]) -> Vec<SymbolicFront> {
    let mut renumbered = vec![NONE; fronts.len()];
    let mut compacted: Vec<SymbolicFront> = Vec::new();
    for (index, mut front) in fronts.into_iter().enumerate() {
        if absorbed[index] {
            continue;
        }
        front.frontal.sort_unstable_by_key(|&node| place[node as usize]);
        for child in &mut front.children {
            *child = renumbered[*child as usize];
        }
        front.children.sort_unstable();
        front.orphans.sort_unstable();
        renumbered[index] = compacted.len() as u32;
        compacted.push(front);
    }
    compacted
}

struct Structure {
    columns: Vec<Column>,
    /// Place of each local node in the order.
    place: Vec<u32>,
}

/// One node's column of the factor.
struct Column {
    /// Nodes with a block below the diagonal, in elimination order.
    later: Vec<u32>,
    /// Places of the columns whose first later node this is.
    children: Vec<u32>,
    orphans: Vec<u32>,
}

/// The structure of each column of the factor, in elimination order: its own neighbours, and what its
/// children and orphans have, as far as eliminated later.
fn structure(part: &Part) -> Structure {
    let count = part.order.len();
    let mut place = vec![NONE; count];
    for (position, &node) in part.order.iter().enumerate() {
        place[node as usize] = position as u32;
    }
    let mut orphans_of: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (orphan, separator) in part.orphans.iter().enumerate() {
        if let Some(first) = separator.iter().map(|&node| place[node as usize]).min() {
            orphans_of[first as usize].push(orphan as u32);
        }
    }
    let mut children_of: Vec<Vec<u32>> = vec![Vec::new(); count];
    let mut columns: Vec<Column> = Vec::with_capacity(count);
    let mut seen = vec![NONE; count];
    let mut positions: Vec<u32> = Vec::new();
    for position in 0..count {
        let node = part.order[position] as usize;
        positions.clear();
        let mut gather = |other: u32| {
            let at = place[other as usize];
            if at > position as u32 && seen[at as usize] != position as u32 {
                seen[at as usize] = position as u32;
                positions.push(at);
            }
        };
        part.targets[part.offsets[node] as usize..part.offsets[node + 1] as usize]
            .iter()
            .copied()
            .for_each(&mut gather);
        let orphans = std::mem::take(&mut orphans_of[position]);
        for &orphan in &orphans {
            part.orphans[orphan as usize].iter().copied().for_each(&mut gather);
        }
        let children = std::mem::take(&mut children_of[position]);
        for &child in &children {
            columns[child as usize].later.iter().copied().for_each(&mut gather);
        }
        positions.sort_unstable();
        if let Some(&parent) = positions.first() {
            children_of[parent as usize].push(position as u32);
        }
        let later = positions.iter().map(|&at| part.order[at as usize]).collect();
        columns.push(Column { later, children, orphans });
    }
    Structure { columns, place }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_becomes_a_path_of_fronts() {
        let offsets: Vec<u32> = vec![0, 1, 3, 5, 6];
        let targets = vec![1, 0, 2, 1, 3, 2];
        let order = [0, 1, 2, 3];
        let fronts = analyse(&Part { order: &order, offsets: &offsets, targets: &targets, orphans: &[] });
        let eliminated: Vec<u32> = fronts.iter().flat_map(|front| front.frontal.clone()).collect();
        assert_eq!(eliminated, order);
        assert!(fronts.last().expect("there is a root").separator.is_empty());
    }

    #[test]
    fn an_orphan_fills_its_separator_and_hangs_below_its_first_node() {
        let offsets = [0, 0, 0, 0, 0];
        let orphans = [vec![1, 3]];
        let fronts =
            analyse(&Part { order: &[0, 1, 2, 3], offsets: &offsets, targets: &[], orphans: &orphans });
        let holder = fronts.iter().find(|front| front.frontal.contains(&1)).expect("each node has a front");
        assert_eq!(holder.orphans, vec![0]);
        assert!(holder.frontal.contains(&3) || holder.separator == vec![3]);
    }
}
