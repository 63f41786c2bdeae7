"""The theorems of the theory of differential variational inequalities, as verdicts.

Each function looks at a problem and answers with a :class:`~nsspice.problems.Verdict`: the theorem
applies, or the hypothesis that fails, or the one that is not decided.  That a theorem does not
apply says nothing about its conclusion.  Read ``standard`` (the form they speak of), ``hypotheses``
(what is checked), then a theorem.  Imports the files next to this folder.

Source: T. Roubal, *Non-smooth analysis in engineering and economics* (2015), chapters 2 and 3, and
appendix B (R. Cibulka, T. Roubal 2017), with errors of the print corrected.
"""

from .inclusions import theorem_2_3_1, theorem_2_3_2, theorem_2_3_3
from .local import (
    corollary_2_1,
    metric_regularity,
    strong_metric_regularity,
    strong_metric_subregularity,
    theorem_2_2_6,
    theorem_2_4,
)
from .reductions import (
    corollary_2_2_1,
    theorem_2_2_1,
    theorem_2_2_2,
    theorem_2_2_3,
    theorem_2_2_4,
    theorem_2_2_9,
)
from .standard import ConvexSet, StandardDVI
from .stepping import theorem_3_3_1
from .trajectories import each_step, one_trajectory

__all__ = [
    "ConvexSet",
    "StandardDVI",
    "corollary_2_1",
    "corollary_2_2_1",
    "each_step",
    "metric_regularity",
    "one_trajectory",
    "strong_metric_regularity",
    "strong_metric_subregularity",
    "theorem_2_2_1",
    "theorem_2_2_2",
    "theorem_2_2_3",
    "theorem_2_2_4",
    "theorem_2_2_6",
    "theorem_2_2_9",
    "theorem_2_3_1",
    "theorem_2_3_2",
    "theorem_2_3_3",
    "theorem_2_4",
    "theorem_3_3_1",
]
