"""The messages of the contract and what they are made of.

Generated from the types in `schemas/src` by `cargo run --release -p pdn-schemas -- generate`.
"""

# fmt: off

from enum import StrEnum
from typing import TypeAlias

from msgspec import Struct


class Ack(Struct, frozen=True):
    """`out/ack`: progress of the events."""

    mission: str
    """Id of the mission."""

    next_seq: int
    """All events below are applied."""

    durable_seq: int
    """All events below survive a power cut."""


class Action:
    """What the vehicle should do next."""

    class Explore(Struct, frozen=True):
        """Go on with the survey."""

    class Revisit(Struct, frozen=True):
        """Go to the waypoint of a candidate, along its path, and come back."""

        candidate: int
        """Number of the candidate, from 1."""

        keyframe: int
        """The waypoint's keyframe."""


AnyAction: TypeAlias = (
    Action.Explore
    | Action.Revisit
)
"""A value of Action."""


class Allowable(Struct, frozen=True):
    """Standard deviations whose product is the sixth-root determinant that uncertainty is measured by
    [PDN12, IV.A]."""

    x_m: float = 0.25
    """North, m; default 0.25."""

    y_m: float = 0.25
    """East, m; default 0.25."""

    depth_m: float = 0.01
    """Down, m; default 0.01."""

    roll_deg: float = 0.1
    """Degrees; default 0.1."""

    pitch_deg: float = 0.1
    """Degrees; default 0.1."""

    heading_deg: float = 0.1
    """Degrees; default 0.1."""


class Appearance:
    """What a keyframe's image shows."""

    class Saliency(Struct, frozen=True):
        """Ready scores, each in [0, 1]."""

        local: float
        """Texture richness S_L."""

        global_: float
        """Rarity S_G."""

    class Words(Struct, frozen=True):
        """A histogram of visual words: pairs of word and count."""

        value: tuple[tuple[int, int], ...]
        """What the variant holds."""

    class Descriptors(Struct, frozen=True):
        """Unit descriptors, `dim` values each."""

        dim: int
        """Length of one descriptor."""

        values: tuple[float, ...]
        """The descriptors one after the other."""

    class None_(Struct, frozen=True):
        """No usable image: both saliencies are 0."""


AnyAppearance: TypeAlias = (
    Appearance.Saliency
    | Appearance.Words
    | Appearance.Descriptors
    | Appearance.None_
)
"""A value of Appearance."""


class Attitude(Struct, frozen=True):
    """Noise of the attitude sensor."""

    tilt_sigma_deg: float | None = 0.25
    """Standard deviation of each tilt, deg; default 0.25; null if there is no attitude sensor."""

    heading_sigma_deg: float | None = 0.25
    """Standard deviation of the heading, deg; default 0.25; null if the heading is not observed."""


class Command(Struct, frozen=True):
    """Payload of `op/{start,pause,resume,hold,complete,abort}`."""

    reason: str
    """Why, in a sentence for whoever reads the record; may be empty."""


class Criterion(StrEnum):
    """The scalar of a covariance that uncertainty is."""

    DETERMINANT = "determinant"
    """The sixth root of the determinant's ratio to the allowable one [PDN12, eq. 5]."""


class Depth(Struct, frozen=True):
    """Noise of the depth sensor."""

    sigma_m: float | None = 0.02
    """Standard deviation, m; default 0.02; null if there is no depth sensor."""


class EvaluateRequest(Struct, frozen=True):
    """Payload of `rpc/evaluate`: paths that a person drew."""

    paths: tuple[tuple[tuple[float, float, float], ...], ...]
    """Each path is a list of world points `[x, y, z]`, m, from the robot's position on; the way back
    follows the same points."""


class Exploration(Struct, frozen=True):
    """Going on with the survey, candidate 0."""

    covariance: tuple[float, ...]
    """Sigma_exp: the robot's marginal carried one step by the last odometry."""

    uncertainty: float
    """U^0 [PDN12, eq. 5]: 0 below the allowance."""

    uncertainty_ratio: float
    """(|Sigma_exp| / |Sigma_allow|)^(1/6), also below the allowance."""

    area: float
    """A^0 [PDN12, eq. 6]."""

    penalty: float
    """C^0 [PDN12, eq. 7]."""

    reward: float
    """R^0 [PDN12, eq. 8]."""


