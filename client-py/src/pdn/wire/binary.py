"""The messages in bincode: little-endian, 64-bit lengths, 32-bit variant tags.

Generated from the types in `schemas/src` by `cargo run --release -p pdn-schemas -- generate`.
"""

# ruff: noqa: E501
# fmt: off

from collections.abc import Callable
from struct import Struct
from typing import Any

from . import messages as m
from .primitives import (
    boolean,
    count,
    flag,
    length,
    one_of,
    read_run,
    read_string,
    run,
    string,
    unknown_variant,
    wrong_sizes,
)

_S0 = Struct("<QQ")
_S1 = Struct("<I")
_S2 = Struct("<IIQ")
_S3 = Struct("<IQ")
_S4 = Struct("<Idd")
_S5 = Struct("<dd")
_S6 = Struct("<2I")
_S7 = Struct("<II")
_S8 = Struct("<Bd")
_S9 = Struct("<d")
_S10 = Struct("<3d")
_S11 = Struct("<Qddd")
_S12 = Struct("<B")
_S13 = Struct("<QQQ")
_S14 = Struct("<2Q")
_S15 = Struct("<Q")
_S16 = Struct("<2d")
_S17 = Struct("<QI")
_S18 = Struct("<ddQQd")
_S19 = Struct("<QQQQB")
_S20 = Struct("<Id")
_S21 = Struct("<ddI")
_S22 = Struct("<ddddIdBI")
_S23 = Struct("<BQ")
_S24 = Struct("<dI36ddddddddd")
_S25 = Struct("<3d4d")
_S26 = Struct("<IQd")
_S27 = Struct("<IQ3d4d36d")
_S28 = Struct("<Q3d4d36d")
_S29 = Struct("<IQQ3d4d36d")
_S30 = Struct("<QQ3d4d36d")
_S31 = Struct("<IQQ3d4d25d")
_S32 = Struct("<QQ3d4d25d")
_S33 = Struct("<IQ4dd")
_S34 = Struct("<Q4dd")
_S35 = Struct("<IQdd")
_S36 = Struct("<Qdd")
_S37 = Struct("<IQ3d9d")
_S38 = Struct("<Q3d9d")
_S39 = Struct("<Q3d4d3d4ddd")
_S40 = Struct("<B36d")
_S41 = Struct("<36d")
_S42 = Struct("<B3d4d")
_S43 = Struct("<3d3d3ddd")
_S44 = Struct("<ddddddd3d4dddddd3d3d")
_S45 = Struct("<B3d3d")
_S46 = Struct("<3d3d")
_S47 = Struct("<BQ3d4d36d")
_S48 = Struct("<QQQdd")
_S49 = Struct("<QIQ3d4d36ddddddddI")
_S50 = Struct("<36dddddd")
_S51 = Struct("<ddB")
_S52 = Struct("<dddd")
_S53 = Struct("<Q36dddddd")
_S54 = Struct("<Q3d4ddd")

def write_ack(out: bytearray, v: m.Ack) -> None:
    string(out, v.mission)
    out += _S0.pack(v.next_seq, v.durable_seq)


def read_ack(b: bytes, i: int) -> tuple[m.Ack, int]:
    x3, i = read_string(b, i)
    x2 = _S0.unpack_from(b, i)
    i += 16
    return m.Ack(mission=x3, next_seq=x2[0], durable_seq=x2[1]), i


def write_action_explore(out: bytearray, _: m.Action.Explore) -> None:
    out += _S1.pack(0)


def read_action_explore(_: bytes, i: int) -> tuple[m.Action.Explore, int]:
    return m.Action.Explore(), i


def write_action_revisit(out: bytearray, v: m.Action.Revisit) -> None:
    out += _S2.pack(1, v.candidate, v.keyframe)


def read_action_revisit(b: bytes, i: int) -> tuple[m.Action.Revisit, int]:
    x7 = _S3.unpack_from(b, i)
    i += 12
    return m.Action.Revisit(candidate=x7[0], keyframe=x7[1]), i


_WRITE_ACTION: dict[type, Callable[[bytearray, Any], None]] = {
    m.Action.Explore: write_action_explore,
    m.Action.Revisit: write_action_revisit,
}
_READ_ACTION: tuple[Callable[[bytes, int], tuple[m.AnyAction, int]], ...] = (
    read_action_explore,
    read_action_revisit,
)


def write_action(out: bytearray, v: m.AnyAction) -> None:
    _WRITE_ACTION[type(v)](out, v)


def read_action(b: bytes, i: int) -> tuple[m.AnyAction, int]:
    tag: int = _S1.unpack_from(b, i)[0]
    if tag >= 2:
        raise unknown_variant("Action", tag, 2)
    return _READ_ACTION[tag](b, i + 4)


def write_appearance_saliency(out: bytearray, v: m.Appearance.Saliency) -> None:
    out += _S4.pack(0, v.local, v.global_)


def read_appearance_saliency(b: bytes, i: int) -> tuple[m.Appearance.Saliency, int]:
    x9 = _S5.unpack_from(b, i)
    i += 16
    return m.Appearance.Saliency(local=x9[0], global_=x9[1]), i


def write_appearance_words(out: bytearray, v: m.Appearance.Words) -> None:
    out += _S1.pack(1)
    length(out, v.value)
    for x11 in v.value:
        out += _S6.pack(*x11)


def read_appearance_words(b: bytes, i: int) -> tuple[m.Appearance.Words, int]:
    x16, i = count(b, i, 8)
    x15: tuple[tuple[int, int], ...] = tuple(x14[0:2] for x14 in _S6.iter_unpack(b[i:i + x16 * 8]))
    i += x16 * 8
    return m.Appearance.Words(value=x15), i


def write_appearance_descriptors(out: bytearray, v: m.Appearance.Descriptors) -> None:
    out += _S7.pack(2, v.dim)
    run(out, "f", v.values)


def read_appearance_descriptors(b: bytes, i: int) -> tuple[m.Appearance.Descriptors, int]:
    x18 = _S1.unpack_from(b, i)
    i += 4
    x20, i = read_run(b, i, "f", 4)
    return m.Appearance.Descriptors(dim=x18[0], values=x20), i


