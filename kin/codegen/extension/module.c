// The module kin._kernels: calls kernels with arguments that it has checked.
//
// `entry(index)` makes a function of Python, which has the place of the entry in its `self`, a bytes object.
#include <setjmp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double re, im; } cplx;
typedef struct { void *p; size_t size; } block;
#include "unit.h"

// Python's stable ABI from 3.11 on, as far as it is used here.
#ifdef _WIN32
#define API extern __declspec(dllimport)
#define EXPORTED __declspec(dllexport)
#else
#define API extern
#define EXPORTED __attribute__((visibility("default")))
#endif
#ifdef KINBOARD_PYTHON_H // a test compares the declarations
#include KINBOARD_PYTHON_H
#else
typedef intptr_t Py_ssize_t;
typedef struct _typeobject PyTypeObject;
typedef struct { Py_ssize_t ob_refcnt; PyTypeObject *ob_type; } PyObject;
typedef struct {
  void *buf; PyObject *obj; Py_ssize_t len, itemsize; int readonly, ndim; char *format;
  Py_ssize_t *shape, *strides, *suboffsets; void *internal;
} Py_buffer;
typedef PyObject *(*PyCFunction)(PyObject *, PyObject *);
typedef struct PyMethodDef { const char *ml_name; PyCFunction ml_meth; int ml_flags; const char *ml_doc; } PyMethodDef;
typedef struct { PyObject ob_base; PyObject *(*m_init)(void); Py_ssize_t m_index; PyObject *m_copy; } PyModuleDef_Base;
typedef struct PyModuleDef {
  PyModuleDef_Base m_base; const char *m_name, *m_doc; Py_ssize_t m_size; PyMethodDef *m_methods;
  void *m_slots, *m_traverse, *m_clear, *m_free;
} PyModuleDef;
#define Py_None (&_Py_NoneStruct)
#define Py_True (&_Py_TrueStruct)
#define Py_False (&_Py_FalseStruct)
#define PyModuleDef_HEAD_INIT {{1, NULL}, NULL, 0, NULL}
enum { METH_VARARGS = 1, METH_NOARGS = 4, METH_FASTCALL = 0x80, Py_TPFLAGS_TUPLE_SUBCLASS = 1 << 26 };
enum { PyBUF_WRITABLE = 1, PyBUF_FORMAT = 4, PyBUF_C_CONTIGUOUS = 0x38, PYTHON_ABI_VERSION = 3 };
API PyObject *PyExc_TypeError, *PyExc_MemoryError, *PyExc_IndexError, _Py_NoneStruct, _Py_TrueStruct, _Py_FalseStruct;
API PyObject *PyErr_Format(PyObject *, const char *, ...), *PyErr_Occurred(void), *PyErr_NoMemory(void);
API void PyErr_Clear(void), PyErr_SetString(PyObject *, const char *), PyBuffer_Release(Py_buffer *);
API void Py_IncRef(PyObject *), Py_DecRef(PyObject *), PyEval_RestoreThread(void *);
API void *PyEval_SaveThread(void);
API int PyObject_GetBuffer(PyObject *, Py_buffer *, int), PyArg_ParseTuple(PyObject *, const char *, ...);
API int PyTuple_SetItem(PyObject *, Py_ssize_t, PyObject *), PyObject_IsTrue(PyObject *);
API unsigned long PyType_GetFlags(PyTypeObject *);
API double PyFloat_AsDouble(PyObject *), PyComplex_RealAsDouble(PyObject *), PyComplex_ImagAsDouble(PyObject *);
API long long PyLong_AsLongLong(PyObject *);
API unsigned long long PyLong_AsUnsignedLongLong(PyObject *);
API PyObject *PyNumber_Index(PyObject *), *PyTuple_GetItem(PyObject *, Py_ssize_t), *PyTuple_New(Py_ssize_t);
API Py_ssize_t PyTuple_Size(PyObject *);
API PyObject *PyFloat_FromDouble(double), *PyBool_FromLong(long), *PyLong_FromLongLong(long long);
API PyObject *PyLong_FromUnsignedLongLong(unsigned long long), *PyComplex_FromDoubles(double, double);
API PyObject *PyUnicode_FromString(const char *), *PyBytes_FromStringAndSize(const char *, Py_ssize_t);
API char *PyBytes_AsString(PyObject *);
API PyObject *PyObject_CallFunctionObjArgs(PyObject *, ...), *PyModule_Create2(PyModuleDef *, int);
API PyObject *PyCMethod_New(PyMethodDef *, PyObject *, PyObject *, PyTypeObject *);
#endif

