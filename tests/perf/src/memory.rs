//! Memory of one job, in a process that does nothing else.

use std::path::Path;

use serde::Serialize;

use crate::Fallible;
use crate::arrays::Arrays;
use crate::input::{self, Blocks};
use crate::kernel::{self, Node, Stream, VirtualPath, Wanted, Workspace};
use crate::measure::{forget_peak, peak_mb, resident_mb};
use crate::survey::Keyframe;

/// Memory of this process, MB.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Memory {
    /// Held before the work began, its input included.
    pub before: f64,
    /// The most that was held while it lasted.
    pub peak: f64,
}

/// Streams a survey.
pub fn of_stream(keyframes: &[Keyframe]) -> Fallible<Memory> {
    let mut stream = Stream::default();
    while_it_lasts(|| {
        for (index, keyframe) in keyframes.iter().enumerate() {
            stream.add(index, keyframe)?;
            stream.follow()?;
        }
        Ok(())
    })
}

/// Candidates that are read and evaluated at a time; what they take counts, and for the peers that of one.
const AT_ONCE: usize = 8;

/// Eliminates what `run --write` wrote and evaluates so many of its candidates, one after the other.
pub fn of_evaluation(file: &Path, count: usize) -> Fallible<Memory> {
    let arrays = Arrays::read(file)?;
    let robot = u32::try_from(arrays.f64("poses")?.len() / 7)?.saturating_sub(1);
    let (blocks, paths) = (Blocks::read(&arrays)?, input::paths(&arrays, Node(robot))?);
    let step = (arrays.u32("path_nodes")?.len() / count.max(1)).max(1);
    drop(arrays);
    let mut paths = paths.step_by(step).peekable();
    while_it_lasts(|| {
        let elimination = kernel::eliminate(blocks.system())?;
        let mut workspace = Workspace::default();
        while paths.peek().is_some() {
            let group: Vec<VirtualPath> = paths.by_ref().take(AT_ONCE).collect();
            let group: Vec<&VirtualPath> = group.iter().collect();
            kernel::evaluate(&elimination, &group, Wanted::Terminal, &mut workspace)?;
        }
        Ok(())
    })
}

fn while_it_lasts(work: impl FnOnce() -> Fallible<()>) -> Fallible<Memory> {
    forget_peak()?;
    let before = resident_mb();
    work()?;
    Ok(Memory { before, peak: peak_mb() })
}