class Facet(Struct, frozen=True):
    """A planar rectangle in the world, seen from the side to which `u x v` points."""

    origin: tuple[float, float, float]
    """The corner from which the raster counts, `[x, y, z]`, m."""

    u: tuple[float, float, float]
    """Unit direction of the first edge."""

    v: tuple[float, float, float]
    """Unit direction of the second edge, orthogonal to `u`."""

    length_u_m: float
    """Length along `u`, m."""

    length_v_m: float
    """Length along `v`, m."""


class FacetCoverage(Struct, frozen=True):
    """The raster of a facet."""

    cells_u: int
    """Cells along `u`."""

    cells_v: int
    """Cells along `v`."""

    covered_cells: int
    """Covered cells."""

    runs: tuple[int, ...]
    """Lengths of alternating runs of uncovered and covered cells, first uncovered, over the cells in the
    order `v * cells_u + u`."""


class CoverageReply(Struct, frozen=True):
    """`rpc/coverage`: the rasters."""

    mission: str
    """Id of the mission."""

    graph_seq: int
    """The answer rests on all events below."""

    covered_m2: float
    """A_covered, m^2."""

    target_m2: float
    """A_target, m^2."""

    cell_m: float
    """Edge of a cell, m."""

    facets: tuple[FacetCoverage, ...]
    """In the order of the configuration."""


class FirstKeyframeSigmas(Struct, frozen=True):
    """Prior on the first keyframe."""

    translation_m: tuple[float, float, float] = (0.02, 0.02, 0.02)
    """Standard deviations in body axes, m; default 0.02 each."""

    rotation_deg: tuple[float, float, float] = (0.1, 0.1, 0.1)
    """Standard deviations in body axes, deg; default 0.1 each."""


class Health(Struct, frozen=True):
    """What is wrong or wanting in a mission."""

    ok: bool
    """Whether decisions can rest on the graph."""

    findings: tuple[str, ...]
    """One sentence for each finding."""


class IngestStatus(Struct, frozen=True):
    """`rpc/ingest`: which events have arrived."""

    mission: str
    """Id of the mission."""

    next_seq: int
    """All events below are applied."""

    durable_seq: int
    """All events below survive a power cut."""

    buffered: int
    """Events that wait for a missing one."""

    missing: tuple[tuple[int, int], ...]
    """Missing events, as `[first, last]`."""

    rejected: int
    """Events refused so far."""


class LinkBin(Struct, frozen=True):
    """One bin of the table."""

    prior_registered: float
    """Beta prior a."""

    prior_failed: float
    """Beta prior b."""

    proposed: int
    """Links proposed in the mission."""

    registered: int
    """Those of them that registered."""

    probability: float
    """(registered + a) / (proposed + a + b)."""


class LinkModel(Struct, frozen=True):
    """What is known beforehand of the probability that a registration succeeds [PDN12, eq. 2]."""

    bins: int = 5
    """Bins of each of the two saliencies, of equal width on [0, 1]; default 5."""

    prior: tuple[tuple[float, float], ...] = (
        (1.0, 199.0),
        (1.0, 199.0),
        (10.0, 190.0),
        (10.0, 190.0),
        (10.0, 190.0),
        (1.0, 199.0),
        (1.0, 199.0),
        (10.0, 190.0),
        (10.0, 190.0),
        (10.0, 190.0),
        (10.0, 190.0),
        (10.0, 190.0),
        (170.0, 30.000000000000004),
        (170.0, 30.000000000000004),
        (170.0, 30.000000000000004),
        (10.0, 190.0),
        (10.0, 190.0),
        (170.0, 30.000000000000004),
        (170.0, 30.000000000000004),
        (170.0, 30.000000000000004),
        (10.0, 190.0),
        (10.0, 190.0),
        (170.0, 30.000000000000004),
        (170.0, 30.000000000000004),
        (170.0, 30.000000000000004),
    )
    """Beta prior `[a, b]` of each bin, row-major, symmetric, `bins * bins` pairs; default: 200 earlier
    proposals a bin, of which 85 % were registered where both saliencies are at least 0.5 (by the bin's
    centre), 5 % where one is, 0.5 % where none is."""