_Static_assert(sizeof(Py_buffer) == 80 && offsetof(Py_buffer, shape) == 48 && sizeof(PyModuleDef) == 104, "64 bits");

#include "units.h" // const kinboard_unit *const units[]

// What NumPy 2 has in an array, compared by kin.kernels.layout when it is loaded.
typedef struct {
  PyObject head;
  char *data;
  int ndim;
  Py_ssize_t *shape, *strides;
  PyObject *base, *dtype;
  int flags;
} array;
enum { CONTIGUOUS_AND_ALIGNED = 0x0001 | 0x0100, WRITEABLE = 0x0400 };

static struct { char letter; const char *formats; size_t size; PyObject *dtype; const char *name; } items[] = {
  {'f', "d", 8, NULL, "float64"}, {'i', "lq", 8, NULL, "int64"}, {'b', "?", 1, NULL, "bool"},
  {'w', "LQ", 8, NULL, "uint64"}, {'s', "f", 4, NULL, "float32"}, {'z', "Zd", 16, NULL, "complex128"},
};
static PyObject *ndarray, *numpy_bool, *numpy_empty;
static bool readable;

enum { DONE, NO_MEMORY, OUTSIDE };
static _Thread_local jmp_buf *failed;
static _Thread_local struct { const char *file; int line; long long index, length; } outside;

_Noreturn void kinboard_no_memory(void) { longjmp(*failed, NO_MEMORY); }

// An index that a unit which looks at them has found.
_Noreturn void kinboard_outside(const char *file, int line, int64_t index, int64_t length) {
  outside.file = file, outside.line = line, outside.index = index, outside.length = length;
  longjmp(*failed, OUTSIDE);
}

// How a kernel ended: unless it is done, the arrays that it made are lost.
static int run(const kinboard_entry *entry, kinboard_slot *slots, block *room) {
  jmp_buf here;
  failed = &here;
  switch (setjmp(here)) {
    case DONE: entry->call(slots, room); return DONE;
    case OUTSIDE: return OUTSIDE;
    default: return NO_MEMORY;
  }
}

// ---- arguments ----

typedef struct {
  const kinboard_entry *entry;
  const char *takes;
  kinboard_slot *slots;
  int position;
} reader;

static bool wrong(const reader *r, const char *wanted) {
  PyErr_Format(PyExc_TypeError, "%s: argument %d is not %s", r->entry->name, r->position, wanted);
  return false;
}

static bool wrong_array(const reader *r, const char *takes, int item) {
  PyErr_Format(PyExc_TypeError, "%s: argument %d is not a C-contiguous %s%s array of %d axes: %s is wanted", r->entry->name, r->position,
               takes[2] == 'w' ? "writable " : "", items[item].name, takes[1] - '0', r->entry->wanted);
  return false;
}

