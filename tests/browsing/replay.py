"""Calls of the compiled core, made once more from their record: here, and in Pyodide."""

import json
import math
import sys


def restored(value, objects, arrays):
    """Return an argument from its record."""
    if isinstance(value, list):
        return [restored(v, objects, arrays) for v in value]
    if not isinstance(value, dict):
        return value
    ((kind, content),) = value.items()
    if kind == "tuple":
        return tuple(restored(v, objects, arrays) for v in content)
    if kind == "object":
        return objects[content]
    return arrays.array(*content)  # kind == "array"


def distance(found, wanted, objects, arrays):
    """Return the largest difference of a result from its record, relative to the largest value.

    Objects of the core are kept under the names of the record.
    """
    if isinstance(wanted, dict):
        ((kind, content),) = wanted.items()
        if kind == "object":
            objects[content] = found
            return 0.0
        if kind == "array":
            kind, shape, values = arrays.contents(found)
            # indices are as wide as addresses are
            if [kind[0], shape] != [content[0][0], content[1]]:
                return math.inf
            return spread(values, content[2])
        if kind == "dict":
            pairs = content.items()
            inner = [distance(found[k], v, objects, arrays) for k, v in pairs]
            return max(inner, default=0.0) if found.keys() == content.keys() else math.inf
        wanted = content  # a tuple
    if isinstance(wanted, list):
        if len(found) != len(wanted):
            return math.inf
        if all(isinstance(v, float) for v in wanted):
            return spread(list(found), wanted)
        pairs = zip(found, wanted, strict=True)
        return max((distance(f, w, objects, arrays) for f, w in pairs), default=0.0)
    if isinstance(wanted, float):
        return spread([found], [wanted])
    return 0.0 if found == wanted else math.inf


def spread(found, wanted):
    """Return the largest difference of numbers, relative to the largest of them."""
    same = all(
        f == w or (f != f and w != w) or (math.isfinite(f) and math.isfinite(w))
        for f, w in zip(found, wanted, strict=True)
    )
    if not same:
        return math.inf
    finite = [(f, w) for f, w in zip(found, wanted, strict=True) if math.isfinite(w)]
    size = max((abs(w) for _, w in finite), default=0.0)
    worst = max((abs(f - w) for f, w in finite), default=0.0)
    return worst / size if worst else 0.0


def replay(core, arrays, calls):
    """Make all calls, and return how many there were with the largest difference by its call."""
    objects, worst = {}, {}
    for call in calls:
        owner = core if call["of"] is None else objects[call["of"]]
        arguments = [restored(v, objects, arrays) for v in call["arguments"]]
        named = {k: restored(v, objects, arrays) for k, v in call["named"].items()}
        member = getattr(owner, call["name"])
        result = member(*arguments, **named) if call["called"] else member
        far = distance(result, call["result"], objects, arrays)
        for argument, wanted in zip(arguments, call["after"], strict=True):
            if wanted is not None:  # an array that the core has written into
                far = max(far, distance(argument, wanted, objects, arrays))
        worst[call["name"]] = max(worst.get(call["name"], 0.0), far)
    return len(calls), worst


def main(paths):
    """Replay the records in some files with the core on the path of imports, as JSON."""
    import arrays

    arrays.install()
    import _core

    found = []
    for path in paths:
        with open(path, encoding="utf-8") as file:
            count, worst = replay(_core, arrays, json.load(file))
        found.append({"calls": count, "worst": worst, "bits": 8 * arrays.ADDRESS})
    return json.dumps(found)


if __name__ == "__main__":
    sys.stdout.write(main(sys.argv[1:]))