def write_appearance_none(out: bytearray, _: m.Appearance.None_) -> None:
    out += _S1.pack(3)


def read_appearance_none(_: bytes, i: int) -> tuple[m.Appearance.None_, int]:
    return m.Appearance.None_(), i


_WRITE_APPEARANCE: dict[type, Callable[[bytearray, Any], None]] = {
    m.Appearance.Saliency: write_appearance_saliency,
    m.Appearance.Words: write_appearance_words,
    m.Appearance.Descriptors: write_appearance_descriptors,
    m.Appearance.None_: write_appearance_none,
}
_READ_APPEARANCE: tuple[Callable[[bytes, int], tuple[m.AnyAppearance, int]], ...] = (
    read_appearance_saliency,
    read_appearance_words,
    read_appearance_descriptors,
    read_appearance_none,
)


def write_appearance(out: bytearray, v: m.AnyAppearance) -> None:
    _WRITE_APPEARANCE[type(v)](out, v)


def read_appearance(b: bytes, i: int) -> tuple[m.AnyAppearance, int]:
    tag: int = _S1.unpack_from(b, i)[0]
    if tag >= 4:
        raise unknown_variant("Appearance", tag, 4)
    return _READ_APPEARANCE[tag](b, i + 4)


def write_attitude(out: bytearray, v: m.Attitude) -> None:
    x24 = v.tilt_sigma_deg
    if x24 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x24)
    x25 = v.heading_sigma_deg
    if x25 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x25)


def read_attitude(b: bytes, i: int) -> tuple[m.Attitude, int]:
    x28: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x29 = _S9.unpack_from(b, i)
        i += 8
        x28 = x29[0]
    x32: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x33 = _S9.unpack_from(b, i)
        i += 8
        x32 = x33[0]
    return m.Attitude(tilt_sigma_deg=x28, heading_sigma_deg=x32), i


def write_command(out: bytearray, v: m.Command) -> None:
    string(out, v.reason)


def read_command(b: bytes, i: int) -> tuple[m.Command, int]:
    x38, i = read_string(b, i)
    return m.Command(reason=x38), i


_CRITERION = (m.Criterion.DETERMINANT,)
_CRITERION_TAG = {value: tag for tag, value in enumerate(_CRITERION)}


def write_depth(out: bytearray, v: m.Depth) -> None:
    x40 = v.sigma_m
    if x40 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x40)


def read_depth(b: bytes, i: int) -> tuple[m.Depth, int]:
    x43: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x44 = _S9.unpack_from(b, i)
        i += 8
        x43 = x44[0]
    return m.Depth(sigma_m=x43), i


def write_evaluate_request(out: bytearray, v: m.EvaluateRequest) -> None:
    length(out, v.paths)
    for x47 in v.paths:
        length(out, x47)
        for x48 in x47:
            out += _S10.pack(*x48)


def read_evaluate_request(b: bytes, i: int) -> tuple[m.EvaluateRequest, int]:
    x52, i = count(b, i, 1)
    x51: list[tuple[tuple[float, float, float], ...]] = []
    for _ in range(x52):
        x57, i = count(b, i, 24)
        x56: tuple[tuple[float, float, float], ...] = tuple(x55[0:3] for x55 in _S10.iter_unpack(b[i:i + x57 * 24]))
        i += x57 * 24
        x51.append(x56)
    return m.EvaluateRequest(paths=tuple(x51)), i


def write_facet_coverage(out: bytearray, v: m.FacetCoverage) -> None:
    out += _S2.pack(v.cells_u, v.cells_v, v.covered_cells)
    run(out, "I", v.runs)


def read_facet_coverage(b: bytes, i: int) -> tuple[m.FacetCoverage, int]:
    x60 = _S2.unpack_from(b, i)
    i += 16
    x62, i = read_run(b, i, "I", 4)
    return m.FacetCoverage(cells_u=x60[0], cells_v=x60[1], covered_cells=x60[2], runs=x62), i


def write_coverage_reply(out: bytearray, v: m.CoverageReply) -> None:
    string(out, v.mission)
    out += _S11.pack(v.graph_seq, v.covered_m2, v.target_m2, v.cell_m)
    length(out, v.facets)
    for x64 in v.facets:
        write_facet_coverage(out, x64)


def read_coverage_reply(b: bytes, i: int) -> tuple[m.CoverageReply, int]:
    x67, i = read_string(b, i)
    x66 = _S11.unpack_from(b, i)
    i += 32
    x70, i = count(b, i, 1)
    x69: list[m.FacetCoverage] = []
    for _ in range(x70):
        x73, i = read_facet_coverage(b, i)
        x69.append(x73)
    return m.CoverageReply(mission=x67, graph_seq=x66[0], covered_m2=x66[1], target_m2=x66[2], cell_m=x66[3], facets=tuple(x69)), i


def write_health(out: bytearray, v: m.Health) -> None:
    out += _S12.pack(v.ok)
    length(out, v.findings)
    for x76 in v.findings:
        string(out, x76)


def read_health(b: bytes, i: int) -> tuple[m.Health, int]:
    x77 = _S12.unpack_from(b, i)
    i += 1
    x80, i = count(b, i, 1)
    x79: list[str] = []
    for _ in range(x80):
        x83, i = read_string(b, i)
        x79.append(x83)
    return m.Health(ok=boolean(x77[0]), findings=tuple(x79)), i


def write_ingest_status(out: bytearray, v: m.IngestStatus) -> None:
    string(out, v.mission)
    out += _S13.pack(v.next_seq, v.durable_seq, v.buffered)
    length(out, v.missing)
    for x86 in v.missing:
        out += _S14.pack(*x86)
    out += _S15.pack(v.rejected)


def read_ingest_status(b: bytes, i: int) -> tuple[m.IngestStatus, int]:
    x89, i = read_string(b, i)
    x88 = _S13.unpack_from(b, i)
    i += 24
    x93, i = count(b, i, 16)
    x92: tuple[tuple[int, int], ...] = tuple(x91[0:2] for x91 in _S14.iter_unpack(b[i:i + x93 * 16]))
    i += x93 * 16
    x90 = _S15.unpack_from(b, i)
    i += 8
    return m.IngestStatus(mission=x89, next_seq=x88[0], durable_seq=x88[1], buffered=x88[2], missing=x92, rejected=x90[0]), i