class LinkModelReply(Struct, frozen=True):
    """`rpc/link_model`: the table of P_L [PDN12, eq. 2]."""

    mission: str
    """Id of the mission."""

    graph_seq: int
    """The answer rests on all events below."""

    bins: int
    """Bins of each saliency."""

    cells: tuple[LinkBin, ...]
    """Row-major, `bins * bins`, symmetric."""


class LinkOutcome(Struct, frozen=True):
    """`in/link`: whether a registration that the vehicle tried has succeeded. The factor of a success
    comes as well."""

    mission: str
    """Id of the mission."""

    seq: int
    """Number of the event."""

    stamp_ns: int
    """Nanoseconds since the Unix epoch on the sender's clock."""

    from_: int
    """One keyframe of the pair."""

    to: int
    """The other."""

    registered: bool
    """Whether the images could be registered."""


class Loss:
    """How the information of a factor shrinks with its whitened residual norm r."""

    class None_(Struct, frozen=True):
        """w = 1."""

    class Huber(Struct, frozen=True):
        """w = min(1, c/r) with this c > 0."""

        value: float
        """What the variant holds."""

    class Cauchy(Struct, frozen=True):
        """w = 1 / (1 + r^2/c^2) with this c > 0."""

        value: float
        """What the variant holds."""


AnyLoss: TypeAlias = (
    Loss.None_
    | Loss.Huber
    | Loss.Cauchy
)
"""A value of Loss."""


class Odometry(Struct, frozen=True):
    """Noise of dead reckoning, growing with the square root of the distance, in body axes."""

    translation_sigma_m_per_sqrt_m: tuple[float, float, float] = (0.012, 0.012, 0.012)
    """m per square root of metre; default 0.012 each."""

    rotation_sigma_deg_per_sqrt_m: tuple[float, float, float] = (0.05, 0.05, 0.05)
    """deg per square root of metre; default 0.05 each."""


class Phase(StrEnum):
    """Where a mission stands."""

    CONFIGURED = "configured"
    """Known, not begun."""

    RUNNING = "running"
    """Decisions are given."""

    PAUSED = "paused"
    """The operator has stopped decisions for a while."""

    HELD = "held"
    """The service has stopped decisions until someone resumes."""

    COMPLETED = "completed"
    """Ended as planned."""

    ABORTED = "aborted"
    """Ended before its end."""


class Planner(Struct, frozen=True):
    """Waypoints, paths and registrations."""

    waypoint_local_saliency: float = 0.5
    """Local saliency from which a keyframe may be clustered; default 0.5 [PDN12, III.B]."""

    eps_m: float = 1.5
    """Radius of DBSCAN, m; default 1.5."""

    min_points: int = 4
    """Keyframes within that radius, itself included, that make a core point; default 4."""

    max_cluster_radius_m: float | None = None
    """Greatest distance of a cluster's keyframes from the one that represents it, m; what is farther is
    represented by another. Default null: 24 times the median distance of consecutive keyframes."""

    edge_radius_m: float | None = None
    """Greatest distance of two keyframes that the search connects, m; default null: 2.6 times the median
    distance of consecutive keyframes. It must exceed the distance of neighbouring tracklines, or paths can
    only go back the way that the vehicle came."""

    sample_spacing_m: float | None = None
    """Greatest distance of successive virtual nodes, m; default null: the median distance of consecutive
    keyframes."""

    min_revisit_m: float = 3.0
    """A waypoint whose path is shorter is no candidate, m; default 3."""

    min_baseline_m: float = 0.3
    """Shortest baseline of a registration, m; default 0.3."""

    max_baseline_m: float = 0.9
    """Longest baseline of a registration, m; default 0.9."""

    max_view_angle_deg: float = 30.0
    """Greatest angle between the optical axes of a registration, deg; default 30."""

    max_links: int = 4
    """Registrations that a keyframe proposes at most; default 4."""

    swath_m: float = 1.6
    """Width that a pass photographs, m; default 1.6."""

    expect_absolute: bool = True
    """Whether virtual nodes get the information of attitude and depth sensors; default true. False gives
    eq. (4) of the paper to the letter."""

    criterion: Criterion = Criterion.DETERMINANT
    """The scalar of a covariance that uncertainty is; default `determinant` [PDN12, eq. 5]."""


