// What the kernels of a unit and the module share.
#define KINBOARD_SLOTS 128 // of an entry
#define KINBOARD_ROOM 32

// An argument or a result: a number, the place of an array, or the length of one of its axes.
typedef union { double f; int64_t i; bool b; uint64_t w; float s; cplx z; void *p; } kinboard_slot;

// A kernel that Python calls. Of `takes` and `gives`, a letter is a number, as in kinboard_slot (n: nothing). With a
// digit it is an array with so many axes, and of an argument the next letter says whether it is read or written.
// Tuples are in brackets; of a result, the character behind the bracket is their length above '0'.
typedef struct {
  const char *name, *takes, *gives;
  const char *wanted; // lengths and values of the arguments, as in entries.txt
  const char *(*wrong)(const kinboard_slot *slots); // which argument has others, NULL if none
  void (*call)(kinboard_slot *slots, block *room); // may leave arrays that it returns in `room`
  int arrays; // the most that it leaves
  bool brief; // keeps the GIL
} kinboard_entry;

typedef struct { const kinboard_entry *entries; int count; } kinboard_unit;

// Whether numbers are those of an arm with n joints, as in kin.kernels.fk: a head of 27, and 9 for each row.
static inline bool kinboard_is_arm(const double *model, int64_t size, int64_t n) {
  int64_t rows = (size - 27) / 9;
  if (rows < 1 || size != 27 + 9 * rows || n < 1 || model[0] != (double)rows || model[1] != (double)n) return false;
  for (const double *row = model + 27; row < model + size; row += 9)
    if (!(row[6] >= 0.0 && row[6] < (double)n)) return false;
  return true;
}
