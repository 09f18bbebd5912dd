//! A small mission: a straight way over a flat sea floor, salient at its beginning.

use super::Client;
use pdn_schemas::reply::Problem;
use serde_json::{Value, json};

/// A mission's configuration: a floor that is seen from above, and a prior on the first keyframe.
pub fn configuration(mission: &str) -> Value {
    json!({
        "mission": mission,
        "target": { "facets": [{
            "origin": [-2.0, -2.0, 12.0], "u": [0.0, 1.0, 0.0], "v": [1.0, 0.0, 0.0],
            "length_u_m": 4.0, "length_v_m": 20.0,
        }] },
        "cell_m": 0.2,
    })
}

/// Keyframe `index` and the odometry factor that ties it, with their keys.
pub fn step(vehicle: &str, mission: &str, index: u64) -> Vec<(String, Value)> {
    let spacing_m = 0.5;
    let x_m = index as f64 * spacing_m;
    let salient = index < 6;
    // The first keyframe is one event, each later one two.
    let seq = if index == 0 { 0 } else { 2 * index - 1 };
    let pose = json!({ "translation": [x_m, 0.0, 10.0], "rotation": [0.0, 0.0, 0.0, 1.0] });
    let saliency = if salient { (0.9, 0.8) } else { (0.1, 0.1) };
    let keyframe = json!({
        "mission": mission, "seq": seq, "stamp_ns": 0, "id": index, "pose": pose, "camera": null,
        "appearance": { "saliency": { "local": saliency.0, "global": saliency.1 } },
    });
    let mut events = vec![(format!("pdn/{vehicle}/v1/in/keyframe"), keyframe)];
    if index > 0 {
        let variances = [1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6];
        let covariance: Vec<f64> =
            (0..36).map(|cell| if cell % 7 == 0 { variances[cell / 7] } else { 0.0 }).collect();
        let odometry = json!({
            "from": index - 1, "to": index, "covariance": covariance,
            "relative": { "translation": [spacing_m, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0] },
        });
        let factor = json!({
            "mission": mission, "seq": seq + 1, "stamp_ns": 0, "factor": { "odometry": odometry },
        });
        events.push((format!("pdn/{vehicle}/v1/in/factor"), factor));
    }
    events
}

/// Number of the last event of the first `keyframes` keyframes.
pub fn last_seq(keyframes: u64) -> u64 {
    2 * (keyframes - 1)
}

/// Configures a mission and starts it.
pub fn begin(client: &Client, vehicle: &str, mission: &str) -> Result<Value, Problem> {
    client.ask(&format!("pdn/{vehicle}/v1/op/configure"), Some(configuration(mission)))?;
    client.ask(&format!("pdn/{vehicle}/v1/op/start"), Some(json!({ "reason": "a test" })))
}

/// Publishes the events of the keyframes in `range`.
pub fn fly(client: &Client, vehicle: &str, mission: &str, range: std::ops::Range<u64>) {
    for index in range {
        for (key, event) in step(vehicle, mission, index) {
            client.publish(&key, &event);
        }
    }
}