class Policy(StrEnum):
    """Who chose the action."""

    PDN = "pdn"
    """The greatest reward [PDN12, eq. 9]."""

    OPERATOR = "operator"
    """The operator."""


class Pose(Struct, frozen=True):
    """A rigid transform; as a keyframe's pose it is `world_from_body`."""

    translation: tuple[float, float, float]
    """`[x, y, z]` in metres."""

    rotation: tuple[float, float, float, float]
    """Unit quaternion `[x, y, z, w]`; its norm must be 1 within 1e-6."""


class Camera(Struct, frozen=True):
    """The camera and what a registration of two of its images measures."""

    body_from_camera: Pose = Pose(
        translation=(0.0, 0.0, 0.0),
        rotation=(0.0, 0.0, 0.7071067811865476, 0.7071067811865476),
    )
    """Pose of the camera (x right, y down, z along the optical axis) in the body frame (x forward, y
    right, z down); default looks straight down, image top forward."""

    horizontal_fov_deg: float = 56.0
    """Full angle along the camera's x axis, deg; default 56."""

    vertical_fov_deg: float = 44.0
    """Full angle along the camera's y axis, deg; default 44."""

    max_range_m: float = 3.0
    """Farthest distance along the optical axis at which a surface counts as photographed, m; default 3."""

    direction_sigma_deg: float = 1.0
    """Standard deviation of each component of the baseline direction, deg; default 1 [PDN12, III.D]."""

    rotation_sigma_deg: float = 0.1
    """Standard deviation of each component of the relative rotation, deg; default 0.1 [PDN12, III.D]."""


class Candidate(Struct, frozen=True, kw_only=True):
    """A revisit, candidate k > 0."""

    candidate: int
    """k."""

    keyframe: int | None = None
    """The waypoint; null for a path that a person drew."""

    path: tuple[int, ...]
    """Keyframes from the robot to the waypoint, both included; empty for a path that a person drew."""

    one_way_m: float
    """Length of the way out, m."""

    nodes: int
    """Virtual nodes of the round trip; the last one is at the robot's pose."""

    covariance: tuple[float, ...]
    """Sigma_nn: expected covariance at the last virtual node [PDN12, eq. 4]."""

    uncertainty: float
    """U^k [PDN12, eq. 5]."""

    uncertainty_all_links: float
    """U^k with every link registered (P = 1)."""

    uncertainty_no_links: float
    """U^k with none registered (P = 0)."""

    peak_uncertainty: float
    """Greatest (|Sigma_ii| / |Sigma_allow|)^(1/6) over the virtual nodes i = 1..n, each the block of the
    same inverse as Sigma_nn."""

    redundant_m2: float
    """A_redundant: twice `one_way_m` times the swath, m^2."""

    area: float
    """A^k [PDN12, eq. 6]."""

    penalty: float
    """C^k [PDN12, eq. 7]."""

    reward: float
    """R^k [PDN12, eq. 8]."""

    break_even_alpha: float | None = None
    """The alpha above which this beats exploring; null when U^k >= U^0."""

    expected_links: float
    """Sum of P_L over the links."""

    poses: tuple[Pose, ...] | None = None
    """World poses of the virtual nodes 1..n; null without `detail=full`."""

    links: tuple[tuple[int, int, float], ...] | None = None
    """`[node, keyframe, probability]` of each expected registration; null without `detail=full`."""