def write_link_model(out: bytearray, v: m.LinkModel) -> None:
    out += _S1.pack(v.bins)
    length(out, v.prior)
    for x95 in v.prior:
        out += _S16.pack(*x95)


def read_link_model(b: bytes, i: int) -> tuple[m.LinkModel, int]:
    x96 = _S1.unpack_from(b, i)
    i += 4
    x100, i = count(b, i, 16)
    x99: tuple[tuple[float, float], ...] = tuple(x98[0:2] for x98 in _S16.iter_unpack(b[i:i + x100 * 16]))
    i += x100 * 16
    return m.LinkModel(bins=x96[0], prior=x99), i


def write_link_model_reply(out: bytearray, v: m.LinkModelReply) -> None:
    string(out, v.mission)
    out += _S17.pack(v.graph_seq, v.bins)
    length(out, v.cells)
    for x102 in v.cells:
        out += _S18.pack(x102.prior_registered, x102.prior_failed, x102.proposed, x102.registered, x102.probability)


def read_link_model_reply(b: bytes, i: int) -> tuple[m.LinkModelReply, int]:
    x105, i = read_string(b, i)
    x104 = _S17.unpack_from(b, i)
    i += 12
    x109, i = count(b, i, 40)
    x108: tuple[m.LinkBin, ...] = tuple(m.LinkBin(prior_registered=x107[0], prior_failed=x107[1], proposed=x107[2], registered=x107[3], probability=x107[4]) for x107 in _S18.iter_unpack(b[i:i + x109 * 40]))
    i += x109 * 40
    return m.LinkModelReply(mission=x105, graph_seq=x104[0], bins=x104[1], cells=x108), i


def write_link_outcome(out: bytearray, v: m.LinkOutcome) -> None:
    string(out, v.mission)
    out += _S19.pack(v.seq, v.stamp_ns, v.from_, v.to, v.registered)


def read_link_outcome(b: bytes, i: int) -> tuple[m.LinkOutcome, int]:
    x113, i = read_string(b, i)
    x112 = _S19.unpack_from(b, i)
    i += 33
    return m.LinkOutcome(mission=x113, seq=x112[0], stamp_ns=x112[1], from_=x112[2], to=x112[3], registered=boolean(x112[4])), i


def write_loss_none(out: bytearray, _: m.Loss.None_) -> None:
    out += _S1.pack(0)


def read_loss_none(_: bytes, i: int) -> tuple[m.Loss.None_, int]:
    return m.Loss.None_(), i


def write_loss_huber(out: bytearray, v: m.Loss.Huber) -> None:
    out += _S20.pack(1, v.value)


def read_loss_huber(b: bytes, i: int) -> tuple[m.Loss.Huber, int]:
    x117 = _S9.unpack_from(b, i)
    i += 8
    return m.Loss.Huber(value=x117[0]), i


def write_loss_cauchy(out: bytearray, v: m.Loss.Cauchy) -> None:
    out += _S20.pack(2, v.value)


def read_loss_cauchy(b: bytes, i: int) -> tuple[m.Loss.Cauchy, int]:
    x119 = _S9.unpack_from(b, i)
    i += 8
    return m.Loss.Cauchy(value=x119[0]), i


_WRITE_LOSS: dict[type, Callable[[bytearray, Any], None]] = {
    m.Loss.None_: write_loss_none,
    m.Loss.Huber: write_loss_huber,
    m.Loss.Cauchy: write_loss_cauchy,
}
_READ_LOSS: tuple[Callable[[bytes, int], tuple[m.AnyLoss, int]], ...] = (
    read_loss_none,
    read_loss_huber,
    read_loss_cauchy,
)


def write_loss(out: bytearray, v: m.AnyLoss) -> None:
    _WRITE_LOSS[type(v)](out, v)


def read_loss(b: bytes, i: int) -> tuple[m.AnyLoss, int]:
    tag: int = _S1.unpack_from(b, i)[0]
    if tag >= 3:
        raise unknown_variant("Loss", tag, 3)
    return _READ_LOSS[tag](b, i + 4)


_PHASE = (m.Phase.CONFIGURED, m.Phase.RUNNING, m.Phase.PAUSED, m.Phase.HELD, m.Phase.COMPLETED, m.Phase.ABORTED,)
_PHASE_TAG = {value: tag for tag, value in enumerate(_PHASE)}


def write_planner(out: bytearray, v: m.Planner) -> None:
    out += _S21.pack(v.waypoint_local_saliency, v.eps_m, v.min_points)
    x121 = v.max_cluster_radius_m
    if x121 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x121)
    x122 = v.edge_radius_m
    if x122 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x122)
    x123 = v.sample_spacing_m
    if x123 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x123)
    out += _S22.pack(v.min_revisit_m, v.min_baseline_m, v.max_baseline_m, v.max_view_angle_deg, v.max_links, v.swath_m, v.expect_absolute, _CRITERION_TAG[v.criterion])


def read_planner(b: bytes, i: int) -> tuple[m.Planner, int]:
    x124 = _S21.unpack_from(b, i)
    i += 20
    x126: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x127 = _S9.unpack_from(b, i)
        i += 8
        x126 = x127[0]
    x130: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x131 = _S9.unpack_from(b, i)
        i += 8
        x130 = x131[0]
    x134: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x135 = _S9.unpack_from(b, i)
        i += 8
        x134 = x135[0]
    x133 = _S22.unpack_from(b, i)
    i += 49
    return m.Planner(waypoint_local_saliency=x124[0], eps_m=x124[1], min_points=x124[2], max_cluster_radius_m=x126, edge_radius_m=x130, sample_spacing_m=x134, min_revisit_m=x133[0], min_baseline_m=x133[1], max_baseline_m=x133[2], max_view_angle_deg=x133[3], max_links=x133[4], swath_m=x133[5], expect_absolute=boolean(x133[6]), criterion=one_of("Criterion", _CRITERION, x133[7])), i


