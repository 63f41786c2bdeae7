"""Arrays for a compiled module where numpy is not: the part of numpy's interface for C it calls.

numpy for browsers comes from a server, which tests do not ask.  An array here has numpy's layout in
memory, and the functions that the binding calls are callbacks of ctypes.  Memory is never freed.
"""

import ctypes
import math
import sys
from types import ModuleType, SimpleNamespace

_VOID, _INT, _SIZE = ctypes.c_void_p, ctypes.c_int, ctypes.c_ssize_t
_api = ctypes.pythonapi
#: length of an address [bytes]
ADDRESS = ctypes.sizeof(_VOID)
_api.PyType_FromSpec.restype = _api.PyType_GenericAlloc.restype = ctypes.py_object
_api.PyType_GenericAlloc.argtypes = [ctypes.py_object, _SIZE]
_api.PyCapsule_New.restype = ctypes.py_object
_api.PyCapsule_New.argtypes = [_VOID, _VOID, _VOID]
_api.Py_IncRef.argtypes = [_VOID]
_kept = []  # memory and callbacks that C knows


class _ArrayFields(ctypes.Structure):
    _fields_ = [
        ("head", ctypes.c_char * object.__basicsize__),
        ("data", _VOID), ("rank", _INT), ("dimensions", _VOID), ("strides", _VOID),
        ("base", _VOID), ("descr", _VOID), ("flags", _INT), ("weakreflist", _VOID),
    ]  # fmt: skip


class _TypeFields(ctypes.Structure):
    _fields_ = [
        ("head", ctypes.c_char * object.__basicsize__),
        ("typeobj", _VOID), ("letters", ctypes.c_char * 4), ("type_num", _INT),
        ("flags", ctypes.c_uint64), ("elsize", _SIZE), ("alignment", _SIZE),
        ("metadata", _VOID), ("hash", _SIZE), ("reserved", _VOID * 2),
    ]  # fmt: skip


class _Slot(ctypes.Structure):
    _fields_ = [("slot", _INT), ("function", _VOID)]


class _Spec(ctypes.Structure):
    _fields_ = [
        ("name", ctypes.c_char_p), ("basicsize", _INT), ("itemsize", _INT),
        ("flags", ctypes.c_uint), ("slots", ctypes.POINTER(_Slot)),
    ]  # fmt: skip


def _class(name, fields):
    slots = (_Slot * 1)()
    spec = _Spec(name, ctypes.sizeof(fields), 0, 0, slots)
    _kept.extend([slots, spec])
    return _api.PyType_FromSpec(ctypes.byref(spec))


ndarray, dtype = _class(b"numpy.ndarray", _ArrayFields), _class(b"numpy.dtype", _TypeFields)

#: numpy's numbers of C's types; what is as long as another has the same name here
_CODES = {
    "b1": [(0, ctypes.c_bool)],
    "i1": [(1, ctypes.c_int8)],
    "u1": [(2, ctypes.c_uint8)],
    "i": [(5, ctypes.c_int), (7, ctypes.c_long), (9, ctypes.c_longlong)],
    "u": [(6, ctypes.c_uint), (8, ctypes.c_ulong), (10, ctypes.c_ulonglong)],
    "f8": [(12, ctypes.c_double)],
}
_types, _elements, _named = {}, {}, {}
for _name, _found in _CODES.items():
    for _number, _element in _found:
        _key = _name if len(_name) > 1 else f"{_name}{ctypes.sizeof(_element)}"
        if _key not in _named:
            _made = _api.PyType_GenericAlloc(dtype, 0)
            _fields = _TypeFields.from_address(id(_made))
            _fields.type_num = _number
            _fields.elsize = _fields.alignment = ctypes.sizeof(_element)
            _named[_key] = _made
            _elements[id(_made)] = (_key, _element)
        _types[_number] = _named[_key]

_CONTIGUOUS, _FORTRAN, _WRITEABLE, _ALIGNED = 1, 2, 0x400, 0x100


