//! Every phase and every command: the table of the contract, written out once more, and every sequence of
//! commands up to a length against a model of a few lines.

mod support;

use pdn_schemas::codec::{Format, encode};
use pdn_schemas::problem::Code;
use pdn_schemas::reply::Phase;
use pdn_state::{DecisionRequest, Event, Limits, Operation, StateError, Vehicle, WhatIf};
use support::{SENT_BYTES, config, script};

const PHASES: [Phase; 6] =
    [Phase::Configured, Phase::Running, Phase::Paused, Phase::Held, Phase::Completed, Phase::Aborted];

/// `configured -> running <-> paused | held -> completed | aborted`, row by row; what is not here is refused,
/// and so nothing leads out of the last two.
const LEGAL: [(Phase, Operation, Phase); 12] = [
    (Phase::Configured, Operation::Start, Phase::Running),
    (Phase::Configured, Operation::Abort, Phase::Aborted),
    (Phase::Running, Operation::Pause, Phase::Paused),
    (Phase::Running, Operation::Hold, Phase::Held),
    (Phase::Running, Operation::Complete, Phase::Completed),
    (Phase::Running, Operation::Abort, Phase::Aborted),
    (Phase::Paused, Operation::Resume, Phase::Running),
    (Phase::Paused, Operation::Complete, Phase::Completed),
    (Phase::Paused, Operation::Abort, Phase::Aborted),
    (Phase::Held, Operation::Resume, Phase::Running),
    (Phase::Held, Operation::Complete, Phase::Completed),
    (Phase::Held, Operation::Abort, Phase::Aborted),
];

fn after(phase: Phase, operation: Operation) -> Option<Phase> {
    let found = LEGAL.iter().find(|(from, by, _)| (*from, *by) == (phase, operation));
    found.map(|(.., to)| *to)
}

/// A vehicle whose mission `m` with 10 events is in this phase.
fn in_phase(phase: Phase) -> Vehicle {
    let way: &[Operation] = match phase {
        Phase::Configured => &[],
        Phase::Running => &[Operation::Start],
        Phase::Paused => &[Operation::Start, Operation::Pause],
        Phase::Held => &[Operation::Start, Operation::Hold],
        Phase::Completed => &[Operation::Start, Operation::Complete],
        Phase::Aborted => &[Operation::Abort],
    };
    let mut vehicle = Vehicle::new(Limits::default());
    vehicle.configure(config("m"), 1).expect("a valid configuration");
    for event in &script("m").events[..10] {
        assert_eq!(vehicle.offer(event.clone(), SENT_BYTES).refused, vec![]);
    }
    for &operation in way {
        vehicle.command(None, operation, "", 2).expect("a legal path");
    }
    assert_eq!(vehicle.mission(None).expect("a mission").phase(), phase);
    vehicle
}

fn told(vehicle: &mut Vehicle) -> Vec<u8> {
    let mission = vehicle.mission(None).expect("a mission");
    let mut told = encode(&mission.state(), Format::Bincode).expect("a state");
    told.extend(encode(&mission.ingest_status(), Format::Bincode).expect("a status"));
    told
}

fn code<T>(result: &Result<T, StateError>) -> Option<Code> {
    result.as_ref().err().map(StateError::code)
}

#[test]
fn every_command_in_every_phase() {
    for phase in PHASES {
        for operation in Operation::ALL {
            let mut vehicle = in_phase(phase);
            let before = told(&mut vehicle);
            let done = vehicle.command(None, operation, "why", 5).map(|mission| mission.phase());
            match after(phase, operation) {
                Some(expected) => {
                    assert_eq!(done.ok(), Some(expected), "{phase:?} {operation:?}");
                    let state = vehicle.mission(None).expect("a mission").state();
                    assert_eq!((state.reason.as_str(), state.since_ns), ("why", 5));
                }
                None => {
                    assert_eq!(code(&done), Some(Code::IllegalTransition), "{phase:?} {operation:?}");
                    assert!(
                        told(&mut vehicle) == before,
                        "{phase:?} {operation:?}: a refusal changes nothing"
                    );
                }
            }
        }
    }
}

