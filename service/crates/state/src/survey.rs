//! How much of the planned way is still ahead.

use nalgebra::Vector3;

/// The planned way over the target: a polyline in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    points: Vec<Vector3<f64>>,
    /// Length from the beginning to each point, m.
    reached_m: Vec<f64>,
    /// The robot counts as on the way while it is no farther from it than this, m.
    corridor_m: f64,
}

/// How far along the way the robot has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Length of the way behind the robot, m.
    pub done_m: f64,
    /// Where the robot was last looked at.
    pub(crate) last: Option<Vector3<f64>>,
}

impl Survey {
    /// A way through `points`, at least two and finite. The robot is on it within `corridor_m`.
    pub fn new(points: Vec<Vector3<f64>>, corridor_m: f64) -> Survey {
        let mut reached_m = Vec::with_capacity(points.len());
        let mut length_m = 0.0;
        for (index, point) in points.iter().enumerate() {
            length_m += index.checked_sub(1).map_or(0.0, |before| (point - points[before]).norm());
            reached_m.push(length_m);
        }
        Survey { points, reached_m, corridor_m }
    }

    /// Its whole length, m.
    pub fn length_m(&self) -> f64 {
        self.reached_m.last().copied().unwrap_or(0.0)
    }

    /// Progress once the robot is at `robot` (world, m).
    ///
    /// It never falls. The robot is projected on the part of the way from where it had come up to twice the
    /// distance that it moved since (a neighbouring line, passed earlier or later, lies outside of that
    /// part), and gets there if that place is within the corridor: a revisit leaves the way and gains
    /// nothing. Before its first look the robot is taken to have come from the way's beginning.
    pub fn advance(&self, progress: Progress, robot: Vector3<f64>) -> Progress {
        let moved_m = (robot - progress.last.unwrap_or(self.points[0])).norm();
        let until_m = progress.done_m + 2.0 * moved_m;
        let mut best = (f64::INFINITY, progress.done_m);
        for (ends, reached) in self.points.windows(2).zip(self.reached_m.windows(2)) {
            let (from_m, to_m) = (reached[0].max(progress.done_m), reached[1].min(until_m));
            let length_m = reached[1] - reached[0];
            if from_m > to_m || length_m <= 0.0 {
                continue;
            }
            let direction = (ends[1] - ends[0]) / length_m;
            let along_m = (reached[0] + (robot - ends[0]).dot(&direction)).clamp(from_m, to_m);
            let distance_m = (robot - ends[0] - direction * (along_m - reached[0])).norm();
            if distance_m < best.0 {
                best = (distance_m, along_m);
            }
        }
        let done_m = if best.0 <= self.corridor_m { best.1 } else { progress.done_m };
        Progress { done_m, last: Some(robot) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four lines of 20 m, 1 m apart, there and back.
    fn lawn() -> Survey {
        let points = (0..4).flat_map(|line| {
            let (y, out) = (f64::from(line), line % 2 == 0);
            let (begin, end) = if out { (0.0, 20.0) } else { (20.0, 0.0) };
            [Vector3::new(begin, y, 0.0), Vector3::new(end, y, 0.0)]
        });
        Survey::new(points.collect(), 1.6)
    }

    fn place(survey: &Survey, at_m: f64) -> Vector3<f64> {
        let index = survey.reached_m.iter().rposition(|reached| *reached <= at_m).unwrap_or(0);
        let last = survey.points.len() - 2;
        let (ends, reached) = (&survey.points[index.min(last)..], survey.reached_m[index.min(last)]);
        ends[0] + (ends[1] - ends[0]).normalize() * (at_m - reached)
    }

    #[test]
    fn a_robot_on_the_way_is_where_it_is_despite_an_offset() {
        let survey = lawn();
        assert_eq!(survey.length_m(), 83.0);
        let mut progress = Progress::default();
        for step in 0..=166 {
            let at_m = 0.5 * f64::from(step);
            progress = survey.advance(progress, place(&survey, at_m) + Vector3::new(0.0, 0.2, 0.1));
            // The offset of 0.2 m shows along the short pieces between the lines, and no more than that.
            assert!((progress.done_m - at_m).abs() <= 0.2 + 1e-9, "{at_m}: {}", progress.done_m);
        }
    }

    #[test]
    fn a_revisit_across_the_lines_gains_nothing() {
        let survey = lawn();
        let mut progress = Progress::default();
        for step in 0..=90 {
            progress = survey.advance(progress, place(&survey, 0.5 * f64::from(step)));
        }
        let before = progress;
        let from = place(&survey, 45.0);
        for step in (0..=40).chain((0..40).rev()) {
            progress = survey.advance(progress, from - Vector3::new(0.0, 0.5 * f64::from(step), 0.0));
            assert!(progress.done_m >= before.done_m);
        }
        assert!((progress.done_m - 45.0).abs() < 1e-9, "{}", progress.done_m);
    }

    #[test]
    fn a_detour_over_a_line_still_ahead_does_not_skip_to_it() {
        let survey = lawn();
        let mut progress = Progress::default();
        for step in 0..=50 {
            progress = survey.advance(progress, place(&survey, 0.5 * f64::from(step)));
        }
        let from = place(&survey, 25.0);
        for step in (0..=4).chain((0..4).rev()) {
            progress = survey.advance(progress, from + Vector3::new(0.0, 0.5 * f64::from(step), 0.0));
        }
        assert!((progress.done_m - 25.0).abs() < 1e-9, "{}", progress.done_m);
    }
}
