//! The daemon as its clients know it, in one program: what zenoh generates for a client is built once.

mod support;

mod program;

mod round_trip;

mod waiting;

mod vehicles;

mod refusals;
