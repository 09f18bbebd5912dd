//! The order of events: gaps, repeats, conflicts, bounds.

mod support;

use pdn_schemas::event::LinkOutcome;
use pdn_schemas::problem::Code;
use pdn_state::{Event, Limits, Operation, Undecodable, Vehicle};
use support::{SENT_BYTES, config, mission, running, script};

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
        let outcome = vehicle.offer(events[seq].clone(), SENT_BYTES);
        assert_eq!((outcome.applied, outcome.repeat), (u64::from(seq < 2), false));
    }
    let status = mission(&mut vehicle).ingest_status();
    assert_eq!((status.next_seq, status.buffered, status.rejected), (2, 4, 0));
    assert_eq!(status.missing, [(2, 3), (6, 8), (10, 11)]);
    assert!(mission(&mut vehicle).state().health.findings.iter().any(|finding| finding.contains("2 to 3")));
    assert_eq!(vehicle.offer(events[2].clone(), SENT_BYTES).applied, 1);
    let outcome = vehicle.offer(events[3].clone(), SENT_BYTES);
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
        vehicle.offer(event.clone(), SENT_BYTES);
    }
    let before = mission(&mut vehicle).ingest_status();
    assert_eq!((before.next_seq, before.rejected), (3, 1));
    for event in [&events[0], &events[1], &bad, &events[5]] {
        let repeat = vehicle.offer(event.clone(), SENT_BYTES);
        assert!(repeat.repeat && repeat.refused.is_empty() && repeat.applied == 0, "{repeat:?}");
        let conflict = vehicle.offer(changed(event), SENT_BYTES);
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
        assert_eq!(vehicle.offer(event.clone(), SENT_BYTES).refused, vec![]);
    }
    let full = vehicle.offer(events[4].clone(), SENT_BYTES);
    assert_eq!((full.refused[0].error.code(), full.refused[0].seq, full.next_seq), (Code::Limit, 4, 0));
    assert_eq!(mission(&mut vehicle).ingest_status().rejected, 0);
    assert_eq!(vehicle.offer(events[0].clone(), SENT_BYTES).next_seq, 4);
    let again = vehicle.offer(events[4].clone(), SENT_BYTES);
    assert_eq!((again.refused, again.next_seq), (vec![], 5));
}

#[test]
fn bytes_of_what_waits_are_taken_by_it_and_given_back_by_what_is_applied() {
    let mut vehicle = Vehicle::new(Limits { max_buffered_bytes: 10, ..Limits::default() });
    vehicle.configure(config("m"), 1).expect("a valid configuration");
    let mut offer = |seq: usize, sent_bytes| {
        let outcome = vehicle.offer(script("m").events[seq].clone(), sent_bytes);
        let refused = outcome.refused.first().map(|refusal| (refusal.error.code(), refusal.seq));
        (refused, outcome.next_seq)
    };
    let overloaded = |seq, next_seq| (Some((Code::Overloaded, seq)), next_seq);
    assert_eq!(offer(3, 4), (None, 0));
    assert_eq!(offer(5, 5), (None, 0));
    assert_eq!(offer(2, 2), overloaded(2, 0));
    assert_eq!(offer(3, 4), (None, 0), "a repeat takes no more");
    assert_eq!(offer(2, 1), (None, 0));
    assert_eq!(offer(0, 100), (None, 1), "what is applied at once takes none");
    assert_eq!(offer(6, 1), overloaded(6, 1));
    assert_eq!(offer(1, 100), (None, 4), "those of 2 and 3 are given back");
    assert_eq!(offer(6, 6), overloaded(6, 4));
    assert_eq!(offer(6, 5), (None, 4));
    assert_eq!(offer(4, 1), (None, 7));
    assert_eq!(offer(9, 10), (None, 7));
}

#[test]
fn missions_of_a_vehicle_share_the_bytes_of_what_waits() {
    let limits = Limits { max_buffered_bytes: 10, max_missions: 2, ..Limits::default() };
    let mut vehicle = Vehicle::new(limits);
    let wait = |vehicle: &mut Vehicle, mission: &str, sent_bytes| {
        let outcome = vehicle.offer(script(mission).events[2].clone(), sent_bytes);
        outcome.refused.first().map(|refusal| refusal.error.to_string())
    };
    let full = "the events that wait for a missing one take up ahead_bytes; send the missing ones \
                (rpc/ingest tells), then event 2 again";
    for (mission, sent_bytes, refused) in
        [("a", 6, None), ("b", 5, Some(full)), ("b", 4, None), ("c", 6, None)]
    {
        if vehicle.mission(Some(mission)).is_err() {
            vehicle.configure(config(mission), 1).expect("the one before has ended");
        }
        assert_eq!(wait(&mut vehicle, mission, sent_bytes).as_deref(), refused, "{mission}");
        if refused.is_none() {
            vehicle.command(None, Operation::Abort, "", 2).expect("configured missions can be aborted");
        }
    }
}

fn undecodable(mission: &str, seq: u64) -> Event {
    let (code, message) = (Code::SchemaMismatch, "another layout".to_owned());
    Event::Undecodable(Undecodable { mission: mission.to_owned(), seq, code, message })
}

#[test]
fn an_undecodable_event_takes_its_turn_and_is_refused_then() {
    let (mut vehicle, events) = (running(), script("m").events);
    let waiting = vehicle.offer(undecodable("m", 1), SENT_BYTES);
    assert_eq!((waiting.refused, waiting.next_seq), (vec![], 0));
    let outcome = vehicle.offer(events[0].clone(), SENT_BYTES);
    assert_eq!((outcome.applied, outcome.next_seq, outcome.refused.len()), (1, 2, 1));
    let problem = outcome.refused[0].problem();
    assert_eq!((problem.code.as_str(), problem.message.as_str()), ("schema_mismatch", "another layout"));
    assert_eq!(problem.seq, Some(1));
    assert!(vehicle.offer(undecodable("m", 1), SENT_BYTES).repeat);
    assert_eq!(vehicle.offer(events[1].clone(), SENT_BYTES).refused[0].error.code(), Code::Conflict);
    let unknown = vehicle.offer(undecodable("other", 1), SENT_BYTES);
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
        .flat_map(|event| vehicle.offer(event.clone(), SENT_BYTES).refused)
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
    assert_eq!(vehicle.offer(event, SENT_BYTES).refused[0].error.code(), Code::Limit);
    assert_eq!(mission(&mut vehicle).ingest_status().missing, []);
    vehicle.command(None, Operation::Complete, "", 3).expect("running missions can be completed");
}
