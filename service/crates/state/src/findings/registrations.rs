//! Registrations that never succeed, or that succeed and measure nothing.

use pdn_planning::LinkModel;

/// Registrations that P_L expects before it is told that there is none. By chance there is none of ten
/// expected once in e^10 = 22 000 missions.
const MANY_EXPECTED: f64 = 10.0;

/// Registrations that were reported before it is told that their measurements are missing.
const MANY_REGISTERED: u64 = 16;

/// Registrations that never succeed though P_L expects them to, or that succeed and measure nothing.
/// `measured` is the number of camera and relative factors of the graph.
pub(crate) fn registrations(model: &LinkModel, measured: u64) -> Option<String> {
    let (mut proposed, mut registered, mut expected) = (0, 0, 0.0);
    let bins = model.bins();
    for (index, bin) in model.cells().iter().enumerate() {
        if index / bins > index % bins {
            continue; // the table is symmetric: each pair of bins counts once
        }
        proposed += bin.proposed;
        registered += bin.registered;
        expected += bin.proposed as f64 * bin.prior_registered / (bin.prior_registered + bin.prior_failed);
    }
    if registered == 0 && expected >= MANY_EXPECTED {
        return Some(format!(
            "none of the {proposed} registrations that were tried has succeeded, where link_model.prior \
             expects {expected:.0}: the images may not match (turbid water, light, blur, another pair than \
             the one named), or link events say registered = false of those that do; revisits will not pay \
             until some succeed"
        ));
    }
    (registered >= MANY_REGISTERED && measured == 0).then(|| {
        format!(
            "{registered} registrations are told as successful, and the graph has none of their \
             measurements: send a camera factor with each"
        )
    })
}