_POLICY = (m.Policy.PDN, m.Policy.OPERATOR,)
_POLICY_TAG = {value: tag for tag, value in enumerate(_POLICY)}


def write_candidate(out: bytearray, v: m.Candidate) -> None:
    out += _S1.pack(v.candidate)
    x138 = v.keyframe
    if x138 is None:
        out.append(0)
    else:
        out += _S23.pack(1, x138)
    run(out, "Q", v.path)
    out += _S24.pack(v.one_way_m, v.nodes, *v.covariance, v.uncertainty, v.uncertainty_all_links, v.uncertainty_no_links, v.peak_uncertainty, v.redundant_m2, v.area, v.penalty, v.reward)
    x139 = v.break_even_alpha
    if x139 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x139)
    out += _S9.pack(v.expected_links)
    x140 = v.poses
    if x140 is None:
        out.append(0)
    else:
        out += _S12.pack(1)
        length(out, x140)
        for x141 in x140:
            if len(x141.translation) != 3:
                raise wrong_sizes()
            out += _S25.pack(*x141.translation, *x141.rotation)
    x142 = v.links
    if x142 is None:
        out.append(0)
    else:
        out += _S12.pack(1)
        length(out, x142)
        for x143 in x142:
            out += _S26.pack(x143[0], x143[1], x143[2])


def read_candidate(b: bytes, i: int) -> tuple[m.Candidate, int]:
    x144 = _S1.unpack_from(b, i)
    i += 4
    x146: int | None = None
    some = flag(b, i)
    i += 1
    if some:
        x147 = _S15.unpack_from(b, i)
        i += 8
        x146 = x147[0]
    x150, i = read_run(b, i, "Q", 8)
    x149 = _S24.unpack_from(b, i)
    i += 364
    x152: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x153 = _S9.unpack_from(b, i)
        i += 8
        x152 = x153[0]
    x151 = _S9.unpack_from(b, i)
    i += 8
    x156: tuple[m.Pose, ...] | None = None
    some = flag(b, i)
    i += 1
    if some:
        x161, i = count(b, i, 56)
        x160: tuple[m.Pose, ...] = tuple(m.Pose(translation=x159[0:3], rotation=x159[3:7]) for x159 in _S25.iter_unpack(b[i:i + x161 * 56]))
        i += x161 * 56
        x156 = x160
    x164: tuple[tuple[int, int, float], ...] | None = None
    some = flag(b, i)
    i += 1
    if some:
        x169, i = count(b, i, 20)
        x168: tuple[tuple[int, int, float], ...] = tuple((x167[0], x167[1], x167[2]) for x167 in _S26.iter_unpack(b[i:i + x169 * 20]))
        i += x169 * 20
        x164 = x168
    return m.Candidate(candidate=x144[0], keyframe=x146, path=x150, one_way_m=x149[0], nodes=x149[1], covariance=x149[2:38], uncertainty=x149[38], uncertainty_all_links=x149[39], uncertainty_no_links=x149[40], peak_uncertainty=x149[41], redundant_m2=x149[42], area=x149[43], penalty=x149[44], reward=x149[45], break_even_alpha=x152, expected_links=x151[0], poses=x156, links=x164), i


def write_factor_kind_prior(out: bytearray, v: m.FactorKind.Prior) -> None:
    if len(v.pose.translation) != 3 or len(v.pose.rotation) != 4:
        raise wrong_sizes()
    out += _S27.pack(0, v.keyframe, *v.pose.translation, *v.pose.rotation, *v.covariance)


def read_factor_kind_prior(b: bytes, i: int) -> tuple[m.FactorKind.Prior, int]:
    x172 = _S28.unpack_from(b, i)
    i += 352
    return m.FactorKind.Prior(keyframe=x172[0], pose=m.Pose(translation=x172[1:4], rotation=x172[4:8]), covariance=x172[8:44]), i


def write_factor_kind_odometry(out: bytearray, v: m.FactorKind.Odometry) -> None:
    if len(v.relative.translation) != 3 or len(v.relative.rotation) != 4:
        raise wrong_sizes()
    out += _S29.pack(1, v.from_, v.to, *v.relative.translation, *v.relative.rotation, *v.covariance)


def read_factor_kind_odometry(b: bytes, i: int) -> tuple[m.FactorKind.Odometry, int]:
    x174 = _S30.unpack_from(b, i)
    i += 360
    return m.FactorKind.Odometry(from_=x174[0], to=x174[1], relative=m.Pose(translation=x174[2:5], rotation=x174[5:9]), covariance=x174[9:45]), i


def write_factor_kind_relative(out: bytearray, v: m.FactorKind.Relative) -> None:
    if len(v.relative.translation) != 3 or len(v.relative.rotation) != 4:
        raise wrong_sizes()
    out += _S29.pack(2, v.from_, v.to, *v.relative.translation, *v.relative.rotation, *v.covariance)


def read_factor_kind_relative(b: bytes, i: int) -> tuple[m.FactorKind.Relative, int]:
    x176 = _S30.unpack_from(b, i)
    i += 360
    return m.FactorKind.Relative(from_=x176[0], to=x176[1], relative=m.Pose(translation=x176[2:5], rotation=x176[5:9]), covariance=x176[9:45]), i


def write_factor_kind_camera(out: bytearray, v: m.FactorKind.Camera) -> None:
    if len(v.direction) != 3 or len(v.rotation) != 4:
        raise wrong_sizes()
    out += _S31.pack(3, v.from_, v.to, *v.direction, *v.rotation, *v.covariance)


def read_factor_kind_camera(b: bytes, i: int) -> tuple[m.FactorKind.Camera, int]:
    x178 = _S32.unpack_from(b, i)
    i += 272
    return m.FactorKind.Camera(from_=x178[0], to=x178[1], direction=x178[2:5], rotation=x178[5:9], covariance=x178[9:34]), i


def write_factor_kind_attitude(out: bytearray, v: m.FactorKind.Attitude) -> None:
    out += _S33.pack(4, v.keyframe, *v.rotation, v.tilt_variance_rad2)
    x180 = v.heading_variance_rad2
    if x180 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x180)


