//! Commands: `op/*`. Each is applied at once and answered with the mission as it then stands.

use super::Owner;
use crate::clock;
use crate::journal_writer::JournalWriter;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::reply::MissionState;
use pdn_schemas::topics::Topic;
use pdn_schemas::{Command, MissionConfig};
use pdn_state::{Operation, Vehicle};
use pdn_transport::answer::Answer;
use pdn_transport::message::Question;

/// Applies `op/configure`; nothing has changed if it is refused, unless it could not be written any more.
pub fn configure(
    vehicle: &mut Vehicle,
    journal_writer: &mut JournalWriter,
    question: &Question,
) -> Result<(), Problem> {
    let parameters = question.parameters.parse(question.topic)?;
    let config: MissionConfig = question.payload.decode().map_err(|error| error.problem(None))?;
    if parameters.text("mission").is_some_and(|mission| mission != config.mission) {
        let message = format!("the parameter names another mission than the payload, \"{}\"", config.mission);
        return Err(Problem::new(Code::Invalid, message, None));
    }
    let (mission, now_ns) = (config.mission.clone(), clock::now_ns());
    let mut prepared = vehicle.prepare(config, now_ns).map_err(|error| error.problem(None))?;
    journal_writer.create(&mut prepared)?;
    vehicle.adopt(prepared, now_ns).map_err(|error| error.problem(None))?;
    journal_writer.sync(vehicle);
    journal_writer.check(&mission, "it was configured anew")
}

impl Owner {
    pub(super) fn take_command(&mut self, question: Question) {
        let done = match question.topic {
            Topic::OpConfigure => {
                configure(&mut self.vehicle, &mut self.journal_writer, &question).map(|()| None)
            }
            _ => self.operate(&question),
        };
        match done {
            Ok(mission) => self.answer_with_state(question.answer, mission.as_deref()),
            Err(problem) => {
                let (command, Problem { code, message, .. }) = (question.topic.suffix(), &problem);
                tracing::warn!(vehicle = %self.id, command, code, "command refused: {message}");
                self.outgoing.refuse(question.answer, problem);
            }
        }
    }

    /// Answers a command that has been applied to a mission, the current one if none is named, and tells
    /// everyone.
    pub(super) fn answer_with_state(&mut self, answer: Answer, mission: Option<&str>) {
        let state = self.vehicle.mission(mission).map(|mission| mission.state());
        let state = state.map_err(|error| error.problem(None));
        if let Ok(MissionState { mission, phase, reason, .. }) = &state {
            tracing::info!(vehicle = %self.id, mission, ?phase, reason, "phase");
        }
        self.state_changed = true;
        self.outgoing.answer(answer, state);
    }

    /// Gives the mission that the parameter `mission=` names, if it does.
    fn operate(&mut self, question: &Question) -> Result<Option<String>, Problem> {
        let name = question.topic.suffix().trim_start_matches("op/");
        let Some(operation) = Operation::named(name) else {
            let message = format!("op/{name} is not a command of this version");
            return Err(Problem::new(Code::Unsupported, message, None));
        };
        let parameters = question.parameters.parse(question.topic)?;
        // A command without a payload has no reason to tell.
        let reason = if question.payload.is_empty() {
            String::new()
        } else {
            question.payload.decode::<Command>().map_err(|error| error.problem(None))?.reason
        };
        let mission = parameters.text("mission");
        if !operation.is_careful() {
            self.journal_writer.ensure_writable(&mut self.vehicle, mission)?;
        }
        let commanded = self.vehicle.command(mission, operation, &reason, clock::now_ns());
        let id = commanded.map_err(|error| error.problem(None))?.id().to_owned();
        self.state_changed = true;
        self.sync();
        self.journal_writer.check(&id, &format!("op/{name} was done all the same"))?;
        Ok(mission.map(str::to_owned))
    }
}