class FactorKind:
    """The kinds of measurement. Every covariance must be finite, symmetric and positive definite."""

    class Prior(Struct, frozen=True):
        """The pose of one keyframe. Residual `Log(Z^-1 X)`."""

        keyframe: int
        """The keyframe."""

        pose: Pose
        """Measured `world_from_body`."""

        covariance: tuple[float, ...]
        """6x6, row-major, `[m; rad]`."""

    class Odometry(Struct, frozen=True):
        """The step between two successive keyframes. Residual `Log(Z^-1 X_from^-1 X_to)`."""

        from_: int
        """The earlier keyframe."""

        to: int
        """The later keyframe."""

        relative: Pose
        """Measured pose of `to` in the body frame of `from`."""

        covariance: tuple[float, ...]
        """6x6, row-major, `[m; rad]`."""

    class Relative(Struct, frozen=True):
        """A six-degree constraint between any two keyframes. Residual as for odometry."""

        from_: int
        """The keyframe in whose frame the other is measured."""

        to: int
        """The keyframe that is measured."""

        relative: Pose
        """Measured pose of `to` in the body frame of `from`."""

        covariance: tuple[float, ...]
        """6x6, row-major, `[m; rad]`."""

    class Camera(Struct, frozen=True):
        """A monocular registration: direction of the baseline and relative rotation, five degrees of
        freedom."""

        from_: int
        """The keyframe in whose camera frame the other is measured."""

        to: int
        """The keyframe whose camera is measured."""

        direction: tuple[float, float, float]
        """Unit vector from the camera of `from` to that of `to`, in the camera frame of `from`."""

        rotation: tuple[float, float, float, float]
        """Unit quaternion `[x, y, z, w]`: the camera of `to` seen from the camera of `from`."""

        covariance: tuple[float, ...]
        """5x5, row-major, rad: two direction components, then rotation."""

    class Attitude(Struct, frozen=True):
        """Attitude in world axes. Residual `Log(R Z^T)`: tilt about x, tilt about y, heading."""

        keyframe: int
        """The keyframe."""

        rotation: tuple[float, float, float, float]
        """Measured rotation of `world_from_body`, `[x, y, z, w]`. Where the heading is not observed, put
        in the one that the vehicle believes: one that is far off distorts the two tilt rows."""

        tilt_variance_rad2: float
        """Variance of each tilt, rad^2."""

        heading_variance_rad2: float | None = None
        """Variance of the heading, rad^2; null if the heading is not observed (then only the tilts count)."""

    class Depth(Struct, frozen=True):
        """Depth. Residual `t_z - z`."""

        keyframe: int
        """The keyframe."""

        depth_m: float
        """Metres, positive down."""

        variance_m2: float
        """Variance, m^2."""

    class Position(Struct, frozen=True):
        """Position in the world (USBL, or GPS at the surface). Residual `t - z`."""

        keyframe: int
        """The keyframe."""

        position: tuple[float, float, float]
        """`[x, y, z]`, m."""

        covariance: tuple[float, ...]
        """3x3, row-major, m^2. Where the depth is not observed its row and column are zero."""


AnyFactorKind: TypeAlias = (
    FactorKind.Prior
    | FactorKind.Odometry
    | FactorKind.Relative
    | FactorKind.Camera
    | FactorKind.Attitude
    | FactorKind.Depth
    | FactorKind.Position
)
"""A value of FactorKind."""


class Factor(Struct, frozen=True):
    """`in/factor`: a measurement that ties one or two keyframes."""

    mission: str
    """Id of the mission."""

    seq: int
    """Number of the event."""

    stamp_ns: int
    """Nanoseconds since the Unix epoch on the sender's clock."""

    factor: AnyFactorKind
    """The measurement."""


class GraphKeyframe(Struct, frozen=True):
    """A keyframe of the pose graph."""

    id: int
    """Its id."""

    pose: Pose
    """Estimate of `world_from_body`."""

    linearization: Pose
    """The linearisation point, at which decisions are evaluated."""

    local_saliency: float
    """S_L."""

    global_saliency: float
    """S_G."""

    covariance: tuple[float, ...] | None = None
    """Marginal covariance at the linearisation point; null without `marginals=true`."""


class GraphReply(Struct, frozen=True):
    """`rpc/graph`: the pose graph."""

    mission: str
    """Id of the mission."""

    graph_seq: int
    """The answer rests on all events below."""

    keyframes: tuple[GraphKeyframe, ...]
    """By id, from `from=` on."""

    factors: dict[str, int]
    """Count of each kind of factor."""

    chi2: float
    """Sum of w r' W r over the factors at the estimate, without 1/2, w being the robust weight."""


