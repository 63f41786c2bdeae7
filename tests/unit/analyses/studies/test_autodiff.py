"""Measures in programs of JAX and PyTorch, where those are installed, against closed forms."""

import numpy as np
import pytest

import nsspice

pytestmark = pytest.mark.soak  # neither package is needed for anything else

DECK = """RC
.param v=1
V1 a 0 {v}
R1 a b 1k
C1 b 0 1u IC=0
.tran 10u 1m uic
.measure tran end find v(b) at=1m
.measure tran mean avg v(b)
"""
X = np.array([2e3, 1.5])
#: of a run with a handful of roundings
CLOSE = 1e-12


def closed(r, v):
    """Both measures and their derivatives by R and V at t = T = 1 ms."""
    k = 1e-3 / (r * 1e-6)
    e = np.exp(-k)
    end, mean = v * (1.0 - e), v * (1.0 - (1.0 - e) / k)
    by_r = [-v * e * k / r, -v * ((1.0 - e) / k - e) / r]
    return np.array([end, mean]), np.array([[by_r[0], end / v], [by_r[1], mean / v]])


@pytest.fixture
def jax():
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    return jax


def test_jax(jax) -> None:
    circuit = nsspice.read(DECK)
    values, slopes = closed(*X)
    goals = {"end": 0.5, "mean": 0.25}
    end = nsspice.objective(circuit, "end", ["r1", "v"]).to_jax()
    both = nsspice.objective(circuit, goals, ["r1", "v"]).to_jax()
    scale = np.array(list(goals.values()))
    x = jax.numpy.asarray(X)
    assert float(end(x)) == pytest.approx(values[0], rel=CLOSE)
    assert jax.grad(end)(x) == pytest.approx(slopes[0], rel=CLOSE)
    assert both(x) == pytest.approx(values / scale - 1.0, rel=CLOSE)
    assert jax.jacrev(both)(x) == pytest.approx(slopes / scale[:, None], rel=CLOSE)
    # within a program that is compiled, and for several points
    square = jax.jit(jax.value_and_grad(lambda u: end(u * x) ** 2))
    assert square(jax.numpy.ones(2))[1] == pytest.approx(2.0 * values[0] * slopes[0] * X, rel=CLOSE)
    many = jax.vmap(end)(jax.numpy.stack([x, 2.0 * x]))
    assert many == pytest.approx([closed(*(f * X))[0][0] for f in (1.0, 2.0)], rel=CLOSE)


def test_torch() -> None:
    torch = pytest.importorskip("torch")
    circuit = nsspice.read(DECK)
    values, slopes = closed(*X)
    goals = {"end": 0.5, "mean": 0.25}
    end = nsspice.objective(circuit, "end", ["r1", "v"]).to_torch()
    both = nsspice.objective(circuit, goals, ["r1", "v"]).to_torch()
    scale = np.array(list(goals.values()))
    x = torch.tensor(X, requires_grad=True)
    (end(x) ** 2).backward()
    assert x.grad.numpy() == pytest.approx(2.0 * values[0] * slopes[0], rel=CLOSE)
    seed = np.array([0.3, -2.0])
    (by,) = torch.autograd.grad(both(x), x, torch.tensor(seed))
    assert by.numpy() == pytest.approx(seed / scale @ slopes, rel=CLOSE)