// An array's place and shape. Nothing else than exactly an ndarray: a subclass may mean something else.
static bool take_array(reader *r, PyObject *given) {
  const char *takes = r->takes;
  int ndim = takes[1] - '0', item = 0;
  bool written = takes[2] == 'w', fits = false;
  kinboard_slot *to = r->slots;
  while (items[item].letter != takes[0]) item++;
  if ((PyObject *)given->ob_type != ndarray) return wrong_array(r, takes, item);
  if (readable) {
    const array *a = (const array *)given;
    int needed = CONTIGUOUS_AND_ALIGNED | (written ? WRITEABLE : 0);
    fits = a->dtype == items[item].dtype && a->ndim == ndim && (a->flags & needed) == needed;
    if (fits) to->p = a->data;
    for (int k = 0; fits && k < ndim; k++) to[k + 1].i = a->shape[k];
  }
  if (!fits) { // another object may say the same type, as that of an unpickled array; the caller holds it until the call returns
    Py_buffer view;
    if (PyObject_GetBuffer(given, &view, PyBUF_FORMAT | PyBUF_C_CONTIGUOUS | (written ? PyBUF_WRITABLE : 0)) != 0) {
      PyErr_Clear();
      return wrong_array(r, takes, item);
    }
    const char *format = view.format;
    bool is_complex = takes[0] == 'z';
    fits = view.ndim == ndim && (size_t)view.itemsize == items[item].size &&
           (is_complex ? strcmp(format, "Zd") == 0 : strlen(format) == 1 && strchr(items[item].formats, format[0]) != NULL);
    to->p = view.buf;
    for (int k = 0; fits && k < ndim; k++) to[k + 1].i = view.shape[k];
    PyBuffer_Release(&view);
  }
  if (!fits) return wrong_array(r, takes, item);
  r->slots += 1 + ndim;
  r->takes += 3;
  return true;
}

static bool take_number(reader *r, PyObject *given) {
  kinboard_slot *to = r->slots++;
  switch (*r->takes++) {
    case 'f':
      to->f = PyFloat_AsDouble(given);
      return (to->f == -1.0 && PyErr_Occurred() != NULL) ? wrong(r, "a float") : true;
    case 's':
      to->s = (float)PyFloat_AsDouble(given);
      return (to->s == -1.0f && PyErr_Occurred() != NULL) ? wrong(r, "a float") : true;
    case 'i':
      to->i = PyLong_AsLongLong(given);
      return (to->i == -1 && PyErr_Occurred() != NULL) ? wrong(r, "an integer of 64 bits") : true;
    case 'w': {
      PyObject *whole = PyNumber_Index(given);
      if (whole == NULL) return wrong(r, "an integer of 64 bits");
      to->w = PyLong_AsUnsignedLongLong(whole);
      Py_DecRef(whole);
      return (to->w == (uint64_t)-1 && PyErr_Occurred() != NULL) ? wrong(r, "an unsigned integer of 64 bits") : true;
    }
    case 'b':
      if (given == Py_True || given == Py_False) to->b = given == Py_True;
      else if ((PyObject *)given->ob_type == numpy_bool) to->b = PyObject_IsTrue(given) == 1;
      else return wrong(r, "a bool");
      return true;
    default:
      to->z.re = PyComplex_RealAsDouble(given);
      to->z.im = PyErr_Occurred() != NULL ? 0.0 : PyComplex_ImagAsDouble(given);
      return PyErr_Occurred() != NULL ? wrong(r, "a complex number") : true;
  }
}

// Arguments, or the items of a tuple.
static bool take(reader *r, PyObject *tuple, PyObject *const *given, Py_ssize_t count) {
  for (Py_ssize_t k = 0;; k++) {
    if (tuple == NULL) r->position = (int)k + 1;
    if (*r->takes == '\0' || *r->takes == ')') return k == count || wrong(r, tuple == NULL ? "taken: there are too many" : "a tuple of this length");
    if (k == count) return wrong(r, tuple == NULL ? "given" : "a tuple of this length");
    PyObject *each = tuple == NULL ? given[k] : PyTuple_GetItem(tuple, k);
    if (*r->takes == '(') {
      if ((PyType_GetFlags(each->ob_type) & Py_TPFLAGS_TUPLE_SUBCLASS) == 0) return wrong(r, "a tuple");
      r->takes++;
      if (!take(r, each, NULL, PyTuple_Size(each))) return false;
      r->takes++;
    } else if (!('0' <= r->takes[1] && r->takes[1] <= '9' ? take_array(r, each) : take_number(r, each))) return false;
  }
}

