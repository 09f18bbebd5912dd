//! The order of events: gaps, repeats, conflicts, bounds.

mod support;

use pdn_schemas::event::LinkOutcome;
use pdn_schemas::problem::Code;
use pdn_state::{Event, Limits, Operation, Vehicle};
use support::{config, mission, running, script};

fn changed(event: &Event) -> Event {
    let mut event = event.clone();
    match &mut event {
        Event::Keyframe(event) => event.stamp_ns += 1,
        Event::Factor(event) => event.stamp_ns += 1,
        Event::Link(event) => event.registered = !event.registered,
        Event::Undecodable(event) => event.message.push('!'),
    }
    event
}

#[test]
fn events_wait_for_missing_ones_which_are_told_as_ranges() {
    let (mut vehicle, events) = (running(), script("m").events);
    for seq in [0, 1, 4, 5, 9, 12] {
        let outcome = vehicle.offer(events[seq].clone());
        assert_eq!((outcome.applied, outcome.repeat), (u64::from(seq < 2), false));
    }
    let status = mission(&mut vehicle).ingest_status();
    assert_eq!((status.next_seq, status.buffered, status.rejected), (2, 4, 0));
    assert_eq!(status.missing, [(2, 3), (6, 8), (10, 11)]);
    assert!(mission(&mut vehicle).state().health.findings.iter().any(|finding| finding.contains("2 to 3")));
    assert_eq!(vehicle.offer(events[2].clone()).applied, 1);
    let outcome = vehicle.offer(events[3].clone());
    assert_eq!((outcome.applied, outcome.next_seq), (3, 6));
    let ack = mission(&mut vehicle).ack();
    assert_eq!((ack.next_seq, ack.durable_seq), (6, 6));
}

#[test]
fn repeats_are_ignored_and_conflicts_refused_whether_applied_waiting_or_refused() {
    let (mut vehicle, events) = (running(), script("m").events);
    let bad = Event::Link(LinkOutcome {
        mission: "m".into(),
        seq: 2,
        stamp_ns: 0,
        from: 77,
        to: 78,
        registered: true,
    });
    for event in [&events[0], &events[1], &bad, &events[5]] {
        vehicle.offer(event.clone());
    }
    let before = mission(&mut vehicle).ingest_status();
    assert_eq!((before.next_seq, before.rejected), (3, 1));
    for event in [&events[0], &events[1], &bad, &events[5]] {
        let repeat = vehicle.offer(event.clone());
        assert!(repeat.repeat && repeat.refused.is_empty() && repeat.applied == 0, "{repeat:?}");
        let conflict = vehicle.offer(changed(event));
        assert_eq!(conflict.refused.len(), 1);
        assert_eq!(
            (conflict.refused[0].seq, conflict.refused[0].error.code()),
            (event.seq(), Code::Conflict)
        );
    }
    assert_eq!(mission(&mut vehicle).ingest_status(), before);
}

#[test]
fn a_full_buffer_refuses_without_consuming_and_the_event_is_welcome_later() {
    let mut vehicle = Vehicle::new(Limits { max_buffered_events: 3, ..Limits::default() });
    vehicle.configure(config("m"), 1).expect("a valid configuration");
    let events = script("m").events;
    for event in &events[1..4] {
        assert_eq!(vehicle.offer(event.clone()).refused, vec![]);
    }
    let full = vehicle.offer(events[4].clone());
    assert_eq!((full.refused[0].error.code(), full.refused[0].seq, full.next_seq), (Code::Limit, 4, 0));
    assert_eq!(mission(&mut vehicle).ingest_status().rejected, 0);
    assert_eq!(vehicle.offer(events[0].clone()).next_seq, 4);
    let again = vehicle.offer(events[4].clone());
    assert_eq!((again.refused, again.next_seq), (vec![], 5));
}

#[test]
fn an_undecodable_event_takes_its_turn_and_is_refused_then() {
    let (mut vehicle, events) = (running(), script("m").events);
    let waiting = vehicle.refuse_undecodable("m", 1, Code::SchemaMismatch, "another layout".into());
    assert_eq!((waiting.refused, waiting.next_seq), (vec![], 0));
    let outcome = vehicle.offer(events[0].clone());
    assert_eq!((outcome.applied, outcome.next_seq, outcome.refused.len()), (1, 2, 1));
    let problem = outcome.refused[0].problem();
    assert_eq!((problem.code.as_str(), problem.message.as_str()), ("schema_mismatch", "another layout"));
    assert_eq!(problem.seq, Some(1));
    assert!(vehicle.refuse_undecodable("m", 1, Code::SchemaMismatch, "another layout".into()).repeat);
    assert_eq!(vehicle.offer(events[1].clone()).refused[0].error.code(), Code::Conflict);
    let unknown = vehicle.refuse_undecodable("other", 1, Code::Invalid, "cut off".into());
    assert_eq!(unknown.refused[0].error.code(), Code::UnknownMission);
}

#[test]
fn the_bounds_of_a_mission_hold_and_consume_what_they_refuse() {
    let limits = Limits { max_keyframes: 3, max_factors_per_keyframe: 4, ..Limits::default() };
    let mut vehicle = Vehicle::new(limits);
    vehicle.configure(config("m"), 1).expect("a valid configuration");
    let mut script = support::Script::new("m");
    for id in 0..4 {
        script.keyframe(id, (id == 0).then(|| support::level(support::place(0))));
    }
    (0..5).for_each(|_| script.depth(0));
    script.link(0, 1, true);
    let refused: Vec<(u64, Code)> = script
        .events
        .iter()
        .flat_map(|event| vehicle.offer(event.clone()).refused)
        .map(|refusal| (refusal.seq, refusal.error.code()))
        .collect();
    assert_eq!(refused, [(3, Code::Limit), (8, Code::Limit)]);
    assert_eq!(mission(&mut vehicle).next_seq(), script.seq());
}

#[test]
fn numbers_at_the_end_of_their_range_harm_nobody() {
    let mut vehicle = running();
    let mut event = script("m").events.swap_remove(0);
    if let Event::Keyframe(keyframe) = &mut event {
        keyframe.seq = u64::MAX;
    }
    assert_eq!(vehicle.offer(event).refused[0].error.code(), Code::Limit);
    assert_eq!(mission(&mut vehicle).ingest_status().missing, []);
    vehicle.command(None, Operation::Complete, "", 3).expect("running missions can be completed");
}
