"""Laws of the outbox against a receiver that applies events strictly in order, over random losses and
restarts.
"""

from hypothesis import given
from hypothesis import strategies as st

from pdn.client.outbox import WINDOW, Entry, Outbox


def entry(seq: int) -> Entry:
    return Entry(seq, "in/keyframe", b"%d" % seq, "text/plain")


class Receiver:
    """The planner's side of the rule: applies the next number, buffers nothing, makes durable what it is
    told to.
    """

    def __init__(self) -> None:
        self.applied: list[int] = []
        self.durable_seq = 0

    def receive(self, seq: int) -> None:
        if seq == len(self.applied):
            self.applied.append(seq)

    def persist(self) -> None:
        self.durable_seq = len(self.applied)

    def crash(self) -> None:
        del self.applied[self.durable_seq :]


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("append"), st.integers(1, 40)),
        st.tuples(st.just("send"), st.integers(1, 64), st.randoms(use_true_random=False)),
        st.tuples(st.just("persist")),
        st.tuples(st.just("acknowledge")),
        st.tuples(st.just("resynchronise")),
        st.tuples(st.just("crash")),
    ),
    max_size=60,
)


@given(window=st.integers(1, 48), steps=STEPS)
def test_nothing_is_lost_and_nothing_counted_twice(window: int, steps: list[tuple]) -> None:
    outbox, receiver = Outbox(0, window), Receiver()
    old_acks: list[tuple[int, int]] = [(0, 0)]

    def check() -> None:
        assert outbox.durable_seq <= outbox.applied_seq <= outbox.next_seq
        assert outbox.next_seq - outbox.durable_seq <= window
        assert outbox.durable_seq <= receiver.durable_seq
        assert 0 <= outbox.unsent <= window

    for step in steps:
        match step:
            case ("append", count):
                for _ in range(count):
                    if not outbox.full:
                        outbox.append(entry(outbox.next_seq))
            case ("send", limit, random):
                for sent in outbox.take(limit):
                    for _ in range(random.choice([0, 1, 1, 1, 2])):  # lost, delivered, repeated
                        receiver.receive(sent.seq)
            case ("persist",):
                receiver.persist()
                old_acks.append((len(receiver.applied), receiver.durable_seq))
            case ("acknowledge",):
                outbox.acknowledge(*old_acks[len(old_acks) // 2])
                outbox.acknowledge(*old_acks[-1])
            case ("resynchronise",):
                assert outbox.lost(len(receiver.applied)) == 0
                outbox.resynchronise(len(receiver.applied), receiver.durable_seq)
            case ("crash",):
                receiver.crash()
        check()

    # Once the link is good, everything arrives, whatever went before.
    outbox.resynchronise(len(receiver.applied), receiver.durable_seq)
    while entries := outbox.take(64):
        for sent in entries:
            receiver.receive(sent.seq)
    receiver.persist()
    outbox.acknowledge(len(receiver.applied), receiver.durable_seq)
    assert outbox.empty
    assert receiver.applied == list(range(outbox.next_seq))


def test_window_is_bounded() -> None:
    outbox = Outbox()
    for seq in range(WINDOW):
        outbox.append(entry(seq))
    assert outbox.full
    assert [taken.seq for taken in outbox.take(3)] == [0, 1, 2]
    assert outbox.acknowledge(2, 1)
    assert not outbox.full
    assert not outbox.acknowledge(2, 1), "an old acknowledgement is no progress"


def test_goes_on_where_the_planner_is() -> None:
    outbox = Outbox(7)
    outbox.append(entry(7))
    outbox.append(entry(8))
    outbox.take(2)
    assert outbox.unsent == 0
    assert not outbox.resynchronise(7, 7)
    assert [taken.seq for taken in outbox.take(9)] == [7, 8]
    assert outbox.lost(5) == 2
