mod geometry;
mod jacobians;
mod refusals;
