"""What is run: surveys, candidates, and how often."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Grid:
    """One extent of the benchmark."""

    keyframes: tuple[int, ...]
    salient_percent: tuple[int, ...]
    candidates: tuple[int, ...]
    repeats: int
    """How often each of our times is measured; the median counts."""
    runs: int
    """Candidates that each peer is run on."""
    exact_runs: int
    """Candidates that are compared with the truth."""
    streams: tuple[int, ...]
    """Surveys, by keyframes, that are streamed through iSAM2 too."""
    memories: tuple[int, ...]
    """Surveys, by keyframes, whose memory is measured, 20 % salient: with 60 GTSAM takes many minutes."""
    decisions: int
    """Whole decisions of the daemon, of each detail and encoding."""
    daemons: tuple[int, ...]
    """Surveys, by keyframes, 20 % salient, that the daemon decides on."""
    alone: tuple[int, ...] = field(default=())
    """Surveys, by keyframes, that only ours is run on, 20 % salient."""


SIZES = (500, 2_000, 5_000, 10_000, 20_000)

GRIDS = {
    "quick": Grid(
        keyframes=(500, 2_000),
        salient_percent=(20,),
        candidates=(10,),
        repeats=1,
        runs=2,
        exact_runs=5,
        streams=(500,),
        memories=(2_000,),
        decisions=2,
        daemons=(500,),
    ),
    "default": Grid(
        keyframes=SIZES,
        salient_percent=(20, 60),
        candidates=(10, 50, 200),
        repeats=3,
        runs=4,
        exact_runs=6,
        streams=(10_000,),
        memories=(20_000,),
        decisions=16,
        daemons=(10_000,),
        alone=(100_000,),
    ),
    "full": Grid(
        keyframes=SIZES,
        salient_percent=(20, 60),
        candidates=(10, 50, 200),
        repeats=5,
        runs=20,
        exact_runs=20,
        streams=SIZES,
        memories=SIZES,
        decisions=32,
        daemons=SIZES,
        alone=(100_000,),
    ),
}
