"""The sender against a planner that loses, repeats, stalls, restarts and refuses; no network, so that
each fault is exact.

Waits are on conditions with a bound of `WAIT_S`, far above the fraction of a second that each case
takes.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from pdn.client import backoff as backoff_module
from pdn.client import sender as sender_module
from pdn.client.errors import (
    EventsRefused,
    MissionLost,
    MissionUnknown,
    OutboxFull,
    PlannerAbsent,
    StreamBroken,
    Timeout,
    TwoPublishers,
)
from pdn.client.outbox import Entry
from pdn.client.outbox_file import OutboxFile
from pdn.client.sender import Sender

WAIT_S = 20.0


@dataclass
class Status:
    next_seq: int = 0
    durable_seq: int = 0
    rejected: int = 0


@dataclass
class Problem:
    code: str
    message: str
    seq: int | None


@dataclass
class Planner:
    """Applies events strictly in order; what it does with each copy that arrives is up to `fate`."""

    fate: Callable[[int, int], str] = lambda seq, copy: "deliver"
    present: bool = True
    knows_mission: bool = True
    acknowledges: bool = True
    status: Status = field(default_factory=Status)
    applied: list[bytes] = field(default_factory=list)
    copies: dict[int, int] = field(default_factory=dict)
    questions: int = 0
    sender: Sender | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)

    def send(self, entry: Entry) -> None:
        with self.lock:
            if not self.present:
                return
            copy = self.copies[entry.seq] = self.copies.get(entry.seq, 0) + 1
            match self.fate(entry.seq, copy):
                case "deliver":
                    self._apply(entry)
                case "repeat":
                    self._apply(entry)
                    self._apply(entry)
                case "refuse":
                    self._refuse(entry, announce=True)
                case "refuse silently":
                    self._refuse(entry, announce=False)
                case "lose":
                    return
                case "ended" if self.sender:
                    sender, problem = self.sender, Problem("mission_ended", "configure a new one", entry.seq)
                    sender.enqueue(lambda: sender.rejected(problem))
            status = Status(self.status.next_seq, self.status.durable_seq)
        if self.acknowledges and self.sender:
            sender = self.sender
            sender.enqueue(lambda: sender.acknowledged(status.next_seq, status.durable_seq))

    def ingest(self, timeout_s: float) -> Status:
        del timeout_s
        with self.lock:
            self.questions += 1
            if not self.present:
                raise PlannerAbsent("nobody answers")
            if not self.knows_mission:
                raise MissionUnknown("unknown_mission", "no such mission")
            return Status(self.status.next_seq, self.status.durable_seq, self.status.rejected)

    def crash(self) -> None:
        with self.lock:
            self.present = False
            del self.applied[self.status.durable_seq :]
            self.status.next_seq = self.status.durable_seq
        assert self.sender
        self.sender.enqueue(self.sender.planner_disappeared)

    def come_back(self) -> None:
        with self.lock:
            self.present = True
        assert self.sender
        self.sender.enqueue(self.sender.planner_appeared)

    def _apply(self, entry: Entry) -> None:
        if entry.seq == self.status.next_seq:
            self.applied.append(entry.payload)
            self.status.next_seq += 1
            self.status.durable_seq = self.status.next_seq

    def _refuse(self, entry: Entry, *, announce: bool) -> None:
        if entry.seq != self.status.next_seq:
            return
        self._apply(Entry(entry.seq, entry.key, b"refused", entry.encoding))
        self.status.rejected += 1
        if announce and self.sender:
            sender, problem = self.sender, Problem("not_unit", "normalise it", entry.seq)
            sender.enqueue(lambda: sender.rejected(problem))


@contextmanager
def sending(planner: Planner, **options: object) -> Iterator[Sender]:
    sender = Sender("m", planner, planner.ingest(1.0), **options)  # type: ignore[arg-type]
    planner.sender = sender
    sender.start()
    try:
        yield sender
    finally:
        sender.close()


def post(sender: Sender, timeout_s: float = WAIT_S) -> int:
    return sender.post(lambda seq: Entry(seq, "in/keyframe", b"%d" % seq, "text/plain"), timeout_s)


def expected(count: int) -> list[bytes]:
    return [b"%d" % seq for seq in range(count)]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of the real time-outs, so that the tests take a second."""
    monkeypatch.setattr(backoff_module, "STALL_S", 0.075)
    monkeypatch.setattr(sender_module, "LATE_REASONS_S", 0.1)