def read_factor_kind_attitude(b: bytes, i: int) -> tuple[m.FactorKind.Attitude, int]:
    x181 = _S34.unpack_from(b, i)
    i += 48
    x183: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x184 = _S9.unpack_from(b, i)
        i += 8
        x183 = x184[0]
    return m.FactorKind.Attitude(keyframe=x181[0], rotation=x181[1:5], tilt_variance_rad2=x181[5], heading_variance_rad2=x183), i


def write_factor_kind_depth(out: bytearray, v: m.FactorKind.Depth) -> None:
    out += _S35.pack(5, v.keyframe, v.depth_m, v.variance_m2)


def read_factor_kind_depth(b: bytes, i: int) -> tuple[m.FactorKind.Depth, int]:
    x187 = _S36.unpack_from(b, i)
    i += 24
    return m.FactorKind.Depth(keyframe=x187[0], depth_m=x187[1], variance_m2=x187[2]), i


def write_factor_kind_position(out: bytearray, v: m.FactorKind.Position) -> None:
    if len(v.position) != 3:
        raise wrong_sizes()
    out += _S37.pack(6, v.keyframe, *v.position, *v.covariance)


def read_factor_kind_position(b: bytes, i: int) -> tuple[m.FactorKind.Position, int]:
    x189 = _S38.unpack_from(b, i)
    i += 104
    return m.FactorKind.Position(keyframe=x189[0], position=x189[1:4], covariance=x189[4:13]), i


_WRITE_FACTOR_KIND: dict[type, Callable[[bytearray, Any], None]] = {
    m.FactorKind.Prior: write_factor_kind_prior,
    m.FactorKind.Odometry: write_factor_kind_odometry,
    m.FactorKind.Relative: write_factor_kind_relative,
    m.FactorKind.Camera: write_factor_kind_camera,
    m.FactorKind.Attitude: write_factor_kind_attitude,
    m.FactorKind.Depth: write_factor_kind_depth,
    m.FactorKind.Position: write_factor_kind_position,
}
_READ_FACTOR_KIND: tuple[Callable[[bytes, int], tuple[m.AnyFactorKind, int]], ...] = (
    read_factor_kind_prior,
    read_factor_kind_odometry,
    read_factor_kind_relative,
    read_factor_kind_camera,
    read_factor_kind_attitude,
    read_factor_kind_depth,
    read_factor_kind_position,
)


def write_factor_kind(out: bytearray, v: m.AnyFactorKind) -> None:
    _WRITE_FACTOR_KIND[type(v)](out, v)


def read_factor_kind(b: bytes, i: int) -> tuple[m.AnyFactorKind, int]:
    tag: int = _S1.unpack_from(b, i)[0]
    if tag >= 7:
        raise unknown_variant("FactorKind", tag, 7)
    return _READ_FACTOR_KIND[tag](b, i + 4)


def write_factor(out: bytearray, v: m.Factor) -> None:
    string(out, v.mission)
    out += _S0.pack(v.seq, v.stamp_ns)
    write_factor_kind(out, v.factor)


def read_factor(b: bytes, i: int) -> tuple[m.Factor, int]:
    x193, i = read_string(b, i)
    x192 = _S0.unpack_from(b, i)
    i += 16
    x195, i = read_factor_kind(b, i)
    return m.Factor(mission=x193, seq=x192[0], stamp_ns=x192[1], factor=x195), i


def write_graph_keyframe(out: bytearray, v: m.GraphKeyframe) -> None:
    if len(v.pose.translation) != 3 or len(v.pose.rotation) != 4 or len(v.linearization.translation) != 3:
        raise wrong_sizes()
    out += _S39.pack(v.id, *v.pose.translation, *v.pose.rotation, *v.linearization.translation, *v.linearization.rotation, v.local_saliency, v.global_saliency)
    x197 = v.covariance
    if x197 is None:
        out.append(0)
    else:
        out += _S40.pack(1, *x197)


def read_graph_keyframe(b: bytes, i: int) -> tuple[m.GraphKeyframe, int]:
    x198 = _S39.unpack_from(b, i)
    i += 136
    x200: tuple[float, ...] | None = None
    some = flag(b, i)
    i += 1
    if some:
        x201 = _S41.unpack_from(b, i)
        i += 288
        x200 = x201[0:36]
    return m.GraphKeyframe(id=x198[0], pose=m.Pose(translation=x198[1:4], rotation=x198[4:8]), linearization=m.Pose(translation=x198[8:11], rotation=x198[11:15]), local_saliency=x198[15], global_saliency=x198[16], covariance=x200), i


def write_graph_reply(out: bytearray, v: m.GraphReply) -> None:
    string(out, v.mission)
    out += _S15.pack(v.graph_seq)
    length(out, v.keyframes)
    for x204 in v.keyframes:
        write_graph_keyframe(out, x204)
    length(out, v.factors)
    for x205 in sorted(v.factors):
        string(out, x205)
        out += _S15.pack(v.factors[x205])
    out += _S9.pack(v.chi2)


def read_graph_reply(b: bytes, i: int) -> tuple[m.GraphReply, int]:
    x208, i = read_string(b, i)
    x207 = _S15.unpack_from(b, i)
    i += 8
    x211, i = count(b, i, 1)
    x210: list[m.GraphKeyframe] = []
    for _ in range(x211):
        x214, i = read_graph_keyframe(b, i)
        x210.append(x214)
    x218, i = count(b, i, 9)
    x217: dict[str, int] = {}
    for _ in range(x218):
        x219, i = read_string(b, i)
        x220 = _S15.unpack_from(b, i)
        i += 8
        x217[x219] = x220[0]
    x216 = _S9.unpack_from(b, i)
    i += 8
    return m.GraphReply(mission=x208, graph_seq=x207[0], keyframes=tuple(x210), factors=x217, chi2=x216[0]), i


