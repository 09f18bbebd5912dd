"""SE(3), written from the contract's page for the auditor alone: 4x4 matrices, tangent [rho; phi]."""

from typing import Any

import numpy as np

Json = dict[str, Any]


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]], dtype=float)


def matrix(pose: Json) -> np.ndarray:
    """4x4 of a pose on the wire."""
    out = np.eye(4)
    out[:3, :3] = rotation(pose["rotation"])
    out[:3, 3] = pose["translation"]
    return out


def rotation(q: list[float]) -> np.ndarray:
    """3x3 of a quaternion [x, y, z, w]."""
    x, y, z, w = np.array(q) / np.linalg.norm(q)
    v = np.array([x, y, z])
    return np.eye(3) + 2 * w * skew(v) + 2 * skew(v) @ skew(v)


def quaternion(r: np.ndarray) -> list[float]:
    """[x, y, z, w] of a 3x3 rotation: the eigenvector of the greatest eigenvalue of Davenport's matrix."""
    k = np.zeros((4, 4))
    k[:3, :3] = r + r.T - np.trace(r) * np.eye(3)
    k[:3, 3] = k[3, :3] = [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]
    k[3, 3] = np.trace(r)
    q = np.linalg.eigh(k)[1][:, -1]
    return (q if q[3] >= 0 else -q).tolist()


def pose_json(pose: np.ndarray) -> Json:
    return {"translation": pose[:3, 3].tolist(), "rotation": quaternion(pose[:3, :3])}


def compose(*poses: np.ndarray) -> np.ndarray:
    return np.linalg.multi_dot(poses)


def inverse(pose: np.ndarray) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3] = pose[:3, :3].T
    out[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return out


def camera_of(world_from_body: np.ndarray, body_from_camera: np.ndarray) -> np.ndarray:
    return world_from_body @ body_from_camera


def exp_so3(phi: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(phi)
    if angle < 1e-12:
        return np.eye(3) + skew(phi)
    k = skew(phi / angle)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def log_so3(r: np.ndarray) -> np.ndarray:
    q = np.array(quaternion(r))
    length = np.linalg.norm(q[:3])
    return 2 * q[:3] if length < 1e-12 else 2 * np.arctan2(length, q[3]) * q[:3] / length


def _series(a: np.ndarray) -> np.ndarray:
    """Sum of a^k / (k+1)!: the left Jacobian when a is the adjoint representation."""
    total, term = np.eye(len(a)), np.eye(len(a))
    for k in range(1, 40):
        term = term @ a / (k + 1)
        total = total + term
    return total


def exp_se3(xi: np.ndarray) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3] = exp_so3(xi[3:])
    out[:3, 3] = _series(skew(xi[3:])) @ xi[:3]
    return out


def log_se3(pose: np.ndarray) -> np.ndarray:
    phi = log_so3(pose[:3, :3])
    return np.r_[np.linalg.solve(_series(skew(phi)), pose[:3, 3]), phi]


def adjoint(pose: np.ndarray) -> np.ndarray:
    r, t = pose[:3, :3], pose[:3, 3]
    return np.block([[r, skew(t) @ r], [np.zeros((3, 3)), r]])


def small_adjoint(xi: np.ndarray) -> np.ndarray:
    return np.block([[skew(xi[3:]), skew(xi[:3])], [np.zeros((3, 3)), skew(xi[3:])]])


def right_jacobian_inverse(xi: np.ndarray) -> np.ndarray:
    """d Log(X Exp(e)) / d e at Log(X) = xi; the right Jacobian by its power series, then inverted."""
    a = -small_adjoint(xi) if len(xi) == 6 else -skew(xi)
    return np.linalg.inv(_series(a))