@pytest.mark.parametrize(
    "fate",
    [
        lambda seq, copy: "deliver",
        lambda seq, copy: "lose" if copy == 1 and seq % 97 == 5 else "deliver",
        lambda seq, copy: "repeat" if seq % 3 == 0 else "deliver",
        lambda seq, copy: "lose" if copy < 3 and seq in (0, 700, 1999) else "repeat",
    ],
    ids=["plain", "loss", "repeats", "losses of resends"],
)
def test_everything_arrives_once_and_in_order(fate: Callable[[int, int], str]) -> None:
    planner = Planner(fate)
    with sending(planner) as sender:
        assert [post(sender) for _ in range(2000)] == list(range(2000))
        sender.flush(WAIT_S)
    assert planner.applied == expected(2000)


def test_lost_acknowledgements_are_made_up_for_by_asking() -> None:
    planner = Planner(acknowledges=False)
    with sending(planner, window=16) as sender:
        for _ in range(40):
            post(sender)
        sender.flush(WAIT_S)
    assert planner.applied == expected(40)
    assert planner.questions >= 3


def test_planner_that_restarts_gets_again_what_was_not_durable() -> None:
    planner = Planner()
    with sending(planner) as sender:
        for _ in range(100):
            post(sender)
        sender.flush(WAIT_S)
        planner.crash()
        for _ in range(100):
            post(sender)
        with pytest.raises(Timeout, match="from 100 on"):
            sender.flush(0.05)
        planner.come_back()
        sender.flush(WAIT_S)
    assert planner.applied == expected(200)


def test_planner_that_comes_back_unannounced_is_found() -> None:
    planner = Planner()
    with sending(planner) as sender:
        planner.crash()
        post(sender)
        planner.present = True
        sender.flush(WAIT_S)
    assert planner.applied == expected(1)


def test_planner_that_lost_what_was_durable_breaks_the_stream() -> None:
    planner = Planner()
    with sending(planner) as sender:
        for _ in range(10):
            post(sender)
        sender.flush(WAIT_S)
        planner.crash()
        planner.status = Status(4, 4)
        planner.come_back()
        post(sender)
        with pytest.raises(MissionLost, match="lost 6 events"):
            sender.flush(WAIT_S)
        with pytest.raises(MissionLost):
            post(sender)


def test_planner_that_forgot_the_mission_breaks_the_stream() -> None:
    planner = Planner()
    with sending(planner) as sender:
        planner.knows_mission = False
        planner.come_back()
        post(sender)
        with pytest.raises(MissionLost, match="no longer knows"):
            sender.flush(WAIT_S)


def test_another_sender_on_the_mission_is_noticed() -> None:
    planner = Planner(lambda seq, copy: "lose")
    with sending(planner) as sender:
        post(sender)
        planner.status = Status(9, 9)
        with pytest.raises(StreamBroken, match="Another program"):
            sender.flush(WAIT_S)


def test_full_window_blocks_with_a_bound_and_takes_nothing() -> None:
    planner = Planner(lambda seq, copy: "lose")
    with sending(planner, window=8) as sender:
        for _ in range(8):
            post(sender)
        with pytest.raises(OutboxFull, match="8 events"):
            post(sender, timeout_s=0.05)
        assert sender.next_seq == 8
        planner.fate = lambda seq, copy: "deliver"
        assert post(sender) == 8
        sender.flush(WAIT_S)
    assert planner.applied == expected(9)


def test_refusals_are_raised_at_the_next_call_and_the_rest_goes_on() -> None:
    planner = Planner(lambda seq, copy: "refuse" if seq in (1, 2) else "deliver")
    with sending(planner) as sender:
        for _ in range(2):
            post(sender)
        with pytest.raises(EventsRefused) as caught:
            sender.flush(WAIT_S)
        assert (caught.value.code, caught.value.seq) == ("not_unit", 1)
        assert post(sender) == 2
        assert post(sender) == 3
        with pytest.raises(EventsRefused, match="event 2"):
            sender.flush(WAIT_S)
        sender.flush(WAIT_S)
        assert [problem.seq for problem in sender.refusals] == [1, 2]
    assert planner.applied == [b"0", b"refused", b"refused", b"3"]


def test_refusals_go_to_the_callback_once() -> None:
    planner = Planner(lambda seq, copy: "refuse" if seq == 1 else "deliver")
    seen: list[int | None] = []
    with sending(planner, on_rejected=lambda problem: seen.append(problem.seq), raises=False) as sender:
        for _ in range(3):
            post(sender)
        sender.flush(WAIT_S)
        sender.enqueue(lambda: sender.rejected(Problem("not_unit", "normalise it", 1)))
        post(sender)
        sender.flush(WAIT_S)
    assert seen == [1]


