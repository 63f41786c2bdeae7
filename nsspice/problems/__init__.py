"""The mathematical problems nsspice solves, usable for any non-smooth system, not only circuits."""

from .csc import Csc, weighted_sum
from .descriptor import DescriptorSystem, Functional, Switch, Waveform

__all__ = ["Csc", "DescriptorSystem", "Functional", "Switch", "Waveform", "weighted_sum"]
