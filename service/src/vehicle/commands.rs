//! Commands: `op/*`. Each is applied at once and answered with the mission as it then stands.

use super::{Owner, now_ns};
use crate::keeper::Keeper;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::Topic;
use pdn_schemas::{Command, MissionConfig};
use pdn_state::{Operation, Vehicle};
use pdn_transport::answer::Answer;
use pdn_transport::message::Question;

/// Applies `op/configure`; nothing has changed if it is refused, unless it could not be written any more.
pub fn configure(vehicle: &mut Vehicle, keeper: &mut Keeper, question: &Question) -> Result<(), Problem> {
    let named = question.parameters.named(question.topic)?;
    let config: MissionConfig = question.payload.decode().map_err(|error| error.problem(None))?;
    if named.text("mission").is_some_and(|mission| mission != config.mission) {
        let message = format!("the parameter names another mission than the payload, \"{}\"", config.mission);
        return Err(Problem::new(Code::Invalid, message, None));
    }
    let (mission, now_ns) = (config.mission.clone(), now_ns());
    let mut prepared = vehicle.prepare(config, now_ns).map_err(|error| error.problem(None))?;
    keeper.begin(&mut prepared)?;
    vehicle.adopt(prepared, now_ns).map_err(|error| error.problem(None))?;
    keeper.sync(vehicle);
    keeper.check(&mission, "it was configured anew")
}

impl Owner {
    pub(super) fn command(&mut self, question: Question) {
        let done = match question.topic {
            Topic::OpConfigure => configure(&mut self.vehicle, &mut self.keeper, &question).map(|()| None),
            _ => self.operate(&question),
        };
        match done {
            Ok(mission) => self.answer_with_state(question.answer, mission.as_deref()),
            Err(problem) => {
                let command = question.topic.suffix();
                tracing::warn!(vehicle = %self.id, command, code = problem.code, "command refused: {}", problem.message);
                self.outgoing.refuse(question.answer, problem);
            }
        }
    }

    /// Answers a command that has been applied to a mission, the current one if none is named, and tells everyone.
    pub(super) fn answer_with_state(&mut self, answer: Answer, mission: Option<&str>) {
        let state =
            self.vehicle.mission(mission).map(|mission| mission.state()).map_err(|error| error.problem(None));
        if let Ok(state) = &state {
            tracing::info!(
                vehicle = %self.id, mission = state.mission, phase = ?state.phase, reason = state.reason, "phase"
            );
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
        let named = question.parameters.named(question.topic)?;
        // A command without a payload has no reason to tell.
        let reason = if question.payload.is_empty() {
            String::new()
        } else {
            question.payload.decode::<Command>().map_err(|error| error.problem(None))?.reason
        };
        let mission = named.text("mission");
        if !operation.is_careful() {
            self.keeper.demand_writable(&mut self.vehicle, mission)?;
        }
        let commanded = self.vehicle.command(mission, operation, &reason, now_ns());
        let id = commanded.map_err(|error| error.problem(None))?.id().to_owned();
        self.state_changed = true;
        self.sync();
        self.keeper.check(&id, &format!("op/{name} was done all the same"))?;
        Ok(mission.map(str::to_owned))
    }
}