def write_keyframe(out: bytearray, v: m.Keyframe) -> None:
    string(out, v.mission)
    out += _S13.pack(v.seq, v.stamp_ns, v.id)
    x223 = v.pose
    if x223 is None:
        out.append(0)
    else:
        if len(x223.translation) != 3:
            raise wrong_sizes()
        out += _S42.pack(1, *x223.translation, *x223.rotation)
    x224 = v.camera
    if x224 is None:
        out.append(0)
    else:
        if len(x224.translation) != 3:
            raise wrong_sizes()
        out += _S42.pack(1, *x224.translation, *x224.rotation)
    write_appearance(out, v.appearance)


def read_keyframe(b: bytes, i: int) -> tuple[m.Keyframe, int]:
    x227, i = read_string(b, i)
    x226 = _S13.unpack_from(b, i)
    i += 24
    x229: m.Pose | None = None
    some = flag(b, i)
    i += 1
    if some:
        x230 = _S25.unpack_from(b, i)
        i += 56
        x229 = m.Pose(translation=x230[0:3], rotation=x230[3:7])
    x233: m.Pose | None = None
    some = flag(b, i)
    i += 1
    if some:
        x234 = _S25.unpack_from(b, i)
        i += 56
        x233 = m.Pose(translation=x234[0:3], rotation=x234[3:7])
    x237, i = read_appearance(b, i)
    return m.Keyframe(mission=x227, seq=x226[0], stamp_ns=x226[1], id=x226[2], pose=x229, camera=x233, appearance=x237), i


def write_problem(out: bytearray, v: m.Problem) -> None:
    string(out, v.code)
    string(out, v.message)
    x239 = v.seq
    if x239 is None:
        out.append(0)
    else:
        out += _S23.pack(1, x239)


def read_problem(b: bytes, i: int) -> tuple[m.Problem, int]:
    x242, i = read_string(b, i)
    x244, i = read_string(b, i)
    x246: int | None = None
    some = flag(b, i)
    i += 1
    if some:
        x247 = _S15.unpack_from(b, i)
        i += 8
        x246 = x247[0]
    return m.Problem(code=x242, message=x244, seq=x246), i


def write_robust(out: bytearray, v: m.Robust) -> None:
    write_loss(out, v.prior)
    write_loss(out, v.odometry)
    write_loss(out, v.relative)
    write_loss(out, v.camera)
    write_loss(out, v.attitude)
    write_loss(out, v.depth)
    write_loss(out, v.position)


def read_robust(b: bytes, i: int) -> tuple[m.Robust, int]:
    x252, i = read_loss(b, i)
    x254, i = read_loss(b, i)
    x256, i = read_loss(b, i)
    x258, i = read_loss(b, i)
    x260, i = read_loss(b, i)
    x262, i = read_loss(b, i)
    x264, i = read_loss(b, i)
    return m.Robust(prior=x252, odometry=x254, relative=x256, camera=x258, attitude=x260, depth=x262, position=x264), i


def write_target(out: bytearray, v: m.Target) -> None:
    length(out, v.facets)
    for x266 in v.facets:
        if len(x266.origin) != 3 or len(x266.u) != 3:
            raise wrong_sizes()
        out += _S43.pack(*x266.origin, *x266.u, *x266.v, x266.length_u_m, x266.length_v_m)
    x267 = v.area_m2
    if x267 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x267)


def read_target(b: bytes, i: int) -> tuple[m.Target, int]:
    x272, i = count(b, i, 88)
    x271: tuple[m.Facet, ...] = tuple(m.Facet(origin=x270[0:3], u=x270[3:6], v=x270[6:9], length_u_m=x270[9], length_v_m=x270[10]) for x270 in _S43.iter_unpack(b[i:i + x272 * 88]))
    i += x272 * 88
    x274: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x275 = _S9.unpack_from(b, i)
        i += 8
        x274 = x275[0]
    return m.Target(facets=x271, area_m2=x274), i


def write_mission_config(out: bytearray, v: m.MissionConfig) -> None:
    string(out, v.mission)
    write_target(out, v.target)
    if len(v.camera.body_from_camera.translation) != 3 or len(v.camera.body_from_camera.rotation) != 4 or len(v.odometry.translation_sigma_m_per_sqrt_m) != 3:
        raise wrong_sizes()
    out += _S44.pack(v.allowable.x_m, v.allowable.y_m, v.allowable.depth_m, v.allowable.roll_deg, v.allowable.pitch_deg, v.allowable.heading_deg, v.alpha, *v.camera.body_from_camera.translation, *v.camera.body_from_camera.rotation, v.camera.horizontal_fov_deg, v.camera.vertical_fov_deg, v.camera.max_range_m, v.camera.direction_sigma_deg, v.camera.rotation_sigma_deg, *v.odometry.translation_sigma_m_per_sqrt_m, *v.odometry.rotation_sigma_deg_per_sqrt_m)
    write_attitude(out, v.attitude)
    write_depth(out, v.depth)
    write_planner(out, v.planner)
    write_link_model(out, v.link_model)
    write_robust(out, v.robust)
    out += _S9.pack(v.cell_m)
    x278 = v.survey
    if x278 is None:
        out.append(0)
    else:
        out += _S12.pack(1)
        length(out, x278)
        for x279 in x278:
            out += _S10.pack(*x279)
    x280 = v.first_keyframe_sigmas
    if x280 is None:
        out.append(0)
    else:
        if len(x280.translation_m) != 3:
            raise wrong_sizes()
        out += _S45.pack(1, *x280.translation_m, *x280.rotation_deg)
    x281 = v.gate_sigmas
    if x281 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x281)