def _new(shape, kind, data=None, base=None):
    """Return a new array of a type, in C's order."""
    made = _api.PyType_GenericAlloc(ndarray, 0)
    fields = _ArrayFields.from_address(id(made))
    element = _elements[id(kind)][1]
    size = ctypes.sizeof(element)
    if data is None:
        memory = (element * max(math.prod(shape), 1))()
        _kept.append(memory)
        data = ctypes.addressof(memory)
    lengths = (_SIZE * max(len(shape), 1))(*shape)
    steps = (_SIZE * max(len(shape), 1))(
        *(size * math.prod(shape[k + 1 :]) for k in range(len(shape)))
    )
    _kept.extend([made, lengths, steps])
    fields.data, fields.rank = data, len(shape)
    fields.dimensions, fields.strides = ctypes.addressof(lengths), ctypes.addressof(steps)
    fields.base, fields.descr = base, id(kind)
    fields.flags = _CONTIGUOUS | _WRITEABLE | _ALIGNED
    fields.flags |= _FORTRAN if len(shape) < 2 or 1 in shape else 0
    _api.Py_IncRef(id(kind))
    return made


def shape_of(array):
    """Return the shape of an array."""
    fields = _ArrayFields.from_address(id(array))
    return tuple((_SIZE * fields.rank).from_address(fields.dimensions)) if fields.rank else ()


def _memory(array):
    fields = _ArrayFields.from_address(id(array))
    element = _elements[fields.descr][1]
    return (element * math.prod(shape_of(array))).from_address(fields.data)


def array(kind, shape, values):
    """Return an array of a type such as "f8" with some values."""
    made = _new(tuple(shape), _named[kind])
    if values:
        _memory(made)[:] = values
    return made


def contents(found):
    """Return type, shape and values of an array."""
    kind = _elements[_ArrayFields.from_address(id(found)).descr][0]
    return kind, list(shape_of(found)), list(_memory(found)) if math.prod(shape_of(found)) else []


def _given(found):
    """Return the address of an object for C, which then owns a reference."""
    _kept.append(found)
    _api.Py_IncRef(id(found))
    return id(found)


def _from_descr(_type, kind, rank, dims, strides, data, flags, _owner):
    shape = tuple((_SIZE * rank).from_address(dims)) if rank else ()
    return _given(_new(shape, _elements_to_type(kind), data or None))


def _elements_to_type(address):
    return next(kind for kind in _named.values() if id(kind) == address)


def _set_base(found, base):
    _ArrayFields.from_address(found).base = base
    return 0


def _new_shape(found, wanted, _order):
    class Dims(ctypes.Structure):
        _fields_ = [("pointer", _VOID), ("length", _INT)]

    dims = Dims.from_address(wanted)
    shape = tuple((_SIZE * dims.length).from_address(dims.pointer))
    old = _ArrayFields.from_address(found)
    return _given(_new(shape, _elements_to_type(old.descr), old.data))


def _function(result, arguments, body):
    made = ctypes.PYFUNCTYPE(result, *arguments)(body)
    _kept.append(made)
    return ctypes.cast(made, _VOID).value


#: places in numpy's table: versions, types, and the functions that the binding calls
_TABLE = {
    0: _function(_INT, [], lambda: 0x2000000),
    2: id(ndarray),
    3: id(dtype),
    45: _function(_VOID, [_INT], lambda number: _given(_types[number])),
    94: _function(_VOID, [_VOID, _VOID, _INT, _VOID, _VOID, _VOID, _INT, _VOID], _from_descr),
    135: _function(_VOID, [_VOID, _VOID, _INT], _new_shape),
    182: _function(ctypes.c_ubyte, [_VOID, _VOID], lambda a, b: int(a == b)),
    210: _function(_INT, [], lambda: 1),
    211: _function(_INT, [], lambda: 0x12),
    282: _function(_INT, [_VOID, _VOID], _set_base),
}


def install():
    """Let compiled modules find this under numpy's name."""
    table = (_VOID * 400)()
    for place, value in _TABLE.items():
        table[place] = value
    names = ("numpy", "numpy.lib", "numpy._core", "numpy._core.multiarray")
    numpy, lib, core, multiarray = modules = [ModuleType(name) for name in names]
    numpy.__version__ = "2.0.0"
    lib.NumpyVersion = lambda text: SimpleNamespace(major=int(text.partition(".")[0]))
    numpy._core, core.multiarray = core, multiarray
    multiarray._ARRAY_API = _api.PyCapsule_New(ctypes.addressof(table), None, None)
    _kept.append(table)
    for module in modules:
        sys.modules[module.__name__] = module