// ---- results ----

static PyObject *give(const char **gives, kinboard_slot **from);

static PyObject *give_array(char letter, int ndim, const kinboard_slot *from) {
  int item = 0;
  while (items[item].letter != letter) item++;
  PyObject *shape = PyTuple_New(ndim), *made = NULL;
  size_t size = items[item].size;
  for (int k = 0; shape != NULL && k < ndim; k++) {
    size *= (size_t)from[k + 1].i;
    PyTuple_SetItem(shape, k, PyLong_FromLongLong(from[k + 1].i));
  }
  if (shape != NULL) made = PyObject_CallFunctionObjArgs(numpy_empty, shape, items[item].dtype, NULL);
  if (shape != NULL) Py_DecRef(shape);
  Py_buffer view;
  if (made == NULL) return NULL;
  if (PyObject_GetBuffer(made, &view, PyBUF_WRITABLE) != 0) return Py_DecRef(made), NULL;
  memcpy(view.buf, from->p, size);
  PyBuffer_Release(&view);
  return made;
}

static PyObject *give(const char **gives, kinboard_slot **from) {
  char letter = *(*gives)++;
  if (letter == '(') {
    int count = *(*gives)++ - '0';
    PyObject *made = PyTuple_New(count);
    for (int k = 0; made != NULL && k < count; k++) {
      PyObject *each = give(gives, from);
      if (each == NULL) return Py_DecRef(made), NULL;
      PyTuple_SetItem(made, k, each);
    }
    ++*gives;
    return made;
  }
  const kinboard_slot *at = (*from)++;
  if ('0' <= **gives && **gives <= '9') {
    int ndim = *(*gives)++ - '0';
    *from += ndim;
    return give_array(letter, ndim, at);
  }
  switch (letter) {
    case 'f': return PyFloat_FromDouble(at->f);
    case 's': return PyFloat_FromDouble(at->s);
    case 'i': return PyLong_FromLongLong(at->i);
    case 'w': return PyLong_FromUnsignedLongLong(at->w);
    case 'b': return PyBool_FromLong(at->b);
    case 'z': return PyComplex_FromDoubles(at->z.re, at->z.im);
  }
  Py_IncRef(Py_None);
  return Py_None;
}

// ---- the functions of the module ----

static const kinboard_entry *entry_at(int64_t index) {
  for (size_t k = 0; k < sizeof units / sizeof *units; k++) {
    if (0 <= index && index < units[k]->count) return units[k]->entries + index;
    index -= units[k]->count;
  }
  return NULL;
}

// The lengths of all arrays, and whole numbers, beside what is wanted of them.
static PyObject *misfit(const kinboard_entry *entry, const kinboard_slot *slots, const char *wrong) {
  char given[600] = "";
  size_t used = 0;
  for (const char *c = entry->takes; *c && used + 120 < sizeof given; c++) {
    if (*c == '(' || *c == ')') continue;
    bool is_array = '0' <= c[1] && c[1] <= '9';
    int ndim = is_array ? c[1] - '0' : 0;
    for (int k = 1; k <= ndim; k++) used += (size_t)snprintf(given + used, 24, k == 1 ? " [%lld" : ",%lld", (long long)slots[k].i);
    if (is_array) used += (size_t)snprintf(given + used, 24, "]"), c += 2;
    else if (*c == 'i') used += (size_t)snprintf(given + used, 24, " %lld", (long long)slots->i);
    slots += 1 + ndim;
  }
  return PyErr_Format(PyExc_TypeError, "%s: %s does not fit: %s is wanted, given is%s", entry->name, wrong, entry->wanted, given);
}

static PyObject *index_error(const kinboard_entry *entry) {
  return PyErr_Format(PyExc_IndexError, "%s: %s, line %d: index %lld of %lld", entry->name, outside.file, outside.line, outside.index, outside.length);
}

