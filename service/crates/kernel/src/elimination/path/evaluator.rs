//! Sigma_nn of many paths over one elimination, one after the other \[PDN12, eq. 4\]: each is checked, analysed
//! and eliminated.

use nalgebra::Matrix6;

use super::virtual_path::{ExpectedCovariances, LinkWeight, VirtualPath};
use super::workspace::{self, Factorization, Workspace};
use crate::KernelError;
use crate::elimination::engine::Elimination;

/// Evaluates paths from the robot over one elimination. Where a path begins as the one before it does, the
/// fronts that only the common places touch are not eliminated again; the numbers are the same bit for bit.
/// So paths with common beginnings should follow one another.
#[derive(Debug)]
pub struct PathEvaluator<'a> {
    elimination: &'a Elimination,
    workspace: &'a mut Workspace,
    previous: Option<VirtualPath>,
}

impl<'a> PathEvaluator<'a> {
    /// Before the first path. The workspace may come from anywhere.
    pub fn new(elimination: &'a Elimination, workspace: &'a mut Workspace) -> PathEvaluator<'a> {
        PathEvaluator { elimination, workspace, previous: None }
    }

    /// Sigma_nn of a path with its links weighed by their probabilities \[PDN12, eq. 4\]. Exact.
    ///
    /// Cost: the fronts that hold a linked keyframe and those above them, as far as not shared. The
    /// elimination stays as it is. Errors: [`KernelError::PathShape`], [`KernelError::UnknownNode`], and
    /// [`KernelError::VirtualNotPositiveDefinite`] for information that is not positive definite.
    pub fn terminal(&mut self, path: &VirtualPath) -> Result<Matrix6<f64>, KernelError> {
        self.analyse(path)?;
        self.workspace.terminal(self.factorization(), path, LinkWeight::Expected, false)
    }

    /// All covariances that a decision tells of a path. What the path touches is found once, and without
    /// links the robot's covariance is all that is needed of the graph.
    ///
    /// `robot_covariance` is the marginal of `path.robot`. Errors: as of [`PathEvaluator::terminal`].
    pub fn covariances(
        &mut self,
        path: &VirtualPath,
        robot_covariance: &Matrix6<f64>,
    ) -> Result<ExpectedCovariances, KernelError> {
        self.analyse(path)?;
        let factorization = self.factorization();
        let terminal_all_links = self.workspace.terminal(factorization, path, LinkWeight::All, false)?;
        let terminal = self.workspace.terminal(factorization, path, LinkWeight::Expected, true)?;
        let along = self.workspace.along(factorization, path);
        let terminal_no_links = workspace::terminal_without_links(path, robot_covariance)?;
        Ok(ExpectedCovariances { terminal, terminal_all_links, terminal_no_links, along })
    }

    fn analyse(&mut self, path: &VirtualPath) -> Result<(), KernelError> {
        // Until its analysis has succeeded nothing is known to be shared with it.
        let previous = self.previous.take();
        self.check(path)?;
        self.workspace.analyse(self.factorization(), path, previous.as_ref())?;
        self.previous = Some(path.clone());
        Ok(())
    }

    fn check(&self, path: &VirtualPath) -> Result<(), KernelError> {
        let places = path.places.len();
        let is_wrong = |&place: &usize| path.places[place].steps.is_some() != (place > 0);
        let wrong_step = (0..places).find(is_wrong);
        if places < 2 || wrong_step.is_some() {
            return Err(KernelError::PathShape { places, wrong_step });
        }
        self.elimination.check(path.robot)?;
        path.links().try_for_each(|(_, link)| self.elimination.check(link.keyframe))
    }

    fn factorization(&self) -> Factorization<'a> {
        Factorization { tree: self.elimination.tree(), system: self.elimination.system() }
    }
}
