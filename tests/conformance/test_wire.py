"""Random messages through both formats of the Python codec, and what it refuses."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pdn import wire

U32 = st.integers(0, 2**32 - 1)
U64 = st.integers(0, 2**64 - 1)
NUMBER = st.floats(allow_nan=False, allow_infinity=False)
SINGLE = st.floats(allow_nan=False, allow_infinity=False, width=32)
# Surrogates have no UTF-8.
TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=64)


def numbers(size: int) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[NUMBER] * size)


POSE = st.builds(wire.Pose, numbers(3), numbers(4))
APPEARANCE = st.one_of(
    st.builds(wire.Appearance.Saliency, NUMBER, NUMBER),
    st.builds(wire.Appearance.Words, st.lists(st.tuples(U32, U32), max_size=9).map(tuple)),
    st.builds(wire.Appearance.Descriptors, U32, st.lists(SINGLE, max_size=40).map(tuple)),
    st.builds(wire.Appearance.None_),
)
FACTOR = st.one_of(
    st.builds(wire.FactorKind.Prior, U64, POSE, numbers(36)),
    st.builds(wire.FactorKind.Odometry, U64, U64, POSE, numbers(36)),
    st.builds(wire.FactorKind.Relative, U64, U64, POSE, numbers(36)),
    st.builds(wire.FactorKind.Camera, U64, U64, numbers(3), numbers(4), numbers(25)),
    st.builds(wire.FactorKind.Attitude, U64, numbers(4), NUMBER, st.none() | NUMBER),
    st.builds(wire.FactorKind.Depth, U64, NUMBER, NUMBER),
    st.builds(wire.FactorKind.Position, U64, numbers(3), numbers(9)),
)
MESSAGE = st.one_of(
    st.builds(
        wire.Keyframe,
        mission=TEXT,
        seq=U64,
        stamp_ns=U64,
        id=U64,
        pose=st.none() | POSE,
        camera=st.none() | POSE,
        appearance=APPEARANCE,
    ),
    st.builds(wire.Factor, TEXT, U64, U64, FACTOR),
    st.builds(wire.LinkOutcome, TEXT, U64, U64, U64, U64, st.booleans()),
    st.builds(
        wire.EvaluateRequest, st.lists(st.lists(numbers(3), max_size=3).map(tuple), max_size=3).map(tuple)
    ),
    st.builds(
        wire.IngestStatus, TEXT, U64, U64, U64, st.lists(st.tuples(U64, U64), max_size=3).map(tuple), U64
    ),
)


@given(MESSAGE)
def test_a_message_survives_both_formats(message: object) -> None:
    payload = wire.encode(message)
    assert wire.decode(type(message), payload) == message
    text = wire.encode(message, wire.Format.JSON)
    # Compared as bytes, which tell -0 from 0.
    assert wire.encode(wire.decode(type(message), text, wire.Format.JSON)) == payload
    assert wire.from_json(type(message), wire.to_json(message, indent=2)) == message


@given(
    st.binary(max_size=300),
    st.sampled_from([wire.Keyframe, wire.Factor, wire.MissionConfig, wire.GraphReply]),
)
def test_bytes_at_random_are_refused(payload: bytes, kind: type) -> None:
    # Each of these messages has more structure than chance finds in so few examples.
    for form in wire.Format:
        with pytest.raises(wire.WireError) as refusal:
            wire.decode(kind, payload, form)
        assert refusal.value.code is wire.Code.INVALID


DEPTH = wire.Factor("m", 1, 2, wire.FactorKind.Depth(3, 4.0, 0.01))


def factor(**changes: object) -> str:
    return json.dumps(wire.to_plain(DEPTH) | changes)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (factor(seq=-1), "seq"),
        (factor(seq=2**64), "seq"),
        (factor(seq=1.0), "seq"),
        (factor(seq=True), "seq"),
        (factor(seq="1"), "seq"),
        (factor(mission=None), "mission"),
        (factor(extra=1), "extra"),
        (factor(factor={"depth": {"keyframe": 3, "depth_m": 4}}), "factor.depth.variance_m2"),
        (factor(factor={"depth": {"keyframe": 3, "depth_m": "4", "variance_m2": 1}}), "factor.depth.depth_m"),
        (factor(factor={"depth": {"keyframe": 3, "depth_m": 4, "variance_m2": 1, "x": 0}}), "factor.depth.x"),
        (factor(factor={"deep": {}}), "factor"),
        (factor(factor={}), "factor"),
        (factor(factor="depth"), "factor"),
        (factor(factor={"depth": {}, "prior": {}}), "factor"),
        (factor().replace("4.0", "1e999"), "factor.depth.depth_m"),
        (factor().replace("4.0", "NaN"), "NaN"),
        (factor().replace("4.0", "1" + "0" * 400), "factor.depth.depth_m"),
        (factor()[:-1] + ', "seq": 1}', "seq"),
        ("[]", "."),
        ("", "JSON"),
        ("[" * 100_000, "JSON"),
    ],
)
def test_json_that_is_not_the_message_is_refused_with_the_place(text: str, place: str) -> None:
    with pytest.raises(wire.WireError) as refusal:
        wire.from_json(wire.Factor, text)
    assert place in refusal.value.message


def test_what_cannot_be_written_names_the_field() -> None:
    pose = wire.Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    bad = [
        (wire.FactorKind.Depth(-1, 0.0, 1.0), "factor.depth.keyframe"),
        (wire.FactorKind.Depth(2**64, 0.0, 1.0), "factor.depth.keyframe"),
        (wire.FactorKind.Depth(1, "deep", 1.0), "factor.depth.depth_m"),
        (wire.FactorKind.Prior(1, pose, (1.0,) * 35), "factor.prior.covariance"),
        (wire.FactorKind.Prior(1, None, (1.0,) * 36), "factor.prior.pose"),
        # Seven numbers as they should be, but four of the translation.
        (
            wire.FactorKind.Prior(1, wire.Pose((0.0,) * 4, (0.0,) * 3), (1.0,) * 36),
            "factor.prior.pose.translation",
        ),
        (None, "factor"),
    ]
    for kind, place in bad:
        for form in wire.Format:
            with pytest.raises(wire.WireError) as refusal:
                wire.encode(wire.Factor("m", 0, 0, kind), form)
            assert f"`{place}`" in refusal.value.message
    with pytest.raises(wire.WireError):
        wire.encode(pose)


def test_only_bincode_carries_what_is_not_finite() -> None:
    for value in (math.nan, math.inf, -math.inf):
        message = wire.Factor("m", 0, 0, wire.FactorKind.Depth(0, value, 1.0))
        decoded = wire.decode(wire.Factor, wire.encode(message))
        assert str(decoded) == str(message)
        with pytest.raises(wire.WireError) as refusal:
            wire.encode(message, wire.Format.JSON)
        assert refusal.value.code is wire.Code.NOT_FINITE


def test_a_payload_beyond_the_limit_is_refused() -> None:
    for form in wire.Format:
        with pytest.raises(wire.WireError) as refusal:
            wire.decode(wire.Keyframe, b" " * 10_000_000, form)
        assert refusal.value.code is wire.Code.TOO_LARGE
    with pytest.raises(wire.WireError) as refusal:
        wire.encode(wire.Command("x" * wire.limits.MAX_REQUEST_BYTES))
    assert refusal.value.code is wire.Code.TOO_LARGE


def test_a_length_that_lies_is_refused_before_memory_is_taken() -> None:
    for length in (1, 2**20, 2**33, 2**63, 2**64 - 1):
        for message, at in [(wire.EvaluateRequest(()), 0), (DEPTH, 0), (wire.EvaluateRequest(((),)), 8)]:
            payload = bytearray(wire.encode(message))
            payload[at : at + 8] = length.to_bytes(8, "little")
            if length == 1 and message is DEPTH:
                continue
            with pytest.raises(wire.WireError):
                wire.decode(type(message), bytes(payload))


def test_an_encoding_names_message_version_and_layout() -> None:
    own = wire.encoding(wire.Keyframe)
    assert wire.format_of(wire.Keyframe, own) is wire.Format.BINCODE
    assert wire.format_of(wire.Keyframe, own.split("#")[0]) is wire.Format.BINCODE
    assert wire.format_of(wire.Keyframe, "application/json") is wire.Format.JSON
    others = [
        wire.encoding(wire.Factor),
        own.replace(".v1.", ".v2."),
        own[:-1],
        own.split("#")[0] + "#",
        own.replace("#", "#0"),
        "",
        "zenoh/bytes",
        "application/octet-stream",
    ]
    for text in others:
        with pytest.raises(wire.WireError) as refusal:
            wire.format_of(wire.Keyframe, text)
        assert refusal.value.code is wire.Code.SCHEMA_MISMATCH


def test_keys_are_made_and_taken_apart() -> None:
    for topic in wire.Topic:
        if topic is not wire.Topic.ALIVE_CONSOLE:
            assert wire.parse_key(wire.key("auv-1", topic)) == wire.Key("auv-1", topic)
    console = wire.console_key("auv-1", "bridge")
    assert console == "pdn/auv-1/v1/alive/console/bridge"
    assert wire.parse_key(console) == wire.Key("auv-1", wire.Topic.ALIVE_CONSOLE, "bridge")
    for bad in (
        "",
        "pdn/a/v2/in/factor",
        "pdn/A/v1/in/factor",
        "pdn/a/v1/in/x",
        "pdn/*/v1/in/factor",
        "pdn/a\n/v1/in/factor",
    ):
        with pytest.raises(wire.WireError):
            wire.parse_key(bad)
    for bad in ("", "A", "a/b", "x" * 65, "a\n", "*"):
        with pytest.raises(wire.WireError):
            wire.check_id(bad)


def test_arrays_of_numpy_are_taken() -> None:
    covariance = np.eye(6) * 1e-4
    pose = wire.Pose(wire.row_major(np.zeros(3)), (0.0, 0.0, 0.0, 1.0))
    event = wire.Factor("m", 0, 0, wire.FactorKind.Prior(1, pose, wire.row_major(covariance)))
    direct = wire.Factor("m", 0, 0, wire.FactorKind.Prior(1, pose, covariance.ravel()))
    for form in wire.Format:
        assert wire.encode(direct, form) == wire.encode(event, form)


def test_a_configuration_can_be_toml() -> None:
    text = """
        mission = "m"
        alpha = 0.5
        [[target.facets]]
        origin = [0, 0, 10]
        u = [1, 0, 0]
        v = [0, 1, 0]
        length_u_m = 40
        length_v_m = 20
        [robust]
        camera = { huber = 1.345 }
        position = "none"
        [allowable]
        x_m = 0.5
    """
    config = wire.from_toml(wire.MissionConfig, text)
    assert (config.alpha, config.cell_m) == (0.5, 0.1)
    assert config.robust == wire.Robust(camera=wire.Loss.Huber(1.345))
    assert config.allowable == wire.Allowable(x_m=0.5)
    with pytest.raises(wire.WireError, match="colour"):
        wire.from_toml(wire.MissionConfig, f"colour = 'red'\n{text}")
    with pytest.raises(wire.WireError, match="not TOML"):
        wire.from_toml(wire.MissionConfig, "mission = ")