static PyObject *called(PyObject *self, PyObject *const *given, Py_ssize_t count) {
  kinboard_slot slots[KINBOARD_SLOTS];
  block room[KINBOARD_ROOM];
  const kinboard_entry *entry;
  memcpy(&entry, PyBytes_AsString(self), sizeof entry);
  reader r = {entry, entry->takes, slots, 0};
  if (!take(&r, NULL, given, count)) return NULL;
  const char *wrong = entry->wrong(slots);
  if (wrong != NULL) return misfit(entry, slots, wrong);
  if (entry->arrays > 0) memset(room, 0, sizeof(block) * (size_t)entry->arrays);
  void *state = entry->brief ? NULL : PyEval_SaveThread();
  int end = run(entry, slots, room);
  if (state != NULL) PyEval_RestoreThread(state);
  const char *gives = entry->gives;
  kinboard_slot *from = slots;
  PyObject *result = end == DONE ? give(&gives, &from) : end == OUTSIDE ? index_error(entry) : PyErr_NoMemory();
  for (int k = 0; k < entry->arrays; k++) free(room[k].p);
  return result;
}

static PyMethodDef call_definition = {"kernel", (PyCFunction)(void (*)(void))called, METH_FASTCALL, NULL};

static PyObject *make_entry(PyObject *self, PyObject *arguments) {
  int index;
  (void)self;
  if (!PyArg_ParseTuple(arguments, "i:entry", &index)) return NULL;
  const kinboard_entry *entry = entry_at(index);
  if (entry == NULL) return PyErr_Format(PyExc_IndexError, "there is no entry %d", index);
  PyObject *bound = PyBytes_FromStringAndSize(NULL, sizeof entry);
  if (bound == NULL) return NULL;
  memcpy(PyBytes_AsString(bound), &entry, sizeof entry);
  PyObject *made = PyCMethod_New(&call_definition, bound, NULL, NULL);
  Py_DecRef(bound);
  return made;
}

static PyObject *list_entries(PyObject *self, PyObject *none) {
  int count = 0;
  (void)self, (void)none;
  while (entry_at(count) != NULL) count++;
  PyObject *made = PyTuple_New(count);
  for (int k = 0; made != NULL && k < count; k++) {
    const kinboard_entry *entry = entry_at(k);
    PyObject *row = PyTuple_New(3);
    if (row == NULL) return Py_DecRef(made), NULL;
    PyTuple_SetItem(row, 0, PyUnicode_FromString(entry->name));
    PyTuple_SetItem(row, 1, PyUnicode_FromString(entry->takes));
    PyTuple_SetItem(row, 2, PyUnicode_FromString(entry->gives));
    PyTuple_SetItem(made, k, row);
  }
  return made;
}

static PyObject *set_up(PyObject *self, PyObject *arguments) {
  PyObject *types[6];
  int fields;
  (void)self;
  if (!PyArg_ParseTuple(arguments, "OOO(OOOOOO)p:set_up", &ndarray, &numpy_bool, &numpy_empty, types, types + 1, types + 2,
                        types + 3, types + 4, types + 5, &fields)) return NULL;
  for (int k = 0; k < 6; k++) Py_IncRef(items[k].dtype = types[k]);
  Py_IncRef(ndarray), Py_IncRef(numpy_bool), Py_IncRef(numpy_empty);
  readable = fields != 0;
  Py_IncRef(Py_None);
  return Py_None;
}

static PyMethodDef methods[] = {
  {"set_up", set_up, METH_VARARGS, "set_up(ndarray, bool_, empty, dtypes, readable): before any entry is called."},
  {"entry", make_entry, METH_VARARGS, "entry(index): an entry as a function."},
  {"entries", list_entries, METH_NOARGS, "entries(): the name of each entry, what it takes and what it gives."},
  {NULL, NULL, 0, NULL},
};
static PyModuleDef definition = {.m_base = PyModuleDef_HEAD_INIT, .m_name = "kin._kernels", .m_size = -1, .m_methods = methods};

EXPORTED PyObject *PyInit__kernels(void) { return PyModule_Create2(&definition, PYTHON_ABI_VERSION); }
