//! Values that are found once.

use crate::error::PlanningError;
use std::sync::OnceLock;

/// Fills a cell once. A failure leaves it empty, so that the next question tries again.
pub(crate) fn get_or_try_init<T>(
    cell: &OnceLock<T>,
    make: impl FnOnce() -> Result<T, PlanningError>,
) -> Result<&T, PlanningError> {
    match cell.get() {
        Some(known) => Ok(known),
        None => {
            let made = make()?;
            Ok(cell.get_or_init(|| made))
        }
    }
}
