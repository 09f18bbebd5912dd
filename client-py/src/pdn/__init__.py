"""pdn: client, vehicle simulator and operator console of the perception-driven navigation service.

`pdn.client` is the library for programs, `pdn.wire` the messages; the command `pdn` is made of the rest.
"""

__version__ = "0.1.0"