class Keyframe(Struct, frozen=True, kw_only=True):
    """`in/keyframe`: a place where the vehicle took an image."""

    mission: str
    """Id of the mission, `[a-z0-9_-]{1,64}`."""

    seq: int
    """Number of the event: from 0, contiguous over the mission's events whatever their key."""

    stamp_ns: int
    """Nanoseconds since the Unix epoch on the sender's clock; no decision depends on it."""

    id: int
    """Unique in the mission."""

    pose: Pose | None = None
    """The sender's estimate of `world_from_body`; null to initialise it from the first factor that ties
    this keyframe to a known one."""

    camera: Pose | None = None
    """`body_from_camera` at this keyframe, where it differs from the mission's."""

    appearance: AnyAppearance
    """What the image shows."""


class Problem(Struct, frozen=True):
    """`out/rejected` and every error reply: what was refused, why and what to do."""

    code: str
    """One of the codes of `schemas/errors.md`."""

    message: str
    """What is wrong, where, and what to do."""

    seq: int | None = None
    """The event's number; null for a query or an event that could not be read."""


class Robot(Struct, frozen=True):
    """The newest keyframe of the graph."""

    keyframe: int
    """Its id."""

    pose: Pose
    """`world_from_body`: in a decision the linearisation point, in a mission's state the estimate."""

    covariance: tuple[float, ...]
    """Its marginal covariance."""


class Robust(Struct, frozen=True):
    """Robust loss of each kind of factor."""

    prior: AnyLoss = Loss.None_()
    """Default none."""

    odometry: AnyLoss = Loss.None_()
    """Default none."""

    relative: AnyLoss = Loss.None_()
    """Default none."""

    camera: AnyLoss = Loss.Cauchy(2.385)
    """Default Cauchy with 2.385."""

    attitude: AnyLoss = Loss.None_()
    """Default none."""

    depth: AnyLoss = Loss.None_()
    """Default none."""

    position: AnyLoss = Loss.None_()
    """Default none."""


class Target(Struct, frozen=True):
    """The surface to photograph."""

    facets: tuple[Facet, ...]
    """Planar rectangles; at least one."""

    area_m2: float | None = None
    """Area that counts as the whole, m^2; null for the sum of the facets."""


class MissionConfig(Struct, frozen=True):
    """Everything that a decision depends on besides the events."""

    mission: str
    """Id of the mission, `[a-z0-9_-]{1,64}`; never used twice by one vehicle."""

    target: Target
    """The surface to photograph."""

    allowable: Allowable = Allowable()
    """The navigation uncertainty that the operator allows, one standard deviation each."""

    alpha: float = 1.0
    """Weight of the uncertainty against the area, in [0, 1]; default 1 [PDN12, eq. 7]."""

    camera: Camera = Camera()
    """The camera."""

    odometry: Odometry = Odometry()
    """Dead reckoning, expected of the way ahead."""

    attitude: Attitude = Attitude()
    """Attitude sensor."""

    depth: Depth = Depth()
    """Depth sensor."""

    planner: Planner = Planner()
    """Waypoints, paths and registrations."""

    link_model: LinkModel = LinkModel()
    """What is known beforehand of the probability that a registration succeeds."""

    robust: Robust = Robust()
    """Robust loss of each kind of factor."""

    cell_m: float = 0.1
    """Edge of a cell of the coverage raster, m; default 0.1."""

    survey: tuple[tuple[float, float, float], ...] | None = None
    """The planned way over the target, world points in m, of which the remaining length is told; default
    null."""

    first_keyframe_sigmas: FirstKeyframeSigmas | None = FirstKeyframeSigmas()
    """Prior on the first keyframe at the pose that its event carries; null if a `prior` factor will come."""

    gate_sigmas: float | None = 20.0
    """A measurement of a kind without a robust loss that lies farther than this from what is believed of
    its keyframes is refused as `contradiction`, in standard deviations (Mahalanobis); default 20, null for
    no gate."""


