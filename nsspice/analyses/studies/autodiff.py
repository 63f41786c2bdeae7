"""Measures within programs that JAX or PyTorch differentiate: their rules call the backward pass.

A function of values of parameters gives measures; backwards it multiplies by their derivatives,
which come with the same run.  Second derivatives are not known.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ...lazy import need_library

if TYPE_CHECKING:
    from .objective import Objective

#: Returns values, shape (k,) or (), and derivatives, shape (k, n) or (n,), at a point.
Both = Callable[[Any], tuple[Any, Any]]


def both_of(target: Objective) -> Both:
    """Return a function with the values of an objective and their derivatives, as arrays."""

    def both(x: Any) -> tuple[Any, Any]:
        point = np.asarray(x, dtype=np.float64)
        values, jacobian = target.values(point), target.jacobian(point)
        return (values[0], jacobian[0]) if target.single else (values, jacobian)

    return both


def for_jax(target: Objective) -> Callable[[Any], Any]:
    """Return an objective as a function of a JAX array; see :meth:`Objective.to_jax`."""
    jax = need_library("jax")
    both = both_of(target)
    shape = () if target.single else (len(target.measures),)

    def run(x: Any) -> Any:
        kinds = [jax.ShapeDtypeStruct(s, x.dtype) for s in (shape, (*shape, *x.shape))]

        def outside(point: Any) -> tuple[Any, ...]:
            return tuple(np.asarray(found, dtype=x.dtype) for found in both(point))

        return jax.pure_callback(outside, tuple(kinds), x, vmap_method="sequential")

    def measured(x: Any) -> Any:
        return run(x)[0]

    def back(jacobian: Any, seed: Any) -> tuple[Any]:
        return (jax.numpy.tensordot(seed, jacobian, axes=len(shape)),)

    found = jax.custom_vjp(measured)
    found.defvjp(run, back)
    return found  # type: ignore[no-any-return]


def for_torch(target: Objective) -> Callable[[Any], Any]:
    """Return an objective as a function of a PyTorch tensor; see :meth:`Objective.to_torch`."""
    torch = need_library("torch")
    both = both_of(target)

    class Measured(torch.autograd.Function):  # type: ignore[misc, name-defined]
        """The rule: a run forwards, its derivatives backwards."""

        @staticmethod
        def forward(ctx: Any, x: Any) -> Any:
            values, jacobian = both(x.detach().cpu().numpy())
            ctx.save_for_backward(x.new_tensor(jacobian))
            return x.new_tensor(values)

        @staticmethod
        def backward(ctx: Any, seed: Any) -> Any:
            (jacobian,) = ctx.saved_tensors
            return torch.tensordot(seed, jacobian, dims=seed.dim())

    return Measured.apply  # type: ignore[no-any-return]
