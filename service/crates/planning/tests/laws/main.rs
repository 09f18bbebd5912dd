//! The laws that each step of the method keeps, each held against another way to the same result.

mod draw;
mod mission;

mod clustering;

mod routing;

mod sampling;

mod linking;

mod believing;

mod covering;

mod rewarding;

mod deciding;

mod caching;
