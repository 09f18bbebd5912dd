//! Same events, same bits: in any order of delivery, with questions at any moment, at any number of threads.

mod support;

use pdn_schemas::codec::{self, Format};
use pdn_state::{DecisionJob, DecisionRequest, Event, Vehicle};
use proptest::prelude::*;
use support::{SENT_BYTES, bits, mission, pool, running, script};

fn reference() -> Vec<u8> {
    let mut vehicle = running();
    script("m").offer_all(&mut vehicle);
    bits(mission(&mut vehicle), &pool(1))
}

/// Sorts the events by seq plus a delay, so that each comes at most `delays.max()` late, and doubles some.
fn delivered(delays: &[u64], repeats: &[bool]) -> Vec<Event> {
    let mut events: Vec<(u64, Event)> = Vec::new();
    for (index, event) in script("m").events.into_iter().enumerate() {
        let (delay, repeat) = (delays[index % delays.len()], repeats[index % repeats.len()]);
        if repeat {
            events.push((event.seq() + 2 * delay + 1, event.clone()));
        }
        events.push((event.seq() + delay, event));
    }
    events.sort_by_key(|(due, _)| *due);
    events.into_iter().map(|(_, event)| event).collect()
}

fn offer(vehicle: &mut Vehicle, event: Event) {
    assert_eq!(vehicle.offer(event, SENT_BYTES).refused, vec![]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, ..ProptestConfig::default() })]

    #[test]
    fn any_order_of_delivery_with_repeats_gives_the_same_bits(
        delays in prop::collection::vec(0..40_u64, 1..120),
        repeats in prop::collection::vec(any::<bool>(), 1..50),
    ) {
        let mut vehicle = running();
        for event in delivered(&delays, &repeats) {
            offer(&mut vehicle, event);
        }
        prop_assert!(bits(mission(&mut vehicle), &pool(1)) == reference());
    }

    #[test]
    fn questions_at_any_moment_change_no_later_bit(
        questions in prop::collection::vec(0..6_u8, 1..120),
    ) {
        let (mut vehicle, pool) = (running(), pool(1));
        for (event, question) in script("m").events.into_iter().zip(questions.iter().cycle()) {
            offer(&mut vehicle, event);
            let mission = mission(&mut vehicle);
            match question {
                0 => drop(mission.state()),
                1 => drop(mission.begin_graph(None, true).run().expect("the graph is regular")),
                2 => drop(mission.coverage()),
                3 => {
                    let job = mission.begin_decision(DecisionRequest::default()).expect("the mission runs");
                    job.run(&pool, &|| false).expect("a decision");
                }
                _ => {}
            }
        }
        prop_assert!(bits(mission(&mut vehicle), &pool) == reference());
    }
}

#[test]
fn decisions_have_the_same_bits_at_any_number_of_threads() {
    let expected = reference();
    for threads in [2, 4] {
        let mut vehicle = running();
        script("m").offer_all(&mut vehicle);
        assert!(bits(mission(&mut vehicle), &pool(threads)) == expected, "{threads} threads");
    }
}

/// Views leave to each other what they derive: each after those before it, each after those that came later,
/// and each alone, in a mission that was asked nothing else, give the same bits.
#[test]
fn decisions_have_the_same_bits_whatever_their_views_inherit() {
    let (pool, events) = (pool(2), script("m").events);
    let asked: Vec<usize> = (10..events.len()).step_by(3).collect();
    let begin = |vehicle: &mut Vehicle| {
        let request = DecisionRequest { full: true, ..Default::default() };
        mission(vehicle).begin_decision(request).expect("the mission runs")
    };
    let decide = |job: &DecisionJob| {
        let outcome = job.run(&pool, &|| false).expect("a decision");
        codec::encode(outcome.decision(), Format::Bincode).expect("it can be encoded")
    };
    let (mut vehicle, mut jobs, mut onward) = (running(), Vec::new(), Vec::new());
    for (index, event) in events.iter().enumerate() {
        offer(&mut vehicle, event.clone());
        if asked.contains(&index) {
            onward.push(decide(&begin(&mut vehicle)));
        }
    }
    let mut vehicle = running();
    for (index, event) in events.iter().enumerate() {
        offer(&mut vehicle, event.clone());
        if asked.contains(&index) {
            jobs.push(begin(&mut vehicle));
        }
    }
    let mut backward: Vec<Vec<u8>> = jobs.iter().rev().map(decide).collect();
    backward.reverse();
    for ((&index, onward), backward) in asked.iter().zip(&onward).zip(&backward) {
        let mut vehicle = running();
        events[..=index].iter().for_each(|event| offer(&mut vehicle, event.clone()));
        let alone = decide(&begin(&mut vehicle));
        assert!(*onward == alone && *backward == alone, "after event {index}");
    }
}