#[test]
fn every_event_question_and_configuration_in_every_phase() {
    let events = script("m").events;
    for phase in PHASES {
        let ended = matches!(phase, Phase::Completed | Phase::Aborted);
        // An event of each kind that comes next in its turn.
        let kinds = [
            events.iter().find(|event| matches!(event, Event::Keyframe(_)) && event.seq() > 9),
            events.iter().find(|event| matches!(event, Event::Factor(_)) && event.seq() > 9),
            events.iter().find(|event| matches!(event, Event::Link(_)) && event.seq() > 9),
        ];
        for event in kinds.into_iter().flatten() {
            let mut vehicle = in_phase(phase);
            for earlier in &events[10..event.seq() as usize] {
                vehicle.offer(earlier.clone(), SENT_BYTES);
            }
            let before = vehicle.mission(None).expect("a mission").next_seq();
            let outcome = vehicle.offer(event.clone(), SENT_BYTES);
            let refused: Vec<Code> = outcome.refused.iter().map(|refusal| refusal.error.code()).collect();
            if ended {
                assert_eq!((refused, outcome.next_seq), (vec![Code::MissionEnded], before), "{phase:?}");
            } else {
                assert_eq!((refused, outcome.next_seq), (vec![], before + 1), "{phase:?}");
            }
            assert!(
                vehicle.offer(events[0].clone(), SENT_BYTES).repeat,
                "a repeat is none's fault, whatever the phase"
            );
        }

        let mut vehicle = in_phase(phase);
        let before = told(&mut vehicle);
        let mission = vehicle.mission(None).expect("a mission");
        let decision = mission.begin_decision(DecisionRequest::default()).map(drop);
        let expected = (phase != Phase::Running).then_some(Code::IllegalTransition);
        assert_eq!(code(&decision), expected, "{phase:?}");
        let what_if = WhatIf { alpha: Some(0.5), ..WhatIf::default() };
        let what_if = DecisionRequest { what_if, ..DecisionRequest::default() };
        assert_eq!(code(&mission.begin_decision(what_if).map(drop)), None, "{phase:?}");
        let path = vec![vec![support::place(1)]];
        assert_eq!(code(&mission.begin_evaluate(path, what_if).map(drop)), None, "{phase:?}");
        assert_eq!(code(&mission.begin_waypoints().map(drop)), None, "{phase:?}");
        assert!(mission.begin_graph(None, false).run().is_ok(), "{phase:?}");
        assert!(told(&mut vehicle) == before, "{phase:?}: questions change nothing");

        for (id, expected) in [("m", Some(Code::RepeatedId)), ("n", None)] {
            let mut vehicle = in_phase(phase);
            let before = told(&mut vehicle);
            let active = matches!(phase, Phase::Running | Phase::Paused | Phase::Held);
            let expected = if active { Some(Code::IllegalTransition) } else { expected };
            let configured = vehicle.configure(config(id), 7).map(drop);
            assert_eq!(code(&configured), expected, "{phase:?} {id}");
            match expected {
                Some(_) => assert!(told(&mut vehicle) == before, "{phase:?} {id}"),
                None => {
                    let old = vehicle.mission(Some("m")).expect("it stays readable").phase();
                    assert_eq!(old, if phase == Phase::Configured { Phase::Aborted } else { phase });
                    assert_eq!(vehicle.mission(None).expect("a mission").phase(), Phase::Configured);
                }
            }
        }
    }
}

/// What a vehicle's missions must have come to: the phases of all, in the order of their configuration, and
/// the events of the last.
#[derive(Clone, Debug, Default, PartialEq)]
struct Model {
    phases: Vec<Phase>,
    events: u64,
}

#[derive(Clone, Copy, Debug)]
enum Act {
    Command(Operation),
    Configure,
    Event,
}

impl Model {
    fn act(&mut self, act: Act) -> bool {
        let current = self.phases.last().copied();
        match (act, current) {
            (Act::Configure, Some(Phase::Running | Phase::Paused | Phase::Held)) => return false,
            (Act::Configure, _) => {
                if let Some(last @ Phase::Configured) = self.phases.last_mut() {
                    *last = Phase::Aborted;
                }
                self.phases.push(Phase::Configured);
                self.events = 0;
            }
            (_, None | Some(Phase::Completed | Phase::Aborted)) => return false,
            (Act::Event, Some(_)) => self.events += 1,
            (Act::Command(operation), Some(phase)) => match (after(phase, operation), self.phases.last_mut())
            {
                (Some(next), Some(last)) => *last = next,
                _ => return false,
            },
        }
        true
    }
}

fn act(vehicle: &mut Vehicle, model: &Model, act: Act) -> bool {
    let number = model.phases.len();
    match act {
        Act::Command(operation) => vehicle.command(None, operation, "", 3).is_ok(),
        Act::Configure => vehicle.configure(config(&format!("m{number}")), 3).is_ok(),
        Act::Event => {
            let id = format!("m{}", number.saturating_sub(1));
            let event = script(&id).events.swap_remove(0);
            let event = match event {
                Event::Keyframe(mut keyframe) => {
                    (keyframe.seq, keyframe.id) = (model.events, model.events);
                    Event::Keyframe(keyframe)
                }
                other => other,
            };
            vehicle.offer(event, SENT_BYTES).refused.is_empty()
        }
    }
}

#[test]
fn every_sequence_of_commands_does_what_the_model_does() {
    const LENGTH: usize = 6;
    let acts: Vec<Act> =
        Operation::ALL.into_iter().map(Act::Command).chain([Act::Configure, Act::Event]).collect();
    let mut waiting = vec![(Vehicle::new(Limits::default()), Model::default(), Vec::<Act>::new())];
    let mut sequences = 0;
    while let Some((vehicle, model, way)) = waiting.pop() {
        for &next in &acts {
            let (mut vehicle, mut expected) = (vehicle.clone(), model.clone());
            let way: Vec<Act> = way.iter().copied().chain([next]).collect();
            let done = act(&mut vehicle, &model, next);
            assert_eq!(done, expected.act(next), "{way:?}");
            for (number, phase) in expected.phases.iter().enumerate() {
                let mission = vehicle.mission(Some(&format!("m{number}"))).expect("it is kept");
                assert_eq!(mission.phase(), *phase, "{way:?}");
            }
            if let Ok(mission) = vehicle.mission(None) {
                assert_eq!(mission.next_seq(), expected.events, "{way:?}");
            }
            sequences += 1;
            if way.len() < LENGTH {
                waiting.push((vehicle, expected, way));
            }
        }
    }
    println!("{sequences} sequences of up to {LENGTH} commands, configurations and events");
}
