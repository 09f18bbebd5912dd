//! Published pose graphs, event by event: the estimate and the last pose's marginal against numbers made
//! elsewhere.

mod support;

use nalgebra::Matrix6;
use pdn_schemas::event::{Appearance, FactorKind, Keyframe};
use pdn_schemas::shared::{Covariance6, Pose};
use pdn_state::{Event, Limits, Operation, Vehicle};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;
use support::{Script, config, diagonal, level, mission};

struct Edge {
    from: u64,
    to: u64,
    relative: Pose,
    covariance: Covariance6,
}

fn folder() -> Option<PathBuf> {
    let shared = std::env::var_os("PDN_SHARED").map(PathBuf::from);
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../../shared");
    let folder = shared.unwrap_or_else(beside).join("data/pose_graphs");
    if !folder.is_dir() {
        // Past the test's capture: a test that has tried nothing must not pass in silence.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: needs {}; PDN_SHARED names the folder above data/",
            folder.display()
        );
        return None;
    }
    Some(folder)
}

/// Edges by the keyframe that completes them. The file's information is upper triangular over [m; rad], as
/// ours.
fn edges(text: &str) -> BTreeMap<u64, Vec<Edge>> {
    let mut by_arrival: BTreeMap<u64, Vec<Edge>> = BTreeMap::new();
    for line in text.lines().filter(|line| line.starts_with("EDGE_SE3:QUAT")) {
        let numbers: Vec<f64> =
            line.split_whitespace().skip(1).map(|word| word.parse().expect("a number")).collect();
        let (from, to) = (numbers[0] as u64, numbers[1] as u64);
        let mut information = Matrix6::zeros();
        let pairs = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
        for ((row, column), value) in pairs.zip(&numbers[9..]) {
            information[(row, column)] = *value;
            information[(column, row)] = *value;
        }
        let inverse = information.try_inverse().expect("an information matrix is regular");
        let mut covariance = [0.0; 36];
        for (index, value) in covariance.iter_mut().enumerate() {
            *value = 0.5 * (inverse[(index / 6, index % 6)] + inverse[(index % 6, index / 6)]);
        }
        let norm = numbers[5..9].iter().map(|value| value * value).sum::<f64>().sqrt();
        let rotation = [5, 6, 7, 8].map(|index: usize| numbers[index] / norm);
        let relative = Pose { translation: [numbers[2], numbers[3], numbers[4]], rotation };
        let edge = Edge { from, to, relative, covariance: Covariance6(covariance) };
        by_arrival.entry(from.max(to)).or_default().push(edge);
    }
    by_arrival
}

fn stream(name: &str) -> Option<(f64, [f64; 36], serde_json::Value)> {
    let folder = folder()?;
    let text = std::fs::read_to_string(folder.join(format!("{name}.g2o"))).expect("the graph can be read");
    let expected =
        std::fs::read_to_string(folder.join(format!("expected/{name}.json"))).expect("its optimum too");
    let expected: serde_json::Value = serde_json::from_str(&expected).expect("JSON");
    let mut arrivals = edges(&text);
    let ids = arrivals.values().flatten().flat_map(|edge| [edge.from, edge.to]);
    let keyframes: std::collections::BTreeSet<u64> = ids.collect();

    let mut vehicle = Vehicle::new(Limits::default());
    let mut without_prior = config("m");
    without_prior.first_keyframe_sigmas = None;
    vehicle.configure(without_prior, 1).expect("a valid configuration");
    vehicle.command(None, Operation::Start, "", 2).expect("configured missions can start");
    let mut script = Script::new("m");
    for (index, id) in keyframes.iter().copied().enumerate() {
        let seq = script.seq();
        let (mission, appearance) = ("m".to_string(), Appearance::None);
        let event = Keyframe { mission, seq, stamp_ns: 0, id, pose: None, camera: None, appearance };
        script.events.push(Event::Keyframe(event));
        if index == 0 {
            script.factor(FactorKind::Prior {
                keyframe: id,
                pose: level([0.0; 3]),
                covariance: diagonal([1e-6; 6]),
            });
        }
        for Edge { from, to, relative, covariance } in arrivals.remove(&id).unwrap_or_default() {
            script.factor(FactorKind::Relative { from, to, relative, covariance });
        }
    }
    script.offer_all(&mut vehicle);
    let last = keyframes.last().copied();
    let graph = mission(&mut vehicle).begin_graph(last, true).run().expect("the graph is regular");
    assert_eq!(mission(&mut vehicle).state().keyframes, keyframes.len() as u64);
    Some((graph.chi2, graph.keyframes[0].covariance.expect("marginals were asked for").0, expected))
}

/// The contract's tolerances: chi2 to 1e-6 relative; the marginal to 1e-6 of the standard deviations'
/// products, the reference being ordered [rad; m].
fn compare(name: &str) {
    let Some((chi2, covariance, expected)) = stream(name) else { return };
    let optimum = &expected["result"]["optimal"]["se3log"];
    let wanted = optimum["chi2"].as_f64().expect("the optimum's chi2");
    assert!((chi2 - wanted).abs() <= 1e-6 * wanted, "{name}: chi2 {chi2}, expected {wanted}");
    let swapped = |index: usize| (index + 3) % 6;
    let reference = |row: usize, column: usize| {
        optimum["cov_last_prior_1e-3"][swapped(row)][swapped(column)].as_f64().expect("a 6x6 matrix")
    };
    for row in 0..6 {
        for column in 0..6 {
            let scale = (reference(row, row) * reference(column, column)).sqrt();
            let difference = (covariance[6 * row + column] - reference(row, column)).abs() / scale;
            assert!(difference <= 1e-6, "{name}: entry ({row}, {column}) differs by {difference:e} scaled");
        }
    }
}

#[test]
fn the_small_grid_reaches_its_optimum() {
    compare("smallGrid3D");
}

#[test]
fn the_parking_garage_reaches_its_optimum() {
    compare("parking-garage");
}
