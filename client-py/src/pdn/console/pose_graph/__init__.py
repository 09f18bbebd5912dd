"""Pose-graph files in text form: g2o and TORO, in space and in the plane. Pure: bytes in, bytes out.

transform <- graph <- records <- components, notes <- assembly <- reader
transform, graph <- information, fields, lines <- tags <- reader; consistency and writer stand beside them

Conventions. An edge measures the pose of its second vertex in the frame of its first, as `relative` does.
Its information matrix is over [x, y, z; rotation], and the rotation part is read as that of the rotation
vector in radians, so that the cost is r' W r with r = Log(Z^-1 X_i^-1 X_j) = [rho; phi] (what GTSAM does
too; g2o itself measures the vector part of the quaternion, about half of it). The tangent order is ours:
covariance = information^-1, no permutation.
"""

from .graph import Edge, PoseGraph, PoseGraphError, Prior, counted
from .reader import read_pose_graph
from .records import Assumptions
from .transform import ORIGIN, Transform

__all__ = [
    "ORIGIN",
    "Assumptions",
    "Edge",
    "PoseGraph",
    "PoseGraphError",
    "Prior",
    "Transform",
    "counted",
    "read_pose_graph",
]