class MissionState(Struct, frozen=True, kw_only=True):
    """`rpc/mission`, `op/*`, `out/state`: a mission as it stands."""

    mission: str
    """Id of the mission."""

    phase: Phase
    """Where it stands."""

    robot: Robot | None = None
    """The newest keyframe of the graph; null before the first."""

    reason: str
    """Why the phase is what it is, in a sentence."""

    since_ns: int
    """When the phase began, ns since the Unix epoch on the daemon's clock."""

    config: MissionConfig
    """What the mission was configured with."""

    next_seq: int
    """All events below are applied."""

    keyframes: int
    """Keyframes in the graph."""

    factors: int
    """Factors in the graph, the prior of `first_keyframe_sigmas` included."""

    covered_m2: float
    """Area photographed, m^2, by the corrected trajectory."""

    target_m2: float
    """Area that counts as the whole, m^2."""

    uncertainty: float | None = None
    """(|Sigma_rr| / |Sigma_allow|)^(1/6) of the robot; null before the first keyframe."""

    decisions: int
    """Decisions given."""

    revisits: int
    """Those of them that chose a revisit."""

    estimated_remaining_m: float | None = None
    """Length of the survey still ahead, m; null without a survey."""

    health: Health
    """What is wrong or wanting."""


class Timing(Struct, frozen=True):
    """Where the time of an answer went, on the daemon's clock."""

    wait_ms: float
    """Waiting for the event of `after=`, ms."""

    queue_ms: float
    """Waiting for a thread of the pool, ms."""

    evaluate_ms: float
    """Evaluating, ms."""

    total_ms: float
    """From the query's arrival to its reply, ms."""


class Decision(Struct, frozen=True, kw_only=True):
    """`rpc/decision`, `out/decided`: explore or revisit, with every number behind it [PDN12, III]."""

    mission: str
    """Id of the mission."""

    decision: int | None = None
    """Number of the decision, from 0; null for a what-if, which is not counted."""

    graph_seq: int
    """The decision rests on all events below."""

    phase: Phase
    """Phase of the mission."""

    robot: Robot
    """The newest keyframe, virtual node 0; the pose is its linearisation point."""

    alpha: float
    """Weight of the uncertainty."""

    allowable: Allowable
    """The allowance."""

    policy: Policy
    """Who chose."""

    action: AnyAction
    """What to do."""

    exploration: Exploration
    """Candidate 0."""

    candidates: tuple[Candidate, ...]
    """Candidates from 1, in the order of their waypoints' keyframe ids."""

    not_evaluated: tuple[int, ...]
    """Keyframes of waypoints that the deadline left unevaluated."""

    target_m2: float
    """A_target, m^2."""

    covered_m2: float
    """A_covered, m^2."""

    complete: bool
    """Whether every candidate was evaluated."""

    link_model: LinkModelReply | None = None
    """The table of P_L that the candidates rest on; null without `detail=full`."""

    timing: Timing
    """Where the time went; not part of what is decided."""

    reason: str
    """Why, in one sentence for a person."""


class EvaluateReply(Struct, frozen=True):
    """`rpc/evaluate`: candidates as in a decision, numbered in the order of the paths."""

    mission: str
    """Id of the mission."""

    graph_seq: int
    """The answer rests on all events below."""

    exploration: Exploration
    """Candidate 0."""

    candidates: tuple[Candidate, ...]
    """One for each path."""

    timing: Timing
    """Where the time went."""


class Waypoint(Struct, frozen=True, kw_only=True):
    """A cluster and its representative."""

    keyframe: int
    """The representative keyframe."""

    pose: Pose
    """Its estimated pose."""

    marginal_uncertainty: float
    """Its marginal's |Sigma|^(1/6)."""

    score: float
    """S_G * u_min / u, by which it was chosen."""

    members: tuple[int, ...]
    """The cluster's keyframes, by id."""

    one_way_m: float | None = None
    """Length of the path from the robot, m; null if there is none."""

    candidate: bool
    """Whether decisions consider it: it has a path no shorter than `min_revisit_m`."""


class WaypointsReply(Struct, frozen=True):
    """`rpc/waypoints`: clusters of salient keyframes [PDN12, III.B]."""

    mission: str
    """Id of the mission."""

    graph_seq: int
    """The answer rests on all events below."""

    waypoints: tuple[Waypoint, ...]
    """In the order of their waypoints' ids."""