def test_refusals_whose_reasons_got_lost_are_still_reported() -> None:
    planner = Planner(lambda seq, copy: "refuse silently" if seq == 1 else "deliver")
    with sending(planner) as sender:
        for _ in range(3):
            post(sender)
        with pytest.raises(EventsRefused, match="1 events were refused"):
            sender.flush(WAIT_S)
        sender.flush(WAIT_S)


@pytest.mark.parametrize("raises", [True, False])
def test_a_mission_that_has_ended_breaks_the_stream_at_once(raises: bool) -> None:
    planner = Planner(lambda seq, copy: "ended" if seq == 2 else "deliver")
    with sending(planner, raises=raises) as sender:
        for _ in range(3):
            post(sender)
        with pytest.raises(StreamBroken, match="takes no more events: configure a new one"):
            sender.flush(WAIT_S)
        assert [problem.seq for problem in sender.refusals] == [2]


def test_refusals_of_events_that_are_not_looked_at_only_delay_them() -> None:
    planner = Planner()
    with sending(planner) as sender:
        post(sender)
        sender.enqueue(lambda: sender.rejected(Problem("overloaded", "later", 0)))
        sender.flush(WAIT_S)
        assert sender.refusals == []


def test_too_many_acknowledgements_do_no_harm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sender_module, "INBOX_CAPACITY", 2)
    planner = Planner()
    with sending(planner) as sender:
        for _ in range(1000):
            post(sender)
        sender.flush(WAIT_S)
    assert planner.applied == expected(1000)


def test_refusals_without_end_do_not_keep_events_from_going_out() -> None:
    planner, ended = Planner(), threading.Event()
    with sending(planner, raises=False) as sender:

        def another() -> None:
            sender.rejected(Problem("invalid", "rubbish of somebody else", None))
            if not ended.is_set():
                sender.enqueue(another)

        another()
        try:
            for _ in range(100):
                post(sender)
            sender.flush(WAIT_S)
        finally:
            ended.set()
    assert planner.applied == expected(100)


# --- two programs, and one that is started again ---


def test_a_number_with_two_contents_breaks_the_stream() -> None:
    planner = Planner()
    with sending(planner, raises=False) as sender:
        post(sender)
        sender.flush(WAIT_S)
        sender.enqueue(lambda: sender.rejected(Problem("conflict", "other content", 0)))
        with pytest.raises(TwoPublishers, match="Another program sends events of mission m"):
            fill(sender)


def test_a_conflict_about_events_of_before_concerns_this_stream_not() -> None:
    planner = Planner(status=Status(5, 5))
    with sending(planner, raises=False) as sender:
        sender.enqueue(lambda: sender.rejected(Problem("conflict", "other content", 4)))
        post(sender)
        sender.flush(WAIT_S)


def fill(sender: Sender) -> None:
    """Posts until something is wrong."""
    for _ in range(1000):
        post(sender)


@pytest.mark.parametrize("applied", [0, 3, 10])
def test_what_an_earlier_program_left_is_sent_whatever_the_planner_has_of_it(
    tmp_path: Path, applied: int
) -> None:
    kept = OutboxFile(tmp_path, "auv", "m")
    kept.begin(0)
    for seq in range(10):
        kept.append(Entry(seq, "in/keyframe", b"%d" % seq, "text/plain"))
    kept.release()
    planner = Planner(status=Status(applied, 0), applied=expected(applied))
    with sending(planner, store=OutboxFile(tmp_path, "auv", "m")) as sender:
        assert sender.next_seq == 10
        assert post(sender) == 10
        sender.flush(WAIT_S)
    assert planner.applied == expected(11)
    assert all(planner.copies.get(seq, 0) > 0 for seq in range(11)), "each is compared with what came before"
    assert not list(tmp_path.iterdir()), "all is durable"


def test_a_planner_with_more_or_less_than_the_outbox_ever_had_is_refused(tmp_path: Path) -> None:
    kept = OutboxFile(tmp_path, "auv", "m")
    kept.begin(7)
    kept.append(Entry(7, "in/keyframe", b"7", "text/plain"))
    for planner, error in (
        (Planner(status=Status(9, 9)), TwoPublishers),
        (Planner(status=Status(6, 6)), MissionLost),
    ):
        with pytest.raises(error):
            Sender("m", planner, planner.ingest(1.0), store=kept)
    kept.release()
