//! How probable a registration is: the empirical table of P_L [PDN12, eq. 2].

use crate::error::PlanningError;

/// The empirical table of P_L over the two local saliencies: `bins` x `bins`, equal widths on [0, 1],
/// symmetric.
///
/// A link between saliencies of bins i and j is the same event as one between j and i: it counts once, in a
/// cell that (i, j) and (j, i) share.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkModel {
    bins: usize,
    cells: Vec<LinkBin>,
}

/// One cell of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkBin {
    /// Beta prior a: registered links known beforehand.
    pub prior_registered: f64,
    /// Beta prior b: failed links known beforehand.
    pub prior_failed: f64,
    /// Links proposed in the mission.
    pub proposed: u64,
    /// Those of them that registered.
    pub registered: u64,
}

impl LinkBin {
    /// P_L = (registered + a) / (proposed + a + b), the mean of the Beta posterior.
    pub fn probability(&self) -> f64 {
        (self.registered as f64 + self.prior_registered)
            / (self.proposed as f64 + self.prior_registered + self.prior_failed)
    }
}

impl LinkModel {
    /// A table without outcomes; `prior` holds `[a, b]` of each bin, row-major.
    ///
    /// # Errors
    /// [`PlanningError::LinkModelShape`] unless there are `bins * bins` pairs and at least one bin;
    /// [`PlanningError::LinkModelPrior`] for a pair that is not finite, negative, zero twice, or not
    /// symmetric.
    pub fn new(bins: usize, prior: &[[f64; 2]]) -> Result<LinkModel, PlanningError> {
        if bins == 0 || bins.checked_mul(bins) != Some(prior.len()) {
            return Err(PlanningError::LinkModelShape { bins, pairs: prior.len() });
        }
        for (index, &[registered, failed]) in prior.iter().enumerate() {
            let (row, column) = (index / bins, index % bins);
            let beta = registered.is_finite() && failed.is_finite() && registered >= 0.0 && failed >= 0.0;
            if !beta || registered + failed <= 0.0 || prior[column * bins + row] != prior[index] {
                return Err(PlanningError::LinkModelPrior { row, column, registered, failed });
            }
        }
        let cells = prior.iter().map(|&[prior_registered, prior_failed]| LinkBin {
            prior_registered,
            prior_failed,
            proposed: 0,
            registered: 0,
        });
        Ok(LinkModel { bins, cells: cells.collect() })
    }

    /// Counts a registration that was tried between images of these local saliencies.
    pub fn record(&mut self, saliency: f64, other_saliency: f64, registered: bool) {
        let index = self.index(saliency, other_saliency);
        let cell = &mut self.cells[index];
        cell.proposed += 1;
        cell.registered += u64::from(registered);
    }

    /// P_L(l = 1; S_Lc, S_Lt) [PDN12, eq. 2], symmetric in its arguments.
    ///
    /// ```
    /// let mut model = pdn_planning::LinkModel::new(1, &[[170.0, 30.0]]).unwrap();
    /// assert_eq!(model.probability(0.98, 0.98), 0.85);
    /// model.record(0.98, 0.15, false);
    /// assert_eq!(model.probability(0.15, 0.98), 170.0 / 201.0);
    /// ```
    pub fn probability(&self, current_saliency: f64, target_saliency: f64) -> f64 {
        self.cells[self.index(current_saliency, target_saliency)].probability()
    }

    /// Bins of each saliency.
    pub fn bins(&self) -> usize {
        self.bins
    }

    /// The table row by row, `bins * bins` cells; mirrored cells are equal.
    pub fn cells(&self) -> Vec<LinkBin> {
        let bins = self.bins;
        (0..bins * bins).map(|index| self.cells[self.shared(index / bins, index % bins)]).collect()
    }

    fn index(&self, saliency: f64, other_saliency: f64) -> usize {
        let bin =
            |saliency: f64| ((saliency * self.bins as f64).floor().max(0.0) as usize).min(self.bins - 1);
        self.shared(bin(saliency), bin(other_saliency))
    }

    fn shared(&self, row: usize, column: usize) -> usize {
        row.min(column) * self.bins + row.max(column)
    }
}