def read_mission_config(b: bytes, i: int) -> tuple[m.MissionConfig, int]:
    x284, i = read_string(b, i)
    x286, i = read_target(b, i)
    x285 = _S44.unpack_from(b, i)
    i += 200
    x288, i = read_attitude(b, i)
    x290, i = read_depth(b, i)
    x292, i = read_planner(b, i)
    x294, i = read_link_model(b, i)
    x296, i = read_robust(b, i)
    x295 = _S9.unpack_from(b, i)
    i += 8
    x298: tuple[tuple[float, float, float], ...] | None = None
    some = flag(b, i)
    i += 1
    if some:
        x303, i = count(b, i, 24)
        x302: tuple[tuple[float, float, float], ...] = tuple(x301[0:3] for x301 in _S10.iter_unpack(b[i:i + x303 * 24]))
        i += x303 * 24
        x298 = x302
    x306: m.FirstKeyframeSigmas | None = None
    some = flag(b, i)
    i += 1
    if some:
        x307 = _S46.unpack_from(b, i)
        i += 48
        x306 = m.FirstKeyframeSigmas(translation_m=x307[0:3], rotation_deg=x307[3:6])
    x310: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x311 = _S9.unpack_from(b, i)
        i += 8
        x310 = x311[0]
    return m.MissionConfig(mission=x284, target=x286, allowable=m.Allowable(x_m=x285[0], y_m=x285[1], depth_m=x285[2], roll_deg=x285[3], pitch_deg=x285[4], heading_deg=x285[5]), alpha=x285[6], camera=m.Camera(body_from_camera=m.Pose(translation=x285[7:10], rotation=x285[10:14]), horizontal_fov_deg=x285[14], vertical_fov_deg=x285[15], max_range_m=x285[16], direction_sigma_deg=x285[17], rotation_sigma_deg=x285[18]), odometry=m.Odometry(translation_sigma_m_per_sqrt_m=x285[19:22], rotation_sigma_deg_per_sqrt_m=x285[22:25]), attitude=x288, depth=x290, planner=x292, link_model=x294, robust=x296, cell_m=x295[0], survey=x298, first_keyframe_sigmas=x306, gate_sigmas=x310), i


def write_mission_state(out: bytearray, v: m.MissionState) -> None:
    string(out, v.mission)
    out += _S1.pack(_PHASE_TAG[v.phase])
    x314 = v.robot
    if x314 is None:
        out.append(0)
    else:
        if len(x314.pose.translation) != 3 or len(x314.pose.rotation) != 4:
            raise wrong_sizes()
        out += _S47.pack(1, x314.keyframe, *x314.pose.translation, *x314.pose.rotation, *x314.covariance)
    string(out, v.reason)
    out += _S15.pack(v.since_ns)
    write_mission_config(out, v.config)
    out += _S48.pack(v.next_seq, v.keyframes, v.factors, v.covered_m2, v.target_m2)
    x315 = v.uncertainty
    if x315 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x315)
    out += _S0.pack(v.decisions, v.revisits)
    x316 = v.estimated_remaining_m
    if x316 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x316)
    write_health(out, v.health)


def read_mission_state(b: bytes, i: int) -> tuple[m.MissionState, int]:
    x319, i = read_string(b, i)
    x318 = _S1.unpack_from(b, i)
    i += 4
    x321: m.Robot | None = None
    some = flag(b, i)
    i += 1
    if some:
        x322 = _S28.unpack_from(b, i)
        i += 352
        x321 = m.Robot(keyframe=x322[0], pose=m.Pose(translation=x322[1:4], rotation=x322[4:8]), covariance=x322[8:44])
    x325, i = read_string(b, i)
    x324 = _S15.unpack_from(b, i)
    i += 8
    x327, i = read_mission_config(b, i)
    x326 = _S48.unpack_from(b, i)
    i += 40
    x329: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x330 = _S9.unpack_from(b, i)
        i += 8
        x329 = x330[0]
    x328 = _S0.unpack_from(b, i)
    i += 16
    x333: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x334 = _S9.unpack_from(b, i)
        i += 8
        x333 = x334[0]
    x337, i = read_health(b, i)
    return m.MissionState(mission=x319, phase=one_of("Phase", _PHASE, x318[0]), robot=x321, reason=x325, since_ns=x324[0], config=x327, next_seq=x326[0], keyframes=x326[1], factors=x326[2], covered_m2=x326[3], target_m2=x326[4], uncertainty=x329, decisions=x328[0], revisits=x328[1], estimated_remaining_m=x333, health=x337), i


def write_decision(out: bytearray, v: m.Decision) -> None:
    string(out, v.mission)
    x339 = v.decision
    if x339 is None:
        out.append(0)
    else:
        out += _S23.pack(1, x339)
    if len(v.robot.pose.translation) != 3 or len(v.robot.pose.rotation) != 4:
        raise wrong_sizes()
    out += _S49.pack(v.graph_seq, _PHASE_TAG[v.phase], v.robot.keyframe, *v.robot.pose.translation, *v.robot.pose.rotation, *v.robot.covariance, v.alpha, v.allowable.x_m, v.allowable.y_m, v.allowable.depth_m, v.allowable.roll_deg, v.allowable.pitch_deg, v.allowable.heading_deg, _POLICY_TAG[v.policy])
    write_action(out, v.action)
    out += _S50.pack(*v.exploration.covariance, v.exploration.uncertainty, v.exploration.uncertainty_ratio, v.exploration.area, v.exploration.penalty, v.exploration.reward)
    length(out, v.candidates)
    for x340 in v.candidates:
        write_candidate(out, x340)
    run(out, "Q", v.not_evaluated)
    out += _S51.pack(v.target_m2, v.covered_m2, v.complete)
    x341 = v.link_model
    if x341 is None:
        out.append(0)
    else:
        out += _S12.pack(1)
        write_link_model_reply(out, x341)
    out += _S52.pack(v.timing.wait_ms, v.timing.queue_ms, v.timing.evaluate_ms, v.timing.total_ms)
    string(out, v.reason)


