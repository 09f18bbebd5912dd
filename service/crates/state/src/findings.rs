//! What a mission's health tells of its events where they do not fit together: each finding is a sentence
//! with the likeliest cause and what to do.
//!
//! Findings follow from the state and the last events alone, so that a mission that comes back from its
//! journal has those that it had. Their cost does not grow with the mission. None changes a decision.
//!
//! Reading order: [`recent`] (the last events), here what is refused and what time it is; then
//! [`registrations`], [`attitudes`] and [`uncovered`].

mod attitudes;
mod recent;
mod registrations;
mod uncovered;

pub(crate) use attitudes::attitudes;
pub(crate) use recent::RecentEvents;
pub(crate) use registrations::registrations;
pub(crate) use uncovered::{LOOKED_AT, MIN_KEYFRAMES, uncovered};

use pdn_schemas::problem::Code;
use recent::RecentEvent;

/// Of the last events so many of one kind must have been refused before it is told: single outliers are what
/// they are.
const MANY_REFUSED: usize = 16;

/// The last events hardly span so long unless they are dated by two clocks, s: 30 days.
const LONG_S: f64 = 30.0 * 86_400.0;

const S_PER_NS: f64 = 1e-9;

/// After a false step every true measurement contradicts the graph.
pub(crate) fn contradicted(recent: &RecentEvents) -> Option<String> {
    let count = recent.iter().filter(|event| event.refused == Some(Code::Contradiction)).count();
    (count >= MANY_REFUSED).then(|| {
        format!(
            "{count} of the last {} events contradict the graph and were left out: a step or \
             prior before them may be false; if so, tie the next keyframe by a prior, or complete this \
             mission and configure another",
            recent::EVENTS
        )
    })
}

/// Kinds of events of which none is taken. Contradictions are told of by themselves.
pub(crate) fn all_refused(recent: &RecentEvents) -> Vec<String> {
    let mut kinds: Vec<&str> = recent.iter().map(|event| event.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds.into_iter().filter_map(|kind| all_refused_of(kind, recent)).collect()
}

fn all_refused_of(kind: &str, recent: &RecentEvents) -> Option<String> {
    let codes: Option<Vec<Code>> =
        recent.iter().filter(|event| event.kind == kind).map(|event| event.refused).collect();
    let codes = codes?; // none if one was taken
    let last = codes.iter().rfind(|code| **code != Code::Contradiction)?;
    (codes.len() >= MANY_REFUSED).then(|| {
        format!(
            "all {} {kind} events among the last {} were refused, the last as {}: out/rejected tells why",
            codes.len(),
            recent::EVENTS,
            last.name()
        )
    })
}

/// Stamps that go back, or that two clocks have made. No decision depends on them, but an export does.
pub(crate) fn stamps(recent: &RecentEvents) -> Option<String> {
    let advice = "decisions do not depend on it, exports do; date all events by one clock that only goes \
                  forward";
    let keyframes: Vec<&RecentEvent> =
        recent.iter().filter(|event| event.kind == recent::KEYFRAME && event.refused.is_none()).collect();
    let back = keyframes.windows(2).rev().find(|pair| pair[1].stamp_ns < pair[0].stamp_ns);
    if let Some([before, after]) = back {
        let back_s = seconds(after.stamp_ns, before.stamp_ns);
        return Some(format!(
            "stamp_ns goes back by {back_s:.3} s from event {} to event {}, both keyframes: {advice}",
            before.seq, after.seq
        ));
    }
    let dated = || recent.iter().filter(|event| event.stamp_ns.is_some());
    let first = dated().min_by_key(|event| event.stamp_ns)?;
    let last = dated().max_by_key(|event| event.stamp_ns)?;
    let span_s = seconds(first.stamp_ns, last.stamp_ns);
    (span_s > LONG_S).then(|| {
        format!(
            "stamp_ns of event {} ({}) lies {:.0} days before that of event {} ({}), as if two clocks had \
             made them: {advice}",
            first.seq,
            first.kind,
            span_s / 86_400.0,
            last.seq,
            last.kind
        )
    })
}

fn seconds(from_ns: Option<u64>, to_ns: Option<u64>) -> f64 {
    to_ns.unwrap_or(0).saturating_sub(from_ns.unwrap_or(0)) as f64 * S_PER_NS
}

/// More is covered than there is, which no new mission can come to.
pub(crate) fn more_than_all(covered_m2: f64, target_m2: f64) -> Option<String> {
    (covered_m2 > target_m2).then(|| {
        format!(
            "{covered_m2:.1} m^2 are covered of a target of {target_m2:.1} m^2: target.area_m2 is less than \
             the facets have, and decisions count the area as negative; configure the next mission with \
             area_m2 null"
        )
    })
}
