"""Modules of the package whose extras are not installed have no examples to run."""

from importlib.util import find_spec

collect_ignore = [] if find_spec("pythonfmu3") else ["nsspice/output/fmu_slave.py"]