def read_decision(b: bytes, i: int) -> tuple[m.Decision, int]:
    x344, i = read_string(b, i)
    x346: int | None = None
    some = flag(b, i)
    i += 1
    if some:
        x347 = _S15.unpack_from(b, i)
        i += 8
        x346 = x347[0]
    x345 = _S49.unpack_from(b, i)
    i += 424
    x350, i = read_action(b, i)
    x349 = _S50.unpack_from(b, i)
    i += 328
    x353, i = count(b, i, 1)
    x352: list[m.Candidate] = []
    for _ in range(x353):
        x356, i = read_candidate(b, i)
        x352.append(x356)
    x359, i = read_run(b, i, "Q", 8)
    x358 = _S51.unpack_from(b, i)
    i += 17
    x361: m.LinkModelReply | None = None
    some = flag(b, i)
    i += 1
    if some:
        x364, i = read_link_model_reply(b, i)
        x361 = x364
    x360 = _S52.unpack_from(b, i)
    i += 32
    x367, i = read_string(b, i)
    return m.Decision(mission=x344, decision=x346, graph_seq=x345[0], phase=one_of("Phase", _PHASE, x345[1]), robot=m.Robot(keyframe=x345[2], pose=m.Pose(translation=x345[3:6], rotation=x345[6:10]), covariance=x345[10:46]), alpha=x345[46], allowable=m.Allowable(x_m=x345[47], y_m=x345[48], depth_m=x345[49], roll_deg=x345[50], pitch_deg=x345[51], heading_deg=x345[52]), policy=one_of("Policy", _POLICY, x345[53]), action=x350, exploration=m.Exploration(covariance=x349[0:36], uncertainty=x349[36], uncertainty_ratio=x349[37], area=x349[38], penalty=x349[39], reward=x349[40]), candidates=tuple(x352), not_evaluated=x359, target_m2=x358[0], covered_m2=x358[1], complete=boolean(x358[2]), link_model=x361, timing=m.Timing(wait_ms=x360[0], queue_ms=x360[1], evaluate_ms=x360[2], total_ms=x360[3]), reason=x367), i


def write_evaluate_reply(out: bytearray, v: m.EvaluateReply) -> None:
    string(out, v.mission)
    out += _S53.pack(v.graph_seq, *v.exploration.covariance, v.exploration.uncertainty, v.exploration.uncertainty_ratio, v.exploration.area, v.exploration.penalty, v.exploration.reward)
    length(out, v.candidates)
    for x369 in v.candidates:
        write_candidate(out, x369)
    out += _S52.pack(v.timing.wait_ms, v.timing.queue_ms, v.timing.evaluate_ms, v.timing.total_ms)


def read_evaluate_reply(b: bytes, i: int) -> tuple[m.EvaluateReply, int]:
    x372, i = read_string(b, i)
    x371 = _S53.unpack_from(b, i)
    i += 336
    x375, i = count(b, i, 1)
    x374: list[m.Candidate] = []
    for _ in range(x375):
        x378, i = read_candidate(b, i)
        x374.append(x378)
    x373 = _S52.unpack_from(b, i)
    i += 32
    return m.EvaluateReply(mission=x372, graph_seq=x371[0], exploration=m.Exploration(covariance=x371[1:37], uncertainty=x371[37], uncertainty_ratio=x371[38], area=x371[39], penalty=x371[40], reward=x371[41]), candidates=tuple(x374), timing=m.Timing(wait_ms=x373[0], queue_ms=x373[1], evaluate_ms=x373[2], total_ms=x373[3])), i


def write_waypoint(out: bytearray, v: m.Waypoint) -> None:
    if len(v.pose.translation) != 3:
        raise wrong_sizes()
    out += _S54.pack(v.keyframe, *v.pose.translation, *v.pose.rotation, v.marginal_uncertainty, v.score)
    run(out, "Q", v.members)
    x381 = v.one_way_m
    if x381 is None:
        out.append(0)
    else:
        out += _S8.pack(1, x381)
    out += _S12.pack(v.candidate)


def read_waypoint(b: bytes, i: int) -> tuple[m.Waypoint, int]:
    x382 = _S54.unpack_from(b, i)
    i += 80
    x384, i = read_run(b, i, "Q", 8)
    x386: float | None = None
    some = flag(b, i)
    i += 1
    if some:
        x387 = _S9.unpack_from(b, i)
        i += 8
        x386 = x387[0]
    x385 = _S12.unpack_from(b, i)
    i += 1
    return m.Waypoint(keyframe=x382[0], pose=m.Pose(translation=x382[1:4], rotation=x382[4:8]), marginal_uncertainty=x382[8], score=x382[9], members=x384, one_way_m=x386, candidate=boolean(x385[0])), i


def write_waypoints_reply(out: bytearray, v: m.WaypointsReply) -> None:
    string(out, v.mission)
    out += _S15.pack(v.graph_seq)
    length(out, v.waypoints)
    for x390 in v.waypoints:
        write_waypoint(out, x390)


def read_waypoints_reply(b: bytes, i: int) -> tuple[m.WaypointsReply, int]:
    x393, i = read_string(b, i)
    x392 = _S15.unpack_from(b, i)
    i += 8
    x396, i = count(b, i, 1)
    x395: list[m.Waypoint] = []
    for _ in range(x396):
        x399, i = read_waypoint(b, i)
        x395.append(x399)
    return m.WaypointsReply(mission=x393, graph_seq=x392[0], waypoints=tuple(x395)), i


WRITERS: dict[type, Callable[[bytearray, Any], None]] = {
    m.Keyframe: write_keyframe,
    m.Factor: write_factor,
    m.LinkOutcome: write_link_outcome,
    m.MissionConfig: write_mission_config,
    m.Command: write_command,
    m.EvaluateRequest: write_evaluate_request,
    m.MissionState: write_mission_state,
    m.IngestStatus: write_ingest_status,
    m.Ack: write_ack,
    m.Problem: write_problem,
    m.Decision: write_decision,
    m.EvaluateReply: write_evaluate_reply,
    m.GraphReply: write_graph_reply,
    m.WaypointsReply: write_waypoints_reply,
    m.CoverageReply: write_coverage_reply,
    m.LinkModelReply: write_link_model_reply,
}

READERS: dict[type, Callable[[bytes, int], tuple[Any, int]]] = {
    m.Keyframe: read_keyframe,
    m.Factor: read_factor,
    m.LinkOutcome: read_link_outcome,
    m.MissionConfig: read_mission_config,
    m.Command: read_command,
    m.EvaluateRequest: read_evaluate_request,
    m.MissionState: read_mission_state,
    m.IngestStatus: read_ingest_status,
    m.Ack: read_ack,
    m.Problem: read_problem,
    m.Decision: read_decision,
    m.EvaluateReply: read_evaluate_reply,
    m.GraphReply: read_graph_reply,
    m.WaypointsReply: read_waypoints_reply,
    m.CoverageReply: read_coverage_reply,
    m.LinkModelReply: read_link_model_reply,
}
