"""Keys: `pdn/{vehicle}/v1/{topic}`. No other module spells one."""

import re
from dataclasses import dataclass

from .errors import invalid
from .limits import MAX_ID_CHARS
from .names import ROOT, VERSION, Topic

_ID = re.compile(rf"[a-z0-9_-]{{1,{MAX_ID_CHARS}}}")
_CONSOLE = Topic.ALIVE_CONSOLE.removesuffix("*")


def check_id(text: str, what: str = "id") -> str:
    """The id of a vehicle, mission or console, if it is one: `[a-z0-9_-]{1,64}`."""
    if not _ID.fullmatch(text):
        raise invalid(
            f"the {what} {text!r} must have 1 to {MAX_ID_CHARS} characters, each of a-z, 0-9, _ and -"
        )
    return text


def key(vehicle: str, topic: Topic) -> str:
    """The key of a topic of one vehicle; for `ALIVE_CONSOLE` a pattern for consoles of every name."""
    return f"{ROOT}/{check_id(vehicle, 'vehicle')}/{VERSION}/{topic}"


def console_key(vehicle: str, name: str) -> str:
    """The liveliness key of one console."""
    return f"{ROOT}/{check_id(vehicle, 'vehicle')}/{VERSION}/{_CONSOLE}{check_id(name, 'console')}"


def every_vehicle(topic: Topic) -> str:
    """A pattern that matches the topic of every vehicle."""
    return f"{ROOT}/*/{VERSION}/{topic}"


@dataclass(frozen=True, slots=True)
class Key:
    """A key, taken apart."""

    vehicle: str
    """Whose."""

    topic: Topic
    """What about."""

    console: str | None = None
    """Which console; `None` but for `ALIVE_CONSOLE`."""


def parse_key(text: str) -> Key:
    """Takes a key without wildcards apart."""
    chunks = text.split("/", 3)
    if len(chunks) != 4 or chunks[0] != ROOT or chunks[2] != VERSION:
        raise invalid(f"{text!r} is no key of this contract: it must begin with {ROOT}/<vehicle>/{VERSION}/")
    vehicle, suffix = check_id(chunks[1], "vehicle"), chunks[3]
    if suffix.startswith(_CONSOLE):
        return Key(vehicle, Topic.ALIVE_CONSOLE, check_id(suffix.removeprefix(_CONSOLE), "console"))
    if suffix not in list(Topic):
        raise invalid(f"{text!r}: nothing stands under {suffix!r}")
    return Key(vehicle, Topic(suffix))
